"""Units as FMI 2.0 describes them: powers of the SI base units (and rad), a factor and an offset.

A unit is written as FMI tools write it: symbols joined by "." and "/", a power as a trailing number,
such as "kg.m2", "N.m/rad", "V.s/rad", "1/s". Everything after the first "/" divides.
"""

from __future__ import annotations

import re
from math import pi
from typing import NamedTuple

BASES = ("kg", "m", "s", "A", "K", "mol", "cd", "rad")


class Unit(NamedTuple):
    """value in SI base units = factor * value + offset; powers of the bases in the order of BASES."""

    powers: tuple[int, ...]
    factor: float = 1.0
    offset: float = 0.0


def _of(factor: float = 1.0, offset: float = 0.0, **powers: int) -> Unit:
    return Unit(tuple(powers.get(base, 0) for base in BASES), factor, offset)


SYMBOLS = {
    **{base: _of(**{base: 1}) for base in BASES},
    "1": _of(),
    "N": _of(kg=1, m=1, s=-2),
    "J": _of(kg=1, m=2, s=-2),
    "W": _of(kg=1, m=2, s=-3),
    "V": _of(kg=1, m=2, s=-3, A=-1),
    "Ohm": _of(kg=1, m=2, s=-3, A=-2),
    "H": _of(kg=1, m=2, s=-2, A=-2),
    "Hz": _of(s=-1),
    "deg": _of(rad=1, factor=pi / 180),
    "degC": _of(K=1, offset=273.15),
    "g": _of(kg=1, factor=1e-3),
    "mm": _of(m=1, factor=1e-3),
    "ms": _of(s=1, factor=1e-3),
    "min": _of(s=1, factor=60.0),
}


def parse(text: str) -> Unit:
    """The unit that a text such as "N.m/rad" names; KeyError names the symbol that is not known."""
    total, factor = [0] * len(BASES), 1.0
    parts = re.split(r"([./])", text)
    sign, offset = 1, 0.0
    for separator, part in zip([None, *parts[1::2]], parts[0::2]):
        if separator == "/":
            sign = -1
        match = re.fullmatch(r"([A-Za-z]+|1)(-?\d+)?", part)
        if not match or match[1] not in SYMBOLS:
            raise KeyError(f"unit {text!r}: {part!r} is not a known symbol; known are {', '.join(SYMBOLS)}")
        unit, power = SYMBOLS[match[1]], sign * int(match[2] or 1)
        total = [have + power * more for have, more in zip(total, unit.powers)]
        factor *= unit.factor**power
        offset = unit.offset if len(parts) == 1 and power == 1 else 0.0
    return Unit(tuple(total), factor, offset)
