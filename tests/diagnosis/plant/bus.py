"""What becomes of the drives of fieldbus.py on their way into a table: messages, counts, means, stamps, and faults."""

from __future__ import annotations

import math
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import pandas as pd

PULLEY = 0.025  # m: of a carriage on a belt, whose columns are in mm
UNITS = {  # column: signal, unit, and how many of them are one SI unit
    "want": ("controller.angle_setpoint", "deg", 180 / math.pi),
    "want_rate": ("controller.speed_setpoint", "deg/s", 180 / math.pi),
    "u": ("motor.voltage", "V", 1.0),
    "duty": ("motor.duty", "1", 1.0),
    "ubat": ("motor.supply_voltage", "V", 1.0),
    "i": ("motor.current", "mA", 1e3),
    "rotor": ("reducer.input_angle", "rad", 1.0),
    "n": ("reducer.input_speed", "rpm", 30 / math.pi),
    "pos": ("load.angle", "deg", 180 / math.pi),
}


@dataclass(frozen=True)
class Recorder:
    """Rows, s; periods and phases of messages, s; how the table is made of them; counts, noise and means of channels."""

    row: float
    periods: dict[str, float]
    phases: dict[str, float]
    table: str  # together | held | straight
    stamps: str  # exact | ms | jitter
    channels: tuple[str, ...]
    counts: tuple[float, float]  # rad of the motor's shaft; and of the load
    noise_voltage: float
    noise_current: float
    least_current: float
    mean: float  # s, over which the current is a mean; 0: none
    noise_speed: float
    window: float  # s, over which the speed is a difference of counts; 0: a filtered one with noise
    wraps: bool
    belt: bool

    def columns(self, table: pd.DataFrame, belt: bool) -> list[str]:
        """Lines of [columns]; of a carriage on a belt the load's angle is its way over the pulley's radius."""
        said = []
        for c in (c for c in table if c in UNITS):
            signal, unit, _ = UNITS[c]
            wraps = ", wraps = 360.0" if c == "pos" and self.wraps else ""
            of = f"factor = {1e-3 / PULLEY!r}" if belt and unit.startswith("deg") else f'unit = "{unit}"'
            said.append(f'"{signal}" = {{ column = "{c}", {of}{wraps} }}')
        return said


def recorder(rng: np.random.Generator, s: dict[str, float], of) -> Recorder:
    """As drawn."""
    row = float(rng.choice([1e-3, 2e-3, 4e-3, 5e-3]))
    table = str(rng.choice(["together", "together", "held", "straight"]))
    channels = {"angle": ("want", "want_rate", "u"), "speed": ("want_rate", "u"), "duty": ("duty", "ubat"), "voltage": ("u",)}[
        of.way
    ]
    told = [("rotor",), ("n",), ("pos",), ("n", "pos"), ("rotor", "pos"), ("n", "pos")][int(rng.integers(6))]
    if of.way == "angle" and not of.at_motor and "pos" not in told:
        told = (*told, "pos")
    if of.way == "angle" and of.at_motor and told != ("rotor", "pos"):
        told = ("rotor",)
    if of.way == "speed":
        told = ("n",)
    channels = (*channels, "i", *told)
    slower = [1.0, 1.0, 2.0] if row < 3e-3 else [1.0]
    periods = {c: row * (float(rng.choice(slower)) if c not in ("want", "want_rate") else 1.0) for c in channels}
    phases = {c: rng.uniform(0.0, periods[c]) if c not in ("want", "want_rate") else 0.0 for c in channels}
    turn = (
        s["ratio"] * float(rng.choice([1024, 4096, 16384])) if of.load == "carriage" else float(rng.choice([4096, 16384, 65536]))
    )
    counts = 2 * math.pi / rng.choice([200, 512, 2000, 4096]), 2 * math.pi / turn
    stall = s["supply"] / s["resistance"]
    fastest = s["supply"] / s["constant"]
    return Recorder(
        row, periods, phases, table, str(rng.choice(["exact", "ms", "jitter"])) if row >= 2e-3 else "exact", channels, counts,
        s["supply"] * 10.0 ** rng.uniform(-4, -2.7), stall * 10.0 ** rng.uniform(-3.3, -2.3), stall / 2048,
        row if rng.random() < 0.3 else 0.0, fastest * 10.0 ** rng.uniform(-4, -2.7),
        row * int(rng.choice([1, 4])) if rng.random() < 0.4 else 0.0, of.load in ("turntable", "spindle") and rng.random() < 0.5,
        of.load == "carriage",
    )  # fmt: skip


def _measured(rng, by: Recorder, s, rows, plan, step) -> dict[str, np.ndarray]:
    """Every channel at every step, as its sender knows it, without noise."""
    acts, i, motor, speed, load, _, supply = rows.T
    down = lambda x, count: count * np.floor(x / count + 0.5)
    late = lambda x, span: np.concatenate([np.full(n := round(span / step), x[0]), x[:-n]]) if span else x
    if by.mean:
        total = np.cumsum(i) * step
        i = (total - late(total, by.mean)) / by.mean
    if by.window:
        counted = down(motor, by.counts[0])
        speed = (counted - late(counted, by.window)) / by.window
    found = {"want": plan[0], "want_rate": plan[1], "u": acts, "duty": plan[2], "ubat": supply, "n": speed}
    found["i"] = s.get("current_scale", 1.0) * i + s.get("current_bias", 0.0)
    return found | {"rotor": down(motor, by.counts[0]), "pos": down(load, by.counts[1])}


def record(rng, by: Recorder, s: dict[str, float], rows: np.ndarray, plan: np.ndarray, step: float, begin: float) -> pd.DataFrame:
    """What the table has, from `begin`, s, on; times in ms."""
    known, end = _measured(rng, by, s, rows, plan, step), len(rows) * step
    clock = np.arange(begin + 0.02, end - 0.02, by.row)
    if by.stamps == "jitter":
        clock = clock + by.row * rng.uniform(-0.2, 0.2, len(clock))
    instant = lambda when: np.rint(when / step).astype(int)
    clock = step * instant(clock)
    noise = {"u": by.noise_voltage, "i": by.noise_current, "n": 0.0 if by.window else by.noise_speed, "ubat": by.noise_voltage}
    quantum = {"i": by.least_current, "u": s["supply"] / 8192, "ubat": s["supply"] / 8192}
    out = {}
    for c in by.channels:
        x = known[c]
        sent = (
            clock
            if by.table == "together" or c.startswith("want")
            else step * instant(np.arange(by.phases[c], end, by.periods[c]))
        )
        value = x[np.minimum(instant(sent), len(x) - 1)] + noise.get(c, 0.0) * rng.standard_normal(len(sent))
        value = quantum[c] * np.round(value / quantum[c]) if c in quantum else value
        if by.table == "straight":
            value = np.interp(clock, sent, value)
        elif by.table == "held":
            value = value[np.maximum(np.searchsorted(sent, clock, side="right") - 1, 0)]
        scaled = value * (1e3 * PULLEY if by.belt and UNITS[c][1].startswith("deg") else UNITS[c][2])
        out[c] = np.mod(scaled, 360.0) if c == "pos" and by.wraps else scaled
    stamp = np.round(1e3 * clock) if by.stamps == "ms" else 1e3 * clock
    return pd.DataFrame({"t": stamp - stamp[0]} | out)


def spoil(rng: np.random.Generator, table: pd.DataFrame) -> tuple[pd.DataFrame, list[str]]:
    """One or two faults of what was measured: spikes, a message that did not come, no numbers, lost rows."""
    table, told = table.copy(), []
    able = [c for c in table if c not in ("t", "want", "want_rate", "u", "duty", "ubat")]
    for kind in rng.choice(["spikes", "stands", "nan", "lost"], size=int(rng.integers(1, 3)), replace=False):
        column, n = str(rng.choice(able)), len(table)
        x, first, many = table[column].to_numpy().copy(), int(rng.integers(50, n - 300)), int(rng.integers(20, 200))
        if kind == "spikes":
            at = rng.integers(5, n - 5, int(rng.integers(1, 6)))
            x[at] += rng.choice([-1.0, 1.0], len(at)) * np.nanstd(x) * rng.uniform(3.0, 20.0, len(at))
        elif kind == "stands":
            x[first : first + many] = x[first]
        elif kind == "nan":
            x[first : first + many // 4] = np.nan
        table[column] = x
        if kind == "lost":
            table = table.drop(index=range(first, first + many)).reset_index(drop=True)
        told.append(f"{kind} {column}")
    return table, told


def written(folder: Path, rig: str, logs: list[pd.DataFrame]) -> tuple[Path, list[Path], Path]:
    """A case's files: its rig, the two logs that teach, the one that judges."""
    file = Path(folder) / "rig.toml"
    file.write_text(rig)
    files = [Path(folder) / f"{name}.csv" for name in ("train1", "train2", "test")]
    for table, path in zip(logs, files):
        table.to_csv(path, index=False, float_format="%.7g")
    return file, files[:-1], files[-1]
