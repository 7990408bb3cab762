"""What a log shows of its recorder: which encoder's counts stand behind a channel."""

from __future__ import annotations

import numpy as np
from scipy.ndimage import gaussian_filter1d

from ..data.signals import ANGLE_OF
from ..data.stuck import resolution
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

    Where the angle is logged, its own count tells n. Else, with rows at equal times, the above holds for every n, and the
    rounding tells it: that of a row comes again with the other sign n rows on; or how long one count is seen while the
    shaft creeps.
    """
    for rows in range(1, RULES.search.differenced + 1):
        count, levels = _on_counts(x, good, time, rows)
        if count > 0.0 and (rows > 1 if own == 0.0 else abs(count - own) < RULES.residuals.on_a_count * own):
            return count, rows
        if count > 0.0 and own == 0.0:
            times = _comes_again(x) or _creeping(levels)
            return (times * count, times) if times else (0.0, 0)
    return 0.0, 0


def _comes_again(x: np.ndarray) -> int:
    """Rows after which what is fast in x (its second differences) comes again with the other sign; 0 where nothing does."""
    fast = np.diff(x, n=2)
    fast = np.clip(fast, *np.quantile(fast, (0.05, 0.95)))
    like = np.array([np.mean(fast[n:] * fast[: len(fast) - n]) for n in range(RULES.search.differenced + 2)])
    like /= max(float(np.mean(fast**2)), 1e-300)
    dips = like[2:-1] - 0.5 * (like[1:-2] + like[3:])
    n = int(np.argmin(dips)) + 2
    return n if dips[n - 2] < RULES.residuals.dip else int(like[1] < RULES.residuals.differenced_once)


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


def _creeping(levels: np.ndarray) -> int:
    """Rows for which a single count is seen between rows without any; 0 where the shaft never creeps."""
    edges = np.flatnonzero(np.diff(levels)) + 1
    runs = [(levels[a], b - a, levels[a - 1], levels[b]) for a, b in zip(edges[:-1], edges[1:])]
    alone = [length for level, length, before, after in runs if abs(level) == 1 and before == after == 0]
    return int(np.median(alone)) if alone else 0


def ticks(period: float, ch: Channels) -> float:
    """How long before the first row a controller of this period, s, ticked, as the steps of its logged command tell; s."""
    if not ch.has(COMMAND):
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
    """The period, s, of a controller whose logged command steps only so often; 0 where no line stands out of the spectrum."""
    if not ch.has(COMMAND):
        return 0.0
    rules, (jumps, when) = RULES.residuals, _jumps(ch)
    step = float(np.median(np.diff(when)))
    even = np.interp(np.arange(when[0], when[-1], step), when, jumps)
    size = 2 ** int(np.ceil(np.log2(rules.period_padding * len(even))))
    power = abs(np.fft.rfft(even - gaussian_filter1d(even, rules.period_slowest / 2.0), size))
    frequency = np.fft.rfftfreq(size, step)
    asked = (frequency > 1.0 / (rules.period_slowest * step)) & (frequency < 1.0 / (rules.period_fastest * step))
    if not asked.any():
        return 0.0
    best = int(np.argmax(np.where(asked, power, 0.0)))
    return float(1.0 / frequency[best]) if power[best] > rules.period_line * np.median(power[asked]) else 0.0


def _jumps(ch: Channels) -> tuple[np.ndarray, np.ndarray]:
    """By how much the command changes from row to row, V, and when, s, from the first row on."""
    time = ch.run.time - ch.run.time[0]
    return abs(np.diff(ch.raw(COMMAND))), 0.5 * (time[1:] + time[:-1])


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
