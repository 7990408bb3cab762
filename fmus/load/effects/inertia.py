"""The inertia about the axis is not the nominal one; gravity is as it was."""

from ...effect import AMPLITUDE, Effect, Parameter


def inertia(p, x):
    return p.inertia_error


EFFECT = Effect(
    component="load",
    name="inertia",
    summary="J = J_0 + dJ",
    parameters=(
        Parameter("inertia_error", "kg.m2", 0.0, -10.0, 10.0, "inertia beyond the nominal one", AMPLITUDE, of_drive=10.0),
    ),
    source="rigid body on an axis; any textbook of mechanics",
    hooks={"inertia": inertia},
    advice="fast accelerations with gravity balanced",
    shown_over="acceleration",
    needs=("time",),
    says=("inertia",),
)
