"""Warm-up: friction changes with time since the start, and with the heat that the losses leave in the reducer."""

import math

from ...effect import AMPLITUDE, SHAPE, Effect, Parameter, positive


def factor(time, heat, excess, warm_up_time, per_heat):
    """(1 + excess exp(-time / warm_up_time)) exp(-per_heat heat), s, J; by heat at most twentyfold either way."""
    cold = excess * math.exp(-time / warm_up_time) if excess != 0.0 else 0.0
    return (1.0 + cold) * (math.exp(min(max(-per_heat * heat, -3.0), 3.0)) if per_heat != 0.0 else 1.0)


def active(p, x):
    return 2.0 if p.cold_excess != 0.0 or p.heat_coefficient != 0.0 else 0.0


def dry(p, x):
    return factor(x.time, x.heat, p.cold_excess, p.warm_up_time, p.heat_coefficient)


def viscosity(p, x):
    return dry(p, x)


EFFECT = Effect(
    component="reducer",
    name="warm_up",
    summary="all friction times (1 + a exp(-time / T)) exp(-g H), dH/dt = loss power - H / T_H",
    parameters=(
        Parameter(
            "cold_excess", "", 0.0, -0.9, 5.0, "a, friction at the start above that of the warm gear, the nominal", AMPLITUDE
        ),
        Parameter("warm_up_time", "s", 60.0, 1e-2, 1e5, "T", SHAPE),
        Parameter("heat_coefficient", "1/J", 0.0, -0.1, 0.1, "g, friction falls with heat where positive", AMPLITUDE),
        Parameter("cooling_time", "s", 600.0, 1e-1, 1e6, "T_H, time in which the heat leaves", SHAPE),
    ),
    source="Bittencourt, Gunnarsson, Static friction in a robot joint, J. Dyn. Sys. Meas. Control 134(5), 2012",
    hooks={"active": active, "dry": dry, "viscosity": viscosity},
    advice="the same motion cold, and again after half an hour of running",
    shown_over="time",
    needs=("time",),
    drifts=True,
    check=positive("warm_up_time", "cooling_time"),
)
