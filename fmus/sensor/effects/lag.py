"""The reading follows with a first-order lag."""

from ...effect import LAG, Effect, Parameter


def lag(p, x):
    return p.lag_time


EFFECT = Effect(
    component="sensor",
    name="lag",
    summary="T y' = x - y",
    parameters=(Parameter("lag_time", "s", 0.0, 0.0, 1.0, "time constant of the reading", LAG),),
    source="Fraden: Handbook of Modern Sensors, ch. 3",
    hooks={"lag": lag},
    advice="a fast step seen by this channel and a faster instrument",
    shown_over="acceleration",
    needs=("time",),
)
