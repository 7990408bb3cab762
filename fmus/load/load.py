"""A load on a bench: a rotor with a mass on an arm, driven by a torque.

    (J + m d^2) w' = M - m g d cos(angle + arm_angle + tilt) - b w - M_c        angle' = w

J inertia about the axis without the mass, m mass at the distance d, b viscous damping, M_c a constant torque such as
that of a weight on a drum. Angle 0 with arm_angle 0 is the arm pointing forward (horizontal); gravity then pulls it
back with m g d. Torques are positive in the direction of positive angle.

The driving torque M is held over a step. The step is cut into equal parts for the classical Runge-Kutta method,
short against the pendulum's and the damper's own times, so that its error stays below 1e-8 of the motion per second.
Plain functions on floats.
"""

from math import ceil, cos, inf, sqrt
from typing import NamedTuple

from ..effect import CONSTANT, Parameter, join, parameters_type
from .effects import EFFECTS, HOOKS

BASE = (
    Parameter("inertia", "kg.m2", 0.1, 0.0, inf, "inertia J about the axis, without the mass on the arm"),
    Parameter("mass", "kg", 0.0, 0.0, inf, "mass m on the arm"),
    Parameter("arm", "m", 0.2, 0.0, inf, "distance d of the mass from the axis"),
    Parameter("arm_angle", "rad", 0.0, -inf, inf, "angle of the arm against horizontal at angle 0"),
    Parameter("damping", "N.m.s/rad", 0.0, 0.0, inf, "viscous damping b"),
    Parameter("constant_torque", "N.m", 0.0, -inf, inf, "constant torque M_c against positive motion"),
    Parameter("gravity", "m/s2", 9.81, 0.0, inf, "acceleration of gravity g", CONSTANT),
    Parameter("start_angle", "rad", 0.0, -inf, inf, "angle at the start"),
    Parameter("start_speed", "rad/s", 0.0, -inf, inf, "speed at the start"),
)
Parameters = parameters_type(BASE, EFFECTS)

PART = 0.05  # longest part of a step, in units of the load's shortest own time


class State(NamedTuple):
    angle: float  # rad
    speed: float  # rad/s


class Output(NamedTuple):
    angle: float  # rad
    speed: float  # rad/s
    acceleration: float  # rad/s2
    load_torque: float  # N.m, what gravity, damping and the constant torque oppose to positive motion


added_mass = join(EFFECTS, HOOKS, "mass")
added_arm = join(EFFECTS, HOOKS, "arm")
added_inertia = join(EFFECTS, HOOKS, "inertia")
tilt = join(EFFECTS, HOOKS, "tilt")


def moment_of_inertia(p, s):
    """J + m d^2 about the axis, kg.m2."""
    arm = p.arm + added_arm(p, s)
    return p.inertia + added_inertia(p, s) + (p.mass + added_mass(p, s)) * arm * arm


def gravity_moment(p, s):
    """m g d: the most that gravity pulls, N.m."""
    return (p.mass + added_mass(p, s)) * p.gravity * (p.arm + added_arm(p, s))


def opposing_torque(p, weight, lean, angle, speed):
    """What gravity (m g d = `weight`, N.m), damping and the constant torque oppose to positive motion, N.m."""
    return weight * cos(angle + lean) + p.damping * speed + p.constant_torque


def driving_torque(p, s, acceleration):
    """The inverse: the torque M that gives the load in state s this acceleration, rad/s2, N.m."""
    load = opposing_torque(p, gravity_moment(p, s), p.arm_angle + tilt(p, s), s.angle, s.speed)
    return moment_of_inertia(p, s) * acceleration + load


def start(p):
    return State(p.start_angle, p.start_speed)


def advance(p, s, torque, dt):
    """A step of dt >= 0 with held torque (N.m)."""
    inertia, weight, lean = moment_of_inertia(p, s), gravity_moment(p, s), p.arm_angle + tilt(p, s)
    angle, speed = s.angle, s.speed
    rate = max(sqrt(abs(weight) / inertia), p.damping / inertia)
    if weight != 0.0:
        rate = max(rate, abs(speed) + abs(torque - p.constant_torque) / inertia * dt)
    parts = max(1.0, ceil(dt * rate / PART))
    h = dt / parts
    n = 0.0
    while n < parts and dt > 0.0:
        net = torque - p.constant_torque
        a1 = (net - weight * cos(angle + lean) - p.damping * speed) / inertia
        v2 = speed + 0.5 * h * a1
        a2 = (net - weight * cos(angle + 0.5 * h * speed + lean) - p.damping * v2) / inertia
        v3 = speed + 0.5 * h * a2
        a3 = (net - weight * cos(angle + 0.5 * h * v2 + lean) - p.damping * v3) / inertia
        v4 = speed + h * a3
        a4 = (net - weight * cos(angle + h * v3 + lean) - p.damping * v4) / inertia
        angle += h * (speed + 2.0 * v2 + 2.0 * v3 + v4) / 6.0
        speed += h * (a1 + 2.0 * a2 + 2.0 * a3 + a4) / 6.0
        n += 1.0
    load = opposing_torque(p, weight, lean, angle, speed)
    return State(angle, speed), Output(angle, speed, (torque - load) / inertia, load)
