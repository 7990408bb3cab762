"""What is taken in of the documents of a system structure before its connections and values are followed."""

from __future__ import annotations

from dataclasses import dataclass, field

from fmpy.model_description import ModelDescription

from ..described import sizes_in, units_of, variables_of
from .arrays import Shape
from .flat import Change, Flat, Items, Joint, Named, Port
from .values import items_of


@dataclass
class Binding:
    """A value that is given to a port, or to what a hierarchical name means, seen from an element."""

    depth: int  # of the element in the hierarchy: higher levels win, then later ones
    path: str
    name: str
    value: object
    unit: Named | None
    origin: str  # where it stands, and what it is called there
    change: Change  # of the value, behind the conversion of units


@dataclass
class TakenIn:
    flat: Flat
    units: dict[Port, Named | None] = field(default_factory=dict)
    links: list[Joint] = field(default_factory=list)
    kinds: dict[Port, str] = field(default_factory=dict)
    items: dict[Port, Items] = field(default_factory=dict)  # of FMUs' variables that are enumerations
    ports: dict[str, set[str]] = field(default_factory=dict)  # the connectors of each element
    shapes: dict[Port, Shape] = field(default_factory=dict)  # of arrays
    described: dict[str, ModelDescription] = field(default_factory=dict)
    bindings: list[Binding] = field(default_factory=list)
    dictionaries: dict[str, dict[str, str]] = field(default_factory=dict)  # of each system: path by name

    @property
    def notes(self) -> list[str]:
        return self.flat.notes

    def variables(self, path: str, description: ModelDescription, start: dict[str, object] | None = None) -> None:
        """The variables of a component's FMU as ports, arrays as such and by their elements. start: what it is given."""
        own, sizes = units_of(description), sizes_in(description, start or {})
        self.described[path] = description
        arrays = {v.name: v for v in description.modelVariables if v.dimensions}
        for name in [name for name in self.kinds if name[0] == path and name[1].partition("[")[0] in arrays]:
            del self.kinds[name]
        for told in variables_of(description, sizes):
            port = path, told.name
            self.units.setdefault(port, Named(told.unit, own) if told.unit else None)
            self.kinds[port] = told.causality
            stem = told.name.rpartition("[")[0]
            if stem in arrays:
                self.kinds[path, stem] = told.causality
                self.units.setdefault((path, stem), self.units[port])
                last = told.name[len(stem) + 1 : -1].split(",")
                self.shapes[path, stem] = tuple(map(int, last))  # of its last element
        for variable in description.modelVariables:
            if items := items_of(variable):
                self.items[path, variable.name] = items
