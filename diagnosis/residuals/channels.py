"""From the channels of a run to what drives the components: filled, smoothed, differentiated, sensors undone."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cache

import numpy as np

from ..data.log import MeasuredRun
from ..rules import RULES
from . import laws
from .kernels import kernels
from .setting import Setting


@dataclass(eq=False)
class ShaftMotion:
    """A shaft's motion: angle, speed, acceleration, and where its direction is certain. One is equal to itself alone."""

    angle: np.ndarray
    speed: np.ndarray
    acceleration: np.ndarray
    sliding: np.ndarray  # bool: moving one way for sure, over the whole smoothing window
    noise: float  # of the speed
    still: float = 0.0  # speed up to which it may as well be at rest


@dataclass
class Channels:
    """The channels of one drive in one run, bad samples bridged; `undo` takes out what sensors are supposed to do."""

    run: MeasuredRun
    prefix: str
    setting: Setting
    take: np.ndarray | None = None  # of a long run: the samples that are simulated
    beside: tuple[MeasuredRun, ...] = ()  # all runs that were recorded together, this one among them
    whole: Channels | None = None  # of an excerpt: what it was taken from

    def __post_init__(self):
        self.dt = np.ones(len(self.run)) if self.steady else self._steps()
        self.memory: dict = {}  # what was derived under this setting

    def _steps(self) -> np.ndarray:
        """Time to each sample from the one before, s; one array for all who look at the run."""
        if "steps" not in self.run.memory:
            steps = np.diff(self.run.time, prepend=self.run.time[:1])
            steps[:1] = steps[1] if len(steps) > 1 else 1.0
            self.run.memory["steps"] = steps
        return self.run.memory["steps"]

    @property
    def steady(self) -> bool:
        """Whether samples are steady-state points."""
        return self.setting.steady

    @property
    def smoothing(self) -> int:
        """Samples over which motions and torques are smoothed alike."""
        return self.setting.smoothing[self.prefix]

    def has(self, *names: str) -> bool:
        """Whether the log has all these channels of the drive."""
        return all(self.prefix + name in self.run.signals for name in names)

    def raw(self, name: str) -> np.ndarray:
        """A channel with its bad samples bridged by straight lines."""
        full, memory = self.prefix + name, self.run.memory
        if full not in memory:
            values, good = self.run.signals[full], self.good(name)
            places = np.flatnonzero(good)
            memory[full] = (
                values
                if good.all()
                else (np.interp(np.arange(len(values)), places, values[good]) if len(places) else np.zeros(len(values)))
            )
        return memory[full]

    def good(self, name: str) -> np.ndarray:
        """Samples at which a channel can be trusted."""
        full = self.prefix + name
        known = self.run.good.get(full)
        return np.isfinite(self.run.signals[full]) if known is None else known

    def true(self, name: str, values: dict[str, float]) -> np.ndarray:
        """A channel as it was before its sensor: lag, scale and bias undone (a resolution cannot be)."""
        x = self.raw(name)
        p = self.sensor(name, values)
        if p is None:
            return x
        probe = laws.law("sensor")
        if lag := probe.lag(p, 0.0):
            x = probe.before_lag(p, x, derivative(smooth(x, window(lag, self.dt)), np.cumsum(self.dt)))
        value = np.empty(len(x))
        self.setting.kernels.undo(p, x, value)
        return value

    def taken(self, x: np.ndarray) -> np.ndarray:
        """Of one value for each sample, those that are simulated."""
        return x if self.take is None else x[self.take]

    def taken_steps(self) -> np.ndarray:
        """Time from each sample that is simulated to the next, s: over what is left out, too."""
        if self.take is None:
            return self.dt
        if "steps" not in self.memory:
            self.memory["steps"] = np.diff(np.concatenate([[0.0], np.cumsum(self.dt)[self.take]]))
        return self.memory["steps"]

    @property
    def gaps(self) -> np.ndarray:
        """Which of the samples simulated are the last before some that are left out."""
        return np.zeros(0, int) if self.take is None else np.flatnonzero(np.diff(self.take) > 1)

    def away_from_gaps(self, samples: int) -> np.ndarray:
        """Which of the samples simulated are so far from those left out that a window of `samples` does not reach them."""
        key = ("away", samples)
        if key not in self.memory:
            away = np.ones(len(self.taken_steps()), bool)
            for shift in range(-(samples // 2), samples // 2 + 1):
                away[np.clip(self.gaps + shift + (shift <= 0), 0, len(away) - 1)] = False
            self.memory[key] = away
        return self.memory[key]

    def sensor(self, name: str, values: dict[str, float]):
        """Parameters of a channel's sensor; None where `values` say nothing of it."""
        return laws.sensor(self.prefix + name, values)


def window(seconds: float, dt: np.ndarray) -> int:
    """An odd number of samples that lasts about so long, at least the shortest window that is tried."""
    return max(RULES.residuals.windows[0], int(seconds / np.median(dt)) | 1)


def smooth(x: np.ndarray, samples: int) -> np.ndarray:
    """Gaussian average over about so many samples (six standard deviations): no overshoot, little fast noise left."""
    if not RULES.residuals.shortest_window <= samples <= len(x):
        return x
    weights = _gaussian(samples)
    reach, beyond = len(weights) - 1, np.empty(len(x) + 2 * len(weights) - 2)
    beyond[:reach], beyond[reach : reach + len(x)], beyond[reach + len(x) :] = x[0], x, x[-1]  # both ends go on as they are
    return averaged(beyond, weights)


def averaged(beyond: np.ndarray, weights: np.ndarray) -> np.ndarray:
    """Averages by weights, (k,), of the middle, then of what lies ever farther to both sides; beyond: k - 1 more to both sides."""
    mean = np.empty(len(beyond) - 2 * (len(weights) - 1))
    kernels().averaged(beyond, weights, mean)
    return mean


@cache
def _gaussian(samples: int) -> np.ndarray:
    """Weights of a Gaussian average over about so many samples, of the middle first."""
    deviations = RULES.residuals.window_deviations
    deviation = samples / deviations
    reach = int(0.5 * deviations * deviation + 0.5)
    weights = np.exp(-0.5 / deviation**2 * np.arange(-reach, reach + 1) ** 2)
    return (weights / weights.sum())[reach:]


def derivative(x: np.ndarray, time: np.ndarray) -> np.ndarray:
    """dx/dt at all samples: numpy's gradient, which needs six times the memory of x, over one piece after another."""
    found = np.empty(len(x))
    size = RULES.residuals.piece
    for first in range(0, len(x), size):
        before = max(0, first - 1)
        piece = slice(before, first + size + 1)
        found[first : first + size] = np.gradient(x[piece], time[piece])[first - before :][:size]
    return found


def rate(x: np.ndarray, time: np.ndarray, samples: int) -> np.ndarray:
    """dx/dt of what is averaged over `samples`.

    Averages of both, so that a steady rate stays what it is however rows or their stamps scatter: divided by single steps, the mean
    of 1 / dt is more than 1 over the mean of dt, 4 % where stamps scatter by a fifth of a step.
    """
    return derivative(smooth(x, samples), _evened(time, samples))


def integral(x: np.ndarray, dt: np.ndarray) -> np.ndarray:
    """Of x over time from the first sample on, by trapezia; dt: to each from the one before."""
    return np.concatenate([[0.0], np.cumsum(0.5 * (x[1:] + x[:-1]) * dt[1:])])


def mean_rate(x: np.ndarray, time: np.ndarray, since: np.ndarray, until: np.ndarray) -> np.ndarray:
    """Mean rate of x between these times, as far as it is known: a channel that is early asks for more than was simulated."""
    ends, least = time[[0, -1]], 1e-3 * (until - since)
    until = np.clip(until, ends[0] + least, ends[1])
    since = np.clip(since, ends[0], until - least)
    return (np.interp(until, time, x) - np.interp(since, time, x)) / (until - since)


def _evened(time: np.ndarray, samples: int) -> np.ndarray:
    """Times whose steps are averaged over `samples`: those of averaged times, without shorter ones at both ends."""
    return time[0] + np.concatenate([[0.0], np.cumsum(smooth(np.diff(time), samples))])


def _quantiles(x: np.ndarray, *shares: float) -> np.ndarray:
    """Of the absolute values; x is left in disorder, for want of memory in an hour's log."""
    return np.quantile(np.abs(x, out=x), shares, overwrite_input=True)


def motion(
    angle: np.ndarray | None, speed: np.ndarray | None, dt: np.ndarray, samples: int, still: float | None = None
) -> ShaftMotion:
    """The motion from an angle, a speed or both: averaged over `samples`, then differentiated.

    Whatever is compared with it can be smoothed in the same way: smoothing and differentiating change places.
    still: speed up to which it may as well be at rest; None: as its noise says.
    """
    rules = RULES.residuals
    samples = min(samples, (len(dt) - 1) | 1)
    samples = samples if samples >= rules.shortest_window else 0
    time = np.cumsum(dt)
    if speed is None:
        assert angle is not None, "a motion is measured by an angle or a speed"
        fine = rate(angle, time, samples)
        plain = derivative(angle, time)
    else:
        fine, plain = smooth(speed, samples), speed
    acceleration = derivative(fine, _evened(time, samples))
    if angle is None:
        angle = integral(fine, dt)
    else:
        angle = smooth(angle, samples) if samples else angle
    noise = 0.0
    if still is None:
        noise, still = _still(plain, fine, samples)
    moving = abs(fine) > still
    same, reach = np.sign(fine).astype(np.int8) * moving, samples // 2 + 1
    turns = np.pad(np.cumsum(same[1:] != same[:-1], dtype=np.int32), (reach + 1, reach), "edge" if len(same) > 1 else "constant")
    turns[: reach + 1] = 0  # how often the direction has changed up to each sample, and beyond both ends
    sliding = moving & (turns[2 * reach :] == turns[: -2 * reach])
    if samples:  # the average has no neighbours at the ends
        sliding[:reach] = sliding[-reach:] = False
    return ShaftMotion(angle, fine, acceleration, sliding, noise, still)


def _still(plain: np.ndarray, fine: np.ndarray, samples: int) -> tuple[float, float]:
    """Noise of a speed that was smoothed, `fine`, and how fast it may be at rest; plain: the same before."""
    rules = RULES.residuals
    calm = fine if samples >= rules.windows[0] else smooth(plain, rules.windows[0])  # what is not smoothed has noise, too
    rough = plain - calm  # half of it may be at rest, where a coarse sensor shows no noise
    noise = float(max(_quantiles(rough, 0.5, 0.9) / (rules.normal_median, rules.normal_tenth)))
    noise /= np.sqrt(max(1, samples) / rules.smoothed_noise)
    return noise, max(rules.still_noise * noise, rules.still_speed * float(_quantiles(fine.copy(), rules.high_speed)[0]), 1e-12)


def rest(n: int) -> ShaftMotion:
    """No motion at all."""
    zero = np.zeros(n)
    return ShaftMotion(zero, zero, zero, np.zeros(n, bool), 0.0)
