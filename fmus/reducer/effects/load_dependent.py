"""Load-dependent friction, driving apart from back-driving."""

from ...effect import AMPLITUDE, Effect, Parameter


def coefficient(output_torque, constant, per_torque):
    """What the load adds to mu: constant + per_torque |P|, P in N.m."""
    return constant + per_torque * abs(output_torque)


def active(p, x):
    if p.driving_load_slope != 0.0 or p.backdriving_load_slope != 0.0:
        return 2.0
    return 1.0 if p.driving_friction != 0.0 or p.backdriving_friction != 0.0 else 0.0


def driving(p, x):
    return coefficient(x.output_torque, p.driving_friction, p.driving_load_slope)


def backdriving(p, x):
    return coefficient(x.output_torque, p.backdriving_friction, p.backdriving_load_slope)


EFFECT = Effect(
    component="reducer",
    name="load_dependent",
    summary="mu + d + e |P| while the load resists, mu + d' + e' |P| while it helps",
    parameters=(
        Parameter("driving_friction", "", 0.0, -1.0, 1.0, "d, added to mu while the load resists the motion", AMPLITUDE),
        Parameter("backdriving_friction", "", 0.0, -1.0, 1.0, "d', added to mu while the load helps the motion", AMPLITUDE),
        Parameter("driving_load_slope", "1/N.m", 0.0, -1.0, 1.0, "e, added to mu per output torque while it resists", AMPLITUDE),
        Parameter(
            "backdriving_load_slope", "1/N.m", 0.0, -1.0, 1.0, "e', added to mu per output torque while it helps", AMPLITUDE
        ),
    ),
    source="Pelchen, Schweiger, Otter 2002 (LossyGear); Duclusaud et al. 2025, Extended Friction Models for Servo Actuators",
    hooks={"active": active, "driving": driving, "backdriving": backdriving},
    advice="the same motion with twice and with half the load, lifting and lowering",
    shown_over="load",
)
