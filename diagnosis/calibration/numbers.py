"""The numbers that are fitted: what the rig asks for, held against what the FMUs say of themselves."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from math import log

import numpy as np

from selflock.master.errors import DescriptionError
from selflock.master.system import did_you_mean
from selflock.master.wiring import typed

from ..data.log import MeasuredRun
from ..data.rig import Rig, Wanted
from ..errors import DataError
from ..rules import RULES
from ..systems.parts import Parts


@dataclass(frozen=True)
class Number:
    """A number that the fit may change. A place in its range is 0 at `low` and 1 at `high`."""

    name: str  # component.variable, and behind it of which run where each has its own
    variable: str
    start: float
    low: float
    high: float
    unit: str = ""
    run: int | None = None  # whose own it is; None: of all

    @property
    def by_decades(self) -> bool:
        """Whether its range is gone through in the logarithm."""
        return self.low > 0.0 and self.high >= RULES.calibrate.decades * self.low

    def at(self, place: float) -> float:
        """The value at a place."""
        place = min(max(float(place), 0.0), 1.0)
        if place in (0.0, 1.0):
            return self.high if place else self.low
        if self.by_decades:
            return float(self.low * (self.high / self.low) ** place)
        return float(self.low + (self.high - self.low) * place)

    def place(self, value: float) -> float:
        """The place of a value."""
        if self.by_decades:
            return log(value / self.low) / log(self.high / self.low)
        return (value - self.low) / (self.high - self.low)

    def slope(self, place: float) -> float:
        """d value / d place."""
        return self.at(place) * log(self.high / self.low) if self.by_decades else self.high - self.low

    def difference(self, place: float) -> float:
        """By how much a place is moved for a derivative, at first."""
        reach = 1.0 if self.by_decades else max(abs(self.at(place)) / (self.high - self.low), RULES.search.range_scale)
        return RULES.calibrate.difference * min(reach, 1.0)


def of_rig(rig: Rig, parts: Parts, runs: Sequence[MeasuredRun]) -> tuple[Number, ...]:
    """All that the rig wants fitted; DataError where a number cannot be."""
    wanted = {name: Wanted(None, *ends) for name, ends in rig.uncertain.items()} | rig.wanted
    if not wanted:
        near = ", ".join(name for name, v in parts.variables.items() if v.causality == "parameter" and v.type == "Real")
        raise DataError(
            f'{rig.path}: names no number to fit. Write under [calibrate] "component.parameter" = [low, high]; '
            f"there is: {near[:300] or 'no parameter in this system'}."
        )
    return tuple(number for name, entry in wanted.items() for number in _numbers(rig, parts, runs, name, entry))


def _numbers(rig: Rig, parts: Parts, runs: Sequence[MeasuredRun], name: str, entry: Wanted) -> Iterator[Number]:
    where = f"{rig.path}: {'[calibrate]' if name in rig.wanted else '[uncertain]'} {name!r}"
    if name not in parts.variables:
        raise DataError(f"{where}: {parts.path.name} has no such variable{did_you_mean(name, parts.variables)}")
    variable, component = parts.variables[name], parts.owner(name)
    fixed = _fixed(rig, parts, name, runs)
    if fixed:
        raise DataError(f"{where} is fixed: {fixed}. Leave it out, or let go of it there.")
    if variable.type != "Real":
        raise DataError(f"{where} is of type {variable.type}: only Reals are fitted. Try its values one by one, with a sweep.")
    low = variable.minimum if entry.low is None else entry.low
    high = variable.maximum if entry.high is None else entry.high
    if low is None or high is None or not np.isfinite(high - low):
        side = "low" if low is None or not np.isfinite(low) else "high"
        raise DataError(f"{where} has no {'lowest' if side == 'low' else 'highest'} value: write {side} = ... beside it.")
    if not low < high:
        raise DataError(f"{where}: its range from {low:g} to {high:g} is none. Write low and high beside it.")
    for end in (low, high):
        try:
            typed(variable, end, where)
        except DescriptionError as error:
            raise DataError(f"{error} So its FMU says; narrow the range.") from None
    given = rig.parameters.get(name, parts.values.get(component, {}).get(_bare(name, component), variable.start))
    start = given if entry.start is None else entry.start
    start = 0.5 * (low + high) if start is None else float(start)
    if not low <= start <= high:
        source = "" if entry.start is not None else ", as the rig, the system or its FMU has it,"
        raise DataError(
            f"{where}: start = {start:g}{source} is outside of its range from {low:g} to {high:g}. Write start = ... inside."
        )
    if not entry.each_run or len(runs) == 1:
        yield Number(name, name, start, low, high, variable.unit)
        return
    for i, run in enumerate(runs):
        yield Number(f"{name} of {label(run)}", name, start, low, high, variable.unit, i)


def _bare(name: str, component: str) -> str:
    return name[len(component) + 1 :]


def label(run: MeasuredRun) -> str:
    """A run's name for people."""
    return f"{run.log} {run.name}".strip()


def _fixed(rig: Rig, parts: Parts, name: str, runs: Sequence[MeasuredRun]) -> str:
    """Why a value cannot be set; "" where it can be."""
    variable = parts.variables[name]
    if name in rig.known or f"{parts.owner(name)}.*" in rig.known:
        return "[rig] known says that it is never questioned"
    if any(name in values for values in rig.logs.values()):
        return "[logs] gives it"
    if variable.causality == "input" and name in runs[0].signals:
        return "the log gives it"
    if name in parts.links:
        link = parts.links[name]
        return f"it is connected to {link.source}.{link.output}"
    if variable.variability == "constant":
        return "its FMU says that it is a constant"
    try:
        typed(variable, 0.0 if variable.start is None else variable.start, name)
    except DescriptionError:
        if variable.causality != "parameter":
            return f"it is computed by its FMU ({variable.causality})"
    return ""


def of_run(numbers: Sequence[Number], i: int) -> list[Number]:
    """The numbers of a run, as of one that is alone."""
    return [n if n.run is None else replace(n, run=0) for n in numbers if n.run in (None, i)]
