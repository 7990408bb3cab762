"""The mass on the arm is not the nominal one."""

from ...effect import AMPLITUDE, Effect, Parameter


def mass(p, x):
    return p.mass_error


EFFECT = Effect(
    component="load",
    name="mass",
    summary="m = m_0 + dm",
    parameters=(
        Parameter("mass_error", "kg", 0.0, -50.0, 50.0, "mass that is there beyond the nominal one", AMPLITUDE, of_drive=2.0),
    ),
    source="rigid body on an axis; any textbook of mechanics",
    hooks={"mass": mass},
    advice="the load held level at standstill, then moved slowly, with the load weighed",
    shown_over="output position",
    says=("mass",),
)
