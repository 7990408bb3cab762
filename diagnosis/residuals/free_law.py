"""A law that nobody knows, inside a whole drive: a free function of one variable, straight between knots.

It is no function of an error: the drive is simulated with it, so that what it does goes through gear, load and loop, as
the effects of the vocabulary do whose rival it is. Its numbers are the heights at its knots, and each says in its name
where it stands:

    free.torque.output position@0.35        N.m at the motor's shaft, against positive motion
    free.friction.speed@12.0                N.m at the motor's shaft, against the motion, none at rest
    free.voltage.current@1.5                V that the motor has less
    free.reading motor.current.current@1.5  A that the channel reads more; the controller acts on what its angle reads
"""

from __future__ import annotations

from collections.abc import Iterable
from functools import cache, lru_cache
from typing import NamedTuple

import numpy as np

PREFIX = "free."
READING = "reading "
PLACES = {"torque": "N.m", "friction": "N.m", "voltage": "V"}
"""In the drive itself, with the unit of what acts there, in the loops' order; beside them the readings of channels."""

IN_LOOP = len(PLACES) + 1
"""The loops' number for the reading of the angle over which the loop closes."""

VARIABLES = ("speed", "load", "position", "output position", "time", "current", "voltage")
"""As the remainder is told to depend on them (judge.depends); position: of the input shaft, within a turn."""


class FreeLaw(NamedTuple):
    """As the loops take it: numbers of place and variable from 1 on, 0 for none; of a reading the channel, and place 0."""

    place: int
    over: int
    knots: np.ndarray
    heights: np.ndarray
    channel: str = ""


@cache
def none() -> FreeLaw:
    """No free law."""
    return FreeLaw(0, 0, np.zeros(1), np.zeros(1))


def name(place: str, variable: str, knot: float) -> str:
    """Of the height at a knot."""
    return f"{PREFIX}{place}.{variable}@{float(knot)!r}"


def names(values: Iterable[str]) -> tuple[str, ...]:
    """Those of these names that are of a free law."""
    return tuple(key for key in values if key.startswith(PREFIX))


def of(values: dict[str, float]) -> FreeLaw:
    """The free law that these values hold."""
    found = names(values)
    if not found:
        return none()
    place, over, knots, channel = _read(found)
    return FreeLaw(place, over, knots, np.array([values[key] for key in found], float), channel)


def channel(name: str) -> str:
    """Of a free law's number: the channel whose reading it is of; "" of one in the drive."""
    place = name.removeprefix(PREFIX).partition("@")[0].rpartition(".")[0]
    return place.removeprefix(READING) if place.startswith(READING) else ""


@lru_cache
def _read(found: tuple[str, ...]) -> tuple[int, int, np.ndarray, str]:
    (law,) = {key.partition("@")[0] for key in found}  # one at a time
    place, _, variable = law.removeprefix(PREFIX).rpartition(".")
    knots = np.array([float(key.partition("@")[2]) for key in found])
    assert np.all(np.diff(knots) > 0.0), "knots in their order"
    number = 1 + list(PLACES).index(place) if place in PLACES else 0
    return number, 1 + VARIABLES.index(variable), knots, channel(found[0])
