"""The reading is off by a constant."""

from ...effect import OFFSET, Effect, Parameter


def bias(p, x):
    return p.bias


EFFECT = Effect(
    component="sensor",
    name="bias",
    summary="y = x + b",
    parameters=(
        Parameter("bias", "", 0.0, -1000.0, 1000.0, "offset of the reading, in the unit of the value", OFFSET, of_value=True),
    ),
    source="Fraden: Handbook of Modern Sensors, ch. 3",
    hooks={"bias": bias},
    advice="a minute at rest without power",
    shown_over="time",
)
