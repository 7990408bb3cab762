"""The same signal of several results in one unit, so that curves on one axis are of one size."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

from selflock.master.errors import DescriptionError
from selflock.master.units import conversion

from .sheet import Sheet, some
from .stages import moving

Scales = dict[tuple[str, str], tuple[str, float, float]]  # (run, column): the unit that it is in now, factor, offset


def alike(tables: list[Sheet]) -> tuple[list[Sheet], Scales]:
    """The tables with each column in the unit of the first that says one; and what was converted.

    What cannot be converted keeps its own unit, and is given an axis of its own; so does what moves a drawing, whose lengths
    and angles are those that it was written with.
    """
    units: dict[str, str] = {}
    for one in tables:
        for name, unit in one.units.items():
            if unit:
                units.setdefault(name, unit)
    scales: Scales = {}
    found = []
    for one in tables:
        columns, own, notes, drawn = dict(one.columns), dict(one.units), list(one.notes), moving(one)
        unsaid = [name for name in columns if units.get(name) and not own[name]]
        if unsaid:
            notes.append(f"{one.label} says no unit of {some(unsaid)}: drawn as if in that of the others.")
        for name, unit in one.units.items():
            wanted = units.get(name, "")
            if unit == wanted or name in drawn:
                continue
            try:
                factor, offset = conversion(unit, wanted)
            except DescriptionError:
                continue
            own[name] = wanted
            if unit:
                columns[name] = factor * columns[name] + offset
                scales[one.label, name] = wanted, factor, offset
        found.append(replace(one, columns=columns, units=own, notes=notes))
    return found, scales


def told_alike(rows: list[dict[str, Any]], scales: Scales) -> None:
    """Peaks and their limits, found in a result's own units, in those that its curves are drawn in."""
    for row in rows:
        if scale := scales.get((row["run"], row["name"])):
            row["unit"], factor, offset = scale
            row["peak"] = factor * row["peak"] + offset
            if row["limit"] is not None:
                row["limit"] = abs(factor) * row["limit"] + offset
