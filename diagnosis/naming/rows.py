"""Outputs that were recorded in the row of an input that they follow at once: a step answers that input at its end."""

from __future__ import annotations

import numpy as np

from ..calibration.fit import Calibrating
from ..calibration.heard import a_row_on
from ..residuals.mending import rms
from ..rules import RULES


def followed(problem: Calibrating, values: dict[str, float]) -> dict[str, tuple[float, float]]:
    """Of such outputs the error beside what the model computes for its row, and beside that for the next, which leaves less.

    Seen in how errors change from row to row: where an input jumps the output's jump is there, and in the model a row later. What
    else is missing changes slowly beside that. Less than half of what is beyond the noise must be left.
    """
    errors, found = problem.errors(values) or {}, {}
    for name, parts in errors.items():
        variable = problem.played.parts.variables[name]
        if variable.depends_on == () or variable.initial in ("exact", "approx"):
            continue  # a state, or what follows no input
        trusted = problem.trusted[name]
        here, later = [], []
        for i, e, good in zip(problem.which, parts, trusted):
            measured = problem.runs[i].signals[name]
            both = good[:-1] & good[1:]
            here.append(e[:-1][both])
            later.append(a_row_on(measured, e)[both])
        noise, now, then = problem.floor(name, parts), rms(here), rms(later)
        jumps = [rms([np.diff(e) for e in one]) ** 2 - 2.0 * noise**2 for one in (here, later)]
        if now > RULES.search.clean * noise and then < now and jumps[1] < 0.5 * jumps[0]:
            found[name] = now, then
    return found
