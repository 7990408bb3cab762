"""Hidden drives on a bench: what is hidden, the runs, the logs and the rig file that the product is given.

case = bench.hide(["motor.brush_drop"], seed=7)      what, how strongly and which drive: the seed decides
files = case.write(folder)                           rig.toml, train.csv, test.csv
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
import pandas as pd

from . import faults
from .causes import DRAWS, Cause
from .drive import CHANNELS, SENSED, Drive, simulate
from .rig import SEEN, rig

STEP = 0.002  # s between rows
FINE = 40  # the plant's steps between two rows: 50 µs
NOISE = {
    "current": 0.05,
    "motor_angle": 2e-3,
    "motor_speed": 0.2,
    "angle": 2e-4,
    "speed": 5e-3,
    "ambient": 0.05,
    "motor_torque": 2e-3,
}
QUANTUM = {"voltage": 1e-3, "current": 5e-3, "motor_angle": 1.5e-3, "angle": 1e-4}  # of the recorder


@dataclass(frozen=True)
class Motion:
    """Set-points and room temperature of one run."""

    start: float
    angle: np.ndarray
    speed: np.ndarray
    ambient: np.ndarray


def motion(rng: np.random.Generator, duration: float, step: float = STEP) -> Motion:
    """Moves of every speed in both directions over both signs of the load, with stops between: a drive's working day."""
    n = int(duration / step)
    speed = np.zeros(n)
    start = position = rng.uniform(-0.5, 0.5)
    k = int(0.3 / step)
    while k < n:
        target = rng.uniform(-2.2, 2.2)
        distance = abs(target - position)
        acceleration = np.exp(rng.uniform(np.log(4.0), np.log(60.0)))
        top = min(np.exp(rng.uniform(np.log(0.06), np.log(4.0))), np.sqrt(distance * acceleration))
        distance = min(distance, top * rng.uniform(0.3, 0.9) + top**2 / acceleration)
        total = distance / top + top / acceleration
        t = np.arange(0.0, total, step)
        profile = np.sign(target - position) * np.clip(np.minimum(t, total - t) * acceleration, 0.0, top)
        m = min(len(profile), n - k)
        speed[k : k + m] = profile[:m]
        position += profile.sum() * step
        k += m + (int(rng.uniform(0.05, 0.5) / step) if rng.random() < 0.4 else 0)
    width = int(0.03 / step)
    speed = np.convolve(speed, np.ones(width) / width)[:n]
    time = np.arange(n) * step
    ambient = 22.0 + 6.0 * np.sin(2.0 * np.pi * (rng.uniform(0.1, 0.25) * time + rng.random()))
    return Motion(start, start + np.cumsum(speed) * step, speed, ambient)


def run(drive: Drive, plan: Motion) -> np.ndarray:
    return simulate(drive, plan.angle, plan.speed, plan.ambient, STEP, FINE, plan.start)


def record(rows: np.ndarray, drive: Drive, rng: np.random.Generator) -> pd.DataFrame:
    """What the recorder writes: noise, then each sensor's and the recorder's own steps."""
    table = pd.DataFrame(rows, columns=list(CHANNELS))
    coarse = {channel: step for channel, step in zip(SENSED, drive.step) if step}
    for channel, sigma in NOISE.items():  # a coarse sensor is a quiet one
        table[channel] += min(sigma, coarse.get(channel, np.inf) / 60.0) * rng.standard_normal(len(table))
    for channel, quantum in (QUANTUM | coarse).items():
        table[channel] = quantum * np.round(table[channel] / quantum)
    table.insert(0, "time", np.arange(len(table)) * STEP)
    return table


def nominal(rng: np.random.Generator) -> Drive:
    """A drive as its data sheet has it: self-locking or not."""
    d = Drive()
    return d._replace(
        resistance=d.resistance * rng.uniform(0.8, 1.25),
        friction=float(rng.choice((0.010, 0.012, 0.015, 0.023, 0.026))),
        mass=d.mass * rng.uniform(0.8, 1.2),
        arm=d.arm * rng.uniform(0.9, 1.1),
        shaft_inertia=d.shaft_inertia * rng.uniform(0.9, 1.3),
    )


def _seen(drive: Drive, plan: Motion) -> np.ndarray:
    """Rows of a run as its coarse sensors read them, without noise."""
    rows = run(drive, plan)
    for channel, step in zip(SENSED, drive.step):
        if step:
            rows[:, CHANNELS.index(channel)] = step * np.round(rows[:, CHANNELS.index(channel)] / step)
    return rows


def ratio(
    before: Drive, after: Drive, plans: list[Motion], sensed: bool = False, without: list[np.ndarray] | None = None
) -> float:
    """Error without the true model over the error with it, in the channel where it shows best: 2 is halving.

    Looked at: the current (motor, gear and load), the command (controller and all before it) and the twist of the
    gear; for a sensor's error its own channel too. Whole runs of the plant with and without the cause, and the noise.
    A cause must show in every run: what the log to learn from does not hold cannot be learnt.
    without: the runs without the cause, where they are known already.
    """
    shown = []
    voltage_noise = np.hypot(before.angle_gain * NOISE["angle"], before.speed_gain * NOISE["speed"])
    for plan, unchanged in zip(plans, without or [_seen(before, plan) for plan in plans]):
        with_it = _seen(after, plan)
        if not np.all(np.isfinite(with_it)):
            return np.inf
        difference = dict(zip(CHANNELS, (with_it - unchanged).T))
        twist = difference["motor_angle"] / before.gear_ratio - difference["angle"]
        seen = [
            difference["current"] / NOISE["current"],
            difference["voltage"] / voltage_noise,
            (twist - np.median(twist)) / NOISE["angle"],
        ]  # the encoders' zeros are not known
        if sensed:
            seen.append(difference["motor_speed"] / NOISE["motor_speed"])
        shown.append(max(np.sqrt(1.0 + np.mean(d**2)) for d in seen))
    return float(min(shown))


@dataclass
class Case:
    """One hidden case: the drive's data sheet, what is really there, and the runs."""

    seed: int
    sheet: Drive
    truth: Drive
    causes: list[Cause]
    strengths: list[float]
    ratios: list[float]
    plans: list[Motion]
    faulty: bool = False  # the log to learn from has every kind of fault
    placed: list[dict] | None = None  # where the faults were put
    kind: str = "forward"  # of rig

    @property
    def parameters(self) -> dict:
        found = {}
        for cause, strength in zip(self.causes, self.strengths):
            found |= cause.parameters(strength)
        return found

    def write(self, folder: Path) -> tuple[Path, Path, Path]:
        """rig.toml, train.csv and test.csv: all that the product sees."""
        folder = Path(folder)
        folder.mkdir(parents=True, exist_ok=True)
        (folder / "rig.toml").write_text(rig(self.sheet, self.kind))
        rng = np.random.default_rng([self.seed, 1])
        for plan, name in zip(self.plans, ("train.csv", "test.csv")):
            if self.kind == "steady":
                table = _steady(self.truth, rng)
            else:
                table = record(run(self.truth, plan), self.truth, rng)[["time", *SEEN[self.kind]]]
            if self.faulty and name == "train.csv":
                table, self.placed = faults.spoil_with_all(table, rng)
            table.to_csv(folder / name, index=False, float_format="%.7g")
        return folder / "rig.toml", folder / "train.csv", folder / "test.csv"


def _steady(drive: Drive, rng: np.random.Generator) -> pd.DataFrame:
    """Runs at constant speed in both directions, lifting and lowering a weight on a pulley."""
    parts = []
    speeds = np.concatenate([sign * np.geomspace(0.06, 4.0, 12) * rng.uniform(0.9, 1.1, 12) for sign in (1, -1)])
    for number, speed in enumerate(speeds):
        time = np.arange(500) * STEP
        ramp = speed * np.maximum(time - 0.3, 0.0)
        plan = Motion(rng.uniform(0.0, 6.0), ramp, np.where(time > 0.3, speed, 0.0), np.full(500, 22.0))
        plan = replace(plan, angle=plan.start + ramp)
        table = record(run(drive, plan), drive, rng).iloc[300:]
        parts.append(table[["time", *SEEN["steady"]]].assign(run=f"{number:02d}"))
    return pd.concat(parts)


def hide(
    names: list[str], seed: int, duration: float = 12.0, target: float | None = None, faulty: bool = False, kind: str = "forward"
) -> Case:
    """Hide causes by name (see causes.DRAWS; [] is none) so strongly that each raises the error `target` times.

    Without a target the seed decides: 3 to 10 times, so that mending it much more than halves the error.
    """
    rng = np.random.default_rng([seed, 0])
    sheet = nominal(rng)
    if kind == "steady":
        sheet = sheet._replace(mass=0.0, load_inertia=0.1, constant_torque=4.0)
    plans = [motion(rng, duration), motion(rng, duration)]
    truth, causes, strengths, ratios = sheet, [], [], []
    for name in names:
        cause = DRAWS[name](rng, sheet)
        wanted = target or float(np.exp(rng.uniform(np.log(3.0), np.log(10.0))))
        without = [] if cause.extent[0] == cause.extent[1] else [_seen(sheet, plan) for plan in plans]
        sensed = cause.component == "sensor"
        strength = strength_of(cause, sheet, lambda after: ratio(sheet, after, plans, sensed, without), wanted)
        causes.append(cause)
        strengths.append(strength)
        ratios.append(ratio(sheet, sheet._replace(**cause.change(strength)), plans, sensed))
        truth = merge(truth, cause.change(strength))
    return Case(seed, sheet, truth, causes, strengths, ratios, plans, faulty, kind=kind)


def merge(drive: Drive, changes: dict) -> Drive:
    """Sensors of two causes side by side; everything else replaces."""
    for name, value in changes.items():
        if isinstance(value, tuple):
            value = tuple(new or old for new, old in zip(value, getattr(drive, name)))
        drive = drive._replace(**{name: value})
    return drive


def strength_of(cause: Cause, sheet: Drive, ratio: Callable[[Drive], float], wanted: float) -> float:
    """The strength, within what makes sense, at which the error is `wanted` times the noise: bisection in its logarithm."""
    low, high = cause.extent
    if low == high:
        return low
    for _ in range(7):
        middle = np.sqrt(low * high)
        if ratio(sheet._replace(**cause.change(middle))) > wanted:
            high = middle
        else:
            low = middle
    return float(low)
