"""Controller, eq 21 and 22 of the study, and its rule for holding still.

    U = k_phi (phi_D - phi) + k_w (w_D - w)     (21)     limited to [U_min, U_max]     (22)

The study prints (phi - phi_D) and (w - w_D), which is stabilising for negative gains only; here gains are positive.
phi and w are angle and speed of what the gear drives.

Holding still (section 2.3): while the motor is stopped and w_D is 0, the voltage goes from that of (22) to the hold
voltage, linearly within the release time; (22) is back as soon as w_D differs from 0. Once letting go has begun it
goes on even if the gear yields a little while the load changes: else it would begin anew with every such move.
With an irreversible gear the hold voltage is 0. With a reversible one it is the least that keeps the gear at rest,

    U_hold = R / K_m F,     F the input torque of least magnitude in the friction cone of the load torque P

(R/K_m from (16), (17) at rest; the cone is the reducer's own, fmus.reducer.wedge), moved into the cone by a small
share of its width so that the gear does not lie on the very edge of slipping. Without static friction the cone has no
width under any load, nothing can be released, and (22) stays.

The voltage at the end of a step is that of the inputs given for the step. Plain functions on floats.
"""

from math import floor, inf
from typing import NamedTuple

from ..effect import METAL, SWITCH, Parameter, join, parameters_type
from ..reducer.wedge import cone, least_torque, wedge_tangent
from .effects import EFFECTS, HOOKS

BASE = (
    Parameter("angle_gain", "V/rad", 400.0, 0.0, inf, "k_phi: voltage per angle error"),
    Parameter("speed_gain", "V.s/rad", 20.0, 0.0, inf, "k_w: voltage per speed error"),
    Parameter("voltage_min", "V", -24.0, -inf, inf, "least voltage U_min"),
    Parameter("voltage_max", "V", 24.0, -inf, inf, "greatest voltage U_max"),
    Parameter("irreversible", "", 1.0, 0.0, 1.0, "true: the gear locks itself, the hold voltage is 0", SWITCH),
    Parameter("release_time", "s", 0.3, 0.0, inf, "time in which the voltage goes to the hold voltage at rest"),
    Parameter("stop_speed", "rad/s", 0.005, 0.0, inf, "output side: the motor counts as stopped up to gear_ratio times this"),
    Parameter("hold_margin", "", 0.02, 0.0, 0.5, "how far inside the friction cone the hold torque lies, share of its width"),
    Parameter("gear_ratio", "", 50.0, 1e-6, inf, "r of the gear, for the hold torque", METAL),
    Parameter("wedge_angle", "rad", 0.0, 0.0, 1.57, "wedge angle of the gear, for the hold torque; 0: atan(1/r)", METAL),
    Parameter("friction_static", "", 0.0, 0.0, inf, "mu_s of the gear, for the hold torque"),
    Parameter("preload", "N.m", 0.0, 0.0, inf, "N_0 of the gear, for the hold torque"),
    Parameter("resistance", "Ohm", 0.6, 0.0, inf, "R of the motor, for the hold voltage"),
    Parameter("torque_constant", "N.m/A", 0.03, 1e-9, inf, "K_m of the motor, for the hold voltage"),
)
Parameters = parameters_type(BASE, EFFECTS)

SLOTS = 8.0  # parts into which the delay is cut; the command is straight between them


class State(NamedTuple):
    command: float  # V, what the controller computed last
    resting: float  # s, since the motor stopped with w_D = 0, up to the release time; 0 while w_D differs from 0
    effects: float  # above 0: some effect acts; the rest is followed then only
    since: float  # s, time since the last sample
    age: float  # s, time since the newest slot of the delay line
    past0: float  # V, the delay line: the command delay/8 apart, newest first
    past1: float
    past2: float
    past3: float
    past4: float
    past5: float
    past6: float
    past7: float
    past8: float


class Output(NamedTuple):
    voltage: float  # V


class Condition(NamedTuple):
    """What an effect's hook sees."""

    command: float  # V, eq 21


active = join(EFFECTS, HOOKS, "active")
lost_command = join(EFFECTS, HOOKS, "lost")
limit_factor = join(EFFECTS, HOOKS, "limits")
sample_period = join(EFFECTS, HOOKS, "period")
command_delay = join(EFFECTS, HOOKS, "delay")


def feedback(p, effects, angle_setpoint, speed_setpoint, angle, speed):
    """U of eq 21 and 22, V; what a power stage loses of it is lost at the limits, too."""
    command = p.angle_gain * (angle_setpoint - angle) + p.speed_gain * (speed_setpoint - speed)
    if effects > 0.0:
        factor = limit_factor(p, Condition(command))
        command = min(max(command, factor * p.voltage_min), factor * p.voltage_max)
        return command - lost_command(p, Condition(command))
    return min(max(command, p.voltage_min), p.voltage_max)


def hold_torque(p, output_torque):
    """(F, width): input torque that keeps a reversible gear at rest, and the width of the friction cone, N.m."""
    t = wedge_tangent(p.gear_ratio, p.wedge_angle)
    low, high = cone(output_torque, p.friction_static, p.preload, t, p.gear_ratio)
    least = least_torque(low, high)
    inside = p.hold_margin * (high - low)
    if least > 0.0:
        least += inside
    elif least < 0.0:
        least -= inside
    return least, high - low


def voltage_at_rest(p, demand, resting, output_torque):
    """The voltage on its way from (22), `demand`, to the hold voltage, V."""
    if resting <= 0.0:
        return demand
    share = max(0.0, 1.0 - resting / p.release_time) if p.release_time > 0.0 else 0.0
    hold = 0.0
    if p.irreversible == 0.0:
        if p.friction_static <= 0.0:  # not where the cone has no width: without load it has none, and the hold torque is 0
            return demand
        torque, _ = hold_torque(p, output_torque)
        hold = min(max(p.resistance / p.torque_constant * torque, p.voltage_min), p.voltage_max)
    return hold + (demand - hold) * share


def start(p, angle_setpoint, speed_setpoint, angle, speed, motor_speed, output_torque):
    """The first sample; before the start the command was the same."""
    effects = active(p, Condition(0.0))
    u = feedback(p, effects, angle_setpoint, speed_setpoint, angle, speed)
    return State(u, 0.0, effects, 0.0, 0.0, u, u, u, u, u, u, u, u, u)


def after(s, since):
    """The state of a controller that took its last sample so long before, s."""
    line = s.past0, s.past1, s.past2, s.past3, s.past4, s.past5, s.past6, s.past7, s.past8
    return State(s.command, s.resting, s.effects, since, s.age, *line)


def moved(line, before, after, slot, dt):
    """The delay line (age, newest ... oldest) after dt, in which the command went straight from before to after."""
    age, a, b, c, d, e, f, g, h, i = line
    count = floor((age + dt) / slot)
    left = min(count - 1.0, SLOTS)  # older slots fall out of the line at once; counted down, for count may be beyond 2^53
    while left >= 0.0:
        share = ((count - left) * slot - age) / dt
        a, b, c, d, e, f, g, h, i = before + (after - before) * share, a, b, c, d, e, f, g, h
        left -= 1.0
    return min(max(age + dt - count * slot, 0.0), slot), a, b, c, d, e, f, g, h, i


def advance(p, s, angle_setpoint, speed_setpoint, angle, speed, motor_speed, output_torque, dt):
    """A step of dt >= 0; angles in rad, speeds in rad/s, output_torque in N.m."""
    stopped = abs(motor_speed) <= p.stop_speed * p.gear_ratio and abs(speed) <= p.stop_speed
    resting = 0.0
    if speed_setpoint == 0.0 and (stopped or s.resting > 0.0):
        resting = min(s.resting + dt, max(p.release_time, dt))
    command = feedback(p, s.effects, angle_setpoint, speed_setpoint, angle, speed)
    command = voltage_at_rest(p, command, resting, output_torque)
    if s.effects > 0.0:
        return acted(p, s, command, resting, dt)
    if resting != s.resting:
        s = State(
            command, resting, 0.0, s.since, s.age, s.past0, s.past1, s.past2, s.past3, s.past4, s.past5, s.past6, s.past7, s.past8
        )
    return s, Output(command)


def asked(p, s, angle_setpoint, speed_setpoint, angle, speed, output_torque):
    """The voltage of eq 21, 22 and at rest of a controller in state s, whatever effects make of it: what one writes that has a power stage behind it."""
    command = feedback(p, 0.0, angle_setpoint, speed_setpoint, angle, speed)
    return voltage_at_rest(p, command, s.resting, output_torque)


def acted(p, s, command, resting, dt):
    """State and output with sampling and delay."""
    x = Condition(command)
    period, since = sample_period(p, x), s.since + dt
    if period > 0.0:
        passed = floor(since / period + 1e-9)
        if passed < 1.0:
            command = s.command
        since = max(since - passed * period, 0.0)
    delay = command_delay(p, x)
    line, voltage = (s.age, s.past0, s.past1, s.past2, s.past3, s.past4, s.past5, s.past6, s.past7, s.past8), command
    if delay > 0.0:
        line = moved(line, s.command, command, delay / SLOTS, dt)
        voltage = line[9] + (line[8] - line[9]) * line[0] / (delay / SLOTS)
    return State(command, resting, s.effects, since, *line), Output(voltage)
