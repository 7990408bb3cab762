"""What an FMU says of itself, of any version of FMI, as our records: variables, units, where values lie.

An array is its elements, `x[1]`, `x[2]`, in a matrix `A[1,2]`: rows first, as FMI 3.0 stores it. A Binary is a String of
hexadecimal digits. Clocks that somebody else than the master ticks are Booleans: an input is true at the communication
points where it ticks, an output where it ticked on the way there.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass
from itertools import product
from typing import Any

from fmpy.model_description import BaseUnit, InterfaceType, ModelDescription, ModelVariable

from ..fmus.units import BASES, Unit
from ..fmus.variable import CAUSALITIES, WHOLE, Variable
from .errors import DescriptionError
from .system import check_choice

INTERFACES = {"cs": "coSimulation", "me": "modelExchange", "se": "scheduledExecution"}
SAID = {"cs": "co-simulation", "me": "model exchange", "se": "scheduled execution"}
TYPES = {"Float32": "Real", "Float64": "Real", "Enumeration": "Integer", "Binary": "String", "Clock": "Boolean"}
SIZED = (*WHOLE, "Float32", "Binary", "Clock")
NEGATED = "negatedAlias"  # of FMI 1.0
ELEMENTS = 1_000_000  # of all arrays together


@dataclass(frozen=True, slots=True)
class Slot:
    """Where a value lies behind a reference: its `index` among `count`; kind: as in the names of the FMU's functions.

    negated: it is the negative of what lies there (FMI 1.0's negatedAlias).
    """

    kind: str
    reference: int
    index: int = 0
    count: int = 1
    array: bool = False
    negated: bool = False


def negative(kind: str, value: Any) -> Any:
    """What a negated alias makes of a value: -x, of a Boolean not x."""
    return value if kind == "String" else 1 - value if kind == "Boolean" else -value


def offered(described: ModelDescription) -> dict[str, InterfaceType]:
    """The interfaces that an FMU has, ours first: by "cs", "me", "se"."""
    return {name: way for name, field in INTERFACES.items() if (way := getattr(described, field)) is not None}


def chosen(described: ModelDescription, path: Any, wanted: str = "") -> str:
    """The interface to couple it by: the wanted one, else the first. Raises DescriptionError."""
    has = offered(described)
    if wanted:
        check_choice("interface", wanted, INTERFACES)
    if wanted and wanted not in has:
        raise DescriptionError(f"{path} is not for {SAID[wanted]} ({wanted}); it is for {', '.join(SAID[one] for one in has)}.")
    return wanted or next(iter(has))


def tolerance_of(described: ModelDescription) -> float:
    """The tolerance that an FMU's default experiment names; 0 where it names none."""
    told = number_of(described.defaultExperiment.tolerance) if described.defaultExperiment else None
    return told if told is not None and told > 0.0 else 0.0


def number_of(text: Any) -> float | None:
    """A finite number that a text says; None where it says none."""
    try:
        number = math.nan if text is None else float(text)
    except (TypeError, ValueError):
        return None
    return number if math.isfinite(number) else None


# --- units -------------------------------------------------------------------------------------------------------


def units_of(described: ModelDescription) -> dict[str, Unit]:
    """What an FMU says of its units, by their names."""
    return {u.name: _si(u.baseUnit) for u in described.unitDefinitions if u.baseUnit is not None}


def _si(unit: BaseUnit) -> Unit:
    return Unit(tuple(int(getattr(unit, base) or 0) for base in BASES), float(unit.factor), float(unit.offset))


# --- variables ---------------------------------------------------------------------------------------------------


def variables_of(described: ModelDescription, sizes: Mapping[str, int] | None = None) -> Iterator[Variable]:
    """What an FMU says of its variables, arrays by their elements. sizes: of structural parameters, in place of their starts."""
    depends: dict[str, tuple[str, ...]] = {}
    shapes = _shapes(described, sizes)
    for unknown in described.outputs:
        if unknown.variable is not None and unknown.dependencies is not None:
            inputs = [v for v in unknown.dependencies if v.causality == "input"]
            depends[unknown.variable.name] = tuple(name for v in inputs for name, _ in _elements(v, shapes))
    for v in described.modelVariables:
        try:
            yield from _face(v, depends.get(v.name), shapes)
        except (ValueError, OverflowError) as error:
            raise DescriptionError(
                f"The modelDescription.xml of {described.modelName} is wrong in its variable {v.name}: {error}"
            ) from None


def places_of(described: ModelDescription, sizes: Mapping[str, int] | None = None) -> dict[str, Slot]:
    """Where each value of an FMU lies, by the name of its variable."""
    shapes, found = _shapes(described, sizes), {}
    for v in described.modelVariables:
        count, kind = math.prod(shapes[v.name]), _kind(v, described)
        for name, index in _elements(v, shapes):
            found[name] = Slot(kind, v.valueReference, index, count, bool(shapes[v.name]), v.alias == NEGATED)
    return found


def sizes_in(described: ModelDescription, given: Mapping[str, Any]) -> dict[str, int]:
    """Those of the values given that are the size of an array. Raises DescriptionError."""
    sizing = {d.valueReference for v in described.modelVariables for d in v.dimensions if d.start is None}
    if not sizing or not given:
        return {}
    sizes = {}
    for v in described.modelVariables:
        if v.valueReference in sizing and v.type in WHOLE and v.name in given:
            try:
                sizes[v.name] = next(_face(v, None, {v.name: ()})).taken(given[v.name])
            except ValueError as error:
                raise DescriptionError(f"{v.name} = {given[v.name]} {error}; it is the size of an array.") from None
    return sizes


def _shapes(described: ModelDescription, sizes: Mapping[str, int] | None) -> dict[str, tuple[int, ...]]:
    """The shape of each variable; () of a scalar."""
    if not any(v.dimensions for v in described.modelVariables):
        return {v.name: () for v in described.modelVariables}
    known = {v.valueReference: (sizes or {}).get(v.name, v.start) for v in described.modelVariables if v.type in WHOLE}
    shapes: dict[str, tuple[int, ...]] = {}
    for v in described.modelVariables:
        told = (d.start if d.start is not None else known.get(d.valueReference) for d in v.dimensions)
        shapes[v.name] = tuple(max(0, int(number_of(size) or 0)) for size in told)
    if (total := sum(math.prod(shape) for shape in shapes.values() if shape)) > ELEMENTS:
        raise DescriptionError(f"its arrays have {total} elements; at most {ELEMENTS} are coupled.")
    return shapes


def _elements(v: ModelVariable, shapes: Mapping[str, tuple[int, ...]]) -> Iterable[tuple[str, int]]:
    """The names of a variable's values, and their places among them."""
    if not (shape := shapes[v.name]):
        return ((v.name, 0),)
    steps = product(*(range(1, size + 1) for size in shape))
    return ((f"{v.name}[{','.join(map(str, step))}]", k) for k, step in enumerate(steps))


def _kind(v: ModelVariable, described: ModelDescription) -> str:
    """As in the names of functions: fmi2GetInteger, fmi3GetInt64."""
    if v.type != "Enumeration":
        return v.type or ""
    return "Int64" if described.fmiMajorVersion == 3 else "Integer"


def _face(v: ModelVariable, depends_on: tuple[str, ...] | None, shapes: Mapping[str, tuple[int, ...]]) -> Iterator[Variable]:
    type_ = TYPES.get(v.type or "", "Integer" if v.type in WHOLE else v.type or "")
    declared = v.declaredType

    def attribute(name: str) -> Any:
        own = getattr(v, name)
        return own if own is not None or declared is None else getattr(declared, name)

    def limit(name: str) -> float | None:
        return number_of(attribute(name)) if type_ in ("Real", "Integer") else None

    causality = "parameter" if v.causality == "structuralParameter" else v.causality or "local"
    if v.type == "Clock" and causality == "input" and v.intervalVariability != "triggered":
        causality = "local"  # the master ticks it
    array = bool(shapes[v.name])
    starts: list[Any] = str(v.start).split() if array and v.start is not None and type_ != "String" else [v.start]
    count = math.prod(shapes[v.name])
    if array and len(starts) != count:  # one for all, or those of another size than is asked for
        starts = starts * count if len(starts) == 1 and type_ != "String" else [None] * count
    for name, index in _elements(v, shapes):
        text = starts[index]
        start = _start(type_, text)
        if v.type == "Clock":
            start = False if causality == "input" else None
        yield Variable(
            name,
            causality=causality if causality in CAUSALITIES else "local",
            type=type_,
            unit=attribute("unit") or "" if type_ == "Real" else "",
            start=start,
            minimum=limit("min"),
            maximum=limit("max"),
            nominal=limit("nominal"),
            variability=_variability(v.variability or "continuous", type_),
            description=v.description or "",
            depends_on=depends_on if v.causality == "output" else None,
            initial=v.initial or "",
            derivative_of=_derived(v, index, shapes),
            sized=v.type if v.type in SIZED and v.type != "Int32" else "",
        )


def _variability(told: str, type_: str) -> str:
    """What is no Real changes at events only, also where its variability is left to the default, which is meant for Reals."""
    return "discrete" if told == "continuous" and type_ != "Real" else told


def _start(type_: str, text: Any) -> Any:
    if text is None or type_ == "String":
        return text
    if type_ == "Boolean":
        return str(text).lower() in ("true", "1")
    if type_ == "Integer" and str(text).strip().lstrip("+-").isdecimal():
        return int(text)
    number = number_of(text)
    return number if number is None or type_ == "Real" else int(number)


def _derived(v: ModelVariable, index: int, shapes: Mapping[str, tuple[int, ...]]) -> str:
    """The name of what it is the time derivative of."""
    state = v.derivative
    if not isinstance(state, ModelVariable) or shapes.get(state.name) != shapes[v.name]:
        return ""
    return next(name for name, k in _elements(state, shapes) if k == index)


def is_name(text: str) -> bool:
    """Whether it names a file in its folder. FMI wants a name of C; that matters in FMI 1.0, whose functions begin with it."""
    return 0 < len(text) <= 200 and text.isprintable() and not text.startswith(".") and not set(text) & set("/\\:")
