"""The reducer as a wedge with Coulomb friction: equations 1 to 14 of the published study, and what follows from them.

F  input torque, N.m: what drives the input shaft, positive in the direction of positive input angle
P  output torque, N.m: what the gear delivers to what it drives, positive when the load resists positive motion
N  normal force, T tangent (friction) force in the wedge, N.m (torques at the input shaft's radius)
s  direction of sliding of the input shaft, +1.0 or -1.0
t  tan(alpha), alpha the wedge angle;  mu friction coefficient, phi = atan(mu);  r gear ratio

Input and output act at different radii, so alpha is a number of its own: a worm's lead angle is not atan(1/r).
Equations 2 to 8 are written for forces at the wedge. With motion in the ratio r, a frictionless gear gives F = P/r
(what goes in comes out), so the force at the wedge is P' = lever P with lever = 1/(r t), which is 1 when t = 1/r.

Sliding, equations 2, 3 and 13 have one solution for each P. With x = P s they are the largest of three lines,

    F s = max( x lever tan(alpha + phi),  x lever tan(alpha - phi),  x / r + mu N0 sqrt(1 + t^2) )
          the load resists (|N| > N0)     the load helps (|N| > N0)  preload holds both flanks (|N| < N0)

The slopes rise from the second over the third to the first, so the largest is convex and continuous in P, P -> F is
single-valued for every mu t < 1, and the lines meet where |N| = N0: with |N| = N0 in (13) each pair is the same.
At rest, (7), (8) and (14) bound y = F - P/r likewise: F is admissible between the sliding torques of the two
directions, taken with the static coefficient. So one function tells all: `sliding_torque`.

Functions of floats alone: they run as they are in an FMU, and compiled in the diagnosis.
"""

import math


def wedge_tangent(gear_ratio, wedge_angle):
    """t = tan(alpha); wedge angle 0 rad stands for alpha = atan(1/r) (1)."""
    return 1.0 / gear_ratio if wedge_angle == 0.0 else math.tan(wedge_angle)


def input_force(normal, tangent, t):
    """F = N sin(alpha) + T cos(alpha) (2)."""
    return (normal * t + tangent) / math.sqrt(1.0 + t * t)


def output_force(normal, tangent, t):
    """P' = N cos(alpha) - T sin(alpha) (3)."""
    return (normal - tangent * t) / math.sqrt(1.0 + t * t)


def normal_force(force_in, force_out, t):
    """N = P' cos(alpha) + F sin(alpha) (4)."""
    return (force_out + force_in * t) / math.sqrt(1.0 + t * t)


def tangent_force(force_in, force_out, t):
    """T = F cos(alpha) - P' sin(alpha) (7)."""
    return (force_in - force_out * t) / math.sqrt(1.0 + t * t)


def friction_limit(mu, normal, preload):
    """Largest friction force mu max(N0, |N|): kinetic times s (13), which is (5) at N0 = 0; static (14), which is (6)."""
    return mu * max(preload, abs(normal))


def static_friction(force_in, force_out, mu, preload, t):
    """Friction force at zero speed (8): what balances, as far as friction reaches."""
    limit = friction_limit(mu, normal_force(force_in, force_out, t), preload)
    return min(max(tangent_force(force_in, force_out, t), -limit), limit)


def driving_slope(mu, t, ratio):
    """dF/dP while the load resists: lever tan(alpha + phi) = (t + mu) / (r t (1 - mu t)); needs mu t < 1."""
    return (t + mu) / (1.0 - mu * t) / (ratio * t)


def backdriving_slope(mu, t, ratio):
    """dF/dP while the load helps: lever tan(alpha - phi) = (t - mu) / (r t (1 + mu t)); negative when self-locking."""
    return (t - mu) / (1.0 + mu * t) / (ratio * t)


def preload_torque(mu, preload, t):
    """Friction torque at the input shaft with both flanks loaded: mu N0 / cos(alpha), N.m."""
    return mu * preload * math.sqrt(1.0 + t * t)


def sliding_torque(output_torque, s, mu, preload, t, ratio):
    """Input torque F while sliding in direction s under output torque P, N.m: (2), (3) and (13) solved."""
    x = output_torque * s
    by_load = x * (driving_slope(mu, t, ratio) if x > 0.0 else backdriving_slope(mu, t, ratio))
    return s * max(by_load, x / ratio + preload_torque(mu, preload, t))


def cone(output_torque, mu, preload, t, ratio):
    """Least and greatest input torque F under which the gear rests at output torque P, N.m: (7), (8), (14) solved."""
    level = preload_torque(mu, preload, t)
    return cone_of(output_torque, driving_slope(mu, t, ratio), backdriving_slope(mu, t, ratio), level, ratio)


def cone_of(output_torque, driving, backdriving, level, ratio):
    """The cone from the slopes of F and the friction of the preload: the `sliding_torque` of either direction."""
    forward, backward = output_torque / ratio + level, output_torque / ratio - level
    if output_torque > 0.0:
        return min(output_torque * backdriving, backward), max(output_torque * driving, forward)
    return min(output_torque * driving, backward), max(output_torque * backdriving, forward)


def least_torque(low, high):
    """The admissible input torque of smallest magnitude, zero where zero is admissible (section 3.2 of the study)."""
    return max(low, min(high, 0.0))


def driving_efficiency(mu, t):
    """P w_out / (F w_in) while the load resists, (1 - mu t) / (1 + mu/t): LossyGear's eta_mf1.

    >>> round(driving_efficiency(0.02, 1 / 50), 3)  # at the limit of self-locking half is lost
    0.5
    """
    return (1.0 - mu * t) / (1.0 + mu / t)


def backdriving_efficiency(mu, t):
    """F w_in / (P w_out) while the load drives, (1 - mu/t) / (1 + mu t): LossyGear's eta_mf2; negative when self-locking."""
    return (1.0 - mu / t) / (1.0 + mu * t)


def self_locking(mu, t):
    """1.0 where no output torque moves the gear by itself, mu > tan(alpha): (11) with mu_k, (12) with mu_s; else 0.0."""
    return 1.0 if mu > t else 0.0
