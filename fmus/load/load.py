"""A load on a bench: a rotor with a mass on an arm, driven by a torque.

    (J + m d^2) w' = M - m g d cos(angle + arm_angle + tilt) - b w - M_c        angle' = w

J inertia about the axis without the mass, m mass at the distance d, b viscous damping, M_c a constant torque such as
that of a weight on a drum. Angle 0 with arm_angle 0 is the arm pointing forward (horizontal); gravity then pulls it
back with m g d. Torques are positive in the direction of positive angle.

The driving torque M is held over a step. The step is cut into equal parts for the classical Runge-Kutta method,
short against the pendulum's and the damper's own times, so that its error stays below 1e-8 of the motion per second.

Where these would be more than FEW, the damper is solved exactly (an exponential), so that its own time cuts nothing:
without gravity in one part, with it by the exponential Runge-Kutta method of fourth order (S. M. Cox, P. C. Matthews,
Exponential time differencing for stiff systems, J. Comput. Phys. 176, 2002), whose parts are short against the motion
that is left: short while the damper takes the speed away, longer after. More than MOST parts are never made: the
result is NaN then. Plain functions on floats.
"""

from math import ceil, cos, exp, expm1, inf, nan, sqrt
from typing import NamedTuple

from ..effect import CONSTANT, Parameter, join, parameters_type
from .effects import EFFECTS, HOOKS

BASE = (
    Parameter("inertia", "kg.m2", 0.1, 0.0, inf, "inertia J about the axis, without the mass on the arm"),
    Parameter("mass", "kg", 0.0, 0.0, inf, "mass m on the arm"),
    Parameter("arm", "m", 0.2, 0.0, inf, "distance d of the mass from the axis"),
    Parameter("arm_angle", "rad", 0.0, -inf, inf, "angle of the arm against horizontal at angle 0"),
    Parameter("damping", "N.m.s/rad", 0.0, 0.0, inf, "viscous damping b", of_drive=10.0),
    Parameter("constant_torque", "N.m", 0.0, -inf, inf, "constant torque M_c against positive motion", of_drive=2.0),
    Parameter("gravity", "m/s2", 9.81, 0.0, inf, "acceleration of gravity g", CONSTANT),
    Parameter("start_angle", "rad", 0.0, -inf, inf, "angle at the start"),
    Parameter("start_speed", "rad/s", 0.0, -inf, inf, "speed at the start"),
)
Parameters = parameters_type(BASE, EFFECTS)

PART = 0.05  # longest part of a step, in units of the load's shortest own time
FEW = 200  # parts beyond which the damper is solved exactly
LAYER = 25.0  # time that a damper is given to take a speed away, in units of its own: 1e-11 is left
LAYER_PART = 0.25  # longest part of that time, in the same units
MOST = 10000  # parts of a step; a step that needs more has no result


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
    pulled = weight * cos(angle + lean) if weight != 0.0 else 0.0  # the cosine is a tenth of a simulated step of a whole drive
    return pulled + p.damping * speed + p.constant_torque


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
    parts = dt * rate / PART
    if not parts <= FEW:
        angle, speed = _eased(inertia, weight, lean, p.damping, torque - p.constant_torque, angle, speed, dt)
        load = opposing_torque(p, weight, lean, angle, speed)
        return State(angle, speed), Output(angle, speed, (torque - load) / inertia, load)
    parts = max(1.0, ceil(parts))
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


def needed(inertia, weight, damping, net, speed, dt):
    """How many parts of dt, s, gravity asks for beside a damper that is solved exactly, and 1.0 without gravity.

    A part is PART of gravity's own time against inertia and damper, and turns no further than PART rad; `net` is the
    torque beside gravity, N.m.
    """
    if weight == 0.0:
        return 1.0
    own, gained = sqrt(abs(weight) / inertia), abs(net) / inertia * dt
    if damping > 0.0:
        own, gained = min(own, abs(weight) / damping), min(gained, abs(net) / damping)
    return max(1.0, dt * max(own, abs(speed) + gained) / PART)


def _eased(inertia, weight, lean, damping, net, angle, speed, dt):
    """Angle and speed after dt with the damper solved exactly, first while it takes the speed away, then the rest."""
    rate = damping / inertia
    layer = LAYER / rate if weight != 0.0 and rate > 0.0 else dt
    if layer >= dt:
        return _zone(inertia, weight, lean, damping, net, angle, speed, dt, rate * dt / LAYER_PART)
    angle, speed = _zone(inertia, weight, lean, damping, net, angle, speed, layer, LAYER / LAYER_PART)
    return _zone(inertia, weight, lean, damping, net, angle, speed, dt - layer, 1.0)


def _zone(inertia, weight, lean, damping, net, angle, speed, dt, least):
    """Angle and speed after dt in equal parts: as many as gravity needs, and with gravity at least so many."""
    parts = needed(inertia, weight, damping, net, speed, dt)
    if weight != 0.0:
        parts = max(parts, least)
    if not parts <= 0.5 * MOST:  # of two zones
        return nan, nan
    parts = max(1.0, ceil(parts))
    h = dt / parts
    z = -damping / inertia * h
    fade, f1, f2, f3, f4 = _phi(z)
    half_fade, g1, g2, _, _ = _phi(0.5 * z)
    s, q = 0.5 * h * g1, 0.25 * h * h * g2  # what a speed and an acceleration move in half a part
    n = 0.0
    while n < parts:
        a0 = (net - weight * cos(angle + lean)) / inertia
        x1, v1 = angle + s * speed + q * a0, half_fade * speed + s * a0
        a1 = (net - weight * cos(x1 + lean)) / inertia
        a2 = (net - weight * cos(angle + s * speed + q * a1 + lean)) / inertia
        a3 = (net - weight * cos(x1 + s * v1 + q * (2.0 * a2 - a0) + lean)) / inertia
        a12 = 2.0 * (a1 + a2)
        moved = (f2 - 3.0 * f3 + 4.0 * f4) * a0 + (f3 - 2.0 * f4) * a12 + (4.0 * f4 - f3) * a3
        gained = (f1 - 3.0 * f2 + 4.0 * f3) * a0 + (f2 - 2.0 * f3) * a12 + (4.0 * f3 - f2) * a3
        angle += h * (f1 * speed + h * moved)
        speed = fade * speed + h * gained
        n += 1.0
    return angle, speed


def _phi(z):
    """e^z and the functions phi_1 to phi_4 of z <= 0: phi_0 = e^z, phi_k+1 = (phi_k - 1/k!) / z, all 1/k! at 0."""
    if z < -1.0:
        f1 = expm1(z) / z
        f2 = (f1 - 1.0) / z
        f3 = (f2 - 0.5) / z
        return exp(z), f1, f2, f3, (f3 - 1.0 / 6.0) / z
    f4 = 1.0
    for k in range(20, 4, -1):
        f4 = 1.0 + f4 * z / k
    f4 /= 24.0
    f3 = 1.0 / 6.0 + z * f4
    f2 = 0.5 + z * f3
    return exp(z), 1.0 + z * f2, f2, f3, f4
