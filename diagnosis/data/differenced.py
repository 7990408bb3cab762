"""Whether a speed is a difference of an encoder's counts, of which, and over how many rows."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.ndimage import maximum_filter1d

from ..rules import RULES
from .values import stretches


@dataclass(frozen=True)
class SpeedRows:
    """A speed as it stands in the rows of one run."""

    x: np.ndarray  # rad/s
    good: np.ndarray  # bool
    time: np.ndarray  # s
    angle: np.ndarray | None = None  # rad, of its encoder, where that is logged


def difference(runs: list[SpeedRows], own: float = 0.0) -> tuple[float, int]:
    """Count, rad, and rows of the difference that a speed is; 0 for none. own: the count of its angle, where that is logged.

    A difference over n rows, times their duration, is a whole number of counts in nearly all rows. With rows at equal times
    that holds for every n, and what is missing in the spectrum tells it, of all runs together; or the own count does. Where its
    angle is logged the two are held against each other first, which a clock in whole ms leaves certain.
    """
    if own > 0.0 and (rows := _of_angle(runs, own)):
        return own, rows
    for rows in range(1, RULES.search.differenced + 1):
        count, levels = _on_counts(runs, rows)
        if count == 0.0:
            continue
        if (told := _missing(levels, [_together(run, rows) for run in runs])) and _may_be(its := _on_counts(runs, told)[0], own):
            return its, told
        if _may_be(count, own) and (rows > 1 or own > 0.0):
            return count, rows
        if own == 0.0:
            return (count, 1) if _once(runs) else (0.0, 0)
    return 0.0, 0


def _may_be(count: float, own: float) -> bool:
    """Whether a difference's count may be that of its angle, where that is known: a speed's own last digit makes counts as well."""
    return count > 0.0 if own == 0.0 else abs(count - own) < RULES.residuals.on_a_count * own


def _of_angle(runs: list[SpeedRows], own: float) -> int:
    """Rows over which the logged angle's difference is the speed but for the clock's steps; 0 for none.

    Of the same counts both are the same to the last one. Else what is left is at least their rounding, count / sqrt(6) of a
    difference (Widrow 1956), but for a speed at which it turns whole counts: so the rows that miss most are asked. Asked of rows
    that turned by so few counts that a clock a twentieth off hides none of them.
    """
    rules, found = RULES.residuals, []
    if any(run.angle is None for run in runs) or not _counted(runs, own):
        return 0
    for rows in range(1, RULES.search.differenced + 1):
        left = [np.zeros(0)]
        for run in runs:
            assert run.angle is not None
            took = run.time[rows:] - run.time[:-rows]
            turned, said = run.angle[rows:] - run.angle[:-rows], run.x[rows:] * took
            few = (abs(turned) > 0.5 * own) & (abs(turned) < rules.few_counts * own)
            left.append((said - turned)[_together(run, rows) & few])
        off = np.concatenate(left)
        if len(off) > rules.noise_samples:
            found.append((float(np.quantile(abs(off), 0.9)) / rules.normal_tenth, rows))
    least, rows = min(found, default=(np.inf, 0))
    return rows if least < 0.5 * own / np.sqrt(6.0) else 0


def _counted(runs: list[SpeedRows], own: float) -> bool:
    """Whether angles may be numbers of counts. The values of a simulated one have a least step, too: that by which it creeps.

    It goes on by that in most rows in which it goes on by little, and in others by any part of it. An encoder's goes on by whole
    numbers of counts; or, where that is one at a time, after a rest; and where it hardly ever goes on by one, `own` is several.
    """
    rules = RULES.residuals
    steps = [abs(np.diff(run.angle)) / own for run in runs if run.angle is not None]
    sound = [run.good[1:] & run.good[:-1] for run in runs]
    each = np.concatenate([step[trusted] for step, trusted in zip(steps, sound)])
    few = each[(each > 0.5) & (each < rules.few_counts)]
    ones = abs(few - 1.0) < rules.on_steps
    if 2 * ones.sum() <= len(few):
        return True
    others = few[~ones]
    if len(others) > rules.noise_samples:
        return bool(np.mean(abs(others - np.round(others))) < rules.on_steps)
    rests = [np.pad(step < rules.on_steps, 1, constant_values=True) for step in steps]
    alone = [(rest[:-2] | rest[2:])[(step > 0.5) & trusted] for rest, step, trusted in zip(rests, steps, sound)]
    return bool(np.mean(np.concatenate(alone)) > 0.5)


def over_losses(time: np.ndarray, rows: int) -> np.ndarray:
    """Rows in which a difference over so many rows back goes over rows that are lost, or begins before the first; bool."""
    begins = np.append(True, lost(time))
    return np.convolve(begins, np.ones(rows))[: len(time)] > 0.0


def lost(time: np.ndarray) -> np.ndarray:
    """Steps from row to row in which rows are lost, bool."""
    steps = np.diff(time)
    return steps > (1.0 + RULES.data.uneven) * np.median(steps)


def _together(run: SpeedRows, rows: int) -> np.ndarray:
    """Where a difference over so many rows, and the next one, are of sound rows without a gap between any of them."""
    begins = ~run.good[1:] | ~run.good[:-1] | lost(run.time)
    return maximum_filter1d(begins.astype(int), 2 * rows + 1)[rows - 1 :] == 0


def _missing(levels: list[np.ndarray], sound: list[np.ndarray]) -> int:
    """The most rows n over which this may be a difference, by what its spectrum lacks; 0 where it lacks nothing.

    A difference over n rows passes nothing, be it motion or rounding, at 1, 2, ... waves in n rows; a row that is wrong, or
    lacks, has all waves. Second differences first, so that the slow motion does not leak into all others.
    """
    from scipy.signal import welch  # a second to load, for those whose recorder is asked

    rules = RULES.residuals
    pieces = []
    for here, trusted in zip(levels, sound):
        starts, lengths = stretches(trusted)
        pieces += [np.diff(here[a : a + n], n=2) for a, n in zip(starts, lengths) if trusted[a] and n > 2]
    longest = max(map(len, pieces), default=0)
    if longest < 2:
        return 0
    total = sum(map(len, pieces))
    segment = 2 ** int(np.log2(max(min(longest, total / rules.segments), 2.0)))
    segment = min(rules.longest_segment, segment)
    pieces = [piece for piece in pieces if len(piece) >= segment]
    each = [welch(piece, nperseg=segment, detrend=False) for piece in pieces]
    frequency = each[0][0]
    power = np.average([found for _, found in each], axis=0, weights=[len(piece) for piece in pieces])
    power = power[1:] / np.sin(np.pi * frequency[1:]) ** 4
    found = 0
    for rows in range(2, min(RULES.search.differenced, segment // rules.segment_rows) + 1):
        places = segment / rows * np.arange(1, rows // 2 + 1) - 1.0
        near = segment / rows / 2.0
        deepest = []
        for place in places:
            at = np.arange(max(0, int(np.ceil(place - near))), min(len(power), int(place + near) + 1))
            apart = abs(at - place)
            deepest.append(power[at[apart < 1.5]].mean() / max(float(np.median(power[at[apart > near / 3.0]])), 1e-300))
        if max(deepest) < rules.missing:
            found = rows
    return found


def _once(runs: list[SpeedRows]) -> bool:
    """Whether the rounding of a row comes again with the other sign in the next, as in a difference over one row."""
    fasts = [np.diff(run.x, n=2) for run in runs if len(run.x) > 3]
    if not fasts:
        return False
    ends = np.quantile(np.concatenate(fasts), (0.05, 0.95))
    fasts = [np.clip(fast, *ends) for fast in fasts]
    beside = np.concatenate([fast[1:] * fast[:-1] for fast in fasts])
    return bool(np.mean(beside) < RULES.residuals.differenced_once * np.mean(np.concatenate(fasts) ** 2))


def _on_counts(runs: list[SpeedRows], rows: int) -> tuple[float, list[np.ndarray]]:
    """The count of which a speed is a whole number in so many rows, 0 for none; and that number in each row of each run."""
    rules = RULES.residuals
    turned = [run.x[rows:] * (run.time[rows:] - run.time[:-rows]) for run in runs]
    trusted = [run.good[rows:] & run.good[:-rows] for run in runs]
    moved = abs(np.concatenate([way[good] for way, good in zip(turned, trusted)]))
    moved = moved[moved > rules.no_count]
    if len(moved) >= rules.noise_samples:
        count = float(np.median(moved[moved < 1.5 * moved.min()]))
        for parts in (1, 2, 3):  # the slowest row may have turned by more than one
            off = abs(moved * parts / count - np.round(moved * parts / count))
            if np.mean(off < rules.on_a_count) > rules.mostly:
                return count / parts, [np.round(way * parts / count) for way in turned]
    return 0.0, []
