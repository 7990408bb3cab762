"""What each residual compares: simulated, measured and trusted samples of one run, from measured inputs and given values."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np

from selflock.fmus.motor.effects.supply_sag import supplied

from ..data.rig import DUAL, MOTOR
from ..data.signals import MOVES
from ..rules import RULES
from . import drive, laws, phase
from .channels import Channels, ShaftMotion, derivative, rate, smooth, window
from .recorder import written_step

Compared = tuple[np.ndarray, np.ndarray, np.ndarray]


def everywhere(n: int) -> np.ndarray:
    """Nothing but the channels' faults, of which Experiment.compare knows, keeps a sample from being trusted."""
    return np.ones(n, bool)


def controller(command: str, values: dict, ch: Channels) -> Compared:
    """The controller acts on what its sensors say, right or wrong."""
    shown = {name: value for name, value in values.items() if not name.startswith("sensor.")}
    first, second = drive.both(shown, ch)
    n = len(ch.dt)
    angle = ch.raw("load.angle") if ch.has("load.angle") else second.angle
    speed = ch.raw("load.speed") if ch.has("load.speed") else second.speed
    at, moves = ch.setting.rig.loop, ch.has("reducer.input_angle")
    if at == MOTOR and moves or at == DUAL and (moves or ch.has("reducer.input_speed")):
        ratio = ch.setting.value(f"{ch.prefix}reducer.gear_ratio", values)
        angle = angle if at == DUAL else ch.raw("reducer.input_angle") / ratio
        speed = ch.raw("reducer.input_speed") / ratio if ch.has("reducer.input_speed") else first.speed / ratio
    wanted = ch.true("controller.angle_setpoint", values)
    if not (ch.has("load.angle") or ch.has("reducer.input_angle")):
        # of a speed, from anywhere: it began where it was asked to be
        angle = angle + (wanted[0] - angle[0])
    rate = drive.speed_setpoint(wanted, values, ch)
    out = np.empty(n)
    motor_speed = ch.raw("reducer.input_speed") if ch.has("reducer.input_speed") else first.speed
    delivered = drive.delivered(values, ch, drive.both(values, ch)[1]) if (rate == 0.0).any() else drive.nothing(n)
    ch.setting.kernels.controller(
        drive.law("controller", values, ch), wanted, rate, angle, speed, motor_speed, delivered, ch.dt, out
    )
    given = ch.raw(command)
    return _in_steps(command, drive.read(command, out, values, ch), given, ch), given, everywhere(n)


def _in_steps(command: str, out: np.ndarray, given: np.ndarray, ch: Channels) -> np.ndarray:
    """A simulated command as its controller may have given it, which has nothing between two of its steps: the nearest to that logged.

    It may round to the nearest, down or to zero, so that it is within a step of what its law says, and no fault is.
    """
    step = written_step(command, ch)
    return out + np.clip(given - out, -step, step) if step > 0.0 else out


def motor(electric: str, values: dict, ch: Channels) -> Compared:
    """The current that the measured voltage and speed make."""
    current, _ = _driven(electric, values, ch, drive.input_shaft(values, ch))
    return drive.read("motor.current", current, values, ch), ch.raw("motor.current"), everywhere(len(ch.dt))


def _driven(electric: str, values: dict, ch: Channels, first: ShaftMotion) -> tuple[np.ndarray, np.ndarray]:
    """Current and torque of the motor at the speed of this motion, on its voltage."""
    sensors = ch.sensor(electric, values), ch.sensor("motor.supply_voltage", values)
    key, law = (first, values.get(drive.shift(electric, ch)), *sensors), drive.law("motor", values, ch)

    def driven() -> tuple[np.ndarray, np.ndarray]:
        further = getattr(ch.setting.kernels, "motor_further", None)
        if further and len(ch.dt) > RULES.residuals.motions_remembered and drive.shift(electric, ch) in values:
            return _in_pieces(law, electric, values, ch, first)
        voltage, speed, dt, parts = drive.kept("given", key, ch, lambda: _given(electric, values, ch, first))
        current, torque = np.empty(len(dt)), np.empty(len(dt))
        ch.setting.kernels.motor(law, voltage, speed, dt, current, torque)
        return current[::parts], torque[::parts]

    return drive.kept("driven", (law, *key), ch, driven)


def _given(electric: str, values: dict, ch: Channels, first: ShaftMotion) -> tuple[np.ndarray, np.ndarray, np.ndarray, int]:
    """Voltage and speed that the motor is given, the steps, s, for which it is, and how many of these are one of the log.

    The voltage is held from row to row where that is how it was given. A measured one is read between its rows as `values`
    say, and the speed goes straight there, in parts of a step.
    """
    voltage, late = drive.voltage(electric, values, ch), values.get(drive.shift(electric, ch))
    if late is None:
        return voltage, first.speed, ch.dt, 1
    return *_between(drive.between(voltage, ch.run.time, late), ch, first, 0, len(ch.dt)), RULES.residuals.motor_parts


def _between(
    voltage: Callable[[np.ndarray], np.ndarray], ch: Channels, first: ShaftMotion, begin: int, end: int
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Voltage and speed in parts of the steps of the rows from `begin` to `end`, and these parts, s."""
    time, parts = ch.run.time[begin:end], RULES.residuals.motor_parts
    rows = np.arange(begin * parts, (end - 1) * parts + 1) / parts
    fine = np.interp(rows, np.arange(begin, end), time)
    dt = np.diff(fine, prepend=fine[0] - ch.dt[begin] / parts)
    return voltage(fine + 0.5 * np.append(dt[1:], dt[-1])), np.interp(fine, time, first.speed[begin:end]), dt


def _in_pieces(law, electric: str, values: dict, ch: Channels, first: ShaftMotion) -> tuple[np.ndarray, np.ndarray]:
    """Current and torque, as of `_given` at once: the parts of an hour's steps would take a gigabyte."""
    n, size, parts = len(ch.dt), RULES.residuals.piece, RULES.residuals.motor_parts
    read = drive.between(drive.voltage(electric, values, ch), ch.run.time, values[drive.shift(electric, ch)])
    current, torque, state = np.empty(n), np.empty(n), np.full(4, np.nan)
    for begin in range(0, n - 1, size):
        end = min(begin + size + 1, n)
        voltage, speed, dt = _between(read, ch, first, begin, end)
        made = np.empty(len(dt)), np.empty(len(dt))
        ch.setting.kernels.motor_further(law, state, voltage, speed, dt, *made)
        if begin == 0:
            current[0], torque[0] = made[0][1], made[1][1]
        current[begin + 1 : end], torque[begin + 1 : end] = (x[parts::parts] for x in made)
    return current, torque


def supply(values: dict, ch: Channels) -> Compared:
    """The supply's voltage under the current that is drawn from it; the current is the measured one, where it is measured.

    Its voltage without load, and what that loses evenly over a run (a battery its charge), are nobody's fault.
    """
    law, voltage = drive.law("motor", values, ch), drive.voltage("controller.voltage", values, ch)
    if ch.has("motor.current"):
        current = ch.true("motor.current", values)
    else:
        current, _ = _driven("controller.voltage", values, ch, drive.both(values, ch)[0])
    name = "motor.supply_voltage"
    out, measured = drive.read(name, supplied(law, voltage, current), values, ch), ch.raw(name)
    return drive.level(out, measured, ch.good(name), ch.run.time), measured, everywhere(len(out))


def gear_inputs(values: dict, ch: Channels, take: np.ndarray | slice = slice(None)) -> tuple[tuple[np.ndarray, ...], ShaftMotion]:
    """What Reducer.fmu is given in kinematic mode, for each step of `take`, and the whole motion of its input shaft.

    The output angle is put where the shaft's spring, behind its play, carries the output torque.
    """
    first, second = drive.both(values, ch)
    law = drive.law("reducer", values, ch)
    delivered = drive.delivered(values, ch, second, take)

    def inputs() -> tuple[np.ndarray, ...]:
        speed = first.speed[take]
        before = first.angle[take] - speed * ch.dt[take]
        windup = np.empty(len(before))
        ch.setting.kernels.windup(law, before, delivered, windup)
        return before, speed, before / law.gear_ratio - windup, speed / law.gear_ratio

    winds = tuple(getattr(law, name) for name in laws.winding())
    loaded = drive.law("load", values, ch), ch.sensor("reducer.output_torque", values)
    return drive.kept("inputs", (first, second, winds, *loaded, isinstance(take, slice)), ch, inputs), first


def gear(torque: str, electric: str, values: dict, ch: Channels) -> Compared:
    """The balance at the motor's shaft: what the gear and the shaft's inertia take against what the motor gives.

    It is compared in what is measured: of a current, the one that the balance asks for. As a torque, a smaller torque
    constant would shrink what is measured and its error alike.
    The measured acceleration is that of a smoothed motion, so the rest of the balance is smoothed in the same way.
    """
    take = ch.take
    pick = ch.taken
    inputs, first = gear_inputs(values, ch, slice(None) if take is None else take)
    law = drive.law("reducer", values, ch)
    dt = ch.taken_steps()
    bare = np.empty(len(dt))
    ch.setting.kernels.gear(law, *inputs, dt, bare)
    del inputs  # of an hour a tenth of a gigabyte
    good = pick(first.sliding)
    if torque == "reducer.input_torque":
        return drive.read(torque, bare, values, ch), pick(ch.raw(torque)), good
    inertial = law.shaft_inertia * pick(first.acceleration)
    if torque == "motor.current":
        constant, beside = _motor_constants(values, ch, first)
        if np.ndim(constant):
            constant, beside = pick(constant), pick(beside)
        bare -= beside
        bare /= constant
        inertial /= constant
    if torque in ("motor.torque", "motor.current"):
        given = ch.raw(torque)
        bare = drive.read(torque, bare + inertial, values, ch) - inertial
    else:
        _, given = _driven(electric, values, ch, first)
    given = pick(given)
    if ch.steady:
        return bare, given, good
    samples = 0 if not ch.setting.balanced else min(ch.smoothing, len(bare) - 1 | 1)
    smoothed = smooth(given - bare, samples)
    if take is not None:
        good = good & ch.away_from_gaps(samples)
    return bare + inertial, bare + smoothed, good


def _motor_constants(values: dict, ch: Channels, first: ShaftMotion) -> tuple[Any, Any]:
    """Torque per current, N.m/A, as the measured current weakens it, and the motor's torque beside it, N.m; one number where it is one."""
    motor = drive.law("motor", values, ch)
    if laws.in_proportion(motor):
        return max(motor.torque_constant, 1e-9), 0.0

    def constants() -> tuple[np.ndarray, np.ndarray]:
        constant, beside = np.empty(len(ch.dt)), np.empty(len(ch.dt))
        current = ch.true("motor.current", values)
        ch.setting.kernels.shaft_torque(motor, current, first.speed, first.angle, ch.dt, constant, beside)
        return np.maximum(constant, 1e-9), beside

    felt = tuple(getattr(motor, name) for name in laws.driving())
    return drive.kept("constants", (first, felt, ch.sensor("motor.current", values)), ch, constants)


def load(values: dict, ch: Channels) -> Compared:
    """The torque that the load takes for its measured motion."""
    second = drive.shaft("load.", values, ch)
    assert second is not None, "compared where the load's motion is measured"
    out = np.empty(len(ch.dt))
    ch.setting.kernels.load_torque(drive.law("load", values, ch), second.angle, second.speed, second.acceleration, out)
    name = "reducer.output_torque"
    return drive.read(name, out, values, ch), ch.raw(name), everywhere(len(out))


def redundant(side: str, values: dict, ch: Channels) -> Compared:
    """A measured speed against the derivative of the measured angle of the same shaft, smoothed alike."""
    samples = ch.smoothing
    slope = rate(ch.true(side + "angle", values), np.cumsum(ch.dt), samples)
    name = side + "speed"
    good = everywhere(len(slope))
    good[:samples] = good[-samples:] = False  # the average has no neighbours there
    return drive.read(name, drive.differenced(name, slope, ch), values, ch), smooth(ch.raw(name), samples), good


def twist(values: dict, ch: Channels) -> Compared:
    """The angle of the load behind the gear's spring and play."""
    _, second = drive.both(values, ch)
    law = drive.law("reducer", values, ch)
    angle, windup = ch.true("reducer.input_angle", values), np.empty(len(ch.dt))
    ch.setting.kernels.windup(law, angle, drive.delivered(values, ch, second), windup)
    out = angle / law.gear_ratio - windup
    good = ch.good("reducer.input_angle") & ch.good("load.angle") & second.sliding & _pressed(ch)
    if good.any():  # where the encoders' zeros lie is nobody's fault
        out -= np.mean((out - ch.raw("load.angle"))[good])
    return drive.read("load.angle", out, values, ch), ch.raw("load.angle"), good


def shafts(name: str, values: dict, ch: Channels) -> Compared:
    """The speed of a shaft against the motion of the other through the ratio, and the rate of the gear's wind-up and play.

    The torque that winds it up comes from a motion that is smoothed; its rate needs more of it, and so has all else.
    While no flank is pressed for sure, how the shafts go through the play is no matter of one of them alone (the motor
    drives the one, its weight the other), but how far they get from flank to flank is: both speeds are averaged over all
    of such a stretch. Each of its n samples then has the mean's error, with 1 / n of their variance, so that together
    they weigh as much as the mean does.
    """
    first, second = drive.both(values, ch)
    law, samples, wide = drive.law("reducer", values, ch), ch.smoothing, _wide(ch)
    torque = drive.delivered(values, ch, second)
    if ch.has("reducer.output_torque"):
        torque = smooth(torque, samples)
    rate = derivative(_followed(law, torque, first.angle, ch), np.cumsum(ch.dt))
    out = first.speed / law.gear_ratio - rate if name == "load.speed" else (second.speed + rate) * law.gear_ratio
    good = ch.run.usable(*(ch.prefix + m for m in MOVES if ch.has(m))) & ~ch.run.behind_gaps
    reach = _reach(ch)
    good[:reach] = good[-reach:] = False  # the average has no neighbours there
    stretch = _stretches(values, ch)
    mean = lambda x: (np.bincount(stretch, x * ch.dt) / np.bincount(stretch, ch.dt))[stretch]
    simulated, measured = drive.read(name, drive.differenced(name, out, ch), values, ch), smooth(ch.raw(name), samples)
    return mean(smooth(simulated, wide)), mean(smooth(measured, wide)), mean(good) > 1.0 - 1e-9


def _wide(ch: Channels) -> int:
    """Samples over which speeds of both shafts are smoothed once more: the longest window that leaves a motion."""
    return window(RULES.residuals.longest_window, ch.dt)


def _reach(ch: Channels) -> int:
    """Samples to either side that both averages feel."""
    return (ch.smoothing + _wide(ch)) // 2 + 1


def _followed(law, torque: np.ndarray, angle: np.ndarray, ch: Channels) -> np.ndarray:
    """The wind-up that follows the output torque M behind the shaft's damper: M = k x + c x', a lag of c / k.

    Of the nominal damper: the smoothing leaves too little of so short a lag to ask for another.
    """
    damping = drive.law("reducer", {}, ch).shaft_damping
    wound, spring = np.empty(len(torque)), np.empty(2)
    ch.setting.kernels.windup(law, angle, torque, wound)
    ch.setting.kernels.windup(law, np.zeros(2), np.array([1.0, 2.0]), spring)  # on one flank: 1 / k is the difference
    followed = np.empty(len(torque))
    ch.setting.kernels.read(laws.no_sensor()._replace(lag_time=damping * (spring[1] - spring[0])), wound, ch.dt, followed)
    return followed


def _stretches(values: dict, ch: Channels) -> np.ndarray:
    """Numbers of the stretches of a run: one sample where a flank is pressed for sure, else as long as none is.

    By the nominal torque, so that what a fit tries changes no stretch, but for where the load hangs in a run that does
    not say it, in eighths of a radian.
    """
    hangs = {name: round(8.0 * v) / 8.0 for name, v in values.items() if name == phase.name(ch.run, ch.prefix + "load.arm_angle")}
    key = ("stretches", ch.smoothing, *hangs.values())
    if key not in ch.memory:
        torque = smooth(drive.delivered(hangs, ch, drive.both({}, ch)[1]), _wide(ch))
        pressed, reach = _on_a_flank(torque, _wide(ch)), _reach(ch)
        ahead = np.concatenate([pressed[reach:], np.repeat(pressed[-1:], min(reach, len(pressed)))])  # an average feels it before
        pressed = pressed & ahead
        new = pressed | np.concatenate([[True], pressed[:-1]])
        ch.memory[key] = np.cumsum(new) - 1
    return ch.memory[key]


def _pressed(ch: Channels) -> np.ndarray:
    """Where the nominal output torque presses one flank for sure."""
    key = ("pressed", ch.smoothing)
    if ch.whole and ch.run.within:
        return _pressed(ch.whole)[ch.run.within[1]]
    if key not in ch.memory:
        ch.memory[key] = _on_a_flank(drive.delivered({}, ch, drive.both({}, ch)[1]), ch.smoothing)
    return ch.memory[key]


def _on_a_flank(torque: np.ndarray, samples: int) -> np.ndarray:
    """Where a torque is far enough from zero to press one flank for sure, and has been for a while, in windows of `samples`."""
    rules = RULES.residuals
    side = np.sign(torque) * (abs(torque) > rules.pressed * np.quantile(abs(torque), rules.high_torque))
    steady = side != 0.0
    for shift in range(1, rules.pressed_windows * samples):
        steady[shift:] &= side[shift:] == side[:-shift]
    return steady
