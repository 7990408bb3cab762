"""What reading an SSP leads to: a system without hierarchy, values in the units of the FMUs' own variables."""

from __future__ import annotations

from dataclasses import dataclass, field
from pathlib import Path

from ..errors import DescriptionError
from ..units import Declared, conversion
from .others import Others

Port = tuple[str, str]  # (element path, connector); the path of a system is that of the system itself
Items = dict[str, int]  # of an enumeration: numbers by name


@dataclass(frozen=True)
class Affine:
    """y = factor · x + offset; `f.then(g)` is g after f."""

    factor: float = 1.0
    offset: float = 0.0

    def then(self, other: Affine) -> Affine:
        return Affine(other.factor * self.factor, other.factor * self.offset + other.offset)

    def __call__(self, value: float) -> float:
        return self.factor * value + self.offset


@dataclass(frozen=True)
class Mapping:
    """Whole numbers, Booleans as 0 and 1, that become others; those that it does not name stay (SSP, Transformation Choice)."""

    entries: tuple[tuple[int, int], ...] = ()

    def then(self, other: Mapping) -> Mapping:
        first, second = dict(self.entries), dict(other.entries)
        both = {**second, **{old: second.get(new, new) for old, new in first.items()}}
        return Mapping(tuple(both.items()))

    def __call__(self, value: float) -> float:
        new = dict(self.entries).get(int(value), value) if value == int(value) else value
        return bool(new) if isinstance(value, bool) else new


@dataclass(frozen=True)
class Renaming:
    """Items of an enumeration that become others, by their names."""

    entries: tuple[tuple[str, str], ...] = ()

    def between(self, given: Items, taken: Items, where: str) -> Mapping:
        """The same in numbers, from one enumeration to another. An item that it does not name stays what its name says."""
        names = {name: name for name in given if name in taken} | dict(self.entries)
        for name, items in [(old, given) for old in dict(self.entries)] + [(new, taken) for new in dict(self.entries).values()]:
            if name not in items:
                raise DescriptionError(
                    f"{where}: its mapping names {name!r}, which is no item there ({', '.join(items) or 'none is known'})."
                )
        return Mapping(tuple((given[old], taken[new]) for old, new in names.items()))


Change = Affine | Mapping | Renaming


@dataclass(frozen=True)
class Named:
    """A unit's name, and what the document or FMU that uses the name says of its units."""

    name: str
    declared: Declared

    def to(self, other: Named, where: str) -> Affine:
        """From this unit to another one. Raises DescriptionError where they measure different things."""
        if self.name == other.name and not (self.name in self.declared and other.name in other.declared):
            return Affine()
        try:
            return Affine(*conversion(self.name, other.name, self.declared, other.declared))
        except DescriptionError as error:
            raise DescriptionError(f"{where}: {error}.") from None


def conversion_of(unit: Named, other: Named) -> Affine | None:
    """From one unit to another by what their files say; None where that is not possible."""
    try:
        return unit.to(other, "")
    except DescriptionError:
        return None


@dataclass
class Joint:
    """One ssd:Connection between two ports, with what it does to the value."""

    start: Port
    end: Port
    transform: Change
    convert: bool
    indices: tuple[tuple[int, ...], tuple[int, ...]] = ((), ())  # of the elements of arrays that it is about, as written; (): all
    either: bool = False  # nobody has said yet which of its ends gives


@dataclass
class Flat:
    """A system structure without its hierarchy. Values and transforms are in the units of the FMUs' variables."""

    name: str
    description: str
    fmus: dict[str, Path] = field(default_factory=dict)  # component path → its file, of an FMU or a table
    interfaces: dict[str, str] = field(default_factory=dict)  # component path → "cs", "me" or "se", where it is told
    places: dict[str, str] = field(default_factory=dict)  # component path → "machine:port" where it runs; "": in a process here
    tables: dict[str, dict[str, str]] = field(default_factory=dict)  # component path → the types of its columns
    connections: dict[Port, tuple[Port, Affine | Mapping]] = field(default_factory=dict)  # input → (output, transform)
    start: dict[Port, object] = field(default_factory=dict)
    root: str = ""  # the name of the outermost system
    told: dict[Port, object] = field(default_factory=dict)  # values of connectors of systems
    start_time: float = 0.0
    stop_time: float | None = None
    smallest_step: float = 0.0  # of the FMUs' default experiments, s; 0: none says one
    notes: list[str] = field(default_factory=list)  # what was mended or is not used, a sentence each
    others: Others = field(default_factory=Others)  # what the annotations of other tools say
    ours: dict = field(default_factory=dict)  # what our annotation says, if it is there; see write.py
