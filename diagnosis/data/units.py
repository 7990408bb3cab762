"""Units of a log's columns. They are converted as at the master's connections; an angle must say that it is one."""

from __future__ import annotations

import re

from selflock.master.errors import DescriptionError
from selflock.master.units import conversion as between
from selflock.master.units import unit

HABITS = {  # as people write a unit that is another one to who takes them at their word: an enzyme's per minute, years, coulombs
    **dict.fromkeys(("u/min", "umdr/min", "umdr./min", "upm", "r/min", "tr/min"), "rpm"),
    **dict.fromkeys(("u/s", "umdr/s", "r/s"), "turn/s"), "rads": "rad/s", "degs": "deg/s", "nm": "N.m", "mnm": "mN.m", "kn": "kN",
    **dict.fromkeys(("a", "amps", "amp", "apk", "arms"), "A"), "ma": "mA", "c": "degC", "k": "K", "s": "s", "ms": "ms",
}  # fmt: skip
GRADES = {"grad": "deg", "grad/s": "deg/s"}
"""What is a gradian to many, and a degree where somebody says so."""


def conversion(given: str, wanted: str) -> tuple[float, float]:
    """Factor and offset from unit `given` to unit `wanted`; ValueError says why there is none.

    No unit on either side: as it is. What counts turns, steps or cycles without naming an angle (count, Hz, 1/min) is
    refused for one: by which angle they turn is not known. A unit at its word comes first, then what people mean by it (HABITS).
    """
    if not given or not wanted or given == wanted:
        return 1.0, 0.0
    meant = HABITS.get(given.strip().lower(), "")
    try:
        return _conversion(_spelt(given), wanted)
    except ValueError:
        if not meant:
            raise
    try:
        return _conversion(meant, wanted)
    except ValueError:
        return _conversion(_spelt(given), wanted)  # to say what is wrong with it as it was written


def agree(said: str, told: str, wanted: str) -> bool:
    """Whether a header's unit is the one that somebody says a column has."""
    if GRADES.get(said.strip().lower()) == told:
        return True
    try:
        return conversion(said, wanted) == conversion(told, wanted)
    except ValueError:
        return without_angle(said, wanted)


def _conversion(given: str, wanted: str) -> tuple[float, float]:
    known, target = unit(given), unit(wanted)
    if known is None or given == "Grad":  # a thousand million rad to pint
        raise ValueError(f"unit {given!r} is not known; write SI units such as rad/s, N.m, V, A, or rpm, deg, mN.m")
    if re.match("grads?\\b", given) and wanted.startswith("rad"):
        raise ValueError(
            f"unit {given!r} is a gradian, 400 to a turn, and elsewhere a word for a degree; write deg, or gon if it is that"
        )
    if target is None:
        raise ValueError(f"nothing can be converted to {wanted!r}, which is not known")
    if target.exponents.get("rad") and not known.exponents.get("rad"):
        raise ValueError(f"unit {given!r} names no angle and cannot be {wanted!r}; write rad, deg, turn, rad/s, rpm or deg/s")
    try:
        return between(given, wanted)
    except DescriptionError:
        raise ValueError(f"unit {given!r} cannot be {wanted!r}") from None


def without_angle(given: str, wanted: str) -> bool:
    """Whether a unit is that of a rate, as 1/min or Hz, and does not say of what: it contradicts no speed."""
    known, target = unit(_spelt(given)), unit(wanted)
    if known is None or target is None or not target.exponents.get("rad"):
        return False
    return {**known.exponents, "rad": 0} == {**target.exponents, "rad": 0} and not known.exponents.get("rad")


def is_unit(text: str) -> bool:
    """Whether somebody knows a unit of this name."""
    return bool(text) and unit(_spelt(text)) is not None


def _spelt(name: str) -> str:
    """Nm, mNm and N·m as N.m, mN.m: to pint Nm is a measure of yarn."""
    return re.sub(r"^([munkM]?N)([cm]?m)$", r"\1.\2", name.strip().replace("·", "."))
