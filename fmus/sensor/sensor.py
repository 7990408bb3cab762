"""A sensor of one value: scale and bias, then a first-order lag, then steps.

    z = k x + b        T y' = z - y        reading = q floor(y / q + 1/2)

With every effect off the reading is the value itself. The value is held over a step, for which the lag is exact.
Plain functions on floats.
"""

from math import exp, floor
from typing import NamedTuple

from ..effect import join, parameters_type
from .effects import EFFECTS, HOOKS

BASE = ()
Parameters = parameters_type(BASE, EFFECTS)


class State(NamedTuple):
    filtered: float  # y, behind the lag


class Output(NamedTuple):
    reading: float


scale = join(EFFECTS, HOOKS, "scale")
bias = join(EFFECTS, HOOKS, "bias")
lag = join(EFFECTS, HOOKS, "lag")
resolution = join(EFFECTS, HOOKS, "resolution")


def start(p, value):
    """The lag has settled on the first value."""
    return State(scale(p, value) * value + bias(p, value))


def advance(p, s, value, dt):
    """A step of dt >= 0 with held value."""
    z = scale(p, value) * value + bias(p, value)
    time = lag(p, value)
    y = z - (z - s.filtered) * exp(-dt / time) if time > 0.0 else z
    q = resolution(p, value)
    return State(y), Output(q * floor(y / q + 0.5) if q > 0.0 else y)
