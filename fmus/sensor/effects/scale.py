"""The reading is off by a factor."""

from ...effect import AMPLITUDE, Effect, Parameter


def scale(p, x):
    return p.scale_factor


EFFECT = Effect(
    component="sensor",
    name="scale",
    summary="y = k x",
    parameters=(Parameter("scale_factor", "", 1.0, 0.5, 2.0, "factor of the reading", AMPLITUDE),),
    source="Fraden: Handbook of Modern Sensors, ch. 3",
    hooks={"scale": scale},
    advice="the channel against a second instrument at two values",
    shown_over="speed",
)
