"""Units at connections, whoever names them: the same dimension is converted, another one refused.

A unit is what it says of itself in the FMU (BaseUnit: exponents, factor, offset); where it says nothing, pint
knows the name. Angles count as dimensionless, except that rad/s and 1/s are never taken for one another: one
turn is 2π rad, and which is meant cannot be known.
"""

from __future__ import annotations

import re
from collections.abc import Mapping
from functools import cache
from math import inf, pi
from types import MappingProxyType
from typing import TYPE_CHECKING

from ..fmus.units import Unit, of, parse
from .errors import DescriptionError

if TYPE_CHECKING:
    from pint import UnitRegistry

Declared = Mapping[str, Unit]  # what an FMU says of its units, by their names
NOTHING: Declared = MappingProxyType({})

_BASE = {
    "kilogram": "kg",
    "meter": "m",
    "second": "s",
    "ampere": "A",
    "kelvin": "K",
    "mole": "mol",
    "candela": "cd",
    "radian": "rad",
}
_NAMES = {"%": "percent", "1": "", "-": "", "rev": "turn", "1/min": "1/minute"}
_USUAL = {  # in logs and data sheets, to the bits that pint has: it takes half a second to load
    "%": of(0.01),
    "deg": of(pi / 180, rad=1),
    "deg/s": of(pi / 180, rad=1, s=-1),
    "rpm": of(pi / 30, rad=1, s=-1),
    **{f"m{name}": parse(name)._replace(factor=1e-3) for name in ("m", "m/s", "s", "A", "V", "N", "N.m", "H", "Ohm", "W")},
}

LONGEST = 200  # characters of a name that is looked up
ENDLESS = re.compile(r"\*\*\s*[(+-]*\s*\d{3,}|\*\*[^A-Za-z]*\*\*")
"""Powers of three digits, and powers of powers: pint works with whole numbers of any length, and would for hours."""


def unit(name: str, declared: Declared = NOTHING) -> Unit | None:
    """The unit called `name`; `declared`: what the FMU says of its units. None when nobody knows it."""
    return declared[name] if name in declared else _plain(name) or _pint_unit(name)


def _without_angle(unit: Unit) -> dict[str, int]:
    return {base: power for base, power in unit.exponents.items() if base != "rad"}


def conversion(source: str, target: str, of_source: Declared = NOTHING, of_target: Declared = NOTHING) -> tuple[float, float]:
    """factor and offset that take a number in unit `source` to unit `target`.

    No unit on either side: passed on as it is. Raises DescriptionError with the reason.

    >>> conversion("degC", "K")
    (1.0, 273.15)
    """
    if not source or not target or source == target and not (of_source or of_target):
        return 1.0, 0.0
    a, b = unit(source, of_source), unit(target, of_target)
    if a is None or b is None:
        if source == target:
            return 1.0, 0.0
        raise DescriptionError(f"nobody knows the unit {source if a is None else target}")
    if _without_angle(a) != _without_angle(b):
        raise DescriptionError(f"{source} cannot be converted to {target}")
    if a.powers != b.powers and _without_angle(a) == {"s": -1}:
        raise DescriptionError(
            f"{source} and {target} differ by the angle of a turn, or do not; give the factor and convert = false"
        )
    return a.factor / b.factor, (a.offset - b.offset) / b.factor


def to_si(name: str, declared: Declared = NOTHING) -> float:
    """Factor from unit `name` to SI; 1 where the unit is unknown."""
    known = unit(name, declared) if name else None
    return known.factor if known else 1.0


@cache
def _plain(name: str) -> Unit | None:
    """A usual unit, or one of SI symbols alone: pint is not asked. It reads N/m.s otherwise than FMI: left to it."""
    if name in _USUAL:
        return _USUAL[name]
    try:
        plain = parse(name)
    except (KeyError, OverflowError):
        return None
    return plain if plain.factor == 1.0 and "degC" not in name and "." not in name.partition("/")[2] else None


@cache
def _registry() -> UnitRegistry:
    import pint

    return pint.UnitRegistry()


@cache
def _pint_unit(name: str) -> Unit | None:
    """A unit by its FMI name (N.m, kg.m2, m.s-2, rad/s) as pint reads it."""
    text = _NAMES.get(name, name)
    text = re.sub(r"(?<=[A-Za-z])(-?\d+)", r"**(\1)", text.replace("^", "**"))  # m2 -> m**(2)
    text = re.sub(r"(?<=[\w)])\.(?=[A-Za-z(])", "*", text)  # N.m -> N*m
    text = re.sub(r"Ohm\b", "ohm", text)
    if len(text) > LONGEST or ENDLESS.search(text):
        return None
    try:
        registry = _registry()
        if not text:
            return of()
        parsed = registry.parse_units(text)
        one, zero = (registry.Quantity(x, parsed).to_base_units() for x in (1.0, 0.0))
        powers = {base: float(power.real) for base, power in one.unit_items()}
        if any(base not in _BASE or power != int(power) for base, power in powers.items()):
            return None
        exponents = {_BASE[base]: int(power) for base, power in powers.items()}
        factor, offset = float(one.magnitude - zero.magnitude), float(zero.magnitude)
        return of(factor, offset, **exponents) if 0.0 < abs(factor) < inf else None
    except Exception:  # pint's many ways to say that it does not know
        return None
