"""An SSP, 1.0 or 2.0, as a flat system of our master.

Nested systems are flattened: component M in system Drive becomes "Drive/M". A connection through the connectors of
systems becomes one connection from an FMU's output to an FMU's input, with every linear transformation and every
conversion of units on its way multiplied out. Parameter values reach FMUs through bindings at every level; a higher
level wins over a lower one, a later binding over an earlier one (SSP 1.0, ParameterBindings). Linear transformations
act after the conversion of units, at connections and in mappings alike. Which end of a connection gives is said by the
kinds of its connectors, not by start and end (SSP 1.0, Connections). Enumerations cross as their numbers.

Not supported, and refused by name: signal dictionaries, mapping transformations other than linear, binary and inout
connectors, arrays, clocks, sources outside the archive. Slips are mended in mend.py.
"""

from __future__ import annotations

import json
import math
import tempfile
from collections.abc import Iterator
from pathlib import Path

from lxml import etree

from ...fmus.units import Unit
from ..described import number_of, units_of, variables_of
from ..errors import DescriptionError
from ..reading import read_description
from .archive import ANNOTATION, inside, opened, parse, proxied, sound, tag, unpack
from .flat import Affine, Flat, Joint, Named, Port, conversion_of
from .values import Items, as_item, enumerations_in, is_number, items_of, transform, unit_of, units_in, value_of

FMU, SSD, SSP = "application/x-fmu-sharedlibrary", "application/x-ssp-definition", "application/x-ssp-package"
INTERFACES = {"CoSimulation": "cs", "ModelExchange": "me", "ScheduledExecution": "se"}  # by the words of SSP
TABLE = "application/table"  # of OMSimulator: its ComponentTable.cpp

NESTED = 100  # structures in a structure, on all levels together


def read(path: Path, folder: Path, variant: str = "SystemStructure.ssd", unlimited: bool = False) -> Flat:
    """Read `path`: an .ssp, unpacked into `folder`, a folder like an unpacked one, or an .ssd beside its files.

    Nothing outside the folder of the .ssd is read, nothing outside `folder` written. Raises DescriptionError.
    """
    notes: list[str] = []
    document = opened(path, folder, variant, unlimited, notes)
    return _Reader(document.parent, folder, notes).read(document)


class _Reader:
    def __init__(self, root: Path, room: Path, notes: list[str]):
        self.root = root
        self.room = room  # where there is room for archives in it
        room.mkdir(parents=True, exist_ok=True)
        self.nested = 0
        self.packed: dict[Path, Path] = {}  # archives in it and their .ssd, unpacked
        self.units: dict[Port, Named | None] = {}
        self.links: list[Joint] = []
        self.kinds: dict[Port, str] = {}
        self.items: dict[Port, Items] = {}  # of FMUs' variables that are enumerations
        self.ports: dict[str, set[str]] = {}
        self.bindings: list[tuple[int, int, Port, object, Named | None, Affine]] = []  # depth, order, …
        self.notes = notes  # what was mended or is not used, a sentence each
        self.flat = Flat("", "", notes=notes)

    def read(self, document: Path) -> Flat:
        root = parse(document, self.notes)
        flat = self.flat
        flat.name, flat.description = root.get("name"), root.get("description", "")
        experiment = root.find(tag("ssd:DefaultExperiment"))
        if experiment is not None:
            flat.start_time = float(experiment.get("startTime", "0"))
            flat.stop_time = float(experiment.get("stopTime")) if experiment.get("stopTime") else None
            if not math.isfinite(flat.start_time) or not math.isfinite(flat.stop_time or 0.0):
                raise DescriptionError(
                    f"{document.name}: its experiment from {flat.start_time} to {flat.stop_time} s has no end."
                )
        flat.others.look(root)
        flat.others.look(experiment)
        for annotation in root.iter(tag("ssc:Annotation")):
            if annotation.get("type") == ANNOTATION and len(annotation):
                try:
                    flat.ours = json.loads(annotation[0].text or "{}")
                except json.JSONDecodeError as error:
                    raise DescriptionError(f"{document.name}: its annotation {ANNOTATION} is damaged: {error}.") from None
        top = root.find(tag("ssd:System"))
        flat.root = top.get("name")
        self._system(top, "", document.parent, units_in(root), 0)
        self._resolve()
        return flat

    def _system(self, node: etree._Element, path: str, base: Path, units: dict[str, Unit], depth: int) -> None:
        """Take in a system and all below it. `path` is "" for the outermost."""
        self.flat.others.look(node, path)
        self._connectors(node, path, units)
        children = {}
        elements = node.find(tag("ssd:Elements"))
        for child in [] if elements is None else elements:
            if not isinstance(child.tag, str):
                continue
            kind, name = etree.QName(child).localname, child.get("name")
            if kind == "SignalDictionaryReference":
                raise DescriptionError(f"{path or 'the system'}: {name!r} is a signal dictionary, which is not supported.")
            if name in children:
                raise DescriptionError(f"{path or 'the system'}: two elements are named {name!r}.")
            children[name] = f"{path}/{name}" if path else name
            if kind == "System":
                self._system(child, children[name], base, units, depth + 1)
            else:
                self._component(child, children[name], base, units, depth + 1)
        connections = node.find(tag("ssd:Connections"))
        for connection in [] if connections is None else connections:
            self._connection(connection, path, children)
        self._parameters(node, path, base, base, depth)

    def _component(self, node: etree._Element, path: str, base: Path, units: dict[str, Unit], depth: int) -> None:
        kind, source = node.get("type", FMU), node.get("source")
        if source is None:  # SSP 2.0: as a system with nothing in it
            self.notes.append(f"{path} has no source; what is connected to it stays as it is")
            self._connectors(node, path, units)
            self._parameters(node, path, base, base, depth)
            return
        if kind in (SSD, SSP):
            source, _, fragment = source.partition("#")
            if not source:
                raise DescriptionError(
                    f"{path}: a reference to a system inside the same document (#{fragment}) is not supported."
                )
            file = inside(source, base, self.root, path, self.notes)
            self.nested += 1
            if self.nested > NESTED:
                raise DescriptionError(
                    f"{path}: more than {NESTED} system structures are in one another; at most so many are read."
                )
            if kind == SSP:
                self._package(file, fragment, path, node, base, depth)
                return
            root = parse(file, self.notes)
            self._system(root.find(tag("ssd:System")), path, file.parent, units_in(root), depth)
            self._parameters(node, path, base, base, depth)
            return
        if kind == TABLE:
            self._table(node, path, base, units)
            return
        if kind != FMU:
            raise DescriptionError(f"{path}: components of type {kind} are not supported; only FMUs, .ssd, .ssp and tables are.")
        if (wanted := node.get("implementation", "any")) in INTERFACES:
            self.flat.interfaces[path] = INTERFACES[wanted]
        source, place = proxied(source)
        if place is not None:
            self.flat.places[path] = place
        file = inside(source, base, self.root, path, self.notes)
        try:
            description, mended = read_description(file)
        except Exception as error:  # fmpy raises whatever its parser meets
            raise DescriptionError(f"{path}: {source} cannot be read as an FMU: {error}") from None
        self.notes += [f"{path}: {note}" for note in mended]
        self.flat.fmus[path] = file
        self.flat.others.look(node, path)
        step = description.defaultExperiment.stepSize if description.defaultExperiment else None
        if (step := number_of(step) or 0.0) > 0.0:
            self.flat.smallest_step = min(step, self.flat.smallest_step or step)
        own = units_of(description)
        for told in variables_of(description):
            self.units[path, told.name] = Named(told.unit, own) if told.unit else None
            self.kinds[path, told.name] = told.causality
        for variable in description.modelVariables:
            if items := items_of(variable):
                self.items[path, variable.name] = items
        self._connectors(node, path, units)
        self._parameters(node, path, base, file.parent, depth)

    def _table(self, node: etree._Element, path: str, base: Path, units: dict[str, Unit]) -> None:
        """Columns of a table over time: straight between its rows where they are Reals, else held, as OMSimulator has it."""
        source = node.get("source")
        file = self.flat.fmus[path] = inside(source, base, self.root, path, self.notes)
        if file.suffix.lower() not in (".csv", ".parquet"):
            raise DescriptionError(f"{path}: tables are read from .csv and .parquet files; {source!r} is none.")
        columns = self.flat.tables[path] = {}
        for connector in node.iterfind(f"{tag('ssd:Connectors')}/{tag('ssd:Connector')}"):
            name = connector.get("name")
            held = next((kind for kind in ("Integer", "Boolean") if connector.find(tag(f"ssc:{kind}")) is not None), "")
            columns[name] = f"held {held}" if held else "Real"
            self.kinds[path, name], self.units[path, name] = "output", None
        self._connectors(node, path, units)

    def _package(self, file: Path, fragment: str, path: str, node: etree._Element, base: Path, depth: int) -> None:
        """A system in an .ssp of its own; its sources lie in it."""
        packed = self.packed.get(file)
        if packed is None:
            packed = self.packed[file] = unpack(file, Path(tempfile.mkdtemp(dir=self.room)), self.notes)
        outer, self.root = self.root, packed.parent
        document = inside(fragment, packed.parent, packed.parent, path, self.notes) if fragment else packed
        root = parse(document, self.notes)
        self._system(root.find(tag("ssd:System")), path, document.parent, units_in(root), depth)
        self.root = outer
        self._parameters(node, path, base, base, depth)

    def _connectors(self, node: etree._Element, path: str, units: dict[str, Unit]) -> None:
        connectors = node.findall(f"{tag('ssd:Connectors')}/{tag('ssd:Connector')}")
        self.ports[path] = {connector.get("name") for connector in connectors}
        for connector in connectors:
            name, where = connector.get("name"), path or "the system"
            if connector.find(tag("ssc:Binary")) is not None:
                raise DescriptionError(f"{path}.{name}: connectors of type Binary are not supported.")
            if connector.get("kind") == "inout":
                raise DescriptionError(f"{where}: connector {name!r} is of kind inout, which is not supported.")
            real = connector.find(tag("ssc:Real"))
            unit = None if real is None else unit_of(real, units, self.notes)
            if path in self.flat.fmus:
                if (path, name) not in self.kinds:
                    self.notes.append(f"{path}: connector {name!r} is not a variable of its FMU; it is left out")
                    self.ports[path].discard(name)
                    continue
                own = self.units[path, name]
                if unit and own and unit.name == own.name:
                    if conversion_of(unit, own) != Affine():
                        self.notes.append(
                            f"{path}: {unit.name!r} is another unit in Units than in its FMU; connector {name!r} is in the FMU's"
                        )
                elif unit and own and unit.to(own, f"{path}.{name}, connector and FMU") != Affine():
                    raise DescriptionError(
                        f"{path}: connector {name!r} is in {unit.name}, its FMU says {own.name}; that is not supported."
                    )
                self.units[path, name] = own or unit  # values cross the face of an FMU in its own unit
                continue
            self.kinds[path, name] = connector.get("kind")
            self.units[path, name] = unit

    def _connection(self, node: etree._Element, path: str, children: dict[str, str]) -> None:
        ends: list[Port] = []
        gives: list[bool] = []
        for side in ("start", "end"):
            element, connector = node.get(f"{side}Element"), node.get(f"{side}Connector")
            if element is not None and element not in children and element == node.getparent().getparent().get("name"):
                self.notes.append(f"a connection names {element!r}, the system that it is in; it is taken as that")
                element = None
            if element is not None and element not in children:
                raise DescriptionError(f"{path or 'the system'}: a connection names {element!r}, which is not an element of it.")
            port = (path if element is None else children[element], connector)
            if connector not in self.ports[port[0]]:
                if port not in self.kinds or port[0] not in self.flat.fmus:
                    raise DescriptionError(
                        f"{path or 'the system'}: a connection names {'.'.join(port)!r}, which is not a connector."
                    )
                self.notes.append(f"a connection names {'.'.join(port)}, a variable of its FMU that is no connector; it is used")
            ends.append(port)
            gives.append((self.kinds[port] in ("input", "parameter")) == (element is None))
        start, end = ends if gives[0] or not gives[1] else reversed(ends)
        if gives[0] == gives[1]:
            raise DescriptionError(
                f"the connection {'.'.join(start)} → {'.'.join(end)}: {'both' if gives[0] else 'neither'} of them "
                f"{'give' if gives[0] else 'gives'} a value ({self.kinds[start]}, {self.kinds[end]})."
            )
        self.links.append(
            Joint(start, end, transform(node, ".".join(end)), node.get("suppressUnitConversion") not in ("true", "1"))
        )

    def _parameters(self, node: etree._Element, path: str, base: Path, component_base: Path, depth: int) -> None:
        """Collect what the bindings of one element say, as (depth, order, port, value, unit)."""
        for binding in node.findall(f"{tag('ssd:ParameterBindings')}/{tag('ssd:ParameterBinding')}"):
            what = f"parameters of {path or 'the system'}"
            kind = binding.get("type", "application/x-ssp-parameter-set")
            if kind != "application/x-ssp-parameter-set":
                raise DescriptionError(f"{what}: type {kind} is not supported; only SSP parameter sets are.")
            values = self._content(binding, "ssd:ParameterValues", "ssv:ParameterSet", base, component_base, what)
            if values is None:
                raise DescriptionError(f"{what}: neither a source nor values are given.")
            mapping = binding.find(tag("ssd:ParameterMapping"))
            renamed: dict[str, list[tuple[str, Affine, bool]]] | None = None
            if mapping is not None:
                entries = self._content(mapping, None, "ssm:ParameterMapping", base, component_base, what)
                renamed = {}
                for entry in entries.iter(tag("ssm:MappingEntry")):
                    change = transform(entry, f"{what}, mapping of {entry.get('source')}")
                    convert = entry.get("suppressUnitConversion") not in ("true", "1")
                    renamed.setdefault(entry.get("source"), []).append((entry.get("target"), change, convert))
            units, enumerations = units_in(values), enumerations_in(values)
            left = [] if renamed is None else [p.get("name") for p in values.iter(tag("ssv:Parameter"))]
            if left := [name for name in left if binding.get("prefix", "") + name not in (renamed or {})]:
                self.notes.append(f"{what}: of {', '.join(left)} its mapping says nothing, so they are not used")
            for parameter in values.iter(tag("ssv:Parameter")):
                name = binding.get("prefix", "") + parameter.get("name")
                value, unit = value_of(parameter, units, enumerations, what, self.notes)
                targets = [(name, Affine(), True)] if renamed is None else renamed.get(name, [])
                for target, change, convert in targets:
                    if change != Affine() and not is_number(value):
                        raise DescriptionError(f"{what}: {name} = {value} is no number, its mapping cannot change it.")
                    said = unit if convert else None
                    self.bindings.append((-depth, len(self.bindings), (path, target), value, said, change))

    def _content(self, node, inline: str | None, wanted: str, base: Path, component_base: Path, what: str):
        """The document that a binding or mapping gives inline or by its source."""
        holder = node if inline is None else node.find(tag(inline))
        if node.get("source"):
            start = component_base if node.get("sourceBase") == "component" else base
            return parse(inside(node.get("source"), start, self.root, what, self.notes), self.notes)
        found = None if holder is None else holder.find(tag(wanted))
        if found is None and inline is None:
            raise DescriptionError(f"{what}: a mapping has neither a source nor entries.")
        return found if found is None else sound(found, what, self.notes)

    def _resolve(self) -> None:
        """Follow every connection from an FMU's input back to an FMU's output, and every value down to FMUs."""
        into: dict[Port, Joint] = {}
        for link in self.links:
            if link == into.get(link.end):
                self.notes.append(f"the connection {'.'.join(link.start)} → {'.'.join(link.end)} is there twice; it is used once")
                continue
            if link.end in into:
                raise DescriptionError(
                    f"{'.'.join(link.end)} has two sources: {'.'.join(into[link.end].start)} and {'.'.join(link.start)}."
                )
            into[link.end] = link
        outof: dict[Port, list[Joint]] = {}
        for link in into.values():
            outof.setdefault(link.start, []).append(link)
        self._silent(into, outof)
        for port in into:
            if port[0] in self.flat.fmus:
                source, change, steps = port, Affine(), 0
                while source in into and (source == port or source[0] not in self.flat.fmus):
                    link = into[source]
                    change, source, steps = self._through(link).then(change), link.start, steps + 1
                    if steps > len(into):
                        raise DescriptionError(f"{'.'.join(port)}: its connection goes round in a circle of system connectors.")
                if source[0] in self.flat.fmus:
                    self.flat.connections[port] = (source, change)
                    self._compare(source, port)
        self._give(outof)

    def _give(self, outof: dict[Port, list[Joint]]) -> None:
        """Take every value to the FMUs. What comes through a connection wins over what is given at its end."""
        found: dict[Port, tuple[int, object]] = {}  # with the number of connections it came through
        for _, _, (path, name), value, unit, change in sorted(self.bindings, key=lambda entry: entry[:2]):
            port, own = self._port(path, name), path.rpartition("/")[2] or self.flat.root
            if port is None and name.startswith(own + "."):
                if port := self._port(path, name.removeprefix(own + ".")):
                    self.notes.append(f"a parameter set of {own} names {name!r}; it is taken as that of {own} itself")
            if port is None:
                self.notes.append(
                    f"a parameter set of {path or 'the system'} names {name!r}, which is neither a variable nor a connector "
                    "of it; it is not used"
                )
                continue
            if is_number(value):
                inner = self.units.get(port)
                convert = unit.to(inner, f"value of {'.'.join(port)}") if unit and inner else Affine()
                value = convert.then(change)(value) if convert.then(change) != Affine() else value
            for reached, given, steps in self._down(port, value, outof):
                if steps >= found.get(reached, (0, None))[0]:
                    found[reached] = steps, given
        for (part, variable), (_, given) in found.items():
            if part in self.flat.fmus:
                given = as_item(given, self.items.get((part, variable)), f"{part}.{variable} = {given}")
                self.flat.start[part, variable] = given
            else:
                self.flat.told[part, variable] = given

    def _silent(self, into: dict[Port, Joint], outof: dict[Port, list[Joint]]) -> None:
        """Connectors of systems that tell no unit have that of what they are connected to (SSP 1.0, Real)."""

        def unit_at(port: Port, ahead: bool, steps: int = 0) -> Named | None:
            if self.units.get(port) or steps > len(into):
                return self.units.get(port)
            links = outof.get(port, []) if ahead else [into[port]] if port in into else []
            found = [unit_at(link.end if ahead else link.start, ahead, steps + 1) for link in links if link.convert]
            return found[0] if found and len({one.name if one else "" for one in found}) == 1 else None

        silent = [port for port, unit in self.units.items() if unit is None and port[0] not in self.flat.fmus]
        for port, unit in [(port, unit_at(port, False) or unit_at(port, True)) for port in silent]:
            self.units[port] = unit

    def _compare(self, source: Port, end: Port) -> None:
        """Enumerations cross as numbers: where these mean something else at the other end, that is told."""
        ours, theirs = ({number: name for name, number in self.items.get(port, {}).items()} for port in (source, end))
        for number in sorted(ours.keys() & theirs.keys()):
            if ours[number] != theirs[number]:
                self.notes.append(
                    f"{'.'.join(source)} → {'.'.join(end)} passes on numbers: {number} is {ours[number]!r} there, {theirs[number]!r} here"
                )
                return

    def _through(self, link: Joint) -> Affine:
        where = f"{'.'.join(link.start)} → {'.'.join(link.end)}"
        start, end = self.units.get(link.start), self.units.get(link.end)
        change = start.to(end, where) if link.convert and start and end else Affine()
        return change.then(link.transform)

    def _port(self, path: str, name: str) -> Port | None:
        """The port that a hierarchical parameter name means, seen from the element at `path`."""
        if (path, name) in self.kinds:
            return path, name
        elements = name.split(".")
        for cut in range(len(elements) - 1, 0, -1):
            below = "/".join(([path] if path else []) + elements[:cut])
            port = (below, ".".join(elements[cut:]))
            if port in self.kinds:
                return port
        return None

    def _down(
        self, port: Port, value: object, outof: dict[Port, list[Joint]], steps: int = 0
    ) -> Iterator[tuple[Port, object, int]]:
        """The variables that a value given at a port reaches, and connectors on the way, each with the value in its unit."""
        yield port, value, steps
        if port[0] in self.flat.fmus:
            return
        if steps > len(self.links):
            raise DescriptionError(f"{'.'.join(port)}: its connection goes round in a circle of system connectors.")
        for link in outof.get(port, []):
            change = self._through(link)
            given = change(value) if is_number(value) and change != Affine() else value
            yield from self._down(link.end, given, outof, steps + 1)
