"""The centre of mass is not where the drawing has it."""

from ...effect import AMPLITUDE, Effect, Parameter


def arm(p, x):
    return p.arm_error


EFFECT = Effect(
    component="load",
    name="centre_of_mass",
    summary="d = d_0 + dd",
    parameters=(
        Parameter(
            "arm_error", "m", 0.0, -1.0, 1.0, "distance of the mass from the axis beyond the nominal", AMPLITUDE, of_drive=2.0
        ),
    ),
    source="rigid body on an axis; any textbook of mechanics",
    hooks={"arm": arm},
    advice="the same motion with the load weighed, fast and slow",
    shown_over="output position",
    says=("arm",),
)
