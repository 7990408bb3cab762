"""The bench leans: gravity acts at another angle."""

from ...effect import AMPLITUDE, Effect, Parameter


def tilt(p, x):
    return p.tilt_error


EFFECT = Effect(
    component="load",
    name="tilt",
    summary="M_g = m g d cos(angle + tilt)",
    parameters=(
        Parameter("tilt_error", "rad", 0.0, -0.8, 0.8, "angle by which the bench leans towards positive angles", AMPLITUDE),
    ),
    source="rigid body on an axis; any textbook of mechanics",
    hooks={"tilt": tilt},
    advice="a full turn of the load, slowly",
    shown_over="output position",
    says=("arm_angle",),
)
