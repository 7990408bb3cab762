"""What each residual compares: simulated, measured and trusted samples of one run, from measured inputs and given values."""

from __future__ import annotations

import numpy as np

from ..rules import RULES
from . import drive
from .channels import Channels, ShaftMotion, derivative, smooth

Compared = tuple[np.ndarray, np.ndarray, np.ndarray]


def everywhere(n: int) -> np.ndarray:
    """Nothing but the channels' faults, of which Experiment.compare knows, keeps a sample from being trusted."""
    return np.ones(n, bool)


def controller(command: str, values: dict, ch: Channels) -> Compared:
    """The controller acts on what its sensors say, right or wrong."""
    shown = {name: value for name, value in values.items() if not name.startswith("sensor.")}
    first, second = drive.both(shown, ch)
    _, moved = drive.both(values, ch)
    n = len(ch.dt)
    angle = ch.raw("load.angle") if ch.has("load.angle") else second.angle
    speed = ch.raw("load.speed") if ch.has("load.speed") else second.speed
    wanted = ch.true("controller.angle_setpoint", values)
    rate = drive.speed_setpoint(wanted, values, ch)
    out = np.empty(n)
    motor_speed = ch.raw("reducer.input_speed") if ch.has("reducer.input_speed") else first.speed
    delivered = drive.delivered(values, ch, moved)
    ch.setting.kernels.controller(
        drive.law("controller", values, ch), wanted, rate, angle, speed, motor_speed, delivered, ch.dt, out
    )
    return drive.read(command, out, values, ch), ch.raw(command), everywhere(n)


def motor(electric: str, values: dict, ch: Channels) -> Compared:
    """The current that the measured voltage and speed make."""
    first, _ = drive.both(values, ch)
    voltage = drive.voltage(electric, values, ch)
    current, torque = np.empty(len(ch.dt)), np.empty(len(ch.dt))
    ch.setting.kernels.motor(drive.law("motor", values, ch), voltage, first.speed, ch.dt, current, torque)
    return drive.read("motor.current", current, values, ch), ch.raw("motor.current"), everywhere(len(ch.dt))


def gear_inputs(values: dict, ch: Channels, take: np.ndarray | slice = slice(None)) -> tuple[tuple[np.ndarray, ...], ShaftMotion]:
    """What Reducer.fmu is given in kinematic mode, for each step of `take`, and the whole motion of its input shaft.

    The output angle is put where the shaft's spring, behind its play, carries the output torque.
    """
    first, second = drive.both(values, ch)
    law = drive.law("reducer", values, ch)
    delivered = drive.delivered(values, ch, second, take)
    speed = first.speed[take]
    before = first.angle[take] - speed * ch.dt[take]
    windup = np.empty(len(before))
    ch.setting.kernels.windup(law, before, delivered, windup)
    return (before, speed, before / law.gear_ratio - windup, speed / law.gear_ratio), first


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
    good = pick(first.sliding)
    if torque == "reducer.input_torque":
        return drive.read(torque, bare, values, ch), pick(ch.raw(torque)), good
    inertial = law.shaft_inertia * pick(first.acceleration)
    if torque == "motor.current":
        constant, beside = map(pick, _motor_constants(values, ch, first))
        bare, inertial = (bare - beside) / constant, inertial / constant
    if torque in ("motor.torque", "motor.current"):
        given = ch.raw(torque)
        bare = drive.read(torque, bare + inertial, values, ch) - inertial
    else:
        given = np.empty(len(ch.dt))
        voltage = drive.voltage(electric, values, ch)
        ch.setting.kernels.motor(drive.law("motor", values, ch), voltage, first.speed, ch.dt, np.empty(len(ch.dt)), given)
    given = pick(given)
    if ch.steady:
        return bare, given, good
    samples = 0 if not ch.setting.balanced else min(ch.smoothing, len(bare) - 1 | 1)
    smoothed = smooth(given - bare, samples)
    if take is not None:
        good = good & ch.away_from_gaps(samples)
    return bare + inertial, bare + smoothed, good


def _motor_constants(values: dict, ch: Channels, first: ShaftMotion) -> tuple[np.ndarray, np.ndarray]:
    """Torque per current, N.m/A, as the measured current weakens it, and the motor's torque beside it, N.m."""
    constant, beside = np.empty(len(ch.dt)), np.empty(len(ch.dt))
    current = ch.true("motor.current", values)
    ch.setting.kernels.shaft_torque(drive.law("motor", values, ch), current, first.speed, first.angle, ch.dt, constant, beside)
    return np.maximum(constant, 1e-9), beside


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
    slope = derivative(smooth(ch.true(side + "angle", values), samples), np.cumsum(ch.dt))
    name = side + "speed"
    good = everywhere(len(slope))
    good[:samples] = good[-samples:] = False  # the average has no neighbours there
    return drive.read(name, slope, values, ch), smooth(ch.raw(name), samples), good


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


def _pressed(ch: Channels) -> np.ndarray:
    """Where the nominal output torque is far enough from zero to press one flank for sure, and has been for a while."""
    key, rules = ("pressed", ch.smoothing), RULES.residuals
    if key not in ch.memory:
        torque = drive.delivered({}, ch, drive.both({}, ch)[1])
        side = np.sign(torque) * (abs(torque) > rules.pressed * np.quantile(abs(torque), rules.high_torque))
        steady = side != 0.0
        for shift in range(1, rules.pressed_windows * ch.smoothing):
            steady[shift:] &= side[shift:] == side[:-shift]
        ch.memory[key] = steady
    return ch.memory[key]
