"""From a system to parts that fit together: everything that can be checked before the first step is checked here."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field, replace
from fnmatch import fnmatchcase
from functools import cached_property
from typing import Any

from .algorithms import ALGORITHMS, Algorithm, Iterated
from .code import load_part, named
from .errors import DescriptionError
from .face import Part, Variable
from .folder import packed
from .garbage import left_alone
from .manoeuvre import Manoeuvre
from .slips import checked
from .system import Component, Connection, System, did_you_mean
from .units import conversion
from .values import given, made_of, resolved

STARTING = ("exact", "approx")  # `initial` of what is computed from a start value on
SIGNALS = ("input", "output")  # what a pattern of recorded names stands for
FITS = {"Real": ("Real", "Integer", "Boolean"), "Integer": ("Integer", "Boolean"), "Boolean": ("Boolean",), "String": ("String",)}


@dataclass(frozen=True, slots=True)
class Link:
    """target.input = factor · source.output + offset, or what its mapping makes of it; units are in the factor and the offset."""

    source: str
    output: str
    target: str
    input: str
    factor: float = 1.0
    offset: float = 0.0
    text: bool = False  # a string
    mapping: tuple[tuple[float, float], ...] = ()  # numbers that become others

    def __str__(self) -> str:
        return f"{self.source}.{self.output} -> {self.target}.{self.input}"


@dataclass(frozen=True)
class Wrong:
    """What is seen instead of a value at the start, where all faults add to it or put another in its place."""

    keeps: bool  # the value counts
    adds: float
    whole: bool

    def __call__(self, value: float) -> float:
        seen = value + self.adds if self.keeps else self.adds
        return round(seen) if self.whole else seen


@dataclass
class Wiring:
    """Parts with their values set, not yet initialized, and what goes where."""

    system: System
    parts: dict[str, Part] = field(default_factory=dict)
    links: list[Link] = field(default_factory=list)
    values: dict[str, dict[str, Any]] = field(default_factory=dict)  # given values by component
    record: dict[str, list[str]] = field(default_factory=dict)  # recorded variables by component
    bound: dict[str, tuple[list[str], list[str]]] = field(default_factory=dict)  # names in u and in y by component
    wrong: dict[tuple[str, str], Wrong] = field(default_factory=dict)  # what faults make of it at the start

    def seen(self, component: str, variable: str, value: float) -> float:
        """What others see of a number at the start."""
        wrong = self.wrong.get((component, variable))
        return value if wrong is None else wrong(value)

    @cached_property
    def algorithm(self) -> Algorithm:
        """How the parts are stepped; it knows those that are no functions of time."""
        kind = ALGORITHMS[self.system.run.algorithm]
        if kind is Iterated:
            from .circles import coupled

            return kind(name for names, _ in coupled(self) for name in names)
        return kind(name for name in self.system.order if not self.parts[name].timed)

    @cached_property
    def into(self) -> dict[str, list[Link]]:
        """What goes into each component, once all links are there."""
        return self._by(lambda link: link.target)

    @cached_property
    def out_of(self) -> dict[str, list[Link]]:
        """What comes out of each component, once all links are there."""
        return self._by(lambda link: link.source)

    def _by(self, end: Callable[[Link], str]) -> dict[str, list[Link]]:
        found: dict[str, list[Link]] = {name: [] for name in self.parts}
        for link in self.links:
            found[end(link)].append(link)
        return found

    def variable(self, name: str, where: str) -> tuple[str, Variable]:
        """The component and the variable called component.variable."""
        component, variable = self.system.split(name, where)
        known = self.parts[component].variables
        if variable not in known:
            raise DescriptionError(f"{where}: {component} has no variable {variable}{did_you_mean(variable, known)}")
        return component, known[variable]

    def close(self) -> None:
        for part in self.parts.values():
            part.close()


@left_alone()
def wire(system: System, settings: dict[str, Any] | None = None, keep: dict[str, Part] | None = None) -> Wiring:
    """Make the parts of `system` and check all that is said about them. `settings`: component.variable = value.

    Parts in `keep` are taken out of it and reset instead of made again.
    """
    system, settings = given(checked(system), settings or {})
    written, system = system, resolved(system)
    wiring = Wiring(system)
    if not system.components:
        raise DescriptionError("The system has no components: add at least one [components.name] with an fmu or a part.")
    try:
        for name, component in system.components.items():
            kept = keep.pop(name, None) if keep else None
            mine = {split[1]: value for key, value in settings.items() if (split := system.split(key, "settings"))[0] == name}
            if kept and not kept.suits(component.start | mine):
                kept.close()
                kept = None
            wiring.parts[name] = kept or make(name, replace(component, start=component.start | mine), system)
            if kept:
                kept.reset()
        _values(wiring, written, settings)
        for target, connection in system.connections.items():
            wiring.links.append(linked(wiring, target, connection))
        if not system.run.open_inputs:
            all_given(wiring)
        _record(wiring)
        _order(wiring)
        _bind(wiring)
        for name, values in wiring.values.items():
            for variable, value in values.items():
                wiring.parts[name].set(variable, value)
    except BaseException:
        wiring.close()
        raise
    return wiring


def make(name: str, component: Component, system: System) -> Part:
    """The part that a component asks for."""
    where = f"[components.{name}]"
    if component.manoeuvre:
        return Manoeuvre(name, system.folder / component.manoeuvre)
    if component.part:
        if component.isolate or component.step_timeout:
            raise DescriptionError(f"{where}: isolate and step_timeout are for FMUs; a part runs in this process.")
        if component.tolerance is not None or component.interface:
            raise DescriptionError(
                f"{where}: tolerance and interface are for FMUs, which have solvers and interfaces of their own."
            )
        given = component.part  # a class is there already: it is its user's own code
        kind = load_part(given, where, system.allow_code) if isinstance(given, str) else given
        try:
            part = kind(name, **component.options)
        except TypeError as error:
            raise DescriptionError(f"{where} options: {error}.") from None
        if not isinstance(part, Part):
            raise DescriptionError(
                f'{where} part = "{named(component.part)}" is no selflock.master.Part. Derive its class from that; it needs to define '
                "only what it does otherwise."
            )
        return part
    from .anybody import part_of
    from .binary import open_fmu

    limit, tolerance = component.step_timeout, _tolerance(where, component, system)
    if not 0.0 <= limit < 1e9:
        raise DescriptionError(f"{where} step_timeout = {limit:g}: a time in s is wanted here.")
    if component.host:
        from .remote import RemotePart

        if component.process or component.isolate:
            raise DescriptionError(
                f"{where}: its FMU runs in a process at {component.host}; `selflock serve --isolate` isolates it there."
            )
        return RemotePart(name, component.host, component.fmu, limit, tolerance, component.interface, component.start)
    path = fmu_path(component, system)
    isolate = component.isolate or system.isolate
    apart = component.process or isolate or limit > 0.0  # then it is not even unpacked here
    if not apart:
        binary = open_fmu(path, system.unlimited)
        try:
            _, way = binary.interface(component.interface)
        except DescriptionError as error:
            raise DescriptionError(f"{where}: {error}") from None
        apart = way.canBeInstantiatedOnlyOncePerProcess
    if apart:
        from .process import ProcessPart

        return ProcessPart(name, path, system.unlimited, isolate, limit, tolerance, component.interface, component.start)
    return part_of(name, path, tolerance, component.interface, component.start)


def _tolerance(where: str, component: Component, system: System) -> float | None:
    """What an FMU's solver is told; 0: nothing, None: what its default experiment says."""
    run, own = system.run.fmu_tolerance, component.tolerance
    told, where = (own, f"{where} tolerance") if own is not None else (run, "[run] fmu_tolerance")
    if told is not None and not 0.0 <= told < 1.0:
        raise DescriptionError(f"{where} = {told:g}: a relative tolerance below 1 is wanted here, or 0 for none.")
    return told


def fmu_path(component: Component, system: System):
    """The file of a component's FMU; those of this package are built when they are not there yet."""
    if component.fmu.startswith("selflock:"):
        from selflock.fmus.build import built

        return built(component.fmu.removeprefix("selflock:"))
    return packed(system.folder / component.fmu)


# --- values ------------------------------------------------------------------------------------------------------


def _values(wiring: Wiring, written: System, settings: dict[str, Any]) -> None:
    """Start values and settings, checked; `written`: the system with the expressions from which start values were computed."""
    given = [
        (f"[components.{name}.start]", name, variable, value)
        for name, component in wiring.system.components.items()
        for variable, value in component.start.items()
    ]
    given += [("settings", *wiring.system.split(name, "settings"), value) for name, value in settings.items()]
    for where, name, variable, value in given:
        _, known = wiring.variable(f"{name}.{variable}", where)
        try:
            wiring.values.setdefault(name, {})[variable] = typed(known, value, f"{where} {name}.{variable}")
        except DescriptionError as error:
            of = made_of(written, written.components[name].start.get(variable)) if where != "settings" else ""
            raise DescriptionError(f"{error}{of}") from None


def typed(variable: Variable, value: Any, where: str) -> Any:
    """`value`, which may be text, as the variable's type wants it, checked against its range."""
    if variable.sized == "Clock" and variable.causality != "input":
        raise DescriptionError(f"{where}: a clock that ticks by time, or that the FMU itself ticks, cannot be set.")
    computed = variable.causality in ("calculatedParameter", "independent") or variable.variability == "constant"
    if computed or (variable.causality == "output" and variable.initial not in STARTING):
        raise DescriptionError(f"{where}: an {variable.causality} is computed, it cannot be set.".replace("an calc", "a calc"))
    try:
        return variable.taken(value)
    except ValueError as error:
        raise DescriptionError(f"{where} = {value} {error}.") from None


# --- connections -------------------------------------------------------------------------------------------------


def linked(wiring: Wiring, target: str, connection: Connection) -> Link:
    where = f"[connections] {target} = {connection.source}"
    to, sink = wiring.variable(target, where)
    of, source = wiring.variable(connection.source, where)
    if sink.causality != "input":
        raise DescriptionError(
            f"{where}: {target} is no input ({sink.causality}). The target stands on the left, the source on the right."
        )
    if source.causality in ("input", "parameter"):
        raise DescriptionError(f"{where}: {connection.source} is an {source.causality}, not an output.".replace("an p", "a p"))
    if source.type not in FITS[sink.type] or (source.sized == "Binary") != (sink.sized == "Binary"):
        kinds = ("Binary" if v.sized == "Binary" else v.type for v in (source, sink))
        raise DescriptionError(f"{where}: {' does not fit into '.join(kinds)}.")
    changes = gain, shift = float(connection.factor), float(connection.offset)
    if sink.type in ("Boolean", "String") and changes != (1.0, 0.0):
        raise DescriptionError(f"{where}: {target} is a {sink.type}, factor and offset have no meaning there.")
    if sink.type == "Integer" and any(change != int(change) for change in changes):
        raise DescriptionError(f"{where}: {target} is an Integer; factor and offset must be whole numbers.")
    if connection.mapping:
        if sink.type not in ("Integer", "Boolean") or source.type not in ("Integer", "Boolean") or changes != (1.0, 0.0):
            raise DescriptionError(
                f"{where}: a mapping is of Integers and Booleans, without factor and offset; this is {source.type} to {sink.type}."
            )
        pairs = [(_mapped(old, source, where), _mapped(new, sink, where)) for old, new in connection.mapping.items()]
        return Link(of, source.name, to, sink.name, mapping=tuple(pairs))
    if sink.type == "String":
        return Link(of, source.name, to, sink.name, text=True)
    factor, offset = 1.0, 0.0
    if connection.convert:
        units = (wiring.parts[name].units for name in (of, to))
        try:
            factor, offset = conversion(source.unit, sink.unit, *units)
        except DescriptionError as error:
            if file := wiring.parts[of].header:
                raise DescriptionError(
                    f"{file}: column {source.name}: {str(error).partition(';')[0]}. Write its numbers in {sink.unit}, and that behind its name."
                ) from None
            raise DescriptionError(f"{where}: {error}. Connect what has the same dimension, or say convert = false.") from None
    return Link(of, source.name, to, sink.name, gain * factor, gain * offset + shift)


def _mapped(value: Any, variable: Variable, where: str) -> float:
    """One side of an entry of a mapping as a number."""
    try:
        return float(Variable(variable.name, type=variable.type, sized=variable.sized).taken(value))
    except ValueError as error:
        raise DescriptionError(f"{where}: in its mapping {value} {error}.") from None


def all_given(wiring: Wiring) -> None:
    connected = {(link.target, link.input) for link in wiring.links}
    open_ = [
        f"{name}.{v.name}"
        for name, part in wiring.parts.items()
        for v in part.variables.values()
        if v.causality == "input" and (name, v.name) not in connected and v.name not in wiring.values.get(name, {})
    ]
    if open_:
        component, variable = wiring.system.split(open_[0], "inputs")
        raise DescriptionError(
            f"Inputs that nobody gives: {', '.join(open_)}. Connect them, or hold them at a value: "
            f"{variable} = ... under [components.{component}.start]; open_inputs = true under [run] "
            "leaves all at their start values."
        )


def _record(wiring: Wiring) -> None:
    patterns = wiring.system.run.record
    used: set[str] = set()
    exact, loose = set(patterns), [p for p in patterns if any(c in p for c in "*?[")]
    for name, part in wiring.parts.items():
        chosen = []
        for v in part.variables.values():
            full = f"{name}.{v.name}"
            fits = [full] if full in exact else []
            fits += [p for p in loose if v.causality in SIGNALS and fnmatchcase(full, p)]
            used.update(fits)
            if fits or not patterns and v.causality == "output":
                chosen.append(v.name)
        wiring.record[name] = chosen
    for pattern in patterns:
        if pattern not in used:
            if not any(c in pattern for c in "*?["):
                wiring.variable(pattern, "[run] record")
            raise DescriptionError(f"[run] record: nothing is called {pattern}.")


def _order(wiring: Wiring) -> None:
    order, names = wiring.system.run.order, wiring.parts
    for name in order:
        if name not in names:
            raise DescriptionError(f"[run] order: there is no component {name}{did_you_mean(name, names)}")
    missing = [name for name in names if name not in order]
    what = f"missing: {', '.join(missing)}" if missing else "one is named twice"
    if order and (missing or len(set(order)) != len(order)):
        raise DescriptionError(f"[run] order must name every component once; {what}.")


def _bind(wiring: Wiring) -> None:
    """Say to each part what travels at every step: connected inputs; recorded and connected outputs."""
    for name, part in wiring.parts.items():
        inputs = [link.input for link in wiring.into[name] if not link.text]
        linked = set(inputs)
        numbers = [v for v in wiring.record[name] if part.variables[v].type != "String" and v not in linked]
        needed = [link.output for link in wiring.out_of[name] if not link.text]
        asked = set(needed)
        needed += [v.name for v in part.variables.values() if v.derivative_of and v.derivative_of in asked]
        faulty = [variable for component, variable in _faulty(wiring) if component == name]
        inputs += [v for v in dict.fromkeys(numbers + faulty) if part.variables[v].causality == "input" and v not in linked]
        needed += [v for v in faulty if part.variables[v].causality in ("output", "local")]
        given = set(inputs)
        outputs = list(dict.fromkeys([v for v in numbers if v not in given] + needed))
        for names in (inputs, outputs):
            names.sort(key=lambda v: part.variables[v].type, reverse=True)  # Real first, types side by side
        part.bind(inputs, outputs)
        wiring.bound[name] = inputs, outputs
        for position, variable in enumerate(inputs):
            start = wiring.values.get(name, {}).get(variable, part.variables[variable].start)
            part.u[position] = float(start or 0.0)


def _faulty(wiring: Wiring):
    for fault in wiring.system.faults:
        component, variable = wiring.variable(fault.variable, "[[faults]]")
        yield component, variable.name
