"""An SSP, 1.0 or 2.0, as a flat system of our master.

Nested systems are flattened: component M in system Drive becomes "Drive/M". A connection through the connectors of
systems becomes one connection from an FMU's output to an FMU's input, with every linear transformation and every
conversion of units on its way multiplied out. Parameter values reach FMUs through bindings at every level; a higher
level wins over a lower one, a later binding over an earlier one (SSP 1.0, ParameterBindings). Linear transformations
act after the conversion of units, at connections and in mappings alike. Which end of a connection gives is said by the
kinds of its connectors, not by start and end (SSP 1.0, Connections). Enumerations cross as their numbers.

Signal dictionaries are as connectors of a system of their own, whose entries take from the one connection that gives.

Not supported, and refused by name: connectors that are inout where nothing says which way, sources outside the archive.
Slips are mended in mend.py; what was taken in is followed in resolve.py.
"""

from __future__ import annotations

import json
import math
import posixpath
import tempfile
import zipfile
from pathlib import Path
from urllib.parse import unquote

from lxml import etree

from ...fmus.units import Unit
from ..archive import XML
from ..described import number_of
from ..errors import DescriptionError
from ..reading import read_description
from .archive import ANNOTATION, inside, opened, parse, proxied, sound, tag, unpack
from .arrays import indices_of, shape_of
from .flat import Affine, Change, Flat, Joint, Port, conversion_of
from .resolve import resolve
from .taken import Binding, TakenIn
from .values import enumerations_in, transform, unit_of, units_in, value_of

FMU, SSD, SSP = "application/x-fmu-sharedlibrary", "application/x-ssp-definition", "application/x-ssp-package"
PACKED = ("application/zip", "application/octet-stream")  # what others call a .fmu
INTERFACES = {"CoSimulation": "cs", "ModelExchange": "me", "ScheduledExecution": "se"}  # by the words of SSP
OPEN, TAKING = ("inout", "unspecified"), ("input", "parameter", "structuralParameter")  # kinds of connectors
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
        self.notes = notes  # what was mended or is not used, a sentence each
        self.flat = Flat("", "", notes=notes)
        self.taken = TakenIn(self.flat)
        self.kinds, self.units, self.ports = self.taken.kinds, self.taken.units, self.taken.ports

    def read(self, document: Path) -> Flat:
        root = parse(document, self.notes)
        flat = self.flat
        flat.name, flat.description = root.get("name"), root.get("description", "")
        experiment = root.find(tag("ssd:DefaultExperiment"))
        if experiment is not None:
            flat.start_time = float(experiment.get("startTime", "0"))
            flat.stop_time = float(experiment.get("stopTime")) if experiment.get("stopTime") else None
            if flat.stop_time is not None and flat.stop_time <= flat.start_time:
                raise DescriptionError(
                    f"{document.name}: its experiment from {flat.start_time:g} to {flat.stop_time:g} s ends before it has begun."
                )
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
        resolve(self.taken)
        return flat

    def _system(self, node: etree._Element, path: str, base: Path, units: dict[str, Unit], depth: int) -> None:
        """Take in a system and all below it. `path` is "" for the outermost."""
        self.flat.others.look(node, path)
        self._connectors(node, path, units)
        self._dictionaries(node, path, base)
        children = {}
        elements = node.find(tag("ssd:Elements"))
        for child in [] if elements is None else elements:
            if not isinstance(child.tag, str):
                continue
            kind, name = etree.QName(child).localname, child.get("name")
            if name in children:
                raise DescriptionError(f"{path or 'the system'}: two elements are named {name!r}.")
            children[name] = f"{path}/{name}" if path else name
            if kind == "SignalDictionaryReference":
                children[name] = self._dictionary(child, path, units)
            elif kind == "System":
                self._system(child, children[name], base, units, depth + 1)
            else:
                self._component(child, children[name], base, units, depth + 1)
        connections = node.find(tag("ssd:Connections"))
        for connection in [] if connections is None else connections:
            self._connection(connection, path, children)
        self._parameters(node, path, base, base, depth)

    def _component(self, node: etree._Element, path: str, base: Path, units: dict[str, Unit], depth: int) -> None:
        kind, source = node.get("type"), node.get("source")
        if kind is None:  # FMUs, in the standard; what the name of an .ssp or .ssd says is clear, too
            kind = {".ssp": SSP, ".ssd": SSD}.get(posixpath.splitext((source or "").partition("#")[0])[1].lower(), FMU)
        if source is None:  # SSP 2.0: as a system with nothing in it
            self.notes.append(f"{path} has no source; what is connected to it stays as it is")
            self._connectors(node, path, units)
            self._parameters(node, path, base, base, depth)
            return
        if kind in (SSD, SSP):
            source, _, fragment = source.partition("#")
            self.nested += 1
            if self.nested > NESTED:
                raise DescriptionError(
                    f"{path}: more than {NESTED} system structures are in one another; at most so many are read."
                )
            if not source:  # one in the same document
                same = [one for one in node.getroottree().iter(tag("ssd:System")) if one.get("id") == fragment]
                if len(same) != 1:
                    raise DescriptionError(f"{path}: there is no system with the id {fragment!r} in its document.")
                self._system(same[0], path, base, units, depth)
                self._parameters(node, path, base, base, depth)
                return
            file = inside(source, base, self.root, path, self.notes)
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
        if (kind in PACKED or kind != FMU and "fmu" in kind) and source.lower().endswith(".fmu"):
            self.notes.append(f"{path}: a component of type {kind!r} whose source is a .fmu is taken as an FMU")
            kind = FMU
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
        self.taken.variables(path, description)
        self._connectors(node, path, units)
        self._parameters(node, path, base, file, depth)

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
                self._of_fmu(connector, path, name)
                self.units[path, name] = own or unit  # values cross the face of an FMU in its own unit
                continue
            self.kinds[path, name] = connector.get("kind")
            self.units[path, name] = unit
            if shape := shape_of(connector, f"{where}: connector {name!r}"):
                self.taken.shapes[path, name] = shape

    def _of_fmu(self, connector: etree._Element, path: str, name: str) -> None:
        """Hold a connector against its FMU, which counts: its kind, and whether it is an array."""
        kind, own = connector.get("kind"), self.kinds[path, name]
        if kind in OPEN or (kind in TAKING) != (own in TAKING):
            self.notes.append(f"{path}: connector {name!r} is of kind {kind}, its FMU says {own}; it is taken as that")
        told, shape = shape_of(connector, f"{path}: connector {name!r}"), self.taken.shapes.get((path, name), ())
        if told and len(told) != len(shape):
            has = f"an array of {len(shape)} dimensions" if shape else "no array"
            raise DescriptionError(f"{path}: connector {name!r} has {len(told)} dimensions; in its FMU it is {has}.")

    def _dictionaries(self, node: etree._Element, path: str, base: Path) -> None:
        """The signal dictionaries of a system, each with its entries as ports."""
        known = self.taken.dictionaries.setdefault(path, {})
        for told in node.iterfind(f"{tag('ssd:SignalDictionaries')}/{tag('ssd:SignalDictionary')}"):
            name = told.get("name")
            what = f"the signal dictionary {name!r} of {path or 'the system'}"
            found = self._content(told, None, "ssb:SignalDictionary", base, base, what)
            known[name] = place = f"{path}:{name}"
            units = units_in(found)
            self.ports[place] = set()
            for entry in found.iterfind(tag("ssb:DictionaryEntry")):
                port = place, entry.get("name")
                real = entry.find(tag("ssc:Real"))
                self.ports[place].add(port[1])
                self.kinds[port], self.units[port] = "inout", None if real is None else unit_of(real, units, self.notes)
                if shape := shape_of(entry, f"{what}: {port[1]!r}"):
                    self.taken.shapes[port] = shape

    def _dictionary(self, node: etree._Element, path: str, units: dict[str, Unit]) -> str:
        """Where the dictionary lies that an element of the system at `path` refers to: in it, or in one around it."""
        name, place = node.get("dictionary"), path
        while name not in self.taken.dictionaries.get(place, {}):
            if not place:
                raise DescriptionError(f"{path or 'the system'}: there is no signal dictionary {name!r}, in it or around it.")
            place = place.rpartition("/")[0]
        found = self.taken.dictionaries[place][name]
        for connector in node.iterfind(f"{tag('ssd:Connectors')}/{tag('ssd:Connector')}"):
            port, real = (found, connector.get("name")), connector.find(tag("ssc:Real"))
            if port not in self.kinds:
                raise DescriptionError(f"{path or 'the system'}: the signal dictionary {name!r} has no entry {port[1]!r}.")
            unit, own = None if real is None else unit_of(real, units, self.notes), self.units[port]
            if unit and own and unit.to(own, f"the signal dictionary {name!r}, {port[1]}") != Affine():
                raise DescriptionError(f"{name}: {port[1]!r} is in {unit.name} at a reference, in {own.name} in the dictionary.")
        return found

    def _connection(self, node: etree._Element, path: str, children: dict[str, str]) -> None:
        ends: list[Port] = []
        gives: list[bool | None] = []  # None: as the other end wants it
        for side in ("start", "end"):
            element, connector = node.get(f"{side}Element"), node.get(f"{side}Connector")
            if element is not None and element not in children and element == node.getparent().getparent().get("name"):
                self.notes.append(f"a connection names {element!r}, the system that it is in; it is taken as that")
                element = None
            if element is not None and element not in children:
                raise DescriptionError(f"{path or 'the system'}: a connection names {element!r}, which is not an element of it.")
            port = (path if element is None else children[element], connector)
            if connector not in self.ports[port[0]]:
                stem, _, index = connector.rpartition("[")  # an element by its name
                if stem not in self.ports[port[0]] and port not in self.kinds or port[0] not in self.flat.fmus:
                    raise DescriptionError(
                        f"{path or 'the system'}: a connection names {'.'.join(port)!r}, which is not a connector."
                    )
                if stem not in self.ports[port[0]]:
                    self.notes.append(
                        f"a connection names {'.'.join(port)}, a variable of its FMU that is no connector; it is used"
                    )
            ends.append(port)
            kind = self.kinds.get(port) or self.kinds[port[0], connector.rpartition("[")[0]]
            gives.append(None if kind in OPEN else (kind in TAKING) == (element is None))
        either = gives == [None, None]
        if None in gives:
            gives = [not gives[1], gives[1]] if gives[0] is None else [gives[0], not gives[0]]
        start, end = ends if gives[0] or not gives[1] else reversed(ends)
        indices = [indices_of(node, side, ".".join(ends[0])) for side in ("start", "end")]
        if gives[0] == gives[1]:
            raise DescriptionError(
                f"the connection {'.'.join(start)} → {'.'.join(end)}: {'both' if gives[0] else 'neither'} of them "
                f"{'give' if gives[0] else 'gives'} a value ({self.kinds[start]}, {self.kinds[end]})."
            )
        chosen = (indices[0], indices[1]) if [start, end] == ends else (indices[1], indices[0])
        convert = node.get("suppressUnitConversion") not in ("true", "1")
        self.taken.links.append(Joint(start, end, transform(node, ".".join(end)), convert, chosen, either))

    def _parameters(self, node: etree._Element, path: str, base: Path, component_base: Path, depth: int) -> None:
        """Collect what the bindings of one element say."""
        for binding in node.findall(f"{tag('ssd:ParameterBindings')}/{tag('ssd:ParameterBinding')}"):
            what = f"parameters of {path or 'the system'}"
            kind = binding.get("type", "application/x-ssp-parameter-set")
            if kind != "application/x-ssp-parameter-set":
                raise DescriptionError(f"{what}: type {kind} is not supported; only SSP parameter sets are.")
            values = self._content(binding, "ssd:ParameterValues", "ssv:ParameterSet", base, component_base, what)
            if values is None:
                raise DescriptionError(f"{what}: neither a source nor values are given.")
            mapping = binding.find(tag("ssd:ParameterMapping"))
            renamed: dict[str, list[tuple[str, Change, bool]]] | None = None
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
                    said = unit if convert else None
                    self.taken.bindings.append(Binding(depth, path, target, value, said, f"{what}: {name}", change))

    def _packed(self, source: str, component: Path) -> Path | None:
        """A file inside a component's archive, unpacked; None where there is none of that name."""
        name = posixpath.normpath(unquote(source))
        if not zipfile.is_zipfile(component):
            return None
        with zipfile.ZipFile(component) as packed:
            if name not in packed.namelist() or packed.getinfo(name).file_size > XML:
                return None
            file = Path(tempfile.mkdtemp(dir=self.room)) / Path(name).name
            file.write_bytes(packed.read(name))
            return file

    def _content(self, node, inline: str | None, wanted: str, base: Path, component_base: Path, what: str):
        """The document that a binding or mapping gives inline or by its source."""
        holder = node if inline is None else node.find(tag(inline))
        if source := node.get("source"):
            if node.get("sourceBase") != "component":
                return parse(inside(source, base, self.root, what, self.notes), self.notes)
            if (packed := self._packed(source, component_base)) is not None:
                return parse(packed, self.notes)
            start = component_base if component_base.is_dir() else component_base.parent
            return parse(inside(source, start, self.root, what, self.notes), self.notes)
        found = None if holder is None else holder.find(tag(wanted))
        if found is None and inline is None:
            raise DescriptionError(f"{what}: a mapping has neither a source nor entries.")
        return found if found is None else sound(found, what, self.notes)
