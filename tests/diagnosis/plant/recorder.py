"""How a drive was recorded, drawn at random: rows of the plant in, what stands in the log out.

recorder = draw(rng)                          the seed decides
recorder.read(rows, run, rng)                 the log: lags, differences, counts, ripple, noise
recorder.read(rows, run)                      the same without rounding, ripple and noise: what a true model would say

Set-points are numbers and go into the log as they are. All else is read late by up to 2 ms, with noise.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import pandas as pd

from .drive import CHANNELS, Drive

TICK = 2.5e-5  # s: the plant's step; a continuous controller acts at each
DENSE = 2.5e-4  # s between two of the plant's rows
FINE = int(round(DENSE / TICK))
LATEST = 2e-3  # s
NOISE = {  # of a good recorder; a bad one has six times as much
    "voltage": 0.02,
    "current": 0.025,
    "motor_speed": 0.1,
    "speed": 3e-3,
    "ambient": 0.05,
    "supply": 0.01,
    "output_torque": 0.03,
}
GRAIN = {"voltage": 60.0 / 4096, "current": 40.0 / 4096, "supply": 30.0 / 4096, "output_torque": 60.0 / 4096}  # 12 bits
SHAFTS = {"motor_speed": "motor_angle", "speed": "angle"}
EXACT = ("setpoint_angle", "setpoint_speed")


@dataclass(frozen=True)
class Speed:
    """How a speed is made: "difference" of counts over `rows`, "tacho" with `ripple`, or "filter" of `time` s."""

    by: str
    rows: int = 1
    ripple: float = 0.0  # relative, `order` times a turn
    order: float = 1.0
    phase: float = 0.0
    time: float = 0.0


@dataclass(frozen=True)
class Recorder:
    """One recorder and the controller beside it. Times in s."""

    control: float  # the controller's period; 0: continuous
    step: float  # between rows
    jitter: float  # of it, each way
    counts: dict[str, int]  # per turn: motor_angle, angle
    speeds: dict[str, Speed]  # motor_speed, speed
    lags: dict[str, float]
    noise: dict[str, float]
    averaged: bool  # the voltage, over the step; else as it is at the instant
    channels: tuple[str, ...]  # that are written
    duration: float
    seed: int  # of the rows' times

    def times(self, run: int, last: float) -> np.ndarray:
        """When the rows of a run were taken, s, stamped to the microsecond."""
        rng = np.random.default_rng([self.seed, run])
        first = 2.0 * LATEST  # later than every lag
        regular = first + self.step * np.arange(int((last - first) / self.step - 1.0))
        return np.round(regular + self.jitter * self.step * rng.uniform(-1.0, 1.0, len(regular)), 6)

    def read(self, rows: np.ndarray, run: int, rng: np.random.Generator | None = None) -> pd.DataFrame:
        """The table of a run from the plant's dense rows; without `rng` as a perfect instrument in its place reads."""
        grid = DENSE * np.arange(len(rows))
        time = self.times(run, grid[-1])
        truth = dict(zip(CHANNELS, rows.T))
        table = {"time": time - time[0]}
        for name in self.channels:
            table[name] = self._read(name, truth, grid, time, rng)
        return pd.DataFrame(table)

    def _read(self, name: str, truth: dict, grid: np.ndarray, time: np.ndarray, rng) -> np.ndarray:
        when = time - self.lags.get(name, 0.0)
        if name in EXACT:
            return _held(truth[name], when)
        if name in SHAFTS.values():
            return self._angle(name, truth, grid, when, rng)
        speed = self.speeds.get(name)
        noise = self.noise[name] * rng.standard_normal(len(time)) if rng else 0.0
        if speed and speed.by == "difference":
            return _difference(self._angle(SHAFTS[name], truth, grid, when, rng), time, speed.rows)
        if speed and speed.by == "filter":
            return np.interp(when, grid, _filtered(truth[name], speed.time)) + noise
        if name == "voltage" and not self.averaged:
            found = _held(truth[name], when)
        elif name == "voltage":
            sums = np.concatenate([[0.0], np.cumsum(truth[name])]) * DENSE
            edges = np.append(grid, grid[-1] + DENSE)
            found = (np.interp(when, edges, sums) - np.interp(when - self.step, edges, sums)) / self.step
        else:
            found = np.interp(when, grid, truth[name])
        if speed and rng:
            angle = np.interp(when, grid, truth[SHAFTS[name]])
            found = found * (1.0 + speed.ripple * np.sin(speed.order * angle + speed.phase))
        found = found + noise
        return GRAIN[name] * np.round(found / GRAIN[name]) if rng and name in GRAIN else found

    def _angle(self, name: str, truth: dict, grid: np.ndarray, when: np.ndarray, rng) -> np.ndarray:
        """Counts of an encoder, whose lines are a twentieth of a count off; half a count of offset is taken out."""
        angle = np.interp(when, grid, truth[name])
        if rng is None:
            return angle
        count = 2.0 * np.pi / self.counts[name]
        return count * (np.floor(angle / count + 0.05 * rng.standard_normal(len(angle))) + 0.5)


def _held(x: np.ndarray, when: np.ndarray) -> np.ndarray:
    return x[np.floor(when / DENSE + 1e-6).astype(int)]


def _difference(angle: np.ndarray, time: np.ndarray, rows: int) -> np.ndarray:
    """Difference over so many rows back; over as many as there are at the start."""
    before = np.maximum(np.arange(len(angle)) - rows, 0)
    before[0], last = 0, np.arange(len(angle))
    last[0] = 1
    return (angle[last] - angle[before]) / (time[last] - time[before])


def _filtered(x: np.ndarray, time: float) -> np.ndarray:
    """First-order lag."""
    from scipy.signal import lfilter

    keep = np.exp(-DENSE / time)
    return lfilter([1.0 - keep], [1.0, -keep], x, zi=[keep * x[0]])[0]


def _between(rng: np.random.Generator, low: float, high: float) -> float:
    """Even in its logarithm."""
    return float(np.exp(rng.uniform(np.log(low), np.log(high))))


def draw(
    rng: np.random.Generator, needs: tuple[str, ...] = (), true_speeds: bool = False, duration: float | None = None
) -> Recorder:
    """A recorder. needs: channels that it must write; true_speeds: no speed is made from an angle."""
    control = TICK * round(1.0 / (_between(rng, 200.0, 20e3) * TICK)) if rng.random() < 0.75 else 0.0
    step = round(1.0 / _between(rng, 200.0, 2000.0), 5)
    jitter = rng.uniform(0.01, 0.15) if rng.random() < 0.5 else 0.0
    counts = {name: int(_between(rng, 500.0, 20e3)) for name in ("motor_angle", "angle")}
    speeds = {}
    for name in SHAFTS:
        by = str(rng.choice(("tacho", "filter") if true_speeds else ("difference", "tacho", "filter")))
        order, phase = float(rng.choice((1, 2, 4))), rng.uniform(0.0, 2.0 * np.pi)
        speeds[name] = Speed(
            by, int(rng.integers(1, 11)), _between(rng, 1e-3, 1e-2), order, float(phase), _between(rng, 5e-4, 5e-3)
        )
    late = rng.random() < 0.5
    lags = {name: float(rng.uniform(0.0, LATEST)) if late else 0.0 for name in CHANNELS if name not in EXACT}
    noise = {name: sigma * _between(rng, 1.0, 6.0) for name, sigma in NOISE.items()}
    shares = {"current": 0.85, "motor_angle": 0.75, "motor_speed": 0.8, "speed": 0.7, "output_torque": 0.4, "supply": 0.3}
    written = {name for name, share in shares.items() if rng.random() < share} | set(needs)
    if "motor_angle" not in written:
        written.add("motor_speed")
    channels = tuple(name for name in CHANNELS if name not in shares or name in written)
    averaged, length, seed = bool(rng.random() < 0.5), _between(rng, 10.0, 300.0), int(rng.integers(2**31))
    return Recorder(
        control=control,
        step=step,
        jitter=jitter,
        counts=counts,
        speeds=speeds,
        lags=lags,
        noise=noise,
        averaged=averaged,
        channels=tuple(name for name in channels if name != "motor_torque"),
        duration=duration or length,
        seed=seed,
    )


def behind(drive: Drive, recorder: Recorder) -> Drive:
    """The drive with the recorder's controller, where nothing slower is hidden in it."""
    return drive if drive.sampling else drive._replace(sampling=recorder.control)
