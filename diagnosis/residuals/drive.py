"""What a log says of a drive: motions of its shafts, voltage, output torque, and what a sensor makes of a value."""

from __future__ import annotations

from collections.abc import Callable, Hashable
from dataclasses import replace
from functools import cache
from typing import Any

import numpy as np
from scipy.ndimage import binary_opening

from ..rules import RULES
from . import laws, memory, phase
from .channels import Channels, ShaftMotion, derivative, integral, mean_rate, motion
from .laws import lags


def law(component: str, values: dict, ch: Channels):
    """A component's Parameters: nominal, with `values` in their place; what the rig says of this log alone stands."""
    known, free, own = _law(component, ch)
    given: dict[str, float] = {}
    for called in (free, own):
        if not called.keys().isdisjoint(values):
            given |= {called[name]: float(values[name]) for name in values if name in called}
    return known._replace(**given) if given else known


def _law(component: str, ch: Channels) -> tuple[Any, dict[str, str], dict[str, str]]:
    """A component's nominal Parameters, and which of them are whose that `values` may hold, of all runs and of this one alone."""
    key = ("law", component)
    if key not in ch.memory:
        rig, name = ch.setting.rig, ch.prefix + component
        alone = rig.of_log(ch.run.log)
        free = {full: field for field, full in laws.names(component, name) if full not in alone}
        own = {phase.name(ch.run, full): field for full, field in free.items()}
        ch.memory[key] = laws.parameters(component, name, {**rig.parameters, **alone}), free, own
    return ch.memory[key]


def nominal(ch: Channels) -> dict[str, float]:
    """Values of all that `values` may change of the components' laws, by name: as they are where nothing is said of them."""
    if "nominal" not in ch.memory:
        found: dict[str, float] = {}
        for part in laws.COMPONENTS:
            known, free, _ = _law(part, ch)
            found |= {name: getattr(known, field) for name, field in free.items()}
        ch.memory["nominal"] = found
    return ch.memory["nominal"]


def kept(what: str, key: Hashable, ch: Channels, make: Callable[[], Any]) -> Any:
    """What `make` gives, of all samples of a run; remembered under a key, the last ones asked for, as far as memory goes."""
    most = min(RULES.residuals.derived_remembered, RULES.residuals.motions_remembered // ch.setting.samples)
    return memory.kept(ch.memory.setdefault(("motion", what), {}), key, make, most if ch.setting.balanced else 0)


def shaft(side: str, values: dict, ch: Channels) -> ShaftMotion | None:
    """The measured motion of one shaft, if it is measured, for what `values` say of its sensors."""
    angle, speed = f"{side}angle", f"{side}speed"
    if not (ch.has(angle) or ch.has(speed)):
        return None
    told = ch.sensor(angle, values), ch.sensor(speed, values)
    known = ch.memory.setdefault(("motion", side), {})
    if told in known:
        return known[told]
    found = (
        _steady(ch, angle, speed, values)
        if ch.steady
        else motion(
            ch.true(angle, values) if ch.has(angle) else None,
            _centred(speed, values, ch) if ch.has(speed) else None,
            ch.dt,
            ch.smoothing,
            _still(side, ch),
        )
    )
    for name in (angle, speed):
        if ch.has(name):
            found.sliding &= ch.good(name)
    if ch.setting.balanced and (not known or (len(known) + 1) * ch.setting.samples <= RULES.residuals.motions_remembered):
        known[told] = found
    return found


def _centred(speed: str, values: dict, ch: Channels) -> np.ndarray:
    """A measured speed where it is the shaft's: a difference over some rows is that of their middle, and stands at their end."""
    x, window = ch.true(speed, values), ch.setting.windows.get(ch.prefix + speed)
    return np.interp(ch.run.time + 0.5 * window, ch.run.time, x) if window else x


def differenced(speed: str, x: np.ndarray, ch: Channels) -> np.ndarray:
    """A speed x of all samples as its channel has it: its mean over the rows of which it is a difference, if it is one."""
    window, time = ch.setting.windows.get(ch.prefix + speed), ch.run.time
    if not window:
        return x
    return mean_rate(integral(x, ch.dt), time, time - window, time)


def _still(side: str, ch: Channels) -> float | None:
    """Of an excerpt, the speed up to which a shaft may as well be at rest in the whole log; else None."""
    whole = ch.whole and shaft(side, {}, ch.whole)
    return whole.still if whole else None


def _steady(ch: Channels, angle: str, speed: str, values: dict) -> ShaftMotion:
    n = len(ch.dt)
    pace = ch.true(speed, values) if ch.has(speed) else np.zeros(n)
    place = ch.true(angle, values) if ch.has(angle) else np.zeros(n)
    return ShaftMotion(place, pace, np.zeros(n), pace != 0.0, 0.0)


def both(values: dict, ch: Channels) -> tuple[ShaftMotion, ShaftMotion]:
    """Motions of the input shaft and of the load; one that is not measured follows the other in the gear's ratio."""
    ratio = ch.setting.value(f"{ch.prefix}reducer.gear_ratio", values)
    first, second = shaft("reducer.input_", values, ch), shaft("load.", values, ch)
    return kept("both", (first, second, ratio), ch, lambda: _both(first, second, ratio, ch))


def input_shaft(values: dict, ch: Channels) -> ShaftMotion:
    """Motion of the input shaft, as both of them would have it."""
    return shaft("reducer.input_", values, ch) or both(values, ch)[0]


def _both(first: ShaftMotion | None, second: ShaftMotion | None, ratio: float, ch: Channels) -> tuple[ShaftMotion, ShaftMotion]:
    if first is None:
        assert second is not None, "a drive that moves has a shaft that is measured"
        first = ShaftMotion(
            second.angle * ratio,
            second.speed * ratio,
            second.acceleration * ratio,
            second.sliding,
            second.noise * ratio,
        )
    elif second is not None and ch.has("reducer.input_angle") and not ch.has("load.angle"):
        # integrated from its speed alone a load's angle begins at 0; where it is the input shaft says
        second = replace(second, angle=second.angle + (first.angle[0] / ratio - second.angle[0]))
    if second is None:
        second = ShaftMotion(
            first.angle / ratio, first.speed / ratio, first.acceleration / ratio, first.sliding, first.noise / ratio
        )
    return first, second


def electric(ch: Channels) -> str:
    """The channel that the motor's voltage is read from; "" where there is none."""
    sources = (("motor.voltage",), ("motor.duty", "motor.supply_voltage"), ("controller.voltage",))
    return next((source[0] for source in sources if ch.has(*source)), "")


def voltage(electric: str, values: dict, ch: Channels) -> np.ndarray:
    """Voltage on the motor, V; a duty counts times the supply's."""
    found = ch.true(electric, values)
    return found * ch.true("motor.supply_voltage", values) if electric == "motor.duty" else found


def shift(electric: str, ch: Channels) -> str:
    """The number that says how a measured voltage is to be read between its rows."""
    return f"recorder.{ch.prefix}{electric}.shift"


def between(rows: np.ndarray, time: np.ndarray, late: float) -> Callable[[np.ndarray], np.ndarray]:
    """A voltage of these rows, V, `late` s after its own time, at any instants.

    The mean of the voltage held from row to row, over 2 |late|, a step at most, about the instant `late` s on: at 0 it is
    held, half a step late it goes straight from row to row, and beyond that it is this straight line that was read late.
    """
    step = float(np.median(np.diff(time)))
    width = min(2.0 * abs(late), step)
    if width < 1e-6 * step:
        return lambda when: rows[np.clip(np.searchsorted(time, when + late, side="right") - 1, 0, len(rows) - 1)]
    margin = 2.0 * (abs(late) + step)
    edges = np.concatenate([[time[0] - margin], time, [time[-1] + margin]])
    area = np.concatenate([[0.0], np.cumsum(np.concatenate([rows[:1], rows]) * np.diff(edges))])

    def mean(when: np.ndarray) -> np.ndarray:
        first, last = when + late - 0.5 * width, when + late + 0.5 * width
        return (np.interp(last, edges, area) - np.interp(first, edges, area)) / width

    return mean


def level(out: np.ndarray, measured: np.ndarray, good: np.ndarray, time: np.ndarray) -> np.ndarray:
    """A simulated voltage of a supply, moved to the measured one's level, and to what of it is lost evenly in time."""
    if good.sum() < 3:
        return out
    since = time - time[good].mean()
    off = (measured - out)[good]
    slope = float(since[good] @ off / max(since[good] @ since[good], 1e-300))
    return out + off.mean() + slope * since


def speed_setpoint(wanted: np.ndarray, values: dict, ch: Channels) -> np.ndarray:
    """Set-point of the speed: logged, or the rate of the angle's, `wanted`."""
    name = "controller.speed_setpoint"
    if ch.has(name):
        return ch.true(name, values)
    rate, stays = derivative(wanted, np.cumsum(ch.dt)), np.diff(wanted) == 0.0
    ends = binary_opening(stays, np.ones(RULES.residuals.rounded_window))  # of a rest, not of the steps of one in counts
    still = np.append(False, stays) & np.append(stays, False) | np.append(ends, False) | np.append(False, ends)
    rate[still] = 0.0  # to the last digit: at rest a controller may let go
    return rate


def delivered(values: dict, ch: Channels, second: ShaftMotion, take: np.ndarray | slice = slice(None)) -> np.ndarray:
    """Output torque: measured, or what the load takes for its motion; `take`: at which samples."""
    if ch.has("reducer.output_torque"):
        return ch.true("reducer.output_torque", values)[take]
    load = law("load", values, ch)

    def torque() -> np.ndarray:
        moves = second.angle[take], second.speed[take], second.acceleration[take]
        out = np.empty(len(moves[0]))
        ch.setting.kernels.load_torque(load, *moves, out)
        out.flags.writeable = False
        return out

    return kept("delivered", (second, load, isinstance(take, slice)), ch, torque)


@cache
def nothing(n: int) -> np.ndarray:
    """No torque at all samples, where none is asked for; not to be written to, as what is delivered else."""
    out = np.zeros(n)
    out.flags.writeable = False
    return out


def read(channel: str, x: np.ndarray, values: dict, ch: Channels) -> np.ndarray:
    """What the sensor of a compared channel makes of the simulated value; a lag below 0 is one in reversed time.

    x: at all samples, or at those that are taken.
    """
    if ch.sensor(channel, values) is None:
        return x
    whole = len(x) == len(ch.dt)
    return sensed(channel, x, ch.dt if whole else ch.taken_steps(), values, ch, None if whole else ch.gaps + 1)


def sensed(
    channel: str, x: np.ndarray, dt: np.ndarray, values: dict, ch: Channels, behind: np.ndarray | None = None
) -> np.ndarray:
    """What a channel's sensor makes of x, held over steps of dt; a lag below 0 is one in reversed time.

    behind: rows at which it begins anew.
    """
    p = ch.sensor(channel, values)
    if p is None:
        return x
    reverse = any(getattr(p, name) < 0.0 for name in lags())
    p = p._replace(**{name: abs(getattr(p, name)) for name in lags()})
    reading, begins = np.empty(len(x)), np.append(0, behind) if behind is not None else np.zeros(1, int)
    if reverse:
        begins = len(x) - np.append(begins[1:], len(x))[::-1]
        ch.setting.kernels.read_anew(p, x[::-1], np.append(dt[:1], dt[:0:-1]), begins, reading)
        return reading[::-1]
    ch.setting.kernels.read_anew(p, x, dt, begins, reading)
    return reading
