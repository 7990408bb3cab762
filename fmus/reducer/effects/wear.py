"""Wear and running-in: dry friction drifts with the distance travelled."""

import math

from ...effect import AMPLITUDE, SHAPE, Effect, Parameter


def factor(distance, rate, reach):
    """1 + rate D, D = distance at first and never more than reach: D = reach (1 - exp(-distance / reach)); rad."""
    return 1.0 + rate * (distance if reach == 0.0 else -reach * math.expm1(-distance / reach))


def active(p, x):
    return 2.0 if p.wear_rate != 0.0 else 0.0


def dry(p, x):
    return factor(x.distance, p.wear_rate, p.wear_reach)


EFFECT = Effect(
    component="reducer",
    name="wear",
    summary="dry friction times 1 + w D, D the distance of the input shaft, levelling off at a reach",
    parameters=(
        Parameter(
            "wear_rate",
            "1/rad",
            0.0,
            -0.1,
            0.1,
            "w, change of friction per distance; negative: running-in",
            AMPLITUDE,
            of_drive=3.0,
        ),
        Parameter("wear_reach", "rad", 0.0, 0.0, 1e6, "distance over which the drift levels off; 0: never", SHAPE),
    ),
    source="Bittencourt, Axelsson, Modeling and experiment design for wear in a robot joint, IEEE/ASME T-Mech 19(5), 2014",
    hooks={"active": active, "dry": dry},
    advice="the same short test before and after a long run, with a pause to cool down between",
    shown_over="time",
    needs=("time",),
    drifts=True,
)
