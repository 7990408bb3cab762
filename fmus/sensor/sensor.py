"""A sensor of one value: scale and bias, then a first-order lag, then steps.

    z = k x + b        T y' = z - y        reading = q floor(y / q + 1/2)

With every effect off the reading is the value itself. The value is held over a step, for which the lag is exact.
The inverse goes back the same way, `before_lag` and then `undone`; what was rounded to steps stays so.
Plain functions on floats.
"""

from math import exp, floor
from typing import NamedTuple

from ..effect import join, parameters_type
from .effects import EFFECTS, HOOKS

BASE = ()
Parameters = parameters_type(BASE, EFFECTS)


ROUNDS = 60  # of the iteration: each brings it nearer by the slope of the bias


class State(NamedTuple):
    filtered: float  # y, behind the lag


class Output(NamedTuple):
    reading: float


scale = join(EFFECTS, HOOKS, "scale")
bias = join(EFFECTS, HOOKS, "bias")
lag = join(EFFECTS, HOOKS, "lag")
resolution = join(EFFECTS, HOOKS, "resolution")


def exact(p, value):
    """z of a value: what is read without lag and steps."""
    return scale(p, value) * value + bias(p, value)


def undone(p, z):
    """The value of which `exact` is z; where scale or bias go with the value, by the iteration x = (z - b(x)) / k(x)."""
    x = z
    for _ in range(ROUNDS):
        last = x
        x = (z - bias(p, last)) / scale(p, last)
        if x == last:
            break
    return x


def before_lag(p, y, rate):
    """z = y + T y' of a reading y and its rate per s."""
    return y + lag(p, y) * rate


def start(p, value):
    """The lag has settled on the first value."""
    return State(exact(p, value))


def advance(p, s, value, dt):
    """A step of dt >= 0 with held value."""
    z = exact(p, value)
    time = lag(p, value)
    y = z - (z - s.filtered) * exp(-dt / time) if time > 0.0 else z
    q = resolution(p, value)
    return State(y), Output(q * floor(y / q + 0.5) if q > 0.0 else y)
