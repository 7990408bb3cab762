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

    @property
    def exponents(self) -> dict[str, int]:
        """The powers that are not zero, by base."""
        return {base: power for base, power in zip(BASES, self.powers) if power}


def of(factor: float = 1.0, offset: float = 0.0, **powers: int) -> Unit:
    """The unit with these powers of the bases."""
    return Unit(tuple(powers.get(base, 0) for base in BASES), factor, offset)


SYMBOLS = {
    **{base: of(**{base: 1}) for base in BASES},
    "1": of(),
    "N": of(kg=1, m=1, s=-2),
    "J": of(kg=1, m=2, s=-2),
    "W": of(kg=1, m=2, s=-3),
    "V": of(kg=1, m=2, s=-3, A=-1),
    "Ohm": of(kg=1, m=2, s=-3, A=-2),
    "H": of(kg=1, m=2, s=-2, A=-2),
    "Hz": of(s=-1),
    "deg": of(rad=1, factor=pi / 180),
    "degC": of(K=1, offset=273.15),
    "g": of(kg=1, factor=1e-3),
    "mm": of(m=1, factor=1e-3),
    "ms": of(s=1, factor=1e-3),
    "min": of(s=1, factor=60.0),
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
