"""The reducer's friction law with its effects, as coefficients that stand still over one inner step.

In direction s, with x = P s (P output torque, N.m) and |w| the speed of the input shaft, the input torque is

    F s = viscous |w| + drag + max(x driving, x backdriving, x / r + level)

which is wedge.py's law where viscous = drag = 0. Effects act on these coefficients through their hooks (see effects).
"""

import math
from typing import NamedTuple

from ..effect import METAL, Above, Parameter, join, parameters_type
from .effects import EFFECTS, HOOKS
from .wedge import backdriving_slope, driving_slope, preload_torque

INF = math.inf

BASE = (
    Parameter("gear_ratio", "", 50.0, 1e-6, 1e6, "r: input speed / output speed (1)", METAL),
    Parameter("wedge_angle", "rad", 0.0, 0.0, 1.5, "alpha; 0 stands for atan(1 / gear_ratio) (1); a worm's lead angle", METAL),
    Parameter("friction_kinetic", "", 0.03, 0.0, INF, "mu_k, coefficient while sliding (5), (13)"),
    Parameter(
        "friction_static",
        "",
        0.0,
        0.0,
        INF,
        "mu_s, coefficient at rest (6), (14); never less than friction_kinetic",
        above=Above("friction_kinetic", 1.0, "mu_s - mu_k"),
    ),
    Parameter("preload", "N.m", 0.0, 0.0, INF, "N0, force between the flanks without load, as torque at the input shaft (13)"),
    Parameter("shaft_inertia", "kg.m2", 2e-5, 0.0, INF, "J of the input shaft, the motor's rotor included"),
    Parameter("shaft_stiffness", "N.m/rad", 2e4, 0.0, INF, "k of the output shaft"),
    Parameter("shaft_damping", "N.m.s/rad", 2.0, 0.0, INF, "c of the output shaft, in parallel with its stiffness"),
)
Parameters = parameters_type(BASE, EFFECTS)


class Condition(NamedTuple):
    """What the reducer is in: the second argument of every hook."""

    direction: float  # s, +1.0 or -1.0: the direction of sliding that is asked about
    speed: float  # of the input shaft, rad/s
    angle: float  # of the input shaft, rad
    output_angle: float  # rad
    output_torque: float  # P, N.m
    time: float  # since the start, s
    heat: float  # what the losses have left in the reducer, J
    distance: float  # travelled by the input shaft, rad


class Friction(NamedTuple):
    """Coefficients of F s for one direction; see the module's text."""

    driving: float  # dF/dP while the load resists
    backdriving: float  # dF/dP while the load helps
    level: float  # of the preload, N.m
    drag: float  # N.m
    viscous: float  # N.m.s/rad


class Law(NamedTuple):
    """Coefficients of the reducer, for each direction, sliding and at rest."""

    forward: Friction
    backward: Friction
    hold_forward: Friction  # bounds of what rests
    hold_backward: Friction
    stiffness: float  # N.m/rad
    damping: float  # N.m.s/rad
    half_play: float  # rad at the output shaft
    torque: float  # on the input shaft beside F, N.m, positive against positive motion


active = join(EFFECTS, HOOKS, "active")
_dry = join(EFFECTS, HOOKS, "dry")
_viscosity = join(EFFECTS, HOOKS, "viscosity")
_kinetic = join(EFFECTS, HOOKS, "kinetic")
_static = join(EFFECTS, HOOKS, "static")
_driving = join(EFFECTS, HOOKS, "driving")
_backdriving = join(EFFECTS, HOOKS, "backdriving")
_drag = join(EFFECTS, HOOKS, "drag")
_viscous = join(EFFECTS, HOOKS, "viscous")
_compliance = join(EFFECTS, HOOKS, "compliance")
_play = join(EFFECTS, HOOKS, "play")
_torque = join(EFFECTS, HOOKS, "torque")


def static_coefficient(p):
    """mu_s, at least mu_k."""
    return max(p.friction_static, p.friction_kinetic)


def plain(p, t):
    """The published law: no effect, t = tan(alpha)."""
    moving = _friction(p.friction_kinetic, 0.0, 0.0, 0.0, 0.0, p.preload, t, p.gear_ratio)
    hold = _friction(static_coefficient(p), 0.0, 0.0, 0.0, 0.0, p.preload, t, p.gear_ratio)
    return Law(moving, moving, hold, hold, p.shaft_stiffness, p.shaft_damping, 0.0, 0.0)


class Slip(NamedTuple):
    """Coefficients of the reducer while it slides in one direction, as in Law."""

    friction: Friction
    stiffness: float  # N.m/rad
    half_play: float  # rad
    torque: float  # N.m


def extended(p, t, x, rate):
    """The law with its effects in condition x, whose output torque is found here from the rate of wind-up, rad/s."""
    stiffness, half_play, output_torque = _wound(p, x, rate)
    forward = _facing(x, 1.0, output_torque)
    ahead, hold_ahead = _affected(p, t, forward)
    back, hold_back = _affected(p, t, _facing(x, -1.0, output_torque))
    return Law(ahead, back, hold_ahead, hold_back, stiffness, p.shaft_damping, half_play, _torque(p, forward))


def sliding(p, t, x, rate):
    """Of `extended` what counts while the shaft slides in the direction of x: a quarter of the work."""
    stiffness, half_play, output_torque = _wound(p, x, rate)
    x = _facing(x, x.direction, output_torque)
    dry, drag, viscous = _around(p, x)
    mu = p.friction_kinetic + _kinetic(p, x)
    friction = _friction(mu * dry, _driving(p, x) * dry, _backdriving(p, x) * dry, drag, viscous, p.preload, t, p.gear_ratio)
    return Slip(friction, stiffness, half_play, _torque(p, _facing(x, 1.0, output_torque)))


def _wound(p, x, rate):
    """Stiffness, N.m/rad, half the play, rad, and the output torque, N.m."""
    stiffness = _stiffness(p, x)
    half_play = 0.5 * _play(p, x)
    windup = x.angle / p.gear_ratio - x.output_angle
    return stiffness, half_play, contact(stiffness, p.shaft_damping, half_play, windup, rate)[0]


def wound_up(p, x, side):
    """Wind-up, rad, at which the output shaft rests under the output torque of x, N.m: the inverse of `contact`.

    side: the flank that touches, +1.0 or -1.0 as the torque's sign; 0.0 the middle of the play.
    """
    return x.output_torque / _stiffness(p, x) + side * 0.5 * _play(p, x)


def flank(output_torque, side):
    """The flank that touches under this output torque, +1.0 or -1.0; without a torque `side`, the one that did before."""
    return math.copysign(1.0, output_torque) if output_torque != 0.0 else side


def _stiffness(p, x):
    softer = _compliance(p, x)
    return p.shaft_stiffness if softer == 0.0 else p.shaft_stiffness / (1.0 + p.shaft_stiffness * softer)


def _facing(x, s, output_torque):
    return Condition(s, x.speed, x.angle, x.output_angle, output_torque, x.time, x.heat, x.distance)


def _affected(p, t, x):
    """Friction in the direction of x, sliding and at rest."""
    dry, drag, viscous = _around(p, x)
    driving, backdriving = _driving(p, x) * dry, _backdriving(p, x) * dry
    moving = (p.friction_kinetic + _kinetic(p, x)) * dry
    hold = (static_coefficient(p) + _static(p, x)) * dry
    return (
        _friction(moving, driving, backdriving, drag, viscous, p.preload, t, p.gear_ratio),
        _friction(hold, driving, backdriving, drag, viscous, p.preload, t, p.gear_ratio),
    )


def _around(p, x):
    """The factor on dry friction, the drag, N.m, and the viscous friction, N.m.s/rad."""
    dry = max(_dry(p, x), 0.0)
    return dry, max(_drag(p, x) * dry, 0.0), max(_viscous(p, x) * _viscosity(p, x), 0.0)


def _friction(mu, driving, backdriving, drag, viscous, preload, t, ratio):
    """Coefficients from mu and what a resisting or helping load adds to it, with mu tan(alpha) held below 1."""
    most = 0.99 / t if driving != 0.0 or backdriving != 0.0 or mu * t >= 1.0 else INF
    return Friction(
        driving_slope(min(max(mu + driving, 0.0), most), t, ratio),
        backdriving_slope(min(max(mu + backdriving, 0.0), most), t, ratio),
        preload_torque(mu, preload, t),
        drag,
        viscous,
    )


def friction_at(friction, output_torque, s, speed, ratio):
    """F at output torque P while sliding in direction s, N.m, without the torque beside it."""
    x = output_torque * s
    by_load = x * (friction.driving if x > 0.0 else friction.backdriving)
    return s * (max(by_load, x / ratio + friction.level) + friction.drag + friction.viscous * abs(speed))


def contact(stiffness, damping, half_play, windup, rate):
    """Output torque, N.m, the wind-up at which it would vanish at rest, rad, and 1.0 where the flanks touch, else 0.0.

    P = k (windup - edge) + c rate, which in a gear with play cannot pull: then it is 0.
    """
    if half_play == 0.0:
        return stiffness * windup + damping * rate, 0.0, 1.0
    side = 1.0 if windup > 0.0 else -1.0
    edge = side * half_play
    output_torque = stiffness * (windup - edge) + damping * rate
    if side * windup >= half_play and (side * output_torque > 0.0 or (output_torque == 0.0 and side * rate > 0.0)):
        return output_torque, edge, 1.0
    return 0.0, edge, 0.0
