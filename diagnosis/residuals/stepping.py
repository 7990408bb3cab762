"""What the counts that a controller sees, and the steps of its command, make of each channel of a whole drive.

Both are in the drive itself: a speed made of counts jumps from one to the next, a converter of 8 bits gives some volts or the next,
and where a gear that locks itself comes to rest depends on either. The simulation knows neither where an encoder's zero lies nor what
a controller does with its counts between rows, so that to it this is noise, which is slow where the drive is. How much there is of it the
command tells: what it has from row to row beside the simulated one is all that such steps can have made (as `dilution` has it of
an open loop's voltage). So the drive is simulated once more with counts and steps, and what that changes counts for as much.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from ..rules import RULES
from . import driven, memory
from .dilution import fast, made_by
from .recorder import commanded

if TYPE_CHECKING:
    from .experiment import Experiment
    from .residual import Residual


WHERE, MADE = "values for steps", "noise of steps"


def anew(experiment: Experiment, values: dict[str, float]) -> None:
    """What counts and steps make is asked for with these values, too, in the place of those given here before.

    Where values are far off, as before anything was fitted, a loop may swing as the drive never did, and so does what its steps
    make. Where each comes to rest is chance in either, so that there are two looks at it: the less is believed, for noise that is
    told too large hides causes, and of noise told too small chance tells.
    """
    where = experiment.remembered(WHERE)
    where["near" if where else "first"] = values
    made = experiment.remembered(MADE)
    for key in [key for key in made if key[0] == "near"]:
        del made[key]


def of_steps(experiment: Experiment, residual: Residual, values: dict[str, float]) -> tuple[float, float, float]:
    """Noise (root mean square) that a whole drive's channel has of counts and steps in its loop: of rows what is slow and fast, of bins.

    0 in open loop, and where no command tells.
    """
    ch = experiment.channels[0, residual.prefix]
    if residual.kind != "whole" or driven.of(ch) == driven.VOLTAGE or not (command := commanded(ch)):
        return 0.0, 0.0, 0.0
    told = next(r for r in experiment.residuals if r.kind == "whole" and r.output == residual.prefix + command)
    where, left = experiment.remembered(WHERE), experiment.remembered("fast command")
    if not where:
        anew(experiment, values)
    found = []
    for which in where:
        (slow, quick, bins), made = _made(experiment, residual, which), _made(experiment, told, which)[1]
        if made <= 0.0:
            return 0.0, 0.0, 0.0
        share = min(1.0, memory.kept(left, frozenset(values.items()), lambda: _left(experiment, told, values), 1) / made)
        found.append((slow * share, quick * share, bins * share))
    return min(found)


def _made(experiment: Experiment, residual: Residual, which: str) -> tuple[float, float, float]:
    """What counts and steps make of a channel with the values first asked for, or near the fit."""
    made = experiment.remembered(MADE)
    if (which, residual.name) not in made:
        at = experiment.remembered(WHERE)[which]
        made[which, residual.name] = made_by(experiment, residual, at, {driven.STEPS: RULES.residuals.zeros[1]})
    return made[which, residual.name]


def _left(experiment: Experiment, command: Residual, values: dict[str, float]) -> float:
    """The fast part of what a simulated command misses of the logged one."""
    simulated, measured, good = zip(*experiment.compare(command, values))
    trusted = [g & np.isfinite(s) for g, s in zip(good, simulated)]
    return fast([np.where(t, m - s, 0.0) for s, m, t in zip(simulated, measured, trusted)], trusted)
