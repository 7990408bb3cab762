"""The reading comes in steps."""

from ...effect import STEP, Effect, Parameter


def resolution(p, x):
    return p.resolution


EFFECT = Effect(
    component="sensor",
    name="quantisation",
    summary="y = q round(x / q)",
    parameters=(
        Parameter("resolution", "", 0.0, 0.0, 10.0, "step of the reading, in the unit of the value", STEP, of_value=True),
    ),
    source="Fraden: Handbook of Modern Sensors, ch. 3",
    hooks={"resolution": resolution},
    advice="the channel recorded raw at slow motion",
    shown_over="time",
    needs=("time",),
)
