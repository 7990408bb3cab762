"""Set-points between the rows of a log: they go straight, but where they jump.

A step is asked for at one instant, and the row that has it first is the first behind that instant. Straight from row to row
a controller faster than the log would be asked for a part of it, and answer with a part of its voltage.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from types import MappingProxyType

import numpy as np

from ..data.values import noise_of
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


def leaps(x: np.ndarray, time: np.ndarray) -> np.ndarray:
    """Jumps of a voltage that was measured: the last row before each and the first behind, (jumps, 2).

    It has noise, and comes as messages, between which a table goes straight, so that a jump takes some rows, or holds the last one,
    so that it is seen late.
    """
    rules, found = RULES.residuals, np.zeros((0, 2), int)
    least = max(rules.leap_noise * noise_of(x) / rules.jump_beside, rules.formulas * float(np.ptp(x)))
    for rows in range(1, rules.leap_rows + 1):
        if len(x) <= 3 * rows:
            break
        at = np.arange(rows, len(x) - 2 * rows)  # the last rows before what may be jumps over so many
        change = abs(x[at + rows] - x[at])
        around = np.maximum(abs(x[at] - x[at - rows]), abs(x[at + 2 * rows] - x[at + rows]))
        even = time[at + 2 * rows] - time[at - rows] < RULES.data.gap * rows * np.median(np.diff(time))
        at = at[(change > least) & (around < rules.jump_beside * change) & even]
        apart = [not np.any((found[:, 0] < first + rows) & (first < found[:, 1])) for first in at]
        at = at[np.array(apart, bool)]
        at = at[np.append(True, np.diff(at) >= rows)[: len(at)]]
        found = np.concatenate([found, np.stack([at, at + rows], axis=1)])
    if len(found) > rules.most_jumps * len(x):
        return np.zeros((0, 2), int)
    found = found[np.argsort(found[:, 0])]
    held = np.maximum(found[:, 0] - rules.leap_held, np.append(0, found[:-1, 1]))
    return np.stack([held, found[:, 1]], axis=1)


def jump(pair: np.ndarray, time: np.ndarray, sooner: Mapping[int, float] = NOWHERE) -> float:
    """When the set-point jumped that has the last row of `pair` as the first behind; sooner: as a share of the time between both."""
    first, last = pair
    return float(time[last] - sooner.get(int(last), 0.0) * (time[last] - time[first]))


def between(
    when: np.ndarray, time: np.ndarray, x: np.ndarray, sooner: Mapping[int, float] = NOWHERE, pairs: np.ndarray | None = None
) -> np.ndarray:
    """A set-point at these instants: straight between its rows, held before a jump until the row that has it.

    sooner: for rows behind a jump the share of the row before by which it came sooner, less than 1.
    pairs: last row before and first row behind each jump, where it took more than a row, or noise hides it.
    """
    found = np.interp(when, time, x)
    rows = jumps(x, time) if pairs is None else np.zeros(0, int)
    for pair in np.stack([rows - 1, rows], axis=1) if pairs is None else pairs:
        first, last = pair
        start, middle, end = np.searchsorted(when, [time[first], jump(pair, time, sooner), time[last]])
        found[start:middle], found[middle:end] = x[first], x[last]
    return found


def upright(time: np.ndarray, instants: np.ndarray, lines: Callable[[np.ndarray], np.ndarray]) -> tuple[np.ndarray, np.ndarray]:
    """Times of which straight lines make the same as `lines`, and what these are there: two for a jump at its instant, hardly apart."""
    hardly = RULES.residuals.upright * float(np.median(np.diff(time)))
    new = np.unique(np.concatenate([time, instants - hardly, instants]))
    new = new[(new >= time[0]) & np.append(True, np.diff(new) > 1e-3 * hardly)]
    return new, lines(new)


def about(pairs: np.ndarray, time: np.ndarray, late: float) -> np.ndarray:
    """Which rows a jump may have reached that came at any instant between the rows of its pair: up to so many s behind it."""
    found = np.zeros(len(time), bool)
    for first, last in pairs:
        found[first : np.searchsorted(time, time[last] + late, side="right")] = True
    return found
