"""Set-points between the rows of a log: they go straight, but where they jump.

A step is asked for at one instant, and the row that has it first is the first behind that instant. Straight from row to row
a controller faster than the log would be asked for a part of it, and answer with a part of its voltage.
"""

from __future__ import annotations

import numpy as np

from ..rules import RULES


def jumps(x: np.ndarray) -> np.ndarray:
    """Rows that are the first behind a jump: changes far larger than those beside them, and rare.

    What changes in steps all the time, as a set-point in counts, goes in steps and does not jump.
    """
    change = abs(np.diff(x))
    if len(change) < 3:
        return np.zeros(0, int)
    around = np.maximum(np.append(0.0, change[:-1]), np.append(change[1:], 0.0))
    found = np.flatnonzero((change > 0.0) & (around < RULES.residuals.jump_beside * change)) + 1
    return found if len(found) <= RULES.residuals.most_jumps * len(x) else np.zeros(0, int)


def between(when: np.ndarray, time: np.ndarray, x: np.ndarray) -> np.ndarray:
    """A set-point at these instants: straight between its rows, held before a jump until the row that has it."""
    found = np.interp(when, time, x)
    for row in jumps(x):
        inside = slice(*np.searchsorted(when, [time[row - 1], time[row]]))
        found[inside] = x[row - 1]
    return found


def upright(time: np.ndarray, columns: dict[str, np.ndarray]) -> dict[str, np.ndarray]:
    """Times and set-points of which straight lines make the same: before each row that is behind a jump one more, hardly sooner."""
    rows = np.unique(np.concatenate([jumps(x) for x in columns.values()]))
    sooner = time[rows] - RULES.residuals.upright * (time[rows] - time[rows - 1])
    found = {name: np.insert(x, rows, between(sooner, time, x)) for name, x in columns.items()}
    return {"time": np.insert(time, rows, sooner), **found}


def about(rows: np.ndarray, time: np.ndarray, late: float) -> np.ndarray:
    """Which rows a jump may have reached that came at any instant of the row before: up to so many s behind it."""
    found = np.zeros(len(time), bool)
    for row in rows:
        found[row - 1 : np.searchsorted(time, time[row] + late, side="right")] = True
    return found
