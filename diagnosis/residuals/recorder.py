"""What a log shows of its recorder: which encoder's counts stand behind a channel."""

from __future__ import annotations

import numpy as np
from scipy.ndimage import gaussian_filter1d, maximum_filter1d

from ..data.signals import ANGLE_OF
from ..data.stuck import resolution, stretches
from ..rules import RULES
from .channels import Channels

COMMAND = "controller.voltage"


def counts(name: str, ch: Channels) -> tuple[float, int]:
    """Of a channel: its count, rad, and the rows over which it is a difference of such counts; 0 for none."""
    key = ("counts", name)
    if key not in ch.memory:
        x, good = ch.raw(name), ch.good(name)
        if name in ANGLE_OF:
            own = resolution(ch.raw(ANGLE_OF[name])[ch.good(ANGLE_OF[name])]) if ch.has(ANGLE_OF[name]) else 0.0
            ch.memory[key] = _difference(x, good, ch.run.time, own)
        else:
            ch.memory[key] = resolution(x[good]), 0
    return ch.memory[key]


def _difference(x: np.ndarray, good: np.ndarray, time: np.ndarray, own: float) -> tuple[float, int]:
    """A difference over n rows, times their duration, is a whole number of counts in nearly all rows.

    With rows at equal times that holds for every n, and what is missing in the spectrum tells it; or the count of the
    angle, where that is logged (own).
    """
    for rows in range(1, RULES.search.differenced + 1):
        count, levels = _on_counts(x, good, time, rows)
        if count == 0.0:
            continue
        if (told := _missing(levels, _together(good, time, rows))) and (its := _on_counts(x, good, time, told)[0]) > 0.0:
            return its, told
        if rows > 1 if own == 0.0 else abs(count - own) < RULES.residuals.on_a_count * own:
            return count, rows
        if own == 0.0:
            return (count, 1) if _once(x) else (0.0, 0)
    return 0.0, 0


def _together(good: np.ndarray, time: np.ndarray, rows: int) -> np.ndarray:
    """Where a difference over so many rows, and the next one, are of sound rows without a gap between any of them."""
    step = np.diff(time)
    begins = ~good[1:] | ~good[:-1] | (step > 1.5 * np.median(step))
    return maximum_filter1d(begins.astype(int), 2 * rows + 1)[rows - 1 :] == 0


def _missing(levels: np.ndarray, sound: np.ndarray) -> int:
    """The most rows n over which this may be a difference, by what its spectrum lacks; 0 where it lacks nothing.

    A difference over n rows passes nothing, be it motion or rounding, at 1, 2, ... waves in n rows; a row that is wrong, or
    lacks, has all waves. Second differences first, so that the slow motion does not leak into all others.
    """
    from scipy.signal import welch  # a second to load, for those whose recorder is asked

    rules = RULES.residuals
    starts, lengths = stretches(sound)
    pieces = [np.diff(levels[a : a + n], n=2) for a, n in zip(starts, lengths) if sound[a] and n > 2]
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


def _once(x: np.ndarray) -> int:
    """1 where the rounding of a row comes again with the other sign in the next, as in a difference over one row; else 0."""
    fast = np.diff(x, n=2)
    fast = np.clip(fast, *np.quantile(fast, (0.05, 0.95)))
    return int(np.mean(fast[1:] * fast[:-1]) < RULES.residuals.differenced_once * np.mean(fast**2))


def _on_counts(x: np.ndarray, good: np.ndarray, time: np.ndarray, rows: int) -> tuple[float, np.ndarray]:
    """The count of which x is a whole number in so many rows, 0 for none; and that number in each row."""
    rules = RULES.residuals
    turned = x[rows:] * (time[rows:] - time[:-rows])
    moved = abs(turned[good[rows:] & good[:-rows] & (abs(turned) > rules.no_count)])
    if len(moved) >= rules.noise_samples:
        count = float(np.median(moved[moved < 1.5 * moved.min()]))
        for parts in (1, 2, 3):  # the slowest row may have turned by more than one
            off = abs(moved * parts / count - np.round(moved * parts / count))
            if np.mean(off < rules.on_a_count) > rules.mostly:
                return count / parts, np.round(turned * parts / count)
    return 0.0, np.zeros(0)


def commanded(ch: Channels) -> str:
    """The channel in which a controller's acts are seen: its command, or the voltage that it makes; "" where there is none."""
    return next((name for name in (COMMAND, "motor.voltage") if ch.has(name)), "")


def ticks(period: float, ch: Channels) -> float:
    """How long before the first row a controller of this period, s, ticked, as the steps of its logged command tell; s."""
    if not commanded(ch):
        return 0.0
    known = ch.run.memory.setdefault("ticks", {})  # the rows tell it, whatever is simulated
    if period not in known:
        jumps, when = _jumps(ch)
        known[period] = float(-np.angle(jumps @ np.exp(2j * np.pi * when / period)) / (2.0 * np.pi) * period % period)
    return known[period]


def measured(name: str, ch: Channels) -> float:
    """Noise of a channel as a share of its spread; 0 where it is a number that somebody wrote down, as a controller its command.

    A number that is held stands in row after row; noise comes anew in each.
    """
    x, good = ch.raw(name), ch.good(name)
    steps, usual = np.diff(x)[good[1:] & good[:-1]], float(np.std(x[good])) if good.any() else 0.0
    if usual <= 0.0 or np.mean(steps == 0.0) > 0.5:
        return 0.0
    return noise_of(x) / usual


def noise_of(x: np.ndarray) -> float:
    """Noise of rows, by fourth differences: a motion leaves next to nothing in them, white noise 70 times its variance."""
    return float(np.median(abs(np.diff(x, n=4)))) / RULES.residuals.normal_median / np.sqrt(70.0) if len(x) > 4 else 0.0


def period(ch: Channels) -> float:
    """The period, s, of a controller whose logged command steps only so often; 0 where no line stands out of the spectrum.

    A command averaged over its row shares a step between two, so changes are those over two rows. Steps that are hardly farther
    apart are in all of these, and are seen in changes over one; a part of a period that is seen in both is none.
    """
    if not commanded(ch):
        return 0.0
    (short, step), (long, _) = (_line(*_jumps(ch, rows)) for rows in (1, 2))
    if not short or not long:
        return short or long
    return short if short < 4.0 * step and abs(long / short - round(long / short)) > 0.02 else long


def _line(jumps: np.ndarray, when: np.ndarray) -> tuple[float, float]:
    """The period, s, at which jumps come, 0 where no line stands out of their spectrum; and the step of the rows, s.

    A motion's own waves are broad: a line is held against what is near it.
    """
    rules, step = RULES.residuals, float(np.median(np.diff(when)))
    even = np.interp(np.arange(when[0], when[-1], step), when, jumps)
    size = 2 ** int(np.ceil(np.log2(rules.period_padding * len(even))))
    power = abs(np.fft.rfft(even - gaussian_filter1d(even, rules.period_slowest / 2.0), size))
    frequency = np.fft.rfftfreq(size, step)
    asked = (frequency > 1.0 / (rules.period_slowest * step)) & (frequency < 1.0 / (rules.period_fastest * step))
    if not asked.any():
        return 0.0, step
    best = int(np.argmax(np.where(asked, power, 0.0)))
    near = asked & (frequency > frequency[best] / rules.period_near) & (frequency < frequency[best] * rules.period_near)
    return (float(1.0 / frequency[best]) if power[best] > rules.period_line * np.median(power[near]) else 0.0), step


def _jumps(ch: Channels, rows: int = 1) -> tuple[np.ndarray, np.ndarray]:
    """By how much the command changes over so many rows, V, and when, s, from the first row on."""
    time, command = ch.run.time - ch.run.time[0], ch.raw(commanded(ch))
    return abs(command[rows:] - command[:-rows]), 0.5 * (time[rows:] + time[:-rows])


def step_of(x: np.ndarray, least: float) -> float:
    """The step in which the values of x lie, above `least`; 0 where they lie in none.

    Of values in steps of q the mean of exp(2 pi i x / q) is as long as noise and a finer rounding leave it: the coarsest
    step at which it is long is taken.
    """
    rules, reach = RULES.residuals, float(np.ptp(x))
    if reach <= 0.0 or least <= 0.0:
        return 0.0
    fine = max(least / rules.step_parts, reach / rules.step_places)
    counts = np.bincount(np.round((x - x.min()) / fine).astype(int))
    size = 2 ** int(np.ceil(np.log2(rules.step_padding * len(counts))))
    like = abs(np.fft.rfft(counts, size)) / len(x)
    frequency = np.fft.rfftfreq(size, fine)
    asked = (frequency > rules.step_most / reach) & (frequency < 1.0 / (rules.step_above * least))
    found = np.flatnonzero(asked & (like > rules.step_like))
    if not len(found):
        return 0.0
    first = found[0]
    near = first + int(np.argmax(like[first : first + np.searchsorted(frequency[first:], 1.2 * frequency[first])]))
    closer = np.linspace(frequency[near - 1], frequency[near + 1], rules.step_closer)
    places = np.arange(len(counts)) * fine
    return float(1.0 / closer[int(np.argmax([abs(counts @ np.exp(2j * np.pi * f * places)) for f in closer]))])
