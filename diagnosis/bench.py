"""The measured drive and its simulation, cut where channels allow, so that each component runs on measured inputs.

A cut is a comparison of one measured channel with what some of the components compute from other measured channels:

    controller   set-points and measured angles     -> voltage
    motor        measured voltage and speed         -> current (or torque)
    gear         measured motion (and load)         -> torque at the motor's shaft
    load         measured motion of the load        -> output torque
    twist        measured angle of the input shaft  -> angle of the load
    input        measured angle of the input shaft  -> its speed: sensors alone
    output       measured angle of the load         -> its speed: sensors alone
    drive        set-points or voltage              -> motion: the whole at once, where the rig asks for it (simulate)

A cut whose residual is noise proves its components; a cut that is off has the fault among its components.
"""

from __future__ import annotations

from dataclasses import dataclass
from threading import Lock
from typing import Callable

import numpy as np

from .errors import DataError
from .kernels import kernels
from .laws import parameters
from .log import Run
from .prepare import Channels, Motion, motion, smooth
from .rig import Rig
from .signals import unit

BLOCKS = 36
"""Blocks that all runs together are cut into, about."""

BINS = 250
"""Averages kept of each block: what is left of noise then is small, and fits are fast."""

MOST = 3_000
"""Samples of the gear's friction simulated in a fit: of longer logs, stretches spread over all of it."""

LONGEST = 0.045
"""s; a longer smoothing window would blur the motion itself."""

STRETCH = 80
"""Samples in such a stretch."""


@dataclass
class Cut:
    """One comparison: `compute(values)` gives simulated, measured and trusted, one array per run."""

    name: str  # drive prefix + controller | motor | gear | load | twist
    components: tuple[str, ...]
    reads: tuple[str, ...]
    output: str  # channel
    unit: str
    compute: Callable[[dict, Channels], tuple[np.ndarray, np.ndarray, np.ndarray]]
    prefix: str = ""  # of the drive
    noise: float = 1.0  # of a bin's average

    def uses(self, name: str) -> bool:
        """Whether a parameter's value matters to this cut: one of its components', or a sensor's of its channels."""
        owner = name.rpartition(".")[0]
        if name.startswith("sensor."):
            return owner.removeprefix("sensor.") in (*self.reads, self.output)
        return owner in self.components or name == self.prefix + "reducer.gear_ratio" or owner == self.prefix + "load"


class Bench:
    """All runs of a measurement under one rig, and the residual of a simulation with given parameter values."""

    def __init__(self, rig: Rig, runs: list[Run], sampled: bool = False):
        self.rig, self.steady = rig, rig.kind == "steady"
        self.original = runs
        self.runs = points(runs) if self.steady else runs
        self.channels = {(i, prefix): Channels(run, prefix, self.steady) for i, run in enumerate(self.runs) for prefix in rig.drives}
        self.kernels = kernels()  # laws that run; extend puts FMUs in their place
        self._memory: dict[str, dict] = {}
        self._lock = Lock()
        self.smoothing = {prefix: 11 for prefix in rig.drives}
        total = sum(len(run) for run in self.runs)
        for ch in self.channels.values():
            ch.take = stretches(len(ch.run), MOST / total) if sampled and total > 1.5 * MOST and not self.steady else None
        self.cuts = [cut for prefix in rig.drives for cut in _cuts(self, prefix) if not rig.only or cut.components == (rig.only,)]
        if not self.cuts:
            have = sorted({name for run in self.runs for name in run.signals})
            raise DataError(f"{rig.path}: the columns {', '.join(have)} allow no comparison. A log needs a motion and a torque, "
                            "current or voltage, or set-points and a voltage; docs/rig.md lists what goes together.")
        self.choosing = False
        self._layout()
        for prefix in rig.drives:
            self._choose_smoothing(prefix)

    def _choose_smoothing(self, prefix: str) -> None:
        """The shortest window over which the noise of the acceleration matters no more than that of the torque."""
        gear = next((cut for cut in self.cuts if cut.name == prefix + "gear"), None)
        if gear is None or self.steady:
            return
        if self.rig.smoothing > 0.0:
            self.smoothing[prefix] = max(5, int(round(self.rig.smoothing / float(np.median(self.channels[0, prefix].dt)))) | 1)
            return
        levels = {}
        self.choosing = True  # the balance is not smoothed meanwhile
        step = float(np.median(np.concatenate([ch.dt for ch in self.channels.values()])))
        for samples in (n for n in (5, 7, 11, 17, 25, 41, 61) if n == 5 or n * step <= LONGEST):
            self.smoothing[prefix] = samples
            steps, count = 0.0, 0
            for simulated, measured, good in self.compare(gear, {}):
                e = (measured - simulated)[good]
                if len(e) > 20:
                    steps, count = steps + float(np.median(abs(e - np.median(e)))) * len(e), count + len(e)
            levels[samples] = steps / max(count, 1)
        self.choosing = False
        self.smoothing[prefix] = min(samples for samples, level in levels.items() if level <= 1.15 * min(levels.values()))

    def reach(self, cut: Cut) -> int:
        """Samples over which smoothing ties the residual of a cut together."""
        return self.smoothing[cut.prefix] if cut.name.endswith(("gear", "input", "output")) and not self.steady else 1

    # --- where the samples of each run go: blocks and bins -------------------------------------------------

    def _layout(self) -> None:
        total = sum(len(run) for run in self.runs)
        if self.steady:
            length, per_bin = 1, 1
        else:
            length = max(20, min(int(np.ceil(total / BLOCKS)), max(len(run) for run in self.runs)))
            per_bin = max(1, int(np.ceil(length / BINS)))
        self.block_samples, self.per_bin = length, per_bin
        self.bins = int(np.ceil(length / per_bin))
        self.block_run: list[int] = []
        self.place: list[np.ndarray] = []  # of each run: index of the bin of each sample
        self.block_of: list[np.ndarray] = []
        for i, run in enumerate(self.runs):
            n = len(run)
            if self.steady:
                count, block = n, np.arange(n)
            else:
                count = max(1, int(round(n / length)))
                block = np.minimum(np.arange(n) // int(np.ceil(n / count)), count - 1)
                length = max(length, int(np.bincount(block).max()))
            self.block_of.append(block)
            self.block_run += [i] * count
        self.bins = int(np.ceil(length / per_bin))
        first = 0
        for block in self.block_of:
            starts = np.concatenate([[0], np.flatnonzero(np.diff(block)) + 1])
            inside = np.arange(len(block)) - starts[block - block[0]]
            self.place.append((first + block) * self.bins + inside // per_bin)
            first += block[-1] + 1
        self.blocks = len(self.block_run)
        self.block_run = np.array(self.block_run)

    def take_all(self) -> bool:
        """From now on simulate all samples; False where that is done already."""
        sampled = any(ch.take is not None for ch in self.channels.values())
        for ch in self.channels.values():
            ch.take = None
        self._memory.clear()
        return sampled

    def bin(self, i: int, samples: np.ndarray, good: np.ndarray, take: np.ndarray | None = None) -> tuple[np.ndarray, np.ndarray]:
        """Sums and counts of run i's good samples in all bins; `take`: which samples these are, where not all."""
        place = (self.place[i] if take is None or len(samples) == len(self.place[i]) else self.place[i][take])[good]
        size = self.blocks * self.bins
        return np.bincount(place, samples[good], size), np.bincount(place, minlength=size)

    # --- the residual --------------------------------------------------------------------------------------

    def compare(self, cut: Cut, values: dict[str, float]):
        """Simulated, measured, trusted of each run, sample by sample."""
        return [cut.compute(values, self.channels[i, cut.prefix]) for i in range(len(self.runs))]

    def binned(self, cut: Cut, values: dict[str, float]) -> tuple[np.ndarray, np.ndarray]:
        """Mean residual (measured - simulated) and count in each bin, arrays (blocks, bins)."""
        total, count = np.zeros(self.blocks * self.bins), np.zeros(self.blocks * self.bins, int)
        for i, (simulated, measured, good) in enumerate(self.compare(cut, values)):
            error = measured - simulated
            wild = ~np.isfinite(error) & good  # a simulation that breaks down is wrong, not absent
            if wild.any():
                error = np.where(wild, 1e3 * np.nanstd(measured), error)
            sums, counts = self.bin(i, error, good, self.channels[i, cut.prefix].take)
            total += sums
            count += counts
        return (total / np.maximum(count, 1)).reshape(self.blocks, self.bins), count.reshape(self.blocks, self.bins)

    def residual(self, values: dict[str, float]) -> np.ndarray:
        """(blocks, bins of all cuts): residuals in units of their noise; 0 where there are no trusted samples."""
        return np.concatenate([self._remembered(cut, values) / cut.noise for cut in self.cuts], axis=1)

    def _remembered(self, cut: Cut, values: dict[str, float]) -> np.ndarray:
        """A cut's residual, computed only when a value that it uses is new: a fit changes few cuts at a time."""
        key = tuple(sorted((name, value) for name, value in values.items() if cut.uses(name)))
        memory = self._memory.setdefault(cut.name, {})
        found = memory.get(key)
        if found is None:
            found = self.binned(cut, values)[0]
            with self._lock:
                while len(memory) >= 24:
                    memory.pop(next(iter(memory)))
                memory[key] = found
        return found

    def present(self, values: dict[str, float]) -> np.ndarray:
        """Which entries of the residual are backed by samples."""
        return np.concatenate([self.binned(cut, values)[1] > 0 for cut in self.cuts], axis=1)

    def slice(self, cut: Cut) -> slice:
        place = self.cuts.index(cut)
        return slice(place * self.bins, (place + 1) * self.bins)

    @property
    def components(self) -> set[str]:
        return {name for cut in self.cuts for name in cut.components}

    @property
    def measured(self) -> set[str]:
        return {name for cut in self.cuts for name in (*cut.reads, cut.output)}

    def value(self, name: str, values: dict[str, float]) -> float:
        """A parameter's value: fitted, else nominal, else the law's default."""
        component, _, parameter = name.rpartition(".")
        base = component[len(self._prefix(component)):]
        return float(values.get(name, self.rig.parameters.get(name, getattr(parameters(base, component, {}), parameter))))

    def _prefix(self, component: str) -> str:
        return next((p for p in sorted(self.rig.drives, key=len, reverse=True) if component.startswith(p)), "")


def stretches(n: int, share: float) -> np.ndarray:
    """Places of short stretches spread evenly over n samples, about this share of them."""
    count = max(1, int(n * share / STRETCH))
    firsts = np.linspace(0, max(0, n - STRETCH), count).astype(int)
    return np.unique((firsts[:, None] + np.arange(STRETCH)).ravel().clip(0, n - 1))


def points(runs: list[Run]) -> list[Run]:
    """Steady-state points: each run's mean over its trusted samples; rows without runs are points already."""
    if len(runs) == 1:
        return runs
    names = list(runs[0].signals)
    mean = {name: np.array([run.signals[name][run.usable(name)].mean() if run.usable(name).any() else np.nan for run in runs]) for name in names}
    joined = Run(runs[0].log, "", np.array([run.rows[0] for run in runs]), np.arange(len(runs), dtype=float), mean)
    joined.good = {name: np.isfinite(values) for name, values in mean.items()}
    joined.labels = [run.name for run in runs]
    return [joined]


# --- the cuts ------------------------------------------------------------------------------------------------


def _cuts(bench: Bench, prefix: str) -> list[Cut]:
    probe = bench.channels[0, prefix]
    has, linear = probe.has, bench.rig.linear
    name = {part: prefix + part for part in ("controller", "motor", "reducer", "load")}
    cuts: list[Cut] = []

    def add(kind, components, reads, output, compute):
        measure = unit("motor.torque" if kind == "gear" else output, linear)
        reads = tuple(prefix + r for r in reads if has(r))
        cuts.append(Cut(prefix + kind, tuple(name[c] for c in components), reads, prefix + output, measure, compute, prefix))

    electric = "motor.voltage" if has("motor.voltage") else "motor.duty" if has("motor.duty", "motor.supply_voltage") else \
        "controller.voltage" if has("controller.voltage") else ""
    moves = [m for m in ("reducer.input_angle", "reducer.input_speed", "load.angle", "load.speed") if has(m)]
    if bench.rig.kind == "forward" and bench.rig.simulate and electric and moves:
        from .forward import simulate

        shown = next(m for m in ("load.angle", "reducer.input_angle", "load.speed", "reducer.input_speed") if has(m))
        closed = bench.rig.simulate == "closed"

        def drive(values, ch):
            row = {"load.angle": "angle", "load.speed": "speed", "reducer.input_angle": "input_angle", "reducer.input_speed": "input_speed"}[shown]
            return _read(shown, simulate(bench, prefix, values, ch, closed)[row], values, ch), ch.raw(shown), ch.good(shown)

        read = ("controller.angle_setpoint", "controller.speed_setpoint", "motor.supply_voltage") if closed else \
            ("motor.duty", "motor.supply_voltage", "motor.voltage", "controller.voltage")
        add("drive", [*(["controller"] if closed else []), "motor", "reducer", "load"], read, shown, drive)
        return cuts

    volts = ("motor.duty", "motor.supply_voltage") if electric == "motor.duty" else (electric,) if electric else ()

    command = "controller.voltage" if has("controller.voltage") else "motor.voltage" if has("motor.voltage") else ""
    if command and has("controller.angle_setpoint") and moves and not bench.steady:
        add("controller", ["controller"], ("controller.angle_setpoint", "controller.speed_setpoint", *moves), command,
            lambda v, ch: _controller(bench, prefix, command, v, ch))
    if electric and moves and has("motor.current"):
        add("motor", ["motor"], (*volts, *moves), "motor.current", lambda v, ch: _motor(bench, prefix, electric, v, ch))
    torque = next((t for t in ("motor.torque", "reducer.input_torque", "motor.current") if has(t)), electric)
    if torque and moves:
        who = ["reducer"] if has("reducer.output_torque") else ["reducer", "load"]
        if torque not in ("motor.torque", "reducer.input_torque"):
            who = ["motor", *who]
        read = (*moves, *(volts if torque == electric else ()), *(("reducer.output_torque",) if has("reducer.output_torque") else ()))
        add("gear", who, read, torque, lambda v, ch: _gear(bench, prefix, torque, electric, v, ch))
    if has("reducer.output_torque") and (has("load.angle") or has("load.speed")) and f"{prefix}load" in {
        key.rpartition(".")[0] for key in bench.rig.parameters
    }:
        add("load", ["load"], ("load.angle", "load.speed"), "reducer.output_torque", lambda v, ch: _load(bench, prefix, v, ch))
    for side, cut in (("reducer.input_", "input"), ("load.", "output")):
        if has(side + "angle", side + "speed") and not bench.steady:
            add(cut, [], (side + "angle",), side + "speed", lambda v, ch, side=side: _redundant(bench, prefix, side, v, ch))
    if has("reducer.input_angle", "load.angle") and not bench.steady:
        add("twist", ["reducer", *([] if has("reducer.output_torque") else ["load"])], ("reducer.input_angle",), "load.angle",
            lambda v, ch: _twist(bench, prefix, v, ch))
    return cuts


def _law(bench: Bench, prefix: str, component: str, values: dict):
    return parameters(component, prefix + component, {**bench.rig.parameters, **values})


def _side(bench: Bench, prefix: str, side: str, values: dict, ch: Channels) -> Motion | None:
    """The measured motion of one shaft, if it is measured; remembered while no sensor is in question."""
    angle, speed = f"{side}angle", f"{side}speed"
    if not (ch.has(angle) or ch.has(speed)):
        return None
    doubted = any(key.startswith((f"sensor.{prefix}{angle}", f"sensor.{prefix}{speed}")) for key in values)
    memory = ch.__dict__.setdefault("_motions", {})
    key = (side, bench.smoothing[prefix])
    if key in memory and not doubted:
        return memory[key]
    found = _steady(ch, angle, speed, values) if bench.steady else motion(
        ch.true(angle, values) if ch.has(angle) else None, ch.true(speed, values) if ch.has(speed) else None, ch.dt, bench.smoothing[prefix])
    for name in (angle, speed):
        if ch.has(name):
            found.sliding &= ch.good(name)
    if not doubted:
        memory[key] = found
    return found


def _steady(ch: Channels, angle: str, speed: str, values: dict) -> Motion:
    n = len(ch.dt)
    pace = ch.true(speed, values) if ch.has(speed) else np.zeros(n)
    place = ch.true(angle, values) if ch.has(angle) else np.zeros(n)
    return Motion(place, pace, np.zeros(n), pace != 0.0, 0.0)


def _both(bench: Bench, prefix: str, values: dict, ch: Channels) -> tuple[Motion, Motion]:
    """Motions of the input shaft and of the load; one that is not measured follows the other in the gear's ratio."""
    ratio = bench.value(f"{prefix}reducer.gear_ratio", values)
    first, second = _side(bench, prefix, "reducer.input_", values, ch), _side(bench, prefix, "load.", values, ch)
    if first is None:
        first = Motion(second.angle * ratio, second.speed * ratio, second.acceleration * ratio, second.sliding, second.noise * ratio)
    if second is None:
        second = Motion(first.angle / ratio, first.speed / ratio, first.acceleration / ratio, first.sliding, first.noise / ratio)
    return first, second


def _voltage(electric: str, values: dict, ch: Channels) -> tuple[np.ndarray, np.ndarray]:
    if electric == "motor.duty":
        good = ch.good("motor.duty") & ch.good("motor.supply_voltage")
        return ch.true("motor.duty", values) * ch.true("motor.supply_voltage", values), good
    return ch.true(electric, values), ch.good(electric)


def _delivered(bench: Bench, prefix: str, values: dict, ch: Channels, second: Motion) -> np.ndarray:
    """Output torque: measured, or what the load takes for its motion."""
    if ch.has("reducer.output_torque"):
        return ch.true("reducer.output_torque", values)
    out = np.empty(len(ch.dt))
    bench.kernels.load_torque(_law(bench, prefix, "load", values), second.angle, second.speed, second.acceleration, out)
    return out


def _read(channel: str, x: np.ndarray, values: dict, ch: Channels) -> np.ndarray:
    """What the sensor of a compared channel makes of the simulated value."""
    bias, factor, lag, step = (ch.sensor(channel, key, values) for key in ("bias", "scale_factor", "lag_time", "resolution"))
    if factor is not None:
        x = x * factor
    if bias is not None:
        x = x + bias
    if lag:
        y = np.empty_like(x)
        kernels().lag(x, ch.dt, lag, y)
        x = y
    if step:
        x = step * np.floor(x / step + 0.5)
    return x


def _controller(bench, prefix, command, values, ch):
    """The controller acts on what its sensors say, right or wrong."""
    first, second = _both(bench, prefix, values, ch)
    n = len(ch.dt)
    angle = ch.raw("load.angle") if ch.has("load.angle") else second.angle
    speed = ch.raw("load.speed") if ch.has("load.speed") else second.speed
    wanted = ch.true("controller.angle_setpoint", values)
    rate = ch.true("controller.speed_setpoint", values) if ch.has("controller.speed_setpoint") else np.gradient(wanted, np.cumsum(ch.dt))
    out = np.empty(n)
    motor_speed = ch.raw("reducer.input_speed") if ch.has("reducer.input_speed") else first.speed
    delivered = _delivered(bench, prefix, values, ch, second)
    bench.kernels.controller(_law(bench, prefix, "controller", values), wanted, rate, angle, speed, motor_speed, delivered, ch.dt, out)
    return _read(command, out, values, ch), ch.raw(command), ch.good(command)


def _motor(bench, prefix, electric, values, ch):
    first, _ = _both(bench, prefix, values, ch)
    voltage, good = _voltage(electric, values, ch)
    current, torque = np.empty(len(ch.dt)), np.empty(len(ch.dt))
    bench.kernels.motor(_law(bench, prefix, "motor", values), voltage, first.speed, ch.dt, current, torque)
    return _read("motor.current", current, values, ch), ch.raw("motor.current"), good & ch.good("motor.current")


def gear_inputs(bench, prefix, values, ch) -> tuple[tuple[np.ndarray, ...], Motion]:
    """What Reducer.fmu is given in kinematic mode, for each step, and the motion of its input shaft.

    The output angle is put where the shaft's spring, behind its play, carries the output torque.
    """
    first, second = _both(bench, prefix, values, ch)
    law = _law(bench, prefix, "reducer", values)
    delivered = _delivered(bench, prefix, values, ch, second)
    windup = delivered * (1.0 / law.shaft_stiffness + law.compliance) + 0.5 * law.backlash * np.sign(delivered)
    before = first.angle - first.speed * ch.dt
    return (before, first.speed, before / law.gear_ratio - windup, first.speed / law.gear_ratio), first


def _gear(bench, prefix, torque, electric, values, ch):
    """The balance at the motor's shaft: what the gear and the shaft's inertia take against what the motor gives.

    The measured acceleration is that of a smoothed motion, so the rest of the balance is smoothed in the same way.
    """
    inputs, first = gear_inputs(bench, prefix, values, ch)
    law = _law(bench, prefix, "reducer", values)
    take = ch.take
    dt = ch.dt if take is None else np.diff(np.concatenate([[0.0], np.cumsum(ch.dt)[take]]))
    pick = (lambda x: x) if take is None else (lambda x: x[take])
    bare = np.empty(len(dt))
    bench.kernels.gear(law, *(pick(x) for x in inputs), dt, bare)
    good = first.sliding.copy()
    if torque == "reducer.input_torque":
        return _read(torque, bare, values, ch), pick(ch.raw(torque)), pick(good & ch.good(torque))
    if torque == "motor.torque":
        given, good = ch.raw(torque), good & ch.good(torque)
    elif torque == "motor.current":
        given, good = np.empty(len(ch.dt)), good & ch.good(torque)
        bench.kernels.shaft_torque(_law(bench, prefix, "motor", values), ch.true(torque, values), first.speed, first.angle, ch.dt, given)
    else:
        given = np.empty(len(ch.dt))
        voltage, fine = _voltage(electric, values, ch)
        good &= fine
        bench.kernels.motor(_law(bench, prefix, "motor", values), voltage, first.speed, ch.dt, np.empty(len(ch.dt)), given)
    given, good, inertial = pick(given), pick(good), law.shaft_inertia * pick(first.acceleration)
    if torque == "motor.torque":
        bare = _read(torque, bare + inertial, values, ch) - inertial
    if bench.steady:
        return bare, given, good
    samples = 0 if bench.choosing else min(bench.smoothing[prefix], len(bare) - 1 | 1)
    smoothed = smooth(given - bare, samples)
    if take is not None:  # not across the gaps between stretches
        edge = np.flatnonzero(np.diff(take) > 1)
        for shift in range(-(samples // 2), samples // 2 + 1):
            good[np.clip(edge + shift + (shift <= 0), 0, len(good) - 1)] = False
    return bare + inertial, bare + smoothed, good


def _load(bench, prefix, values, ch):
    second = _side(bench, prefix, "load.", values, ch)
    out = np.empty(len(ch.dt))
    bench.kernels.load_torque(_law(bench, prefix, "load", values), second.angle, second.speed, second.acceleration, out)
    name = "reducer.output_torque"
    return _read(name, out, values, ch), ch.raw(name), ch.good(name) & ch.good("load.angle" if ch.has("load.angle") else "load.speed")


def _redundant(bench, prefix, side, values, ch):
    """A measured speed against the derivative of the measured angle of the same shaft, smoothed alike."""
    samples = bench.smoothing[prefix]
    slope = motion(ch.true(side + "angle", values), None, ch.dt, samples).speed
    name = side + "speed"
    good = ch.good(name) & ch.good(side + "angle")
    good[:samples] = good[-samples:] = False  # the average has no neighbours there
    return _read(name, slope, values, ch), smooth(ch.raw(name), samples), good


def _twist(bench, prefix, values, ch):
    _, second = _both(bench, prefix, values, ch)
    out = np.empty(len(ch.dt))
    angle = ch.true("reducer.input_angle", values)
    bench.kernels.twist(_law(bench, prefix, "reducer", values), angle, _delivered(bench, prefix, values, ch, second), out)
    out -= np.median(out - ch.raw("load.angle"))  # where the encoders' zeros lie is nobody's fault
    good = ch.good("reducer.input_angle") & ch.good("load.angle") & second.sliding & _pressed(bench, prefix, ch)
    return _read("load.angle", out, values, ch), ch.raw("load.angle"), good


def _pressed(bench, prefix, ch) -> np.ndarray:
    """Where the nominal output torque is far enough from zero to press one flank for sure, and has been for a while."""
    memory = ch.__dict__.setdefault("_motions", {})
    key = ("pressed", bench.smoothing[prefix])
    if key not in memory:
        torque = _delivered(bench, prefix, {}, ch, _both(bench, prefix, {}, ch)[1])
        side = np.sign(torque) * (abs(torque) > 0.1 * np.quantile(abs(torque), 0.9))
        steady = side != 0.0
        for shift in range(1, 2 * bench.smoothing[prefix]):
            steady[shift:] &= side[shift:] == side[:-shift]
        memory[key] = steady
    return memory[key]
