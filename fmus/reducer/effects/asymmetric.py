"""Asymmetric friction: flanks, bearings and seals differ by the direction of rotation."""

from ...effect import AMPLITUDE, Effect, Parameter


def factor(asymmetry, direction):
    """Factor 1 + a s on friction in direction s."""
    return 1.0 + asymmetry * direction


def active(p, x):
    return 1.0 if p.friction_asymmetry != 0.0 or p.viscous_asymmetry != 0.0 else 0.0


def dry(p, x):
    return factor(p.friction_asymmetry, x.direction)


def viscosity(p, x):
    return factor(p.viscous_asymmetry, x.direction)


EFFECT = Effect(
    component="reducer",
    name="asymmetric",
    summary="dry friction times 1 + a s, viscous friction times 1 + a_v s, s the direction of the input shaft",
    parameters=(
        Parameter("friction_asymmetry", "", 0.0, -1.0, 1.0, "a, dry friction is larger forward where positive", AMPLITUDE),
        Parameter("viscous_asymmetry", "", 0.0, -1.0, 1.0, "a_v, viscous friction is larger forward where positive", AMPLITUDE),
    ),
    source="Janot, Gautier, Brunot, Nonlinear System Identification Benchmarks 2019 (EMPS)",
    hooks={"active": active, "dry": dry, "viscosity": viscosity},
    advice="the same speeds in both directions with the load taken off",
    shown_over="speed",
)
