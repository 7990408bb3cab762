"""What a log shows of its recorder: which encoder's counts stand behind a channel."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from scipy.ndimage import gaussian_filter1d

from ..data.differenced import SpeedRows, difference, over_losses
from ..data.signals import ANGLE_OF
from ..data.values import arrivals, noise_of, resolution, rough
from ..rules import RULES
from .channels import Channels

COMMAND = "controller.voltage"


def counts(name: str, ch: Channels) -> tuple[float, int]:
    """Of a channel: its count, rad, and the rows over which it is a difference of such counts; 0 for none.

    One recorder wrote all runs: they tell together, or a run by itself where they do not agree.
    """
    key = ("counts", name)
    if key not in ch.memory:
        if name in ANGLE_OF:
            ch.memory[key] = _together(name, ch) or _alone(name, ch)
        else:
            beside = [replace(ch, run=run, take=None) for run in ch.beside]
            ch.memory[key] = _finest(name, beside, least_step(name, ch)), 0
    return ch.memory[key]


def least_step(name: str, ch: Channels) -> float:
    """The least step between the values of a run's channel, which every simulation of a controller in steps asks for."""
    known, full = ch.run.memory.setdefault("least step", {}), ch.prefix + name
    if full not in known:
        known[full] = resolution(ch.raw(name)[ch.good(name)])
    return known[full]


def _finest(name: str, runs: list[Channels], own: float) -> float:
    """The least step between a channel's values in any run, of which every run's is some: who turned fast passed over every other count.

    Else `own`: of values that lie anywhere the least step says little, and that of another run nothing.
    """
    steps = [least_step(name, ch) for ch in runs if ch.has(name)]
    least = min(steps, default=0.0)
    return least if least > 0.0 and all(abs(s / least - round(s / least)) < RULES.residuals.on_a_count for s in steps) else own


def _together(name: str, ch: Channels) -> tuple[float, int] | None:
    """What all runs tell, if anything."""
    if len(ch.beside) < 2:
        return None
    known, full = ch.beside[0].memory.setdefault("counts", {}), ch.prefix + name
    if full not in known:
        known[full] = _difference(name, [replace(ch, run=run, take=None) for run in ch.beside])
    return known[full] if known[full][1] else None


def _alone(name: str, ch: Channels) -> tuple[float, int]:
    """What a run tells by itself."""
    known, full = ch.run.memory.setdefault("counts alone", {}), ch.prefix + name
    if full not in known:
        known[full] = _difference(name, [ch])
    return known[full]


def _difference(name: str, runs: list[Channels]) -> tuple[float, int]:
    angle = ANGLE_OF[name]
    told = [
        SpeedRows(ch.raw(name), ch.good(name) & ch.good(angle), ch.run.time, ch.raw(angle))
        if ch.has(angle)
        else SpeedRows(ch.raw(name), ch.good(name), ch.run.time)
        for ch in runs
    ]
    own = [least_step(angle, ch) for ch in runs if ch.has(angle)]
    return difference(told, _finest(angle, runs, float(np.median(own)) if own else 0.0))


def over_lost_rows(name: str, ch: Channels) -> np.ndarray:
    """Rows in which a speed that is a difference goes over rows that are lost: by how much it is off depends on who lost them."""
    rows = counts(name, ch)[1] if name in ANGLE_OF else 0
    if not rows:
        return np.zeros(len(ch.run), bool)
    known = ch.run.memory.setdefault("over lost rows", {})
    if rows not in known:
        known[rows] = over_losses(ch.run.time, rows)
    return known[rows]


def commanded(ch: Channels) -> str:
    """The channel in which a controller's acts are seen: its command, or the voltage that it makes; "" where there is none."""
    return next((name for name in (COMMAND, "motor.duty", "motor.voltage") if ch.has(name)), "")


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


def written_step(name: str, ch: Channels) -> float:
    """The step between the numbers in which somebody wrote a channel, as a controller its command; 0 of one that was measured.

    Also 0 of numbers that lie in no step: between those of a law that is computed to its last digit there is a least distance, too.
    A command that changes in most rows has the noise of its own steps, and no more.
    """
    known, full = ch.run.memory.setdefault("written step", {}), ch.prefix + name
    if full not in known:
        runs = [replace(ch, run=run, take=None) for run in ch.beside or (ch.run,)]
        values = np.concatenate([one.raw(name)[one.good(name)] for one in runs])
        step = resolution(values)
        rounds = noise_of(ch.raw(name)) <= RULES.residuals.of_own_steps * step or measured(name, ch) <= RULES.residuals.exact
        known[full] = step if step > 0.0 and rounds and _all_in(values, step) else 0.0
    return known[full]


def _all_in(values: np.ndarray, step: float) -> bool:
    """Whether values lie at whole numbers of a step from one another."""
    numbers = (values - values.min()) / step
    return bool(np.mean(abs(numbers - np.round(numbers))) < RULES.residuals.on_steps)


def noisy(name: str, ch: Channels) -> bool:
    """Whether a motion was measured: noise or counts are more of what it changes by from row to row than a number has.

    It may rest for most of the log, where counts show none.
    """
    x, rules = ch.raw(name), RULES.residuals
    often = float(np.quantile(rough(x), 0.9)) / rules.normal_tenth if len(x) > 4 else 0.0
    noise = max(noise_of(x), often)
    return noise > rules.exact * float(np.std(np.diff(x)))


def periods(ch: Channels) -> tuple[float, ...]:
    """The period, s, that a controller may have whose logged command steps only so often; none where no line stands out of the spectrum.

    A command averaged over its row shares a step between two, so changes are those over two rows. Steps that are hardly farther
    apart are in all of these, and are seen in changes over one; a part of a period that is seen in both is none. A second where the
    strongest line may be a part of a period: a model, and no spectrum, tells a part from steps of which every other is larger.
    """
    if not commanded(ch):
        return ()
    (short, step), (long, _) = (_lines(*_jumps(ch, rows)) for rows in (1, 2))
    if not short or not long:
        return short or long
    return short if short[0] < 4.0 * step and abs(long[0] / short[0] - round(long[0] / short[0])) > 0.02 else long


def _lines(jumps: np.ndarray, when: np.ndarray) -> tuple[tuple[float, ...], float]:
    """The period, s, at which jumps come, none where no line stands out of their spectrum, and that of which it may be a part; and
    the step of the rows, s.

    A motion's own waves are broad: a line is held against what is near it. All lines of jumps that come again and again are as strong.
    """
    rules, step = RULES.residuals, float(np.median(np.diff(when)))
    even = np.interp(np.arange(when[0], when[-1], step), when, jumps)
    size = 2 ** int(np.ceil(np.log2(rules.period_padding * len(even))))
    power = abs(np.fft.rfft(even - gaussian_filter1d(even, rules.period_slowest / 2.0), size))
    frequency = np.fft.rfftfreq(size, step)
    asked = (frequency > 1.0 / (rules.period_slowest * step)) & (frequency < 1.0 / (rules.period_fastest * step))
    if not asked.any():
        return (), step

    def stands(line: int) -> bool:
        near = asked & (frequency > frequency[line] / rules.period_near) & (frequency < frequency[line] * rules.period_near)
        return bool(power[line] > rules.period_line * np.median(power[near]))

    power = np.where(asked, power, 0.0)
    best = int(np.argmax(power))
    if not stands(best):
        return (), step
    lines, about = [best], rules.period_padding
    for part in range(2, int(frequency[best] * rules.period_slowest * step) + 1):
        lowest = max(best // part - about, 0)
        line = lowest + int(np.argmax(power[lowest : best // part + about + 1]))
        if power[line] > rules.period_part * power[best] and stands(line):
            lines[1:] = [line]
    return tuple(float(1.0 / frequency[line]) for line in lines), step


def _jumps(ch: Channels, rows: int = 1) -> tuple[np.ndarray, np.ndarray]:
    """By how much the command changes over so many rows, V, and when, s, from the first row on."""
    time, command = ch.run.time - ch.run.time[0], ch.raw(commanded(ch))
    return abs(command[rows:] - command[:-rows]), 0.5 * (time[rows:] + time[:-rows])


def lies_in(name: str, ch: Channels) -> tuple[float, ...]:
    """The step in which a channel's values lie, and another that they lie in as well; none above their own resolution. See steps_of."""
    known, full = ch.run.memory.setdefault("lies in", {}), ch.prefix + name
    if full not in known:
        known[full] = steps_of(ch.raw(name)[ch.good(name)], least_step(name, ch))
    return known[full]


def steps_of(x: np.ndarray, least: float) -> tuple[float, ...]:
    """The steps in which the values of x may lie, above `least`: one, two or none.

    Of whole numbers n of `least` the mean of exp(2 pi i n least f) is as long at f = 1 / least - 1 / q as at 1 / q: of steps of about
    two of their own the values alone do not tell which of both it is.
    """
    step = step_of(x, least)
    other = 1.0 / (1.0 / least - 1.0 / step) if step > least else 0.0
    return tuple(q for q in (step, other) if q > RULES.residuals.step_above * least)


def step_of(x: np.ndarray, least: float) -> float:
    """The step in which the values of x lie, above `least`; 0 where they lie in none.

    Of values in steps of q the mean of exp(2 pi i x / q) is as long as noise and a finer rounding leave it: the coarsest
    step at which it is long is taken. Few of them may be where a signal stays, and not where it can be: of few it is asked of the rows
    in which it goes on to another. Of one that mostly rests it is long at any step: the coarsest that those rows say is taken then.
    """
    rules, reach = RULES.residuals, float(np.ptp(x))
    if reach <= 0.0 or least <= 0.0:
        return 0.0
    fine = max(least / rules.step_parts, reach / rules.step_places)
    counts = np.bincount(np.round((x - x.min()) / fine).astype(int))
    size = 2 ** int(np.ceil(np.log2(rules.step_padding * len(counts))))
    like = abs(np.fft.rfft(counts, size)) / len(x)
    frequency = np.fft.rfftfreq(size, fine)
    asked = (frequency > rules.step_fewest / reach) & (frequency < 1.0 / (rules.step_above * least))
    found = np.flatnonzero(asked & (like > rules.step_like))
    there = np.flatnonzero(counts)  # of two hundred thousand places no more than there are rows
    often, places = counts[there], there * fine
    first, coarsest = int(found[0]) if len(found) else 0, True
    while first:
        end = first + int(np.searchsorted(frequency[first:], rules.step_lobes * frequency[first]))
        near = first + int(np.argmax(like[first:end]))
        while near + 2 < len(like) and like[near + 1] > like[near]:  # a crest that lies just beyond
            near += 1
        closer = np.linspace(frequency[near - 1], frequency[near + 1], rules.step_closer)
        step = float(1.0 / closer[int(np.argmax([abs(often @ np.exp(2j * np.pi * f * places)) for f in closer]))])
        if (coarsest and reach >= rules.step_most * step) or _goes_by(x, step):
            return step
        beyond = found[found >= end]
        crests = beyond[(like[beyond] >= like[beyond - 1]) & (like[beyond] > like[np.minimum(beyond + 1, len(like) - 1)])]
        first, coarsest = int(crests[0]) if len(crests) else 0, False
    return 0.0


def _goes_by(x: np.ndarray, step: float) -> bool:
    """Whether values lie in this step in the rows in which they go on to another of its steps, too."""
    zero = step * float(np.angle(np.exp(2j * np.pi * x / step).mean())) / (2.0 * np.pi)
    passed = arrivals(x, step, zero)
    return len(passed) >= RULES.residuals.step_passed and float(passed.mean()) > RULES.residuals.step_like
