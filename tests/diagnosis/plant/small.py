"""A sixth hidden plant, apart from the others: geared DC motors that a microcontroller drives and logs over a serial line.

case = small.hide(["reducer.viscous"], seed=7)
files = case.write(folder)                           rig.toml, the logs that teach, the log that judges

Raw numbers in a table of 50 to 250 rows a second: PWM counts, converter counts, an encoder of 4096 at the output or of 48 at the
motor, whole ms or us of a loop that is now and then late, lost rows. A PID of counts acts once a row, or by a timer each ms; or duties
are played from a table. Friction is a bristle (LuGre), its level the gear's efficiency's. Seeds below 100 are for development.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import pandas as pd
from numba import njit

DEVELOPMENT = 0
STEP = 5e-5  # s
GRAVITY = 9.81

SHEET = (
    "resistance", "inductance", "constant", "ratio", "driving", "helping", "least", "rotor", "stiffness", "damping", "inertia",
    "weight", "p", "i", "d", "supply", "battery", "drain", "bits", "yields",
)  # fmt: skip
HIDDEN = (
    "static", "static_speed", "static_power", "viscous", "play", "ripple", "asymmetry", "cold", "cold_time", "brushes", "cogging",
    "cogging_order", "strength", "weak", "sag", "dead_zone", "delay", "limit", "pull",
)  # fmt: skip


@njit(cache=True)
def _shaft(p, h, y):
    """Torque of the output shaft: a spring and a damper behind a play."""
    twist = y[2] / p[3] - y[4]
    touches = twist - min(max(twist, -0.5 * h[4]), 0.5 * h[4])
    if h[4] > 0.0 and touches == 0.0:
        return 0.0
    torque = p[8] * touches + p[9] * (y[1] / p[3] - y[3])
    return 0.0 if h[4] > 0.0 and torque * touches < 0.0 else torque


@njit(cache=True)
def _level(p, h, s, speed, angle, torque, time):
    """Friction at the motor's shaft while it turns in direction s: what the gear's efficiencies lose of its load, or its least."""
    lost = p[4] if s * torque > 0.0 else p[5]
    level = max(p[6], abs(torque) / p[3] * lost) * (1.0 + h[6] * s) * (1.0 + h[7] * math.exp(-time / h[8]))
    level *= 1.0 + h[0] * math.exp(-((abs(speed) / h[1]) ** h[2]))
    return level * (1.0 + h[5] * math.cos(angle / p[3]))


@njit(cache=True)
def _slope(p, h, y, u, rubs, out):
    """Rates of current, speed and angle of the motor, speed and angle of the load."""
    torque, full = _shaft(p, h, y), p[15] / p[0]
    k = p[2] * (1.0 + h[12])
    out[0] = (u - k * y[1] - p[0] * y[0] - h[9] * math.tanh(20.0 * y[0] / full)) / p[1]
    motor = k * y[0] / (1.0 + h[13] * abs(y[0]) / full) - h[10] * math.sin(h[11] * y[2])
    out[1] = (motor - torque / p[3] - rubs - h[3] * y[1]) / p[7]
    out[2] = y[1]
    out[3] = (torque - p[11] * math.sin(y[4]) - h[18]) / p[10]
    out[4] = y[3]


@njit(cache=True)
def _run(p, h, wanted, given, acts, count, at_motor, smooth, rows):
    """Each step's PWM count, supply, current, angle and speed of the motor, angle of the load. given: duties, where no loop acts."""
    y, new, k, z = np.zeros(5), np.zeros(5), np.zeros((4, 5)), 0.0
    most, lag = 2.0 ** p[18] - 1.0, round(h[16] / STEP)
    waiting, duty, integral, before, rate, then = np.zeros(lag + 1), 0.0, 0.0, 0.0, 0.0, -1
    closed = p[12] > 0.0
    for n in range(len(wanted)):
        if acts[n]:
            if closed:
                told = (y[2] / p[3] if at_motor else y[4]) / count
                told = math.floor(told) * count
                if then >= 0:
                    rate += smooth * ((told - before) / ((n - then) * STEP) - rate)
                    error = wanted[n] - told
                    duty = p[12] * error + integral - p[14] * rate
                    if abs(duty) < 1.0:
                        integral += p[13] * error * (n - then) * STEP
                before, then = told, n
            else:
                duty = given[n]
            duty = math.floor(min(max(duty, -1.0), 1.0) * most + 0.5) / most
        waiting[n % (lag + 1)] = duty
        real = waiting[(n + 1) % (lag + 1)]
        real = min(max(real, -h[17]), h[17])
        real = math.copysign(max(abs(real) - h[15], 0.0), real)
        supply = p[15] * (1.0 - p[17] * n * STEP) - p[16] * y[0] * real
        u = real * (supply - h[14] * abs(y[0]))
        torque, s = _shaft(p, h, y), math.copysign(1.0, y[1])
        level = _level(p, h, s, y[1], y[2], torque, n * STEP)
        goal, way = s * p[19], abs(y[1]) * STEP / p[19]
        after = goal + (z - goal) * math.exp(-way)
        damped = 0.6 * math.sqrt(level / p[19] * p[7]) * (after - z) / STEP
        rubs = level * 0.5 * (z + after) / p[19] + damped
        z = after
        _slope(p, h, y, u, rubs, k[0])
        for m, part in ((1, 0.5), (2, 0.5), (3, 1.0)):
            for j in range(5):
                new[j] = y[j] + part * STEP * k[m - 1, j]
            _slope(p, h, new, u, rubs, k[m])
        for j in range(5):
            y[j] += STEP * (k[0, j] + 2.0 * k[1, j] + 2.0 * k[2, j] + k[3, j]) / 6.0
        row = rows[n]
        row[0], row[1], row[2], row[3], row[4], row[5] = duty * most, supply, y[0], y[2], y[1], y[4]


@dataclass(frozen=True)
class Make:
    """What it is, and what its sketch logs."""

    load: str  # wheel | arm | nothing
    worm: bool
    loop: str  # pd | pid | none
    battery: bool  # it sags, and is measured
    encoder: str  # output | motor
    row: float  # s
    fast: bool  # the loop acts each ms
    stamps: str  # ms | us
    speed: int  # rows of its difference; 0: not logged
    current: str  # none | once | mean
    converter: int  # bits
    raw: bool  # angle of the output in counts that wrap; else degrees
    told: tuple[bool, bool, bool]  # whether the user knows: inductance, stiffness, the loop's period


def make(rng: np.random.Generator) -> Make:
    """As drawn."""
    loop = str(rng.choice(["pd", "pd", "pid", "none"]))
    encoder = str(rng.choice(["output", "motor"]))
    current = str(rng.choice(["none", "once", "mean", "mean"]))
    return Make(
        str(rng.choice(["wheel", "arm", "nothing"])), bool(rng.random() < 0.35), loop, bool(rng.random() < 0.4), encoder,
        float(rng.choice([0.004, 0.005, 0.01, 0.01, 0.02])), bool(rng.random() < 0.4), str(rng.choice(["ms", "us"])),
        int(rng.choice([0, 0, 1, 4])), current, int(rng.choice([10, 12])), bool(rng.random() < 0.5),
        (bool(rng.random() < 0.5), bool(rng.random() < 0.5), bool(rng.random() < 0.5)),
    )  # fmt: skip


def sheet(rng: np.random.Generator, of: Make) -> dict[str, float]:
    """Its data sheet, and `mu`, `tangent`, `preload`: the same friction as a wedge has it."""
    supply = float(rng.choice([6.0, 7.4, 12.0, 12.0, 24.0]))
    ratio = float(rng.choice([30, 40, 60])) if of.worm else float(rng.choice([9.7, 18.75, 29.0, 50.0, 98.8]))
    k, r = supply / rng.uniform(500.0, 1000.0), supply / rng.uniform(1.5, 8.0)
    stall = k * supply / r
    t = rng.uniform(0.06, 0.12) if of.worm else 1.0 / ratio
    mu = t * (rng.uniform(1.1, 1.5) if of.worm else rng.uniform(0.15, 0.5))
    least = rng.uniform(0.03, 0.09) * stall
    eta, back = (1.0 - mu * t) / (1.0 + mu / t), (1.0 - mu / t) / (1.0 + mu * t)
    rotor = rng.uniform(0.015, 0.05) * k * k / r
    share = {"wheel": rng.uniform(0.4, 3.0), "arm": rng.uniform(0.2, 1.0), "nothing": rng.uniform(0.05, 0.15)}[of.load]
    inertia, weight = share * rotor * ratio**2, 0.0
    mass = arm = 0.0
    if of.load == "arm":
        weight = rng.uniform(0.08, 0.25) * stall * ratio * eta
        arm = rng.uniform(0.1, 0.25)
        mass = weight / GRAVITY / arm
        inertia += mass * arm**2
    reduced = inertia * rotor * ratio**2 / (inertia + rotor * ratio**2)
    stiff = reduced * (2.0 * math.pi * rng.uniform(80.0, 150.0)) ** 2
    damps = 2.0 * rng.uniform(0.05, 0.2) * math.sqrt(stiff * reduced)
    period = 0.001 if of.fast else of.row
    band = min(rng.uniform(6.0, 15.0), 0.2 / period)
    lag = r * (rotor + inertia / ratio**2) / k**2  # s, mechanical
    p = band * k * ratio / supply * rng.uniform(0.8, 1.5)
    d = max(band * lag - 0.5, 0.1) * k * ratio / supply if of.loop != "none" else 0.0
    i = 0.2 * band * p if of.loop == "pid" else 0.0
    gains = (p, i, d) if of.loop != "none" else (0.0, 0.0, 0.0)
    battery = (rng.uniform(0.02, 0.1) * r, rng.uniform(0.0, 0.001)) if of.battery else (0.0, 0.0)
    values = (
        r, r * rng.uniform(2e-4, 6e-4), k, ratio, 1.0 / eta - 1.0, 1.0 - back, least, rotor, stiff, damps, inertia, weight, *gains,
        supply, *battery, float(rng.choice([8, 8, 10, 12])), rng.uniform(3e-4, 2e-3),
    )  # fmt: skip
    more = {"mu": mu, "tangent": t, "preload": least / mu / math.sqrt(1.0 + t * t), "mass": mass, "arm": arm}
    return dict(zip(SHEET, values, strict=True)) | more


def _stall(s: dict[str, float]) -> float:
    return s["supply"] / s["resistance"] * s["constant"]


LOOP, CURRENT = lambda of: of.loop == "pd", lambda of: of.current != "none"
ALL = lambda of: True
CAUSES: dict[str, tuple[Callable[[dict[str, float], float], dict[str, float]], Callable[[Make], bool]]] = {
    "reducer.viscous": (lambda s, g: {"viscous": 0.1 * g * s["constant"] ** 2 / s["resistance"]}, ALL),
    "reducer.preload": (lambda s, g: {"least": (1.0 + g) * s["least"]}, ALL),
    "reducer.stribeck": (lambda s, g: {"static": 0.7 * g}, ALL),
    "reducer.asymmetric": (lambda s, g: {"asymmetry": min(0.35 * g, 0.8)}, ALL),
    "reducer.backlash": (lambda s, g: {"play": 0.03 * g}, ALL),
    "reducer.compliance": (lambda s, g: {"stiffness": s["stiffness"] / (1.0 + 9.0 * g)}, lambda of: of.load != "nothing"),
    "reducer.ripple": (lambda s, g: {"ripple": min(0.5 * g, 0.9)}, lambda of: of.load != "arm"),
    "reducer.warm_up": (lambda s, g: {"cold": 1.2 * g, "cold_time": 8.0}, ALL),
    "motor.cogging": (lambda s, g: {"cogging": 0.04 * g * _stall(s)}, lambda of: of.encoder == "motor"),
    "motor.brush_drop": (lambda s, g: {"brushes": 0.06 * g * s["supply"]}, CURRENT),
    "motor.torque_constant": (lambda s, g: {"weak": 0.8 * g}, CURRENT),
    "motor.parameter motor.resistance": (lambda s, g: {"resistance": (1.0 + 0.3 * g) * s["resistance"]}, ALL),
    "motor.supply_sag": (lambda s, g: {"sag": 0.25 * g * s["resistance"]}, lambda of: not of.battery and CURRENT(of)),
    "controller.dead_zone": (lambda s, g: {"dead_zone": 0.06 * g}, LOOP),
    "controller.delay": (lambda s, g: {"delay": 0.025 * g}, LOOP),
    "controller.saturation": (lambda s, g: {"limit": 1.0 / (1.0 + 0.8 * g)}, LOOP),
    "sensor.scale motor.current": (lambda s, g: {"current_scale": 1.0 + 0.15 * g}, CURRENT),
    "sensor.bias motor.current": (lambda s, g: {"current_bias": 0.03 * g * s["supply"] / s["resistance"]}, CURRENT),
    "sensor.lag motor.current": (lambda s, g: {"current_lag": 0.04 * g}, CURRENT),
    "load.inertia": (lambda s, g: {"inertia": (1.0 + 0.6 * g) * s["inertia"]}, lambda of: of.load == "wheel"),
    "load.mass": (
        lambda s, g: {"weight": (1.0 + 0.4 * g) * s["weight"], "inertia": s["inertia"] + 0.4 * g * s["mass"] * s["arm"] ** 2},
        lambda of: of.load == "arm",
    ),
    "load.parameter load.constant_torque": (lambda s, g: {"pull": 0.06 * g * _stall(s) * s["ratio"]}, ALL),
}
OFF = dict.fromkeys(HIDDEN, 0.0) | {
    "static_speed": 30.0,
    "static_power": 1.0,
    "cold_time": 8.0,
    "cogging_order": 3.0,
    "limit": 1.0,
}


def moves(rng: np.random.Generator, s: dict[str, float], of: Make, duration: float) -> tuple[np.ndarray, np.ndarray]:
    """Set-points in rad, and duties: steps, ramps and waves one after the other."""
    n = round(duration / STEP)
    time, reach = np.arange(n) * STEP, 1.3 if s["weight"] else 6.0
    top = s["supply"] / s["constant"] / s["ratio"]
    wanted, given, at, place = np.zeros(n), np.zeros(n), 0.3, 0.0
    while at < duration:
        span = rng.uniform(1.0, 4.0)
        here = (time >= at) & (time < at + span)
        since, kind = time[here] - at, rng.choice(["step", "ramp", "wave"])
        goal = rng.uniform(-reach, reach)
        level = rng.uniform(0.15, 0.9) * rng.choice([-1.0, 1.0])
        if kind == "step":
            wanted[here], given[here] = goal, level
        elif kind == "ramp":
            rate = rng.uniform(0.1, 0.5) * top
            wanted[here] = place + np.clip(goal - place, -rate * since, rate * since)
            given[here] = level * since / span
        else:
            w = 2.0 * math.pi * rng.uniform(0.3, 1.5)
            size = min(0.3 * reach, 0.4 * top / w)
            wanted[here], given[here] = place + size * np.sin(w * since), level * np.sin(w * since)
            goal = wanted[here][-1] if here.any() else goal
        place, at = float(wanted[here][-1]) if here.any() else place, at + span
        if rng.random() < 0.4:
            rest = (time >= at) & (time < at + 0.5)
            wanted[rest], at = place, at + 0.5
    if s["weight"]:  # nobody lets an arm turn over: duties that swing it
        given *= 0.35
    return wanted, given


def clock(rng: np.random.Generator, of: Make, duration: float) -> np.ndarray:
    """Steps at which the sketch makes a row: its loop is now and then late."""
    due = np.arange(0.05, duration - of.row, of.row)
    late = rng.uniform(0.0, 2e-4, len(due)) + np.where(rng.random(len(due)) < 0.05, rng.uniform(0.0, 1e-3, len(due)), 0.0)
    return np.round((due + late) / STEP).astype(int)


def count(of: Make) -> float:
    """rad of the encoder's own shaft."""
    return 2.0 * math.pi / (4096 if of.encoder == "output" else 48)


def simulate(s: dict[str, float], of: Make, plan: tuple[np.ndarray, np.ndarray], rows: np.ndarray) -> np.ndarray:
    """Each step: see _run."""
    out, all_of, acts = np.zeros((len(plan[0]), 6)), {**OFF, **s}, np.zeros(len(plan[0]), dtype=bool)
    if of.fast and of.loop != "none":  # a timer's; a row tells what it did last
        acts[:: round(0.001 / STEP)] = True
    else:
        acts[rows] = True
    p, h = (np.array([all_of[n] for n in names]) for names in (SHEET, HIDDEN))
    at_motor = of.encoder == "motor"
    smooth = 0.2 if of.fast else 1.0  # of the speed that its D sees
    _run(p, h, *plan, acts, count(of) / (s["ratio"] if at_motor else 1.0), at_motor, smooth, out)
    return out


def least(of: Make, s: dict[str, float]) -> float:
    """A step of the converter, A."""
    return 3.0 * s["supply"] / s["resistance"] / 2**of.converter


def noise(of: Make, s: dict[str, float]) -> float:
    """Of the current, A: a Hall sensor's, of which a mean has less."""
    return (0.012 if of.current == "once" else 0.0045) * s["supply"] / s["resistance"]


def current(s: dict[str, float], of: Make, run: np.ndarray, rows: np.ndarray) -> np.ndarray:
    """As the sensor has it in each row, A."""
    i = run[:, 2]
    if s.get("current_lag"):
        i = pd.Series(i).ewm(alpha=1.0 - math.exp(-STEP / s["current_lag"]), adjust=False).mean().to_numpy()
    if of.current == "mean":
        total = np.concatenate([[0.0], np.cumsum(i)])
        before = np.concatenate([[rows[0] - round(of.row / STEP)], rows[:-1]])
        i = (total[rows] - total[before]) / (rows - before)
    else:
        i = i[rows - 1]
    return i * s.get("current_scale", 1.0) + s.get("current_bias", 0.0)


def record(rng: np.random.Generator, of: Make, s: dict[str, float], plan, run: np.ndarray, rows: np.ndarray) -> pd.DataFrame:
    """The table: sensors are read, the duty is set, the row is printed."""
    seen = run[rows - 1]  # before the new duty acts
    told, wide = np.floor(seen[:, 3 if of.encoder == "motor" else 5] / count(of)), least(of, s)
    stamp = np.floor(rows * STEP * 1e3) if of.stamps == "ms" else np.floor(rows * STEP * 1e6)
    table = {of.stamps.replace("us", "micros").replace("ms", "millis"): stamp.astype(int)}
    if of.loop != "none":
        table["target"] = np.round(np.degrees(plan[0][rows]), 2)
    table["pwm"] = np.round(run[rows, 0]).astype(int)
    if of.battery:
        table["vbat"] = np.round(
            1.5
            * s["supply"]
            / 1023
            * np.round((seen[:, 1] + rng.normal(0.0, 0.001 * s["supply"], len(rows))) / (1.5 * s["supply"] / 1023)),
            3,
        )
    if of.current != "none":
        i = current(s, of, run, rows) + rng.normal(0.0, noise(of, s), len(rows))
        table["current_mA"] = np.round(1e3 * (wide * np.round(i / wide) if of.current == "once" else i), 1)
    if of.encoder == "motor":
        table["enc"] = told.astype(int)
    else:
        table["angle"] = np.mod(told + 512, 4096).astype(int) if of.raw else np.round(told * 360.0 / 4096, 2)
    if of.speed:
        n, when = of.speed, rows * STEP
        rate = np.zeros(len(rows))
        rate[n:] = (told[n:] - told[:-n]) * count(of) / (when[n:] - when[:-n])
        table["rpm"] = np.round(rate * 30.0 / math.pi, 2)
    return pd.DataFrame(table)[rng.random(len(rows)) > 0.003].reset_index(drop=True)


def spoil(rng: np.random.Generator, of: Make, table: pd.DataFrame) -> tuple[pd.DataFrame, list[str]]:
    """One or two faults of what was measured."""
    table, told = table.copy(), []
    able = [c for c in table if c in ("current_mA", "enc", "angle", "rpm", "vbat")]
    for kind in rng.choice(["stuck", "nan", "garbage", "clipped", "lost"], size=int(rng.integers(1, 3)), replace=False):
        column, n = str(rng.choice(able)), len(table)
        first, many = int(rng.integers(100, n - 300)), int(rng.integers(20, 150))
        x = table[column].to_numpy().astype(float)
        if kind == "stuck":
            x[first : first + many] = x[first]
        elif kind == "nan":
            x[rng.random(n) < 0.01] = np.nan
        elif kind == "garbage":
            at = rng.integers(5, n - 5, int(rng.integers(1, 8)))
            x[at] = rng.integers(0, 10, len(at))
        elif kind == "clipped" and of.current != "none":
            column = "current_mA"
            x = table[column].to_numpy().astype(float)
            most = np.nanquantile(abs(x), 0.99)
            x = np.clip(x, -most, most)
        elif kind == "lost":
            table = table.drop(index=range(first, first + many)).reset_index(drop=True)
            told.append("lost")
            continue
        table[column] = x
        told.append(f"{kind} {column}")
    return table, told


@dataclass(frozen=True)
class Case:
    """What is hidden, and what the product may see of it."""

    names: list[str]
    seed: int
    make: Make
    sheet: dict[str, float]
    true: dict[str, float]
    logs: list[pd.DataFrame]  # the last one judges
    faults: list[str]
    ratio: float  # error of the sheet's drive over the noise of what is measured, where it is most

    def rig(self) -> str:
        """The data sheet and the columns, nothing else."""
        s, of = self.sheet, self.make
        full, loop = 2.0 ** s["bits"] - 1.0, "motor" if of.encoder == "motor" else "load"
        columns = []
        if of.loop != "none":
            columns.append('"controller.angle_setpoint" = { column = "target", unit = "deg" }')
        if of.battery:
            columns += [
                f'"motor.duty" = {{ column = "pwm", factor = {1.0 / full!r} }}',
                '"motor.supply_voltage" = { column = "vbat", unit = "V" }',
            ]
        else:
            columns.append(f'"motor.voltage" = {{ column = "pwm", factor = {s["supply"] / full!r} }}')
        if of.current != "none":
            columns.append('"motor.current" = { column = "current_mA", unit = "mA" }')
        if of.encoder == "motor":
            columns.append(f'"reducer.input_angle" = {{ column = "enc", factor = {2.0 * math.pi / 48!r} }}')
        elif of.raw:
            columns.append(
                f'"load.angle" = {{ column = "angle", factor = {2.0 * math.pi / 4096!r}, wraps = 4096.0, offset = {-2.0 * math.pi * 512 / 4096!r} }}'
            )
        else:
            columns.append('"load.angle" = { column = "angle", unit = "deg" }')
        if of.speed:
            columns.append(
                f'"{"reducer.input_speed" if of.encoder == "motor" else "load.speed"}" = {{ column = "rpm", unit = "rpm" }}'
            )
        values = {
            "motor.resistance": s["resistance"], "motor.voltage_constant": s["constant"], "motor.torque_constant": s["constant"],
            "reducer.gear_ratio": s["ratio"], "reducer.wedge_angle": math.atan(s["tangent"]), "reducer.friction_kinetic": s["mu"],
            "reducer.preload": s["preload"], "reducer.shaft_inertia": s["rotor"],
            "load.inertia": s["inertia"] - s["mass"] * s["arm"] ** 2,
        }  # fmt: skip
        if of.told[0]:
            values["motor.inductance"] = s["inductance"]
        uncertain = [] if of.told[0] else ["\n[uncertain]", '"motor.inductance" = [0.0, 0.01]']
        if of.told[1]:
            values |= {"reducer.shaft_stiffness": s["stiffness"], "reducer.shaft_damping": s["damping"]}
        if s["mass"]:
            values |= {"load.mass": s["mass"], "load.arm": s["arm"], "load.arm_angle": -0.5 * math.pi}
        head = ['name = "bot"', 'kind = "forward"']
        if of.loop == "pd":
            unit = 1.0 if of.battery else s["supply"]
            values |= {
                "controller.angle_gain": s["p"] * unit, "controller.speed_gain": s["d"] * unit, "controller.voltage_max": unit,
                "controller.voltage_min": -unit, "controller.release_time": 1e6,
            }  # fmt: skip
            columns.append('"controller.speed_setpoint" = { value = 0.0 }')
            head.append(f'loop = "{loop}"')
            if of.told[2]:
                values["controller.sample_period"] = 0.001 if of.fast else of.row
        stamp = ('column = "millis"', 'unit = "ms"') if of.stamps == "ms" else ('column = "micros"', 'unit = "us"')
        given = [f'"{name}" = {float(value)!r}' for name, value in values.items()]
        return "\n".join(["[rig]", *head, "\n[time]", *stamp, "\n[columns]", *columns, "\n[parameters]", *given, *uncertain, ""])

    def write(self, folder: Path) -> tuple[Path, list[Path], Path]:
        """rig.toml, train1.csv, train2.csv, test.csv."""
        rig = Path(folder) / "rig.toml"
        rig.write_text(self.rig())
        files = [Path(folder) / f"{name}.csv" for name in ("train1", "train2", "test")]
        for table, path in zip(self.logs, files, strict=True):
            table.to_csv(path, index=False)
        return rig, files[:-1], files[-1]


def calm(of: Make, s: dict[str, float], run: np.ndarray) -> bool:
    """Whether the loop neither swings nor lives at its limit, and a hanging arm stays below."""
    if not np.isfinite(run).all():
        return False
    if of.loop == "none":
        return not s["weight"] or bool(abs(run[:, 5]).max() < 2.5)
    duty = run[::100, 0] / (2.0 ** s["bits"] - 1.0)
    slow = pd.Series(duty).rolling(61, center=True).mean().to_numpy()
    return bool(np.nanmedian(abs(duty - slow)) < 0.03 and np.mean(abs(duty) > 0.98) < 0.15)


def apart(of: Make, s: dict[str, float], true: dict[str, float], plan, rows: np.ndarray) -> float:
    """Error of the sheet's drive over the noise, in the current, the speed, or the angle that a loop holds, where it is most."""
    sound, real = (simulate(d, of, plan, rows) for d in (s, true))
    wide, one = least(of, s), count(of) * (1.0 if of.encoder == "motor" else s["ratio"])
    errors = [
        ((sound[rows, 4] - real[rows, 4]), max(one / of.row / math.sqrt(6.0) / max(of.speed, 4), 0.003 * sound[rows, 4].std()))
    ]
    if of.current != "none":
        errors.append(
            (current(s, of, sound, rows) - current(true, of, real, rows), math.hypot(noise(of, s), wide / math.sqrt(12.0)))
        )
    if of.loop != "none":
        errors.append((sound[rows, 3] - real[rows, 3], max(one / math.sqrt(12.0), 0.003 * sound[rows, 3].std())))
    return max(math.sqrt(1.0 + np.mean(e**2) / floor**2) for e, floor in errors)


def hide(names: list[str], seed: int, duration: float = 0.0, faulty: bool = False) -> Case:
    """Hide causes by name ([] is none) in a drive, profile and recorder of this seed's drawing."""
    for attempt in range(1000):
        rng = np.random.default_rng([seed, 6, attempt])
        of = make(rng)
        if not all(CAUSES[name][1](of) for name in names):
            continue
        s = sheet(rng, of)
        lasts = duration or float(rng.choice([20.0, 20.0, 30.0]))
        plans = [moves(rng, s, of, lasts) for _ in range(3)]
        clocks = [clock(rng, of, lasts) for _ in range(3)]
        if all(calm(of, s, simulate(s, of, plan, rows)) for plan, rows in zip(plans, clocks, strict=True)):
            break
    true, ratio = dict(s), 1.0
    for strength in (1.0, 1.6, 2.5, 4.0):
        for name in names:
            true |= CAUSES[name][0](s, strength)
        ratio = apart(of, s, true, plans[2], clocks[2]) if names else 1.0
        if ratio > 3.0 or not names:
            break
    logs = [record(rng, of, true, plan, simulate(true, of, plan, rows), rows) for plan, rows in zip(plans, clocks, strict=True)]
    faults: list[str] = []
    if faulty:
        logs[0], faults = spoil(rng, of, logs[0])
    return Case(list(names), seed, of, s, true, logs, faults, float(ratio))
