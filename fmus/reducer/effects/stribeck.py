"""Stribeck: friction falls with speed from the static to the kinetic coefficient."""

import math

from ...effect import Effect, Parameter


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


EFFECT = Effect(
    component="reducer",
    name="stribeck",
    summary="mu(w) = mu_k + (mu_s - mu_k) exp(-|w / w_s|^delta) (1 + a s)",
    parameters=(
        Parameter("stribeck_speed", "rad/s", 0.0, 0.0, 1e3, "w_s, speed over which friction falls from mu_s to mu_k; 0: at once"),
        Parameter("stribeck_exponent", "", 1.0, 0.2, 4.0, "delta, shape of the fall"),
        Parameter(
            "stribeck_asymmetry",
            "",
            0.0,
            -4.0,
            4.0,
            "a of the factor 1 + a s on the fall in direction s: flanks that run in differently",
        ),
    ),
    source="Stribeck 1902; Armstrong-Helouvry, Dupont, Canudas de Wit, Automatica 30(7), 1994",
    hooks={"active": active, "kinetic": kinetic},
    frees=("friction_kinetic", "friction_static"),
)
