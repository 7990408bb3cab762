"""What a data sheet's own error makes of each channel of a whole drive.

A drive that nearly swings by itself turns what is not quite right into much: a gear that judders as it lets its load down makes of a
hundredth of its friction as much as of ten hundredths elsewhere. In proportion to its signals (`noise.of_formulas`) no
simulation of such a drive is right, however right its laws are.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from ..rules import RULES
from . import drive
from .dilution import made_by

if TYPE_CHECKING:
    from .experiment import Experiment
    from .residual import Residual

SWINGS = "reducer.friction_kinetic", "reducer.shaft_stiffness"
"""Numbers of which such a swing is made: what feeds it, and the spring."""
MADE = "noise of the data sheet"


def anew(experiment: Experiment) -> None:
    """It is asked for again, with the values that are known by now."""
    experiment.remembered(MADE).clear()


def of_sheet(experiment: Experiment, residual: Residual, values: dict[str, float]) -> float:
    """By how much (root mean square, in its unit) a channel moves with a share of what makes a drive swing, with the values first asked for."""
    made = experiment.remembered(MADE)
    if residual.name not in made:
        made[residual.name] = max(_moved(experiment, residual, values, name) for name in SWINGS)
    return made[residual.name]


def _moved(experiment: Experiment, residual: Residual, values: dict[str, float], name: str) -> float:
    ch = experiment.channels[0, residual.prefix]
    known = drive.nominal(ch) | values
    if not known.get(full := ch.prefix + name):
        return 0.0
    slow, quick, _ = made_by(experiment, residual, values, {full: (1.0 + RULES.residuals.formulas) * known[full]})
    return float(np.hypot(slow, quick))
