"""Set-points between the rows of a log: they go straight, but where they jump.

A step is asked for at one instant, and the row that has it first is the first behind that instant. Straight from row to row
a controller faster than the log would be asked for a part of it, and answer with a part of its voltage.
"""

from __future__ import annotations

from collections.abc import Mapping
from types import MappingProxyType

import numpy as np

from ..rules import RULES

NOWHERE: Mapping[int, float] = MappingProxyType({})
"""Of no jump is it known when it came: each at its row."""


def jumps(x: np.ndarray, time: np.ndarray) -> np.ndarray:
    """Rows that are the first behind a jump: changes far larger than those beside them, and rare.

    What changes in steps all the time, as a set-point in counts, goes in steps and does not jump. How it went through a gap
    nobody knows.
    """
    change, steps = abs(np.diff(x)), np.diff(time)
    if len(change) < 3:
        return np.zeros(0, int)
    change = np.where(steps > RULES.data.gap * np.median(steps), 0.0, change)
    around = np.maximum(np.append(0.0, change[:-1]), np.append(change[1:], 0.0))
    found = np.flatnonzero((change > 0.0) & (around < RULES.residuals.jump_beside * change)) + 1
    return found if len(found) <= RULES.residuals.most_jumps * len(x) else np.zeros(0, int)


def jump(row: int, time: np.ndarray, sooner: Mapping[int, float] = NOWHERE) -> float:
    """When the set-point jumped that this row is the first to have."""
    return float(time[row] - sooner.get(row, 0.0) * (time[row] - time[row - 1]))


def between(when: np.ndarray, time: np.ndarray, x: np.ndarray, sooner: Mapping[int, float] = NOWHERE) -> np.ndarray:
    """A set-point at these instants: straight between its rows, held before a jump until the row that has it.

    sooner: for rows behind a jump the share of the row before by which it came sooner, less than 1.
    """
    found = np.interp(when, time, x)
    for row in jumps(x, time):
        start, middle, end = np.searchsorted(when, [time[row - 1], jump(int(row), time, sooner), time[row]])
        found[start:middle], found[middle:end] = x[row - 1], x[row]
    return found


def upright(time: np.ndarray, columns: dict[str, np.ndarray], sooner: Mapping[int, float] = NOWHERE) -> dict[str, np.ndarray]:
    """Times and set-points of which straight lines make the same: two rows for a jump, hardly apart."""
    rows = np.unique(np.concatenate([jumps(x, time) for x in columns.values()]))
    steps = time[rows] - time[rows - 1]
    jumped = time[rows] - np.array([sooner.get(int(row), 0.0) for row in rows]) * steps
    new = np.sort(np.concatenate([time, jumped - RULES.residuals.upright * steps, jumped[jumped < time[rows]]]))
    return {"time": new, **{name: between(new, time, x, sooner) for name, x in columns.items()}}


def about(rows: np.ndarray, time: np.ndarray, late: float) -> np.ndarray:
    """Which rows a jump may have reached that came at any instant of the row before: up to so many s behind it."""
    found = np.zeros(len(time), bool)
    for row in rows:
        found[row - 1 : np.searchsorted(time, time[row] + late, side="right")] = True
    return found
