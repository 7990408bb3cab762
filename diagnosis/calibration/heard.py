"""Inputs that another component gives, and that heard what was measured of it with its noise: as a controller hears its sensor.

What a sensor adds goes through such a controller into all that follows, and no model knows it. Given what was measured it is no
more of a riddle than any other input of a log.
"""

from __future__ import annotations

from collections.abc import Sequence
from contextlib import closing
from dataclasses import replace

import numpy as np

from selflock.master.wiring import Link

from ..data.log import MeasuredRun
from ..data.values import resolution, rough
from ..rules import RULES
from .fit import Calibrating
from .played import Played


def heard(problem: Calibrating, values: dict[str, float]) -> dict[str, Link]:
    """Such inputs, with what is connected to them.

    Told by the noise of an output of their component, from row to row: where a component heard what was measured most of it goes,
    and where it did not the sensor's comes in. What goes must be noise by fourth differences, too: in a loop whose numbers are off,
    a house with a thermostat, half of what changed from row to row was what the loop did. An output may have been read in the row
    of what it follows (naming.rows).
    """
    parts, played = problem.played.parts, problem.played
    fed = {feed.target for feed in played.group.feeds}
    found, errors = dict[str, Link](), None
    for name, link in parts.links.items():
        mine = [output for output in played.outputs if parts.owner(output) == link.target]
        if name in fed or not mine or f"{link.source}.{link.output}" not in played.outputs:
            continue
        if link.source == link.target or link.text or link.mapping:
            continue
        errors = errors or problem.errors(values)
        if errors is None:
            break
        with closing(Played(problem.rig, parts, as_measured(problem.runs, {name: link}), problem.numbers)) as other:
            simulated = other.errors(problem.settings(values), problem.which)
        if simulated is None:
            continue
        for output in mine:
            spread = played.spread(output) or 1.0
            now, bent = problem.floor(output, errors[output]) / spread, _noise(problem, output, errors[output])
            for one in (simulated[output], _a_row_on(problem, output, simulated[output])):
                then, less = problem.floor(output, one) / spread, _noise(problem, output, one)
                if now > RULES.pipeline.fine and then < RULES.calibrate.heard * now and less < RULES.calibrate.heard_noise * bent:
                    found[name] = link
    return found


def _noise(problem: Calibrating, output: str, errors: list[np.ndarray]) -> float:
    """Noise of single rows by fourth differences, in which what goes on slowly leaves nothing, and the recorder's steps."""
    measured = np.concatenate([problem.runs[i].signals[output] for i in problem.which])
    bent = np.concatenate([rough(e[good]) for e, good in zip(errors, problem.trusted[output])])
    noise = float(np.median(bent)) / RULES.residuals.normal_median if len(bent) else 0.0
    return max(noise, resolution(measured) / np.sqrt(12.0))


def _a_row_on(problem: Calibrating, output: str, errors: list[np.ndarray]) -> list[np.ndarray]:
    """The same of an output's runs, of the last rows as they are."""
    measured = [problem.runs[i].signals[output] for i in problem.which]
    return [np.append(a_row_on(y, e), e[-1:]) for y, e in zip(measured, errors)]


def a_row_on(measured: np.ndarray, errors: np.ndarray) -> np.ndarray:
    """What is left of each row but the last beside that which is simulated for the next."""
    return measured[:-1] - (measured - errors)[1:]


def as_measured(runs: Sequence[MeasuredRun], links: dict[str, Link]) -> list[MeasuredRun]:
    """The runs with these inputs as columns of their own: what was measured of what gives them."""
    found = []
    for run in runs:
        signals, good = dict(run.signals), dict(run.good)
        for name, link in links.items():
            source = f"{link.source}.{link.output}"
            signals[name] = link.factor * run.signals[source] + link.offset
            if source in run.good:
                good[name] = run.good[source]
        found.append(replace(run, signals=signals, good=good))
    return found


def sentences(found: dict[str, Link]) -> list[str]:
    """What is to be told of them."""
    return [
        f"{name} is given what was measured of {link.source}.{link.output}: {link.target} heard its noise"
        for name, link in found.items()
    ]
