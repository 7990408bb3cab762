"""Measured against simulated, where it was off most, as data for the page's script (selflock.view.figures)."""

from __future__ import annotations

from typing import Any

import numpy as np

from selflock.view.figures import axis, line, points

from ..residuals.experiment import Experiment
from ..residuals.mending import Mending

BEFORE, AFTER, MEASURED = 1, 0, "ink"  # colours
Plots = list[dict[str, Any]]


def traces(mending: Mending, compared: list | None = None) -> Plots:
    """Measured against simulated, before and after: over time where it was worst, steady points over speed.

    compared: what was simulated before, where something else than the laws did it."""
    experiment, residual, changed = mending.experiment, mending.residual, mending.before != mending.after
    old = experiment.compare(residual, mending.before) if compared is None else compared
    new = experiment.compare(residual, mending.after) if changed else old
    steady = experiment.steady
    if steady:
        x = experiment.variables(residual, mending.after)["speed"][0]
        part = np.argsort(x)
        i, x = 0, x[part]
        if (x < 0.0).any() and (x > 0.0).any():  # no line through standstill, where the torque is another
            turn = np.searchsorted(x, 0.0)
            x, part = np.insert(x, turn, np.nan), np.insert(part, turn, part[0])
        over = axis("speed", "m/s" if experiment.rig.linear else "rad/s")
    else:
        i, stretch = _worst(experiment, old, mending.blocks)
        part = np.arange(len(experiment.runs[i]))[stretch]
        x, over = experiment.runs[i].time[part], axis("time", "s")
    hide = lambda run, y: np.where(run[i][2][part], y[part], np.nan)
    measured = old[i][1]
    kind = points if steady else line
    top = [kind(x, hide(old, measured), "measured", MEASURED)]
    if not steady:
        top.append(line(x, np.where(old[i][2][part], np.nan, measured[part]), "", MEASURED, faint=True, thin=True))
    low = []
    for run, label, colour in ((old, "simulated, nominal", BEFORE), (new, "simulated, extended", AFTER))[: 2 if changed else 1]:
        top.append(line(x, hide(run, run[i][0]), label, colour, dots=steady))
        low.append(line(x, hide(run, run[i][1] - run[i][0]), label, colour, dots=steady, thin=True))
    quantity, beside = axis(residual.quantity, residual.unit), axis("measured − simulated", residual.unit)
    return [{"x": over, "y": quantity, "marks": top, "shares": "x"}, {"x": over, "y": beside, "marks": low, "shares": "x"}]


def _worst(experiment: Experiment, compared, held: np.ndarray) -> tuple[int, slice]:
    """A stretch of held-out data in which the nominal simulation is off most."""
    best, where = -1.0, (0, slice(0, len(experiment.runs[0])))
    for i, (simulated, measured, good) in enumerate(compared):
        block = experiment.layout.block(i)
        for b in np.unique(block):
            mine = (block == b) & good
            if held[b] and mine.sum() > 20:
                level = float(np.sqrt(np.mean((measured - simulated)[mine] ** 2)))
                if level > best:
                    places = np.flatnonzero(block == b)
                    wide = 2 * (places[-1] - places[0])
                    best, where = (
                        level,
                        (i, slice(max(0, places[0] - wide // 4), min(len(block), places[-1] + wide // 4))),
                    )
    return where
