"""Units as FMUs name them."""

import math
from itertools import product

import pytest

from selflock.fmus.units import SYMBOLS, of
from selflock.master.errors import DescriptionError
from selflock.master.units import _USUAL, _pint_unit, conversion, to_si, unit


@pytest.mark.parametrize(
    "source, target, factor, offset",
    [
        ("rad", "deg", 180 / math.pi, 0),
        ("rpm", "rad/s", math.pi / 30, 0),
        ("degC", "K", 1, 273.15),
        ("K", "degC", 1, -273.15),
        ("kN.m", "N.m", 1000, 0),
        ("kg.m2", "g.mm2", 1e9, 0),
        ("m.s-2", "m/s2", 1, 0),
        ("V.s/rad", "V.s", 1, 0),
        ("%", "1", 0.01, 0),
        ("N.m/A", "V.s", 1, 0),
        ("", "rad", 1, 0),
        ("quux", "quux", 1, 0),
        ("mOhm", "Ohm", 1e-3, 0),
        ("J", "N.m", 1, 0),
    ],
)
def test_conversion(source, target, factor, offset):
    assert conversion(source, target) == (pytest.approx(factor), pytest.approx(offset))


@pytest.mark.parametrize("source, target", [("N.m", "N"), ("rad/s", "Hz"), ("1/s", "rad/s"), ("quux", "N"), ("degC", "rad")])
def test_refused(source, target):
    with pytest.raises(DescriptionError):
        conversion(source, target)


def test_what_pint_is_not_asked_it_would_say_too():
    second = [separator + symbol for separator in "./" for symbol in ("m", "s-1", "degC", "rad2")]
    names = [first + rest for first, rest in product([*SYMBOLS, "m2", "s-2", "degC2"], ("", "/s.m", *second))]
    assert all(unit(name) == _pint_unit(name) for name in [*names, *_USUAL])


def test_what_an_fmu_says_of_its_units_counts_first():
    declared = {"turn": of(2 * math.pi, rad=1), "degC": of(offset=273.15, K=1)}
    assert conversion("turn", "rad", declared) == (pytest.approx(2 * math.pi), 0.0)
    assert conversion("degC", "K", declared) == (1.0, 273.15)
    assert to_si("turn", declared) == pytest.approx(2 * math.pi)
