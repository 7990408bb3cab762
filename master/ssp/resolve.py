"""Connections followed from FMU to FMU, and values down to FMUs: what was taken in becomes a flat system."""

from __future__ import annotations

from collections.abc import Iterator

from ..errors import DescriptionError
from .arrays import Arrays, names
from .flat import Affine, Joint, Mapping, Named, Port, Renaming, conversion_of
from .taken import Binding, TakenIn
from .values import as_item, changed, composed, is_number


def resolve(taken: TakenIn) -> None:
    """Fill in the connections and start values of its flat system. Raises DescriptionError."""
    _Resolved(taken).all()


class _Resolved:
    def __init__(self, taken: TakenIn):
        self.taken, self.flat = taken, taken.flat
        self.kinds, self.units, self.notes = taken.kinds, taken.units, taken.notes
        self.into: dict[Port, Joint] = {}
        self.outof: dict[Port, list[Joint]] = {}
        self.dotted = any("." in path for path in taken.ports)  # whether names of elements have dots in them

    def all(self) -> None:
        taken = self.taken
        if any(v.dimensions for described in taken.described.values() for v in described.modelVariables):
            self._size()
        self._orient()
        self.arrays = Arrays(taken.shapes, taken.links, self.notes)
        for port in list(taken.shapes):
            if port[0] in self.flat.fmus:
                continue
            for element in self.arrays.elements(port):
                self.kinds[element], self.units[element] = self.kinds[port], self.units[port]
        self._follow(self.arrays.joints())
        self._silent()
        for port in self.into:
            if port[0] in self.flat.fmus:
                self._connect(port)
        self._give()

    # --- before -----------------------------------------------------------------------------------------------------

    def _size(self) -> None:
        """Arrays whose sizes are structural parameters, where a document gives these."""
        self._follow([link for link in self.taken.links if not self.taken.shapes.get(link.end) and not link.either])
        start = {port: value for port, (_, value) in self._given([], numbers=True).items()}
        for path, description in self.taken.described.items():
            mine = {name: value for (component, name), value in start.items() if component == path}
            self.taken.variables(path, description, mine)

    def _orient(self) -> None:
        """Connections between entries of signal dictionaries go from the one that something is given to."""
        waiting = [link for link in self.taken.links if link.either]
        for _ in range(len(waiting)):
            fed = {link.end for link in self.taken.links if not link.either}
            for link in waiting:
                if link.either and (link.start in fed) != (link.end in fed):
                    link.either = False
                    if link.end in fed:
                        link.start, link.end, link.indices = link.end, link.start, link.indices[::-1]
        for link in waiting:
            if link.either:
                raise DescriptionError(
                    f"{'.'.join(link.start)} and {'.'.join(link.end)}: nobody says which of them gives a value."
                )

    def _follow(self, links: list[Joint]) -> None:
        self.into, self.outof = {}, {}
        for link in links:
            if link == self.into.get(link.end):
                self._note(f"the connection {'.'.join(link.start)} → {'.'.join(link.end)} is there twice; it is used once")
                continue
            if link.end in self.into:
                raise DescriptionError(
                    f"{'.'.join(link.end)} has two sources: {'.'.join(self.into[link.end].start)} and {'.'.join(link.start)}."
                )
            self.into[link.end] = link
        for link in self.into.values():
            self.outof.setdefault(link.start, []).append(link)

    # --- connections --------------------------------------------------------------------------------------------------

    def _connect(self, port: Port) -> None:
        """Follow an FMU's input back to an FMU's output."""
        source, way = port, list[Joint]()
        while source in self.into and (source == port or source[0] not in self.flat.fmus):
            way.append(self.into[source])
            source = way[-1].start
            if len(way) > len(self.into):
                raise DescriptionError(f"{'.'.join(port)}: its connection goes round in a circle of system connectors.")
        if source[0] not in self.flat.fmus:
            return
        where = f"{'.'.join(source)} → {'.'.join(port)}"
        change: Affine | Mapping = Affine()
        renamings = [link.transform for link in way[::-1] if isinstance(link.transform, Renaming)]
        for link in way[::-1]:
            change = composed(change, self._converted(link), where)
            if not isinstance(link.transform, Renaming):
                change = composed(change, link.transform, where)
        if renamings:
            names_ = {old: old for one in renamings for old, _ in one.entries}
            for one in renamings:
                names_ = {old: dict(one.entries).get(new, new) for old, new in names_.items()}
            given, items = (self.taken.items.get(end, {}) for end in (source, port))
            change = composed(
                Renaming(tuple((old, new) for old, new in names_.items() if old in given)).between(given, items, where),
                change,
                where,
            )
        else:
            self._compare(source, port, change)
        self.flat.connections[port] = source, change

    def _converted(self, link: Joint) -> Affine:
        """What the units at the ends of a connection do to a value."""
        start, end = self.units.get(link.start), self.units.get(link.end)
        if not (link.convert and start and end):
            return Affine()
        own = link.start[0] in self.flat.fmus and link.end[0] in self.flat.fmus
        return self._unit(start, end, f"{'.'.join(link.start)} → {'.'.join(link.end)}", own)

    def _unit(self, start: Named, end: Named, where: str, own: bool = False) -> Affine:
        """From unit to unit. One name that is defined in two ways is told: between FMUs (`own`) each definition counts, else the name."""
        if start.name != end.name:
            return start.to(end, where)
        change = conversion_of(start, end)
        if change == Affine() or not (start.name in start.declared and end.name in end.declared):
            return Affine()
        own = own and change is not None
        said = f"a value is converted by the factor {change.factor:.6g}" if own and change else "a value is passed on as it is"
        self._note(f"{where}: {start.name!r} is one unit at one end and another at the other; {said}")
        return change if own and change else Affine()

    def _note(self, said: str) -> None:
        if said not in self.notes:
            self.notes.append(said)

    def _silent(self) -> None:
        """Connectors of systems that tell no unit have that of what they are connected to (SSP 1.0, Real)."""

        def unit_at(port: Port, ahead: bool, steps: int = 0) -> Named | None:
            if self.units.get(port) or steps > len(self.into):
                return self.units.get(port)
            links = self.outof.get(port, []) if ahead else [self.into[port]] if port in self.into else []
            found = [unit_at(link.end if ahead else link.start, ahead, steps + 1) for link in links if link.convert]
            return found[0] if found and len({one.name if one else "" for one in found}) == 1 else None

        silent = [port for port, unit in self.units.items() if unit is None and port[0] not in self.flat.fmus]
        for port, unit in [(port, unit_at(port, False) or unit_at(port, True)) for port in silent]:
            self.units[port] = unit

    def _compare(self, source: Port, end: Port, change: Affine | Mapping) -> None:
        """Enumerations cross as numbers: where these mean something else at the other end, that is told."""
        if isinstance(change, Mapping):
            return
        ours, theirs = ({number: name for name, number in self.taken.items.get(port, {}).items()} for port in (source, end))
        for number in sorted(ours.keys() & theirs.keys()):
            if ours[number] != theirs[number]:
                self.notes.append(
                    f"{'.'.join(source)} → {'.'.join(end)} passes on numbers: {number} is {ours[number]!r} there, {theirs[number]!r} here"
                )
                return

    # --- values -------------------------------------------------------------------------------------------------------

    def _give(self) -> None:
        """Take every value to the FMUs. What comes through a connection wins over what is given at its end."""
        for (part, variable), (_, given) in self._given(self.notes).items():
            if part in self.flat.fmus:
                self.flat.start[part, variable] = as_item(given, self._items(part, variable), f"{part}.{variable} = {given}")
            else:
                self.flat.told[part, variable] = given

    def _items(self, part: str, variable: str):
        return self.taken.items.get((part, variable)) or self.taken.items.get((part, variable.rpartition("[")[0]))

    def _given(self, notes: list[str], numbers: bool = False) -> dict[Port, tuple[int, object]]:
        """The value of each port that one reaches, with the number of connections that it came through. numbers: of scalars alone."""
        found: dict[Port, tuple[int, object]] = {}
        for binding in sorted(self.taken.bindings, key=lambda one: -one.depth):
            if numbers and not is_number(binding.value):
                continue
            ports = self._ports(binding.path, binding.name)
            own = binding.path.rpartition("/")[2] or self.flat.root
            if not ports and binding.name.startswith(own + "."):
                if ports := self._ports(binding.path, binding.name.removeprefix(own + ".")):
                    notes.append(f"a parameter set of {own} names {binding.name!r}; it is taken as that of {own} itself")
            if not ports:
                notes.append(
                    f"a parameter set of {binding.path or 'the system'} names {binding.name!r}, which is neither a variable nor a "
                    "connector of it; it is not used"
                )
            for port in ports:
                for element, value in self._elements(port, self._fitting(binding, port)):
                    for reached, given, steps in self._down(element, value):
                        if steps >= found.get(reached, (0, None))[0]:
                            found[reached] = steps, given
        return found

    def _fitting(self, binding: Binding, port: Port) -> object:
        """The value of a binding in the unit of a port, behind its mapping."""
        value, where = binding.value, f"value of {'.'.join(port)}"
        inner = self.units.get(port)
        if binding.unit and inner and (convert := self._unit(binding.unit, inner, where)) != Affine():
            value = changed(value, convert, where)
        return changed(value, binding.change, binding.origin)

    def _elements(self, port: Port, value: object) -> list[tuple[Port, object]]:
        """The elements of an array with their values; one value is that of each."""
        shape = self.taken.shapes.get(port, ())
        if not shape:
            if isinstance(value, tuple):
                raise DescriptionError(f"{'.'.join(port)} is given {len(value)} values, and is no array.")
            return [(port, value)]
        if any(size is None for size in shape):
            return []  # of how many elements nobody says: nothing is connected to it
        ports = [(port[0], name) for name in names(port[1], tuple(size or 0 for size in shape))]
        values = value if isinstance(value, tuple) else (value,) * len(ports)
        if len(values) != len(ports):
            raise DescriptionError(f"{'.'.join(port)} has {len(ports)} elements, it is given {len(values)} values.")
        return list(zip(ports, values))

    def _ports(self, path: str, name: str) -> list[Port]:
        """The ports that a hierarchical parameter name means, seen from the element at `path`: one, or several that are called so."""
        found = [(path, name)] if (path, name) in self.kinds else []
        elements = name.split(".")
        for cut in range(len(elements) - 1, 0, -1):
            for way in _ways(elements[:cut]) if self.dotted else [elements[:cut]]:
                port = ("/".join(([path] if path else []) + way), ".".join(elements[cut:]))
                if port in self.kinds:
                    found.append(port)
        return found

    def _down(self, port: Port, value: object, steps: int = 0) -> Iterator[tuple[Port, object, int]]:
        """The variables that a value given at a port reaches, and connectors on the way, each with the value in its unit."""
        yield port, value, steps
        if port[0] in self.flat.fmus:
            return
        if steps > len(self.taken.links) + len(self.into):
            raise DescriptionError(f"{'.'.join(port)}: its connection goes round in a circle of system connectors.")
        for link in self.outof.get(port, []):
            where = f"{'.'.join(link.start)} → {'.'.join(link.end)}"
            given = value
            if (convert := self._converted(link)) != Affine() and (is_number(value) or isinstance(value, tuple)):
                given = changed(given, convert, where)
            if not (isinstance(link.transform, Affine) and not is_number(value)):
                given = changed(given, link.transform, where)
            yield from self._down(link.end, given, steps + 1)


def _ways(parts: list[str]) -> Iterator[list[str]]:
    """How a dotted name may be one of elements in one another: names of elements may have dots themselves."""
    for cuts in range(1 << min(len(parts) - 1, 6)):
        way = [parts[0]]
        for k, part in enumerate(parts[1:]):
            if k < 6 and cuts >> k & 1:
                way[-1] += f".{part}"
            else:
                way.append(part)
        yield way
