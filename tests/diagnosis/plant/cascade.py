"""A fifth hidden plant, apart from the others: axes of a drive amplifier's own cascade, which no rig can describe.

case = cascade.hide(["reducer.viscous"], seed=10_007)
files = case.write(folder)                           rig.toml, the logs that teach, the log that judges

A position loop over a speed loop with an integrator and feed-forward acts on counts, faster than the log, so that the voltage changes
between rows and nothing but the measured one says what drove the motor. Friction is a spring that gives way at the wedge's torques
(Prandtl's element: the shaft yields by less than a third of a milliradian before it slides). A step of 10 us, speeds before angles.
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

from .bus import spoil, written

DEVELOPMENT = 10_000
STEP = 1e-5  # s
ARM = 0.05  # m
GRAVITY = 9.81

SHEET = (
    "resistance", "inductance", "constant", "ratio", "tangent", "friction", "preload", "rotor", "stiffness", "damping", "inertia",
    "weight", "pull", "position_gain", "speed_gain", "integral_gain", "supply", "bristle", "bristle_damping",
)  # fmt: skip
HIDDEN = (
    "static", "static_speed", "viscous", "play", "brushes", "cogging", "cogging_order", "asymmetry", "cold", "cold_time", "strength",
)  # fmt: skip


@njit(cache=True)
def _slides(s, torque, mu, t, ratio, preload):
    """Torque at which the input slides in direction s under an output torque: the wedge of the study (2), (3), (13)."""
    x = torque * s
    bent = (t + mu) / (1.0 - mu * t) if x > 0.0 else (t - mu) / (1.0 + mu * t)
    return s * max(x * bent / (ratio * t), x / ratio + mu * preload * math.sqrt(1.0 + t * t))


@njit(cache=True)
def _run(p, h, wanted, fast, count, act, rows):
    """Each step's voltage, current, angle and speed of the motor, angle and speed of the load."""
    (
        r,
        inductance,
        k,
        ratio,
        t,
        friction,
        preload,
        rotor,
        stiff,
        damps,
        inertia,
        weight,
        pull,
        kv,
        kp,
        ki,
        supply,
        bristle,
        damped,
    ) = p
    static, static_speed, viscous, play, brushes, cogging, order, asymmetry, cold, cold_time, strength = h
    load, load_speed, speed, current = wanted[0], 0.0, 0.0, 0.0
    holds = weight * math.sin(load) + pull
    angle = ratio * (load + holds / stiff + 0.5 * math.copysign(play, holds))
    anchor, before, seen, integral, u = angle, angle, 0.0, 0.0, 0.0
    for n in range(len(wanted)):
        if n % act == 0:
            told = math.floor(angle / count + 0.5) * count
            seen += 0.3 * ((told - before) / (act * STEP) - seen)
            before = told
            error = kv * (wanted[n] * ratio - told) + fast[n] * ratio - seen
            u = kp * error + integral + k * fast[n] * ratio
            if abs(u) < supply:
                integral += ki * error * act * STEP
            u = min(max(u, -supply), supply)
        twist = angle / ratio - load
        touches = twist - min(max(twist, -0.5 * play), 0.5 * play)
        torque = stiff * touches + damps * (speed / ratio - load_speed)
        if play > 0.0 and torque * touches <= 0.0:
            torque = 0.0
        mu = friction * (1.0 + asymmetry * (1.0 if speed > 0.0 else -1.0)) * (1.0 + cold / (1.0 + n * STEP / cold_time))
        mu *= 1.0 + static / (1.0 + (speed / static_speed) ** 2)
        low, high = _slides(-1.0, torque, mu, t, ratio, preload), _slides(1.0, torque, mu, t, ratio, preload)
        holds = min(max(bristle * (angle - anchor), low), high)
        anchor = angle - holds / bristle
        drag = viscous * speed + (damped * speed if low < holds < high else 0.0)
        speed += STEP * ((1.0 + strength) * k * current - cogging * math.cos(order * angle) - holds - drag) / rotor
        angle += STEP * speed
        load_speed += STEP * (torque - weight * math.sin(load) - pull) / inertia
        load += STEP * load_speed
        lost = r * current + brushes * math.tanh(30.0 * current * r / supply)
        current += STEP * (u - (1.0 + strength) * k * speed - lost) / inductance
        row = rows[n]
        row[0], row[1], row[2], row[3], row[4], row[5] = u, current, angle, speed, load, load_speed


def moves(rng: np.random.Generator, s: dict[str, float], duration: float) -> np.ndarray:
    """Angle and speed of trapezoids one after the other, with and without rests, (2, steps)."""
    top = 0.6 * s["supply"] / s["constant"] / s["ratio"]
    hardest = top / rng.uniform(0.15, 0.4)
    time = np.arange(round(duration / STEP)) * STEP
    speed, place, at = np.zeros(len(time)), 0.0, 0.1
    while at < duration - 0.2:
        goal = rng.uniform(-1.2, 1.2) if s["weight"] else place + rng.uniform(-6.0, 6.0)
        way, rate = abs(goal - place), hardest * rng.uniform(0.3, 1.0)
        fastest = min(top * rng.uniform(0.15, 1.0), math.sqrt(way * rate))
        lasts = way / fastest + fastest / rate
        since = time - at
        inside = np.maximum(np.minimum(np.minimum(since * rate, fastest), (lasts - since) * rate), 0.0)
        speed += np.copysign(inside, goal - place)
        at += lasts + (rng.uniform(0.1, 0.8) if rng.random() < 0.6 else 0.02)
        place = goal
    return np.stack([np.cumsum(speed) * STEP, speed])


def sheet(rng: np.random.Generator) -> dict[str, float]:
    """Its data sheet: speed without load, stall current, time to speed and share of friction are drawn, the rest follows."""
    supply, ratio = float(rng.choice([24.0, 48.0])), float(rng.choice([8, 16, 25, 40, 70]))
    t = 1.0 / ratio if rng.random() < 0.6 else rng.uniform(0.05, 0.15)
    k, r = supply / rng.uniform(200.0, 500.0), supply / rng.uniform(4.0, 20.0)
    share, stall = rng.uniform(0.3, 2.0), supply / r * k
    rotor = rng.uniform(0.02, 0.08) * k * k / r / (1.0 + share)
    inertia, mu = ratio**2 * rotor * share, t * rng.uniform(0.15, 0.8)
    preload = rng.uniform(0.02, 0.08) * stall / mu
    weight = rng.uniform(0.1, 0.25) * stall * ratio * t * (1.0 - mu * t) / (t + mu) if rng.random() < 0.4 else 0.0
    weight = min(weight, 0.5 * inertia * GRAVITY / ARM)  # what hangs on the arm is less than half of what turns
    stiff = inertia * (2.0 * math.pi * rng.uniform(50.0, 150.0)) ** 2
    damps = 2.0 * rng.uniform(0.05, 0.3) * math.sqrt(stiff * inertia)
    band = 2.0 * math.pi * rng.uniform(8.0, 20.0)
    kp = rotor * (1.0 + share) * band * r / k
    bristle = mu * preload / rng.uniform(1e-4, 3e-4)
    values = (r, r * 10.0 ** rng.uniform(-3.6, -2.7), k, ratio, t, mu, preload, rotor, stiff, damps, inertia, weight, 0.0)
    return dict(
        zip(SHEET, (*values, 0.25 * band, kp, 0.25 * band * kp, supply, bristle, 0.6 * math.sqrt(bristle * rotor)), strict=True)
    )


def _stall(s: dict[str, float]) -> float:
    return s["supply"] / s["resistance"] * s["constant"]


CAUSES: dict[str, Callable[[dict[str, float]], dict[str, float]]] = {
    "motor.parameter motor.resistance": lambda s: {"resistance": 1.25 * s["resistance"]},
    "reducer.viscous": lambda s: {"viscous": 0.1 * s["constant"] ** 2 / s["resistance"]},
    "reducer.preload": lambda s: {"preload": 2.2 * s["preload"]},
    "reducer.stribeck": lambda s: {"static": 0.8},
    "reducer.asymmetric": lambda s: {"asymmetry": 0.35},
    "reducer.backlash": lambda s: {"play": 35.0 / s["ratio"] / 57.3},
    "load.inertia": lambda s: {"inertia": 1.6 * s["inertia"]},
    "motor.brush_drop": lambda s: {"brushes": 0.05 * s["supply"]},
    "motor.cogging": lambda s: {"cogging": 0.05 * _stall(s), "cogging_order": 4.0},
    "sensor.scale motor.current": lambda s: {"current_scale": 1.12},
    "sensor.bias motor.current": lambda s: {"current_bias": 0.03 * s["supply"] / s["resistance"]},
    "reducer.warm_up": lambda s: {"cold": 1.2},
    "load.parameter load.constant_torque": lambda s: {"pull": 0.06 * _stall(s) * s["ratio"]},
    "motor.parameter motor.voltage_constant": lambda s: {"strength": -0.12},
}
OFF = dict.fromkeys(HIDDEN, 0.0) | {"static_speed": 10.0, "cold_time": 4.0, "cogging_order": 1.0}


@dataclass(frozen=True)
class Recorder:
    """Steps from row to row and from act to act; counts of the motor's and the load's turn; how each channel is taken."""

    row: int
    act: int
    seen: float  # rad: a count as the amplifier sees it
    count: float  # the same, as it is logged
    load_count: float
    late: int  # steps that the load's encoder is late
    rows: int  # over which the speed is a difference
    mean_voltage: bool
    mean_current: bool
    channels: tuple[str, ...]


def recorder(rng: np.random.Generator) -> Recorder:
    """As drawn."""
    row, seen = int(rng.choice([50, 100, 100, 200])), 2.0 * math.pi / float(rng.choice([2048, 4096, 8192, 16384, 65536]))
    count = seen if rng.random() < 0.7 else 2.0 * math.pi / 1024
    told = [("rotor",), ("n",), ("rotor", "n"), ("rotor", "n", "pos"), ("n", "pos"), ("rotor", "pos")][int(rng.integers(6))]
    return Recorder(
        row,
        int(rng.choice([12, 25, 50, 100])),
        seen,
        count,
        2.0 * math.pi / float(rng.choice([4096, 16384, 131072])),
        int(rng.choice([0, 0, row // 2, row])),
        int(rng.choice([1, 2, 4, 8])),
        bool(rng.random() < 0.6),
        bool(rng.random() < 0.6),
        ("u", "i", *told),
    )


COLUMNS = {
    "u": '"motor.voltage" = "u"',
    "i": '"motor.current" = "i"',
    "rotor": '"reducer.input_angle" = "rotor"',
    "n": '"reducer.input_speed" = { column = "n", unit = "rpm" }',
    "pos": '"load.angle" = { column = "pos", unit = "deg" }',
}
PARAMETERS = {
    "motor.resistance": "resistance", "motor.inductance": "inductance", "motor.voltage_constant": "constant",
    "motor.torque_constant": "constant", "motor.supply_voltage": "supply", "reducer.gear_ratio": "ratio",
    "reducer.friction_kinetic": "friction", "reducer.preload": "preload", "reducer.shaft_inertia": "rotor",
    "reducer.shaft_stiffness": "stiffness", "reducer.shaft_damping": "damping",
}  # fmt: skip


def simulate(s: dict[str, float], plan: np.ndarray, by: Recorder) -> np.ndarray:
    """Each step of a drive with `s` for sheet and what is hidden: see _run."""
    rows, all_of = np.zeros((plan.shape[1], 6)), {**OFF, **s}
    p, h = (np.array([all_of[n] for n in names]) for names in (SHEET, HIDDEN))
    _run(p, h, plan[0], plan[1], by.seen, by.act, rows)
    return rows


def noise(s: dict[str, float]) -> tuple[float, float]:
    """Of the current: its deviation and the converter's step, A."""
    most = s["supply"] / s["resistance"]
    return 1e-3 * most, 3.0 * most / 2**12


def record(rng: np.random.Generator, by: Recorder, s: dict[str, float], rows: np.ndarray) -> pd.DataFrame:
    """The table of a run."""
    at = np.arange(by.row, len(rows), by.row)
    sums = np.cumsum(rows[:, :2], axis=0)
    mean = (sums[at] - sums[at - by.row]) / by.row
    deviation, step = noise(s)
    u, i = (mean[:, k] if averaged else rows[at, k] for k, averaged in enumerate((by.mean_voltage, by.mean_current)))
    i = i * s.get("current_scale", 1.0) + s.get("current_bias", 0.0) + deviation * rng.standard_normal(len(at))
    rotor = np.floor(rows[at, 2] / by.count + 0.5) * by.count
    speed = np.concatenate([np.zeros(by.rows), (rotor[by.rows :] - rotor[: -by.rows]) / (by.rows * by.row * STEP)])
    load = np.floor(rows[np.maximum(at - by.late, 0), 4] / by.load_count + 0.5) * by.load_count
    channels = {"u": np.round(u, 3), "i": np.round(i / step) * step, "rotor": rotor}
    channels |= {"n": speed * 30.0 / math.pi, "pos": np.degrees(load)}
    return pd.DataFrame({"t": at * STEP} | {name: channels[name] for name in by.channels})


@dataclass(frozen=True)
class Case:
    """What is hidden, and what the product may see of it."""

    names: list[str]
    seed: int
    sheet: dict[str, float]
    true: dict[str, float]
    recorder: Recorder
    logs: list[pd.DataFrame]  # the last one judges
    faults: list[str]
    ratio: float  # error of the sheet's drive in current or motor speed, where it is more, over the noise there

    def rig(self) -> str:
        """The data sheet and the columns, nothing else."""
        s, head = self.sheet, ["[rig]", 'name = "axis"', 'kind = "forward"', "\n[time]", 'column = "t"', "\n[columns]"]
        values = {name: s[of] for name, of in PARAMETERS.items()} | {"reducer.wedge_angle": math.atan(s["tangent"])}
        mass = s["weight"] / (GRAVITY * ARM)
        values["load.inertia"] = s["inertia"] - mass * ARM**2
        if mass:
            values |= {"load.mass": mass, "load.arm": ARM, "load.arm_angle": -0.5 * math.pi}
        given = [f'"{name}" = {float(value)!r}' for name, value in values.items()]
        return "\n".join([*head, *(COLUMNS[name] for name in self.recorder.channels), "\n[parameters]", *given, ""])

    def write(self, folder: Path) -> tuple[Path, list[Path], Path]:
        """rig.toml, train1.csv, train2.csv, test.csv."""
        return written(folder, self.rig(), self.logs)


def calm(rows: np.ndarray, s: dict[str, float]) -> bool:
    """Whether the loop neither swings nor lives at its limit."""
    u = rows[::100, 0]
    swings = np.mean(abs(np.diff(u))) > 0.12 * s["supply"]
    return bool(np.isfinite(rows).all() and not swings and np.mean(abs(u) > 0.97 * s["supply"]) < 0.03)


def hide(names: list[str], seed: int, duration: float = 12.0, faulty: bool = False) -> Case:
    """Hide causes by name ([] is none) in a drive, profile and recorder of this seed's drawing."""
    for attempt in range(1000):
        rng = np.random.default_rng([seed, 77, attempt])
        s, by = sheet(rng), recorder(rng)
        plans = [moves(rng, s, duration) for _ in range(3)]
        if calm(simulate(s, plans[0], by), s):
            break
    true = dict(s)
    for name in names:
        true |= CAUSES[name](s)
    logs = [record(rng, by, true, simulate(true, plan, by)) for plan in plans]
    sound, real = (simulate(d, plans[2], by)[::100] for d in (s, true))
    real[:, 1] = real[:, 1] * true.get("current_scale", 1.0) + true.get("current_bias", 0.0)
    deviation, step = noise(s)
    speed = max(by.count / (by.rows * by.row * STEP) / math.sqrt(6.0), 0.003 * sound[:, 3].std())
    floors = {1: math.hypot(deviation, step / math.sqrt(12.0)), 3: speed}
    ratio = max(math.sqrt(1.0 + np.mean((sound[:, k] - real[:, k]) ** 2) / of_it**2) for k, of_it in floors.items())
    faults: list[str] = []
    if faulty:
        logs[0], faults = spoil(rng, logs[0])
    return Case(list(names), seed, s, true, by, logs, faults, float(ratio))
