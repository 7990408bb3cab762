"""A fourth hidden plant, apart from the others: turntables, spindles, winches and carriages, read over a field bus.

case = fieldbus.hide(["reducer.viscous"], seed=10_007)
files = case.write(folder)                           rig.toml, the logs that teach, the log that judges

Nothing is lifted by an arm. The drive slides forward, slides backward or sticks; within each of these its equations are
smooth and go by Runge-Kutta's method, and where one ends a step is cut at that instant (Filippov's modes). Profiles are
trapezoids, waves, chirps, ramps of speed, or jogs by hand, in open loop by a voltage or by the duty of a sagging battery.
Each channel is sent in its own period and phase; the table holds what came last, or goes straight between messages.
Seeds from DEVELOPMENT on are for development; those below judge.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import pandas as pd
from numba import njit

from .bus import Recorder, record, recorder, spoil, written
from .profiles import profile

DEVELOPMENT = 10_000
STEP = 2e-5  # s

SHEET = (
    "resistance", "inductance", "constant", "ratio", "tangent", "friction", "preload", "rotor", "stiffness", "damping", "inertia",
    "drag", "pull", "angle_gain", "speed_gain", "supply",
)  # fmt: skip
HIDDEN = (
    "static", "static_speed", "viscous", "asymmetry", "ripple", "play", "cold", "cold_time", "by_load", "brushes", "cogging",
    "cogging_order", "weak", "sag", "dead_zone", "delay", "push",
)  # fmt: skip


@njit(cache=True)
def _friction(p, h, s, speed, motor, torque, time):
    """Torque that the gear takes while its input slides in direction s under an output torque; and its part that is viscous."""
    ratio, t = p[3], p[4]
    mu = p[5] * (1.0 + h[0] / (1.0 + (speed / h[1]) ** 2)) * (1.0 + s * h[3]) * (1.0 + h[6] / (1.0 + time / h[7]))
    mu *= 1.0 + h[4] * math.cos(motor / ratio)
    mu *= 1.0 + h[8] * min(abs(torque) / (ratio * p[2] * p[15] / p[0]), 2.0)
    x = torque * s
    bent = (t + mu) / (1.0 - mu * t) if x > 0.0 else (t - mu) / (1.0 + mu * t)
    return s * max(x * bent / (ratio * t), x / ratio + mu * p[6] * math.sqrt(1.0 + t * t))


@njit(cache=True)
def _shaft(p, h, y):
    """Output torque of the gear: a spring and a damper behind a play."""
    twist = y[2] / p[3] - y[4]
    touches = twist - min(max(twist, -0.5 * h[5]), 0.5 * h[5])
    if h[5] > 0.0 and touches == 0.0:
        return 0.0
    torque = p[8] * touches + p[9] * (y[1] / p[3] - y[3])
    return 0.0 if h[5] > 0.0 and torque * touches < 0.0 else torque


@njit(cache=True)
def _drive(p, h, y):
    """Torque of the motor, without what its gear takes."""
    k = p[2] / (1.0 + (h[12] * y[0] * p[0] / p[15]) ** 2)
    return k * y[0] - h[10] * math.cos(h[11] * y[2])


@njit(cache=True)
def _slope(p, h, s, y, u, time, out):
    """Rates of current, speed and angle of the motor, speed and angle of the load, in the mode s: 1, -1, or 0 at rest."""
    torque = _shaft(p, h, y)
    out[0] = (u - p[2] * y[1] - p[0] * y[0] - h[9] * math.tanh(30.0 * y[0] * p[0] / p[15])) / p[1]
    out[1] = 0.0 if s == 0.0 else (_drive(p, h, y) - _friction(p, h, s, y[1], y[2], torque, time) - h[2] * y[1]) / p[7]
    out[2] = y[1]
    out[3] = (torque - p[11] * y[3] - p[12] - h[16] * math.sin(11.0 * time)) / p[10]
    out[4] = y[3]


@njit(cache=True)
def _go(p, h, s, y, u, time, dt, k, new):
    """A step of dt in one mode: `new` from y."""
    _slope(p, h, s, y, u, time, k[0])
    for n, part in ((1, 0.5), (2, 0.5), (3, 1.0)):
        for m in range(5):
            new[m] = y[m] + part * dt * k[n - 1, m]
        _slope(p, h, s, new, u, time + part * dt, k[n])
    for m in range(5):
        new[m] = y[m] + dt * (k[0, m] + 2.0 * k[1, m] + 2.0 * k[2, m] + k[3, m]) / 6.0


@njit(cache=True)
def _mode(p, h, y, time):
    """The mode at rest: whether the gear holds what drives it, else which way it slides."""
    torque, drive = _shaft(p, h, y), _drive(p, h, y)
    if drive > _friction(p, h, 1.0, 0.0, y[2], torque, time):
        return 1.0
    return -1.0 if drive < _friction(p, h, -1.0, 0.0, y[2], torque, time) else 0.0


@njit(cache=True)
def _run(p, h, wanted, fast, given, battery, act, seen, at_motor, rows):
    """Each step's end: voltage, current, angle and speed of the motor, angle and speed of the load, supply."""
    y, new, k = np.zeros(5), np.zeros(5), np.zeros((4, 5))
    y[4] = wanted[0]
    y[2] = (y[4] + p[12] / p[8] + math.copysign(0.5 * h[5], p[12])) * p[3]
    mode, u, lag = 0.0, 0.0, int(round(h[15] / STEP))
    waiting = np.zeros(lag + 1)
    for n in range(len(wanted)):
        supply = battery[0] * (1.0 - battery[1] * n * STEP) - battery[2] * abs(y[0])
        if battery[3] > 0.0:
            u = given[n] * supply
        elif p[13] + p[14] == 0.0:
            u = given[n]
        elif n % act == 0:
            told = y[2] / p[3] if at_motor else y[4]
            told = told if seen == 0.0 else math.floor(told / seen + 0.5) * seen
            rate = y[1] / p[3] if at_motor else y[3]
            u = min(max(p[13] * (wanted[n] - told) + p[14] * (fast[n] - rate), -p[15]), p[15])
        waiting[n % (lag + 1)] = u
        acts = waiting[(n + 1) % (lag + 1)]
        acts = 0.0 if abs(acts) < h[14] else acts
        real = acts - math.copysign(min(h[13] * abs(y[0]), abs(acts)), acts)
        left, time = STEP, n * STEP
        for _ in range(4):
            if mode == 0.0:
                mode = _mode(p, h, y, time)
            _go(p, h, mode, y, real, time, left, k, new)
            if mode * new[1] >= 0.0:
                y[:] = new
                break
            if y[1] == 0.0:  # what would slide comes back within the step: it rests
                _go(p, h, 0.0, y, real, time, left, k, new)
                y[:], mode = new, 0.0
                break
            part = left * y[1] / (y[1] - new[1])
            _go(p, h, mode, y, real, time, part, k, new)
            y[:] = new
            y[1], mode, left, time = 0.0, 0.0, left - part, time + part
        row = rows[n]
        row[0], row[1], row[2], row[3], row[4], row[5], row[6] = acts, y[0], y[2], y[1], y[4], y[3], supply


@dataclass(frozen=True)
class Make:
    """What stands on the stand, and how it is driven."""

    load: str  # turntable | spindle | winch | carriage | cart
    way: str  # angle | speed | voltage | duty
    at_motor: bool  # where the loop is closed
    act: int  # steps between acts of the controller
    seen: float  # count of its sensor, rad; 0: none
    battery: tuple[float, float, float, float]  # V, 1/s, Ohm, and whether a duty drives


def make(rng: np.random.Generator) -> Make:
    """As drawn."""
    load = str(rng.choice(["turntable", "spindle", "winch", "carriage", "cart"]))
    ways = {
        "turntable": ["angle", "angle", "voltage"],
        "spindle": ["speed", "voltage"],
        "winch": ["angle", "voltage"],
        "cart": ["duty"],
    }
    way = str(rng.choice(ways.get(load, ["angle"])))
    battery = (float(rng.choice([24.0, 36.0, 48.0])), rng.uniform(0.0, 0.004), rng.uniform(0.02, 0.15), 1.0)
    seen = 2.0 * math.pi / 65536 if rng.random() < 0.3 else 0.0
    act = int(rng.choice([1, 5, 12, 50, 100, 200]))
    return Make(
        load, way, bool(rng.random() < 0.5) or way == "speed", act, seen, battery if way == "duty" else (1.0, 0.0, 0.0, 0.0)
    )


def sheet(rng: np.random.Generator, of: Make) -> dict[str, float]:
    """Its data sheet: speed without load, stall current, time to speed and share of friction are drawn, the rest follows."""
    supply = of.battery[0] if of.way == "duty" else float(rng.choice([12.0, 24.0, 48.0]))
    ratio = float(rng.choice([5, 12, 20, 30, 50, 90]))
    tangent = rng.uniform(0.05, 0.15) if rng.random() < 0.4 else 1.0 / ratio
    k, r = supply / rng.uniform(200, 600), supply / rng.uniform(3.0, 25.0)
    stall = k * supply / r
    all_of_it, share = rng.uniform(0.02, 0.12) * k * k / r, rng.uniform(0.3, 3.0)
    rotor = all_of_it / (1.0 + share)
    inertia = ratio**2 * rotor * share
    mu = tangent * rng.uniform(0.2, 0.8)
    if of.load == "winch" and rng.random() < 0.4:
        mu = tangent * rng.uniform(1.05, 1.4)
    preload = rng.uniform(0.02, 0.08) * stall / (mu * math.sqrt(1.0 + tangent**2))
    pull = rng.uniform(0.1, 0.25) * stall * ratio * tangent * (1.0 - mu * tangent) / (tangent + mu) if of.load == "winch" else 0.0
    fastest = supply / k / ratio
    drag = rng.uniform(0.05, 0.2) * stall * ratio / fastest if of.load in ("spindle", "cart") else 0.0
    stiff = inertia * (2.0 * math.pi * rng.uniform(40.0, 150.0)) ** 2
    damps = 2.0 * rng.uniform(0.05, 0.3) * math.sqrt(stiff * inertia)
    closed = {"angle": (1.0, 1.0), "speed": (0.0, 1.0)}.get(of.way, (0.0, 0.0))
    kd = rng.uniform(0.5, 2.0) * supply / fastest
    gains = closed[0] * kd * rng.uniform(5.0, 20.0), closed[1] * kd
    values = (r, r * 10.0 ** rng.uniform(-3.8, -3.0), k, ratio, tangent, mu, preload, rotor, stiff, damps, inertia, drag, pull)
    return dict(zip(SHEET, (*values, *gains, supply)))


CAUSES = {
    "reducer.stribeck": lambda s, rng: {"static": 0.8, "static_speed": rng.uniform(5.0, 20.0)},
    "reducer.viscous": lambda s, rng: {"viscous": 0.12 * s["constant"] ** 2 / s["resistance"]},
    "reducer.asymmetric": lambda s, rng: {"asymmetry": 0.4},
    "reducer.preload": lambda s, rng: {"preload": 2.2 * s["preload"]},
    "reducer.ripple": lambda s, rng: {"ripple": 0.6},
    "reducer.backlash": lambda s, rng: {"play": 40.0 / s["ratio"] / 57.3},
    "reducer.compliance": lambda s, rng: {"stiffness": s["stiffness"] / 8.0},
    "reducer.warm_up": lambda s, rng: {"cold": 1.2, "cold_time": rng.uniform(2.0, 6.0)},
    "motor.brush_drop": lambda s, rng: {"brushes": 0.05 * s["supply"]},
    "motor.cogging": lambda s, rng: {"cogging": 0.05 * _stall(s), "cogging_order": float(rng.integers(2, 9))},
    "motor.parameter motor.resistance": lambda s, rng: {"resistance": 1.3 * s["resistance"]},
    "motor.supply_sag": lambda s, rng: {"sag": 0.2 * s["resistance"]},
    "controller.dead_zone": lambda s, rng: {"dead_zone": 0.06 * s["supply"]},
    "controller.delay": lambda s, rng: {"delay": 0.012},
    "sensor.scale motor.current": lambda s, rng: {"current_scale": 1.12},
    "sensor.bias motor.current": lambda s, rng: {"current_bias": 0.03 * s["supply"] / s["resistance"]},
    "load.inertia": lambda s, rng: {"inertia": 1.5 * s["inertia"]},
    "load.parameter load.constant_torque": lambda s, rng: {"pull": s["pull"] + 0.06 * _stall(s) * s["ratio"]},
    "unknown.disturbance": lambda s, rng: {"push": 0.12 * _stall(s) * s["ratio"]},
}
OFF = dict.fromkeys(HIDDEN, 0.0) | {"static_speed": 8.0, "cold_time": 4.0}


def _stall(s: dict[str, float]) -> float:
    return s["supply"] / s["resistance"] * s["constant"]


def askable(name: str, of: Make) -> bool:
    """Whether such a drive can show it: a loop, a command behind which a supply sags, waves of a shaft that has a turn."""
    if name.startswith("controller."):
        return of.way == "angle"
    if name == "motor.supply_sag":
        return of.way != "duty"
    return name != "reducer.ripple" or of.load in ("spindle", "turntable", "cart")


def simulate(s: dict[str, float], of: Make, plan: np.ndarray) -> np.ndarray:
    """Each step's end of a drive with `s` for sheet and what is hidden: see _run. plan: rows of angle, rate, and voltage or duty."""
    rows, all_of = np.zeros((plan.shape[1], 7)), {**OFF, **s}
    p, h = (np.array([all_of[n] for n in names]) for names in (SHEET, HIDDEN))
    _run(p, h, plan[0], plan[1], plan[2], np.array(of.battery), of.act, of.seen, of.at_motor, rows)
    return rows


PARAMETERS = {
    "motor.resistance": "resistance", "motor.inductance": "inductance", "motor.voltage_constant": "constant",
    "motor.torque_constant": "constant", "reducer.gear_ratio": "ratio", "reducer.friction_kinetic": "friction",
    "reducer.preload": "preload", "reducer.shaft_inertia": "rotor", "reducer.shaft_stiffness": "stiffness",
    "reducer.shaft_damping": "damping", "load.inertia": "inertia", "load.damping": "drag", "load.constant_torque": "pull",
}  # fmt: skip
LOOP = {"controller.angle_gain": "angle_gain", "controller.speed_gain": "speed_gain", "controller.voltage_max": "supply"}


@dataclass(frozen=True)
class Case:
    """What is hidden, and what the product may see of it."""

    names: list[str]
    seed: int
    make: Make
    sheet: dict[str, float]
    true: dict[str, float]
    recorder: Recorder
    logs: list[pd.DataFrame]  # the last one judges
    faults: list[str]
    ratio: float  # error of the sheet's drive in current or motor speed, where it is more, over the noise there

    def rig(self) -> str:
        """The data sheet and the columns, nothing else."""
        values = {name: self.sheet[of] for name, of in PARAMETERS.items() if self.sheet[of] or of != "drag"}
        values["reducer.wedge_angle"] = math.atan(self.sheet["tangent"])
        head = ['name = "stand"', 'kind = "forward"']
        if self.make.way in ("angle", "speed"):
            values |= {name: self.sheet[of] for name, of in LOOP.items()}
            values |= {"controller.voltage_min": -self.sheet["supply"], "controller.release_time": 1e9}
            head.append(f'loop = "{"motor" if self.make.at_motor else "load"}"')
            if self.make.act * STEP >= self.recorder.row:
                values["controller.sample_period"] = self.make.act * STEP
        if self.make.way != "duty":
            values["motor.supply_voltage"] = self.sheet["supply"]
        columns = self.recorder.columns(self.logs[0], self.recorder.belt)
        given = [f'"{name}" = {float(value)!r}' for name, value in values.items()]
        return "\n".join(
            ["[rig]", *head, "\n[time]", 'column = "t"', 'unit = "ms"', "\n[columns]", *columns, "\n[parameters]", *given, ""]
        )

    def write(self, folder: Path) -> tuple[Path, list[Path], Path]:
        """rig.toml, train1.csv, train2.csv, test.csv."""
        return written(folder, self.rig(), self.logs)


def calm(rows: np.ndarray, s: dict[str, float], of: Make) -> bool:
    """Whether the loop neither swings nor lives at its limit."""
    u = rows[::50, 0]
    slow = pd.Series(u).rolling(41, center=True).mean().to_numpy()
    swings = of.way in ("angle", "speed") and np.nanmedian(abs(u - slow)) > 0.01 * s["supply"]
    return bool(np.isfinite(rows).all() and not swings and np.mean(abs(u) > 0.98 * s["supply"]) < 0.02)


def hide(names: list[str], seed: int, duration: float = 8.0, faulty: bool = False) -> Case:
    """Hide causes by name ([] is none) in a drive, profile and recorder of this seed's drawing."""
    for attempt in range(1000):
        rng = np.random.default_rng([seed, 41, attempt])
        of = make(rng)
        s = sheet(rng, of)
        by = recorder(rng, s, of)
        plans = [profile(rng, s, of, duration, STEP) for _ in range(3)]
        if all(askable(name, of) for name in names) and calm(simulate(s, of, plans[0]), s, of):
            break
    true = dict(s)
    for name in names:
        true |= CAUSES[name](s, np.random.default_rng([seed, 42]))
    first = [0.0, rng.uniform(0.5, 2.5), 0.0]  # s: the second log begins in the middle of its motion
    logs = [record(rng, by, true, simulate(true, of, plan), plan, STEP, begin) for plan, begin in zip(plans, first)]
    sound, real = (simulate(d, of, plans[2])[::50] for d in (s, true))
    real[:, 1] = real[:, 1] * true.get("current_scale", 1.0) + true.get("current_bias", 0.0)
    noise = math.hypot(by.noise_current, by.least_current / math.sqrt(12.0)), max(by.noise_speed, 0.003 * sound[:, 3].std())
    ratio = max(math.sqrt(1.0 + np.mean((sound[:, n] - real[:, n]) ** 2) / of_it**2) for n, of_it in zip((1, 3), noise))
    faults: list[str] = []
    if faulty:
        logs[0], faults = spoil(rng, logs[0])
    return Case(list(names), seed, of, s, true, by, logs, faults, float(ratio))
