"""Where a correction may sit in a system, what its law may go with, and the system with corrections put in."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass, replace

from selflock.fmus.correction.law import DIFFERENCE, INTEGRAL, PRODUCT, RATE, ROOTED, SINCE_TURN, VALUE
from selflock.master.system import Component, Connection, System

from ..systems.parts import LOG, Parts

IN, OUT, READ = "in", "out", "read"
WORDS = {
    VALUE: "{}",
    RATE: "the rate of {}",
    INTEGRAL: "the integral of {}",
    SINCE_TURN: "the time since {} turned",
    DIFFERENCE: "{} - {}",
    PRODUCT: "{} · {}",
    ROOTED: "{} · sqrt|{}|",
}
MIDDLE = 0.5  # of a step: there a held law is right to second order


@dataclass(frozen=True)
class Place:
    """Before an input (IN), behind an output for all that listen to it (OUT), or of an output only as it is recorded (READ)."""

    where: str
    variable: str  # component.variable

    def __str__(self) -> str:
        return f"{'recorded ' if self.where == READ else ''}{self.variable}"


@dataclass(frozen=True)
class Insert:
    """A correction: where it sits, its law, and what the law goes with."""

    name: str  # of its component
    place: Place
    law: str
    multiplies: bool = False
    over: str = ""  # the variable; "" of a path
    taken: int = VALUE
    points: int = 0  # of a table
    fixed: tuple[tuple[str, float], ...] = ()  # numbers that no fit changes
    beside: str = ""  # a second variable

    @property
    def goes_with(self) -> str:
        """What the law goes with, in words."""
        return WORDS[self.taken].format(self.over, self.beside) if self.over else ""

    @property
    def own(self) -> bool:
        """Whether the law goes with the signal itself."""
        return self.over == self.place.variable and not self.beside


def of_system(parts: Parts, members: Sequence[str], fed: Iterable[str], recorded: Iterable[str]) -> list[Place]:
    """All places among these components: inputs that something gives, and recorded outputs."""
    given = {*fed, *parts.links}
    inputs = [
        Place(IN, name)
        for component in members
        for name in parts.inputs[component]
        if name in given and parts.variables[name].type == "Real"
    ]
    heard = {f"{link.source}.{link.output}" for link in parts.links.values() if link.target in members}
    outputs = [Place(OUT, name) for name in recorded if parts.variables[name].type == "Real"]
    return inputs + outputs + [Place(READ, place.variable) for place in outputs if place.variable in heard]


def origin(parts: Parts, name: str) -> str:
    """What a variable is given by a link, else itself."""
    link = parts.links.get(name)
    return f"{link.source}.{link.output}" if link else name


def quantities(parts: Parts, component: str, names: Sequence[str]) -> tuple[list[str], list[str]]:
    """Variables of a component, and what there is beside these, each quantity once.

    An input is what its link gives it, by another name and read at another time, for which `ahead` makes up.
    """
    mine = [name for name in names if name in parts.variables and parts.owner(name) == component]
    known = {origin(parts, name) for name in mine}
    others: dict[str, str] = {}
    for name in sorted((name for name in names if name not in mine), key=lambda name: name in parts.links):
        others.setdefault(origin(parts, name), name)
    return mine, [name for quantity, name in others.items() if quantity not in known]


def extended(
    system: System, parts: Parts, inserts: Sequence[Insert], make: Callable[[Insert], Component]
) -> tuple[System, dict[str, str]]:
    """The system with corrections, each right before or behind its component; and what outputs are called behind them."""
    plain = _plain(system, parts)
    connections, components, order = dict(plain), dict(system.components), list(system.order)
    moved: dict[str, str] = {}
    for one in inserts:
        variable, corrected = one.place.variable, f"{one.name}.corrected"
        component = parts.owner(variable)
        if one.place.where == IN:
            if variable in connections:
                connections[f"{one.name}.signal"] = connections[variable]
            connections[variable] = Connection(corrected, convert=False)
            order.insert(order.index(component), one.name)
        else:
            connections[f"{one.name}.signal"] = Connection(moved.get(variable, variable), convert=False)
            if one.place.where == OUT:
                for target, c in connections.items():
                    if c.source == variable and not target.startswith(f"{one.name}."):
                        connections[target] = replace(c, source=corrected)
            behind = moved.get(variable, variable).rpartition(".")[0] if variable in moved else component
            order.insert(order.index(behind) + 1, one.name)
            moved[variable] = corrected
        for target, over in (("x", "" if one.own else one.over), ("beside", one.beside)):
            if over and (heard := _heard(system, plain, parts, over)):
                connections[f"{one.name}.{target}"] = heard
        made = make(one)
        idle = {target: 0.0 for target in ("x", "beside") if f"{one.name}.{target}" not in connections}
        components[one.name] = replace(made, start=idle | made.start)  # a system may leave no input open
    wanted = [moved.get(name, name) for name in system.run.record]
    return replace(
        system, components=components, connections=connections, run=replace(system.run, order=order, record=wanted)
    ), moved


def _plain(system: System, parts: Parts) -> dict[str, Connection]:
    """What inputs are given where nothing is corrected."""
    return {
        name: Connection(c.source, parts.links[name].factor, parts.links[name].offset, convert=False)
        if name in parts.links and not c.mapping and not c.source.startswith(f"{LOG}.")
        else c
        for name, c in system.connections.items()
    }


def _heard(system: System, plain: dict[str, Connection], parts: Parts, over: str) -> Connection | None:
    """How a correction is given a variable; None where nothing there has it."""
    if over in plain:
        return plain[over]
    if over in parts.variables and parts.variables[over].causality != "input":
        return Connection(over, convert=False)
    return Connection(f"{LOG}.{over}", convert=False) if LOG in system.components else None


def listening(
    plain: System,
    system: System,
    parts: Parts,
    moved: dict[str, str],
    place: Place,
    overs: Sequence[str],
    make: Callable[[Insert], Component],
) -> tuple[System, dict[str, str]]:
    """The system, in which `plain` was extended, with ears for what a correction at a place would be given; and their columns.

    The signal is under "". An ear passes nothing on, so that the system does as it did.
    """
    variable, component = place.variable, parts.owner(place.variable)
    connections, components, order = dict(system.connections), dict(system.components), list(system.order)
    behind = moved.get(variable, variable).rpartition(".")[0] if variable in moved else component
    at = order.index(component) if place.where == IN else order.index(behind) + 1
    given, columns = _plain(plain, parts), {}
    for k, over in enumerate(("", *overs)):
        if over:
            heard = _heard(plain, given, parts, over)
        else:
            heard = connections.get(variable) if place.where == IN else Connection(moved.get(variable, variable), convert=False)
        if heard is None:
            continue
        ear = f"ear_{k + 1}"
        made = make(Insert(ear, place, "constant", over=over))
        components[ear] = replace(made, start={"x": 0.0, "beside": 0.0} | made.start)
        connections[f"{ear}.signal"] = heard
        order.insert(at, ear)
        columns[over] = f"{ear}.signal"
    record = [*system.run.record, *columns.values()]
    return replace(
        system, components=components, connections=connections, run=replace(system.run, order=order, record=record)
    ), columns


def ahead(parts: Parts, place: Place, over: str, smooth: bool) -> float:
    """By which share of a step x must be carried on to be that of the step's middle, or of what is recorded.

    A component that is stepped before the correction tells x of the step's end, one behind it that of its begin; the log
    that of the begin, or where the rig reads it so that of the middle. What is recorded is of the step's end.
    """
    if over == place.variable:
        return 0.0
    component = parts.owner(place.variable)
    wanted = MIDDLE if place.where == IN else 1.0
    link = parts.links.get(over)
    source = link.source if link else parts.owner(over) if over in parts.variables else ""
    causality = parts.variables[over].causality if over in parts.variables else "input"
    if link is None and causality == "input":  # the log's
        if place.where == IN:
            return 0.0  # as the FMU is given its inputs
        return wanted - (MIDDLE if smooth else 0.0)
    ranks = {name: k for k, name in enumerate(parts.system.order)}
    known_at = 1.0 if ranks[source] < ranks[component] or (source == component and place.where != IN) else 0.0
    return wanted - known_at
