"""Units against pint's opinion, and units that are not there."""

import pint
import pytest

from selflock.fmus import build, units

NAMES = {"degC": "degC", "Ohm": "ohm"}


def every_unit():
    faces = [build.face_of(name) for name in ("Motor", "Controller", "Load", "Sensor")]
    return sorted({row.unit for face in faces for row in (*face.inputs, *face.outputs, *face.parameters) if row.unit})


@pytest.fixture(scope="module")
def registry():
    return pint.UnitRegistry()


@pytest.mark.slow
@pytest.mark.parametrize("text", every_unit())
def test_base_units(registry, text):
    first, *below = text.replace("Ohm", "ohm").split("/")
    factors = [part for part in first.split(".")]
    spelled = "*".join(_power(part) for part in factors) + "".join(
        "/(" + "*".join(map(_power, part.split("."))) + ")" for part in below
    )
    base = registry.Quantity(1.0, spelled).to_base_units()
    unit = units.parse(text)
    assert base.magnitude == pytest.approx(unit.factor)
    expected = {"kg": "kilogram", "m": "meter", "s": "second", "A": "ampere", "K": "kelvin", "mol": "mole", "cd": "candela"}
    powers = {expected[name]: power for name, power in zip(units.BASES, unit.powers) if power and name != "rad"}
    assert {name: power for name, power in base.unit_items() if name != "radian"} == powers


def _power(part):
    name = part.rstrip("-0123456789")
    return f"{name}**{part[len(name) :]}" if name and name != part else part


def test_unknown_symbol_is_named():
    with pytest.raises(KeyError, match="furlong"):
        units.parse("N.furlong")


def test_offset_counts_only_alone():
    assert units.parse("degC").offset == 273.15
    assert units.parse("W/degC").offset == 0.0
