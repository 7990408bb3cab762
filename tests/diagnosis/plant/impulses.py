"""Another hidden plant, apart from drive.py: friction as a set-valued force that acts by impulses, on drives of other makes.

case = impulses.hide(["reducer.backlash"], seed=10_007)
files = case.write(folder)                           rig.toml, train.csv, test.csv

Each step of 10 us takes from the speed what friction can take of it, and no more (Moreau, Unilateral contact and dry friction in finite
freedom dynamics, 1988): no bristle, no band about zero. The wedge is that of the study (2), (3), (13). The motor is exact for
a held voltage. Its controller is told the shaft or an encoder's counts, its recorder rounds counts down.
Seeds from DEVELOPMENT on are for development; those below judge.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import pandas as pd
from numba import njit

DEVELOPMENT = 10_000
STEP = 1e-5  # s
GRAVITY = 9.81

SHEET = (
    "resistance", "inductance", "constant", "ratio", "tangent", "friction", "rotor", "stiffness", "damping", "mass", "arm",
    "inertia", "angle_gain", "speed_gain", "supply",
)  # fmt: skip
HIDDEN = (
    "static", "static_speed", "viscous", "asymmetry", "preload", "ripple", "ripple_order", "play", "cold", "cold_time",
    "brushes", "cogging", "cogging_order", "dead_zone", "delay", "tilt", "push",
)  # fmt: skip


@njit(cache=True)
def _run(p, h, wanted, fast, per_act, per_row, seen, rows):
    """Rows of time, voltage, current, angle and speed of the motor, angle and speed of the load."""
    r, inductance, k, ratio, t, mu, rotor, stiff, damps, mass, arm, beside, kp, kd, supply = p
    (static, static_speed, viscous, asymmetry, preload, ripple, ripple_order, play, cold, cold_time,
     brushes, cogging, cogging_order, dead, delay, tilt, push) = h  # fmt: skip
    weight, inertia = mass * GRAVITY * arm, beside + mass * arm * arm
    load, turning = wanted[0], 0.0
    torque = weight * math.sin(load + tilt)
    motor, speed, current, u = (load + torque / stiff + math.copysign(0.5 * play, torque)) * ratio, 0.0, 0.0, 0.0
    lever, level, lag = 1.0 / (ratio * t), math.sqrt(1.0 + t * t), int(round(delay / STEP))
    waiting = np.zeros(lag + 1)
    for n in range(len(wanted)):
        if n % per_act == 0:
            told = load if seen == 0.0 else math.floor(load / seen) * seen
            u = min(max(kp * (wanted[n] - told) + kd * (fast[n] - turning), -supply), supply)
        waiting[n % (lag + 1)] = u
        given = waiting[(n + 1) % (lag + 1)]
        given = 0.0 if abs(given) < dead else given
        ends = (given - k * speed - brushes * math.tanh(current / 0.02)) / r
        current = ends + (current - ends) * math.exp(-r * STEP / inductance)
        twist = motor / ratio - load
        touches = twist - min(max(twist, -0.5 * play), 0.5 * play)
        torque = 0.0 if play > 0.0 and touches == 0.0 else stiff * touches + damps * (speed / ratio - turning)
        if play > 0.0 and torque * touches < 0.0:
            torque = 0.0
        f = mu * (1.0 + static * math.exp(-((speed / static_speed) ** 2))) * (1.0 + cold * math.exp(-n * STEP / cold_time))
        f *= 1.0 + ripple * math.sin(ripple_order * load)
        up, down = f * (1.0 + asymmetry), f * (1.0 - asymmetry)
        slope = (t + up) / (1.0 - t * up) if torque > 0.0 else (t - up) / (1.0 + t * up)
        most = max(torque * slope * lever, torque / ratio + up * preload * level)
        slope = (t + down) / (1.0 - t * down) if torque < 0.0 else (t - down) / (1.0 + t * down)
        least = -max(-torque * slope * lever, -torque / ratio + down * preload * level)
        drive = k * current - cogging * math.sin(cogging_order * motor) - viscous * speed
        free = speed + STEP * drive / rotor
        speed = free - STEP * min(max(free * rotor / STEP, least), most) / rotor  # what would stop it, as far as friction reaches
        motor += STEP * speed
        pull = torque - weight * math.sin(load + tilt) - push * math.sin(2.0 * math.pi * 1.7 * n * STEP)
        turning += STEP * pull / inertia
        load += STEP * turning
        if n % per_row == 0:
            row = rows[n // per_row]
            row[0], row[1], row[2], row[3], row[4], row[5], row[6] = n * STEP, given, current, motor, speed, load, turning


def sheet(rng: np.random.Generator) -> dict[str, float]:
    """A drive that can lift its arm with a third of its stall torque, whose loop is calm: its data sheet tells all of it."""
    ratio = float(rng.choice([25, 36, 48, 62, 80, 100]))
    tangent = math.tan(rng.uniform(0.03, 0.09)) if rng.random() < 0.5 else 1.0 / ratio
    supply = float(rng.choice([12, 24, 36]))
    k, r = supply / rng.uniform(350, 600), rng.uniform(0.8, 5.0) * supply / 24.0
    mass, arm = rng.uniform(0.5, 2.0), rng.uniform(0.1, 0.3)
    mu = tangent * (rng.uniform(0.3, 0.85) if rng.random() < 0.7 else rng.uniform(1.05, 1.3))
    needs = mass * GRAVITY * arm * (tangent + mu) / (1.0 - tangent * mu) / (ratio * tangent)
    r = min(r, 0.35 * supply * k / needs)
    rotor, stiff = 10.0 ** rng.uniform(-5, -4), rng.uniform(1500, 6000)
    swings = 1.0 / (1.0 / (rotor * ratio**2) + 1.0 / (0.02 + mass * arm**2))
    damps = 2.0 * rng.uniform(0.1, 0.4) * math.sqrt(stiff * swings)
    inductance = r * 10.0 ** rng.uniform(-3.8, -3.0)
    gains = supply / rng.uniform(0.3, 0.8), supply / rng.uniform(8, 30)
    values = (r, inductance, k, ratio, tangent, mu, rotor, stiff, damps, mass, arm, 0.02, *gains, supply)
    return dict(zip(SHEET, values))


def _torque(s: dict[str, float]) -> float:
    return s["supply"] / s["resistance"] * s["constant"]


CAUSES: dict[str, Callable[[dict, np.random.Generator], dict[str, float]]] = {
    "reducer.stribeck": lambda s, rng: {"static": 0.5, "static_speed": rng.uniform(5.0, 15.0)},
    "reducer.viscous": lambda s, rng: {"viscous": 0.15 * _torque(s) / (s["supply"] / s["constant"])},
    "reducer.asymmetric": lambda s, rng: {"asymmetry": 0.3},
    "reducer.preload": lambda s, rng: {"preload": 2.0},
    "reducer.ripple": lambda s, rng: {"ripple": 0.6, "ripple_order": float(rng.integers(1, 4))},
    "reducer.backlash": lambda s, rng: {"play": 0.01},
    "reducer.compliance": lambda s, rng: {"stiffness": s["stiffness"] / 8.0},
    "reducer.warm_up": lambda s, rng: {"cold": 0.6, "cold_time": rng.uniform(4.0, 12.0)},
    "motor.brush_drop": lambda s, rng: {"brushes": 0.05 * s["supply"]},
    "motor.cogging": lambda s, rng: {"cogging": 0.05 * _torque(s), "cogging_order": float(rng.integers(3, 9))},
    "controller.dead_zone": lambda s, rng: {"dead_zone": 0.06 * s["supply"]},
    "controller.delay": lambda s, rng: {"delay": 0.012},
    "load.mass": lambda s, rng: {"mass": 1.35 * s["mass"]},
    "load.tilt": lambda s, rng: {"tilt": 0.15},
    "unknown.disturbance": lambda s, rng: {"push": 0.3 * s["mass"] * GRAVITY * s["arm"]},
}
OFF = dict.fromkeys(HIDDEN, 0.0) | {"static_speed": 8.0, "cold_time": 10.0}


@dataclass(frozen=True)
class Recorder:
    """Rows and acts in steps; a count of each shaft, rad; noise of voltage, V, current, A, and a tacho, rad/s."""

    per_row: int
    per_act: int
    counts: tuple[float, float]
    seen: float
    noise: tuple[float, float, float]
    least_current: float
    motor: str  # angle | speed | difference | both
    rows: int  # of a difference
    load_speed: bool
    smooth: bool  # the current is the mean of this row and the last
    command: bool  # the voltage is called the controller's, not the motor's


def recorder(rng: np.random.Generator, s: dict[str, float]) -> Recorder:
    """As drawn."""
    counts = 2.0 * math.pi / rng.choice([400, 1024, 2000, 4096]), 2.0 * math.pi / rng.choice([2048, 4096, 16384, 65536])
    stall = s["supply"] / s["resistance"]
    noise = s["supply"] * 10.0 ** rng.uniform(-4, -3), stall * 10.0 ** rng.uniform(-3.3, -2.3), rng.uniform(0.02, 0.5)
    return Recorder(
        int(rng.choice([50, 100, 200, 400])), int(rng.choice([1, 10, 20, 50, 100, 200])), counts,
        counts[1] if rng.random() < 0.3 else 0.0, noise, stall / 2048, str(rng.choice(["angle", "speed", "difference", "both"])),
        int(rng.choice([1, 2, 4, 8])), bool(rng.random() < 0.4), bool(rng.random() < 0.3), bool(rng.random() < 0.5),
    )  # fmt: skip


def motion(rng: np.random.Generator, duration: float, fastest: float) -> tuple[np.ndarray, np.ndarray]:
    """Waves, moves from rest to rest, or both, in steps: angle and its rate."""
    n = int(duration / STEP)
    time, angle, kind = STEP * np.arange(n), np.zeros(n), rng.choice(["waves", "moves", "both"])
    if kind != "moves":
        for _ in range(4):
            turns = 2.0 * math.pi * 10.0 ** rng.uniform(-1.0, 0.1)
            size = min(rng.uniform(0.05, 0.5), 0.35 * fastest / turns)
            angle += size * np.sin(turns * time + rng.uniform(0.0, 2.0 * math.pi))
        begin = np.minimum(1.0, time)
        angle = (angle - angle[0]) * begin**2 * (3.0 - 2.0 * begin)
    if kind != "waves":
        place, first, moves = 0.0, int(0.3 / STEP), np.zeros(n)
        while first < n:
            goal = rng.uniform(-1.4, 1.4)
            steps = int(max(1.9 * abs(goal - place) / (fastest * rng.uniform(0.2, 0.8)), 0.25) / STEP)
            x = np.minimum(np.arange(n - first) / steps, 1.0)
            moves[first:] = place + (goal - place) * (10.0 * x**3 - 15.0 * x**4 + 6.0 * x**5)
            place, first = goal, first + steps + int(rng.uniform(0.1, 0.9) / STEP)
        angle = moves if kind == "moves" else 0.6 * moves + angle
    angle = angle + rng.uniform(-0.5, 0.5)
    return angle, np.gradient(angle, STEP)


def simulate(s: dict[str, float], plan: tuple[np.ndarray, np.ndarray], per_act: int, per_row: int, seen: float) -> np.ndarray:
    """Rows of a drive with `s` for sheet and what is hidden."""
    rows = np.zeros(((len(plan[0]) - 1) // per_row + 1, 7))
    of = {**OFF, **s}
    _run(np.array([of[n] for n in SHEET]), np.array([of[n] for n in HIDDEN]), *plan, per_act, per_row, seen, rows)
    return rows


def log(rng: np.random.Generator, s: dict[str, float], by: Recorder, plan: tuple[np.ndarray, np.ndarray]) -> pd.DataFrame:
    """What the recorder writes."""
    time, u, i, motor, speed, load, _ = simulate(s, plan, by.per_act, by.per_row, by.seen).T
    step, n = by.per_row * STEP, len(time)
    down = lambda x, count: count * np.floor(x / count)
    motor, load = down(motor, by.counts[0]), down(load, by.counts[1])

    def rate(x: np.ndarray) -> np.ndarray:
        found = np.zeros(n)
        found[by.rows :] = (x[by.rows :] - x[: -by.rows]) / (by.rows * step)
        return found

    i = np.convolve(np.append(i[0], i), [0.5, 0.5], "valid") if by.smooth else i
    i = by.least_current * np.round((i + by.noise[1] * rng.standard_normal(n)) / by.least_current)
    found = {"time": time, "wanted": plan[0][:: by.per_row], "rate": plan[1][:: by.per_row]}
    found |= {"voltage": u + by.noise[0] * rng.standard_normal(n), "current": i, "load_angle": load}
    if by.motor in ("angle", "both"):
        found["motor_angle"] = motor
    if by.motor != "angle":
        found["motor_speed"] = speed + by.noise[2] * rng.standard_normal(n) if by.motor == "speed" else rate(motor)
    if by.load_speed:
        found["load_speed"] = rate(load)
    return pd.DataFrame(found)


def spoil(rng: np.random.Generator, table: pd.DataFrame) -> tuple[pd.DataFrame, list[str]]:
    """One to three faults of one to three channels: spikes, a channel that stands, no numbers, lost rows, a limit."""
    table, told = table.copy(), []
    able = [c for c in table if c not in ("time", "wanted", "rate", "voltage")]
    for kind in rng.choice(["spikes", "stands", "nan", "lost", "limit"], size=int(rng.integers(1, 4)), replace=False):
        column, n = str(rng.choice(able)), len(table)
        x, first, many = table[column].to_numpy().copy(), int(rng.integers(50, n - 300)), int(rng.integers(5, 200))
        if kind == "spikes":
            at = rng.integers(5, n - 5, int(rng.integers(1, 6)))
            x[at] += rng.choice([-1.0, 1.0], len(at)) * x.std() * rng.uniform(3.0, 20.0, len(at))
        elif kind == "stands":
            x[first : first + many] = x[first]
        elif kind == "nan":
            x[first : first + many // 4] = np.nan
        elif kind == "limit":
            x = np.minimum(x, np.nanquantile(x, 0.97))
        table[column] = x
        if kind == "lost":
            table = table.drop(index=range(first, first + many)).reset_index(drop=True)
        told.append(f"{kind} {column}")
    return table, told


COLUMNS = {
    "wanted": ("controller.angle_setpoint", "rad"), "rate": ("controller.speed_setpoint", "rad/s"), "current": ("motor.current", "A"),
    "motor_angle": ("reducer.input_angle", "rad"), "motor_speed": ("reducer.input_speed", "rad/s"), "load_angle": ("load.angle", "rad"),
    "load_speed": ("load.speed", "rad/s"),
}  # fmt: skip
PARAMETERS = {
    "motor.resistance": "resistance", "motor.inductance": "inductance", "motor.voltage_constant": "constant",
    "motor.torque_constant": "constant", "motor.supply_voltage": "supply", "reducer.gear_ratio": "ratio",
    "reducer.friction_kinetic": "friction", "reducer.friction_static": "friction", "reducer.shaft_inertia": "rotor",
    "reducer.shaft_stiffness": "stiffness", "reducer.shaft_damping": "damping", "load.mass": "mass", "load.arm": "arm",
    "load.inertia": "inertia", "controller.angle_gain": "angle_gain", "controller.speed_gain": "speed_gain",
    "controller.voltage_max": "supply",
}  # fmt: skip


@dataclass(frozen=True)
class Case:
    """What is hidden, and what the product may see of it."""

    names: list[str]
    seed: int
    sheet: dict[str, float]
    true: dict[str, float]
    recorder: Recorder
    logs: list[pd.DataFrame]
    faults: list[str]
    ratio: float  # error of the sheet's drive in voltage or current, where it is more, over the noise there

    def rig(self) -> str:
        """The data sheet and the columns, nothing else."""
        columns = COLUMNS | {"voltage": ("controller.voltage" if self.recorder.command else "motor.voltage", "V")}
        values = {name: self.sheet[of] for name, of in PARAMETERS.items()}
        values |= {"reducer.wedge_angle": math.atan(self.sheet["tangent"]), "load.arm_angle": -0.5 * math.pi}
        values |= {"controller.voltage_min": -self.sheet["supply"], "controller.release_time": 1e9}
        if self.recorder.per_act > self.recorder.per_row:
            values["controller.sample_period"] = self.recorder.per_act * STEP
        named = [f'"{columns[c][0]}" = {{ column = "{c}", unit = "{columns[c][1]}" }}' for c in self.logs[0] if c in columns]
        given = [f'"{name}" = {float(value)!r}' for name, value in values.items()]
        return "\n".join(['[rig]\nname = "bench"\nkind = "forward"\n\n[columns]', *named, "\n[parameters]", *given, ""])

    def write(self, folder: Path) -> tuple[Path, list[Path], Path]:
        """rig.toml, train.csv, test.csv."""
        files = [Path(folder) / name for name in ("rig.toml", "train.csv", "test.csv")]
        files[0].write_text(self.rig())
        for table, path in zip(self.logs, files[1:]):
            table.to_csv(path, index=False, float_format="%.9g")
        return files[0], files[1:2], files[2]


def calm(s: dict[str, float], plan: tuple[np.ndarray, np.ndarray], by: Recorder) -> bool:
    """Whether the sound drive's loop neither swings nor lives at its limit."""
    u = simulate(s, plan, by.per_act, 100, by.seen)[:, 1]
    slow = pd.Series(u).rolling(41, center=True).mean().to_numpy()
    return bool(np.nanstd(u - slow) < 0.02 * s["supply"] and np.mean(abs(u) > 0.98 * s["supply"]) < 0.02)


def hide(names: list[str], seed: int, duration: float = 15.0, faulty: bool = False) -> Case:
    """Hide causes by name ([] is none) in a drive, motion and recorder of this seed's drawing."""
    for attempt in range(1000):
        rng = np.random.default_rng([seed, 21, attempt])
        s = sheet(rng)
        by = recorder(rng, s)
        plans = [motion(rng, duration, 0.6 * s["supply"] / s["constant"] / s["ratio"]) for _ in range(2)]
        if calm(s, plans[0], by):
            break
    true = dict(s)
    for name in names:
        true |= CAUSES[name](s, np.random.default_rng([seed, 22]))
    logs = [log(rng, true, by, plan) for plan in plans]
    shown = [simulate(d, plans[1], by.per_act, by.per_row, by.seen).T[1:3] for d in (s, true)]
    noise = by.noise[0], np.hypot(by.noise[1], by.least_current / math.sqrt(12.0))
    ratio = max(float(np.sqrt(1.0 + np.mean((a - b) ** 2) / n**2)) for a, b, n in zip(*shown, noise))
    faults: list[str] = []
    if faulty:
        logs[0], faults = spoil(rng, logs[0])
    return Case(list(names), seed, s, true, by, logs, faults, ratio)
