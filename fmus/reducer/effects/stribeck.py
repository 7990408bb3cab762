"""Stribeck: friction falls with speed from the static to the kinetic coefficient."""

import math

from ...effect import AMPLITUDE, SHAPE, Effect, Parameter, positive


def coefficient(speed, stribeck_speed, exponent):
    """Share of mu_s - mu_k that is left at this speed, rad/s: exp(-|w / w_s|^delta)."""
    return math.exp(-(abs(speed / stribeck_speed) ** exponent))


def active(p, x):
    return 2.0 if p.stribeck_speed != 0.0 and p.friction_static > p.friction_kinetic else 0.0


def kinetic(p, x):
    if p.stribeck_speed == 0.0 or p.friction_static <= p.friction_kinetic:
        return 0.0
    fall = (p.friction_static - p.friction_kinetic) * coefficient(x.speed, p.stribeck_speed, p.stribeck_exponent)
    return fall * (1.0 + p.stribeck_asymmetry * x.direction)


def static(p, x):
    """At rest friction is that of the slowest motion in this direction: else it would stick and slip without end."""
    if p.stribeck_speed == 0.0 or p.friction_static <= p.friction_kinetic:
        return 0.0
    return (p.friction_static - p.friction_kinetic) * p.stribeck_asymmetry * x.direction


EFFECT = Effect(
    component="reducer",
    name="stribeck",
    summary="mu(w) = mu_k + (mu_s - mu_k) exp(-|w / w_s|^delta) (1 + a s)",
    parameters=(
        Parameter(
            "stribeck_speed", "rad/s", 0.0, 0.0, 1e3, "w_s, over which friction falls from mu_s to mu_k; 0: at once", AMPLITUDE
        ),
        Parameter("stribeck_exponent", "", 1.0, 0.2, 4.0, "delta, shape of the fall", SHAPE),
        Parameter(
            "stribeck_asymmetry", "", 0.0, -4.0, 4.0, "a, the fall is larger forward where positive", SHAPE, on_request=True
        ),
    ),
    source="Stribeck 1902; Armstrong-Helouvry, Dupont, Canudas de Wit, Automatica 30(7), 1994",
    hooks={"active": active, "kinetic": kinetic, "static": static},
    frees=("friction_kinetic", "friction_static"),
    advice="slow ramps of speed through zero, both ways, at one load",
    shown_over="speed",
    check=positive("stribeck_exponent"),
)
