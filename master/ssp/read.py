"""An SSP 1.0 file as a flat system of our master.

Nested systems are flattened: component M in system Drive becomes "Drive/M". A connection through the connectors of
systems becomes one connection from an FMU's output to an FMU's input, with every linear transformation and every
conversion of units on its way multiplied out. Parameter values reach FMUs through bindings at every level; a higher
level wins over a lower one, a later binding over an earlier one (SSP 1.0, ParameterBindings). Linear transformations
act after the conversion of units, at connections and in mappings alike.

Not supported, and refused by name: signal dictionaries, mapping transformations other than linear, binary,
enumeration and inout connectors, model exchange, sources outside the archive.
"""

from __future__ import annotations

import json
from pathlib import Path

import fmpy
from lxml import etree

from ...fmus.units import BASES, Unit, of
from ..errors import DescriptionError
from ..fmu import units_of
from .archive import ANNOTATION, inside, parse, tag, unpack
from .flat import Affine, Flat, Joint, Named, Port

FMU, SSD, SSP = "application/x-fmu-sharedlibrary", "application/x-ssp-definition", "application/x-ssp-package"

NESTED = 100  # structures in a structure, on all levels together


def read(path: Path, folder: Path, variant: str = "SystemStructure.ssd", unlimited: bool = False) -> Flat:
    """Read `path` (.ssp), unpacked into `folder`. Raises DescriptionError."""
    root_folder = unpack(path, folder, unlimited)
    document = root_folder / variant
    if not document.is_file():
        raise DescriptionError(f"{path}: there is no {variant} in it.")
    return _Reader(root_folder).read(document)


class _Reader:
    def __init__(self, root: Path):
        self.root = root
        self.nested = 0
        self.units: dict[Port, Named | None] = {}
        self.links: list[Joint] = []
        self.kinds: dict[Port, str] = {}
        self.ports: dict[str, set[str]] = {}
        self.bindings: list[tuple[int, int, Port, object, Named | None, Affine]] = []  # depth, order, …
        self.flat = Flat("", "")

    def read(self, document: Path) -> Flat:
        root = parse(document)
        flat = self.flat
        flat.name, flat.description = root.get("name"), root.get("description", "")
        experiment = root.find(tag("ssd:DefaultExperiment"))
        if experiment is not None:
            flat.start_time = float(experiment.get("startTime", "0"))
            flat.stop_time = float(experiment.get("stopTime")) if experiment.get("stopTime") else None
        flat.others.look(root)
        flat.others.look(experiment)
        for annotation in root.iter(tag("ssc:Annotation")):
            if annotation.get("type") == ANNOTATION and len(annotation):
                try:
                    flat.ours = json.loads(annotation[0].text or "{}")
                except json.JSONDecodeError as error:
                    raise DescriptionError(f"{document.name}: its annotation {ANNOTATION} is damaged: {error}.") from None
        self._system(root.find(tag("ssd:System")), "", document.parent, _read_units(root), 0)
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
        if kind in (SSD, SSP):
            source, _, fragment = source.partition("#")
            if not source:
                raise DescriptionError(
                    f"{path}: a reference to a system inside the same document (#{fragment}) is not supported."
                )
            file = inside(source, base, self.root, path)
            self.nested += 1
            if self.nested > NESTED:
                raise DescriptionError(
                    f"{path}: more than {NESTED} system structures are in one another; at most so many are read."
                )
            if kind == SSP:
                inner = file.with_name(file.name + ".unpacked")
                inner = inner if inner.is_dir() else unpack(file, inner)
                file = inner / (fragment or "SystemStructure.ssd")
            root = parse(file)
            self._system(root.find(tag("ssd:System")), path, file.parent, _read_units(root), depth)
            self._parameters(node, path, base, base, depth)
            return
        if kind != FMU:
            raise DescriptionError(f"{path}: components of type {kind} are not supported; only FMUs, .ssd and .ssp are.")
        if node.get("implementation", "any") == "ModelExchange":
            raise DescriptionError(f"{path}: asks for model exchange, which is not supported; only co-simulation is.")
        file = inside(source, base, self.root, path)
        try:
            description = fmpy.read_model_description(str(file), validate=False)
        except Exception as error:  # fmpy raises whatever its parser meets
            raise DescriptionError(f"{path}: {source} cannot be read as an FMU: {error}") from None
        self.flat.fmus[path] = file
        self.flat.others.look(node, path)
        step = description.defaultExperiment.stepSize if description.defaultExperiment else None
        if step:
            self.flat.smallest_step = min(float(step), self.flat.smallest_step or float(step))
        own = units_of(description)
        for variable in description.modelVariables:
            unit = variable.unit or (variable.declaredType.unit if variable.declaredType is not None else None)
            self.units[path, variable.name] = Named(unit, own) if unit else None
            self.kinds[path, variable.name] = variable.causality or "local"
        self._connectors(node, path, units)
        self._parameters(node, path, base, file.parent, depth)

    def _connectors(self, node: etree._Element, path: str, units: dict[str, Unit]) -> None:
        connectors = node.find(tag("ssd:Connectors"))
        self.ports[path] = {connector.get("name") for connector in ([] if connectors is None else connectors)}
        for connector in [] if connectors is None else connectors:
            name = connector.get("name")
            for refused in ("Binary", "Enumeration"):
                if connector.find(tag(f"ssc:{refused}")) is not None:
                    raise DescriptionError(f"{path}.{name}: connectors of type {refused} are not supported.")
            if connector.get("kind") == "inout":
                raise DescriptionError(f"{path or 'the system'}: connector {name!r} is of kind inout, which is not supported.")
            real = connector.find(tag("ssc:Real"))
            text = None if real is None else real.get("unit")
            if text is not None and text not in units:
                raise DescriptionError(f"{path or 'the system'}: connector {name!r} has unit {text!r}, which is not in Units.")
            unit = Named(text, units) if text else None
            if path in self.flat.fmus:
                if (path, name) not in self.kinds:
                    raise DescriptionError(f"{path}: connector {name!r} is not a variable of its FMU.")
                own = self.units[path, name]
                if unit and own and unit.to(own, f"{path}.{name}, connector and FMU") != Affine():
                    raise DescriptionError(
                        f"{path}: connector {name!r} is in {text}, its FMU says {own.name}; that is not supported."
                    )
                self.units[path, name] = own or unit  # values cross the face of an FMU in its own unit
                continue
            self.kinds[path, name] = connector.get("kind")
            self.units[path, name] = unit

    def _connection(self, node: etree._Element, path: str, children: dict[str, str]) -> None:
        ends: list[Port] = []
        for side in ("start", "end"):
            element, connector = node.get(f"{side}Element"), node.get(f"{side}Connector")
            if element is not None and element not in children:
                raise DescriptionError(f"{path or 'the system'}: a connection names {element!r}, which is not an element of it.")
            port = (path if element is None else children[element], connector)
            if connector not in self.ports[port[0]]:
                raise DescriptionError(
                    f"{path or 'the system'}: a connection names {'.'.join(port)!r}, which is not a connector."
                )
            ends.append(port)
        start, end = ends
        self.links.append(
            Joint(start, end, _transform(node, ".".join(end)), node.get("suppressUnitConversion") not in ("true", "1"))
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
                    change = _transform(entry, f"{what}, mapping of {entry.get('source')}")
                    convert = entry.get("suppressUnitConversion") not in ("true", "1")
                    renamed.setdefault(entry.get("source"), []).append((entry.get("target"), change, convert))
            units = _read_units(values)
            for parameter in values.iter(tag("ssv:Parameter")):
                name = binding.get("prefix", "") + parameter.get("name")
                value, unit = _value(parameter, units, what)
                targets = [(name, Affine(), True)] if renamed is None else renamed.get(name, [])
                for target, change, convert in targets:
                    if change != Affine() and not _number(value):
                        raise DescriptionError(f"{what}: {name} = {value!r} is no number, its mapping cannot change it.")
                    said = unit if convert else None
                    self.bindings.append((-depth, len(self.bindings), (path, target), value, said, change))

    def _content(self, node, inline: str | None, wanted: str, base: Path, component_base: Path, what: str):
        """The document that a binding or mapping gives inline or by its source."""
        holder = node if inline is None else node.find(tag(inline))
        if node.get("source"):
            start = component_base if node.get("sourceBase") == "component" else base
            return parse(inside(node.get("source"), start, self.root, what))
        found = None if holder is None else holder.find(tag(wanted))
        if found is None and inline is None:
            raise DescriptionError(f"{what}: a mapping has neither a source nor entries.")
        return found

    def _resolve(self) -> None:
        """Follow every connection from an FMU's input back to an FMU's output, and every value down to FMUs."""
        into: dict[Port, Joint] = {}
        for link in self.links:
            start, end = self._oriented(link)
            if end in into:
                raise DescriptionError(f"{'.'.join(end)} has two sources: {'.'.join(into[end].start)} and {'.'.join(start)}.")
            into[end] = Joint(start, end, link.transform, link.convert)
        outof: dict[Port, list[Joint]] = {}
        for link in into.values():
            outof.setdefault(link.start, []).append(link)
        for port in into:
            if port[0] in self.flat.fmus:
                source, transform, steps = port, Affine(), 0
                while source in into and (source == port or source[0] not in self.flat.fmus):
                    link = into[source]
                    transform, source, steps = self._through(link).then(transform), link.start, steps + 1
                    if steps > len(into):
                        raise DescriptionError(f"{'.'.join(port)}: its connection goes round in a circle of system connectors.")
                if source[0] in self.flat.fmus:
                    self.flat.connections[port] = (source, transform)
        for _, _, (path, name), value, unit, change in sorted(self.bindings, key=lambda entry: entry[:2]):
            port = self._port(path, name)
            own = self.units.get(port)
            if isinstance(value, (int, float)) and not isinstance(value, bool):
                convert = unit.to(own, f"value of {'.'.join(port)}") if unit and own else Affine()
                value = convert.then(change)(value) if convert.then(change) != Affine() else value
            self.flat.start.update(self._down(port, value, outof))

    def _oriented(self, link: Joint) -> tuple[Port, Port]:
        """SSP connections run from start to end; a connection written backwards to an FMU's input is refused."""
        for port, wrong in ((link.start, ("input", "parameter")), (link.end, ("output",))):
            if port[0] in self.flat.fmus and self.kinds.get(port) in wrong:
                raise DescriptionError(
                    f"the connection {'.'.join(link.start)} → {'.'.join(link.end)} runs the wrong way: "
                    f"{'.'.join(port)} is {'an ' + self.kinds[port] if self.kinds[port] != 'parameter' else 'a parameter'}."
                )
        return link.start, link.end

    def _through(self, link: Joint) -> Affine:
        where = f"{'.'.join(link.start)} → {'.'.join(link.end)}"
        start, end = self.units.get(link.start), self.units.get(link.end)
        change = start.to(end, where) if link.convert and start and end else Affine()
        return change.then(link.transform)

    def _port(self, path: str, name: str) -> Port:
        """The port that a hierarchical parameter name means, seen from the element at `path`."""
        if (path, name) in self.kinds:
            return path, name
        elements = name.split(".")
        for cut in range(len(elements) - 1, 0, -1):
            below = "/".join(([path] if path else []) + elements[:cut])
            port = (below, ".".join(elements[cut:]))
            if port in self.kinds:
                return port
        raise DescriptionError(
            f"a parameter set of {path or 'the system'} names {name!r}, which is neither a variable nor a connector of it."
        )

    def _down(self, port: Port, value, outof: dict[Port, list[Joint]]):
        """The FMU variables that a value given at a port reaches, each with the value in its unit."""
        if port[0] in self.flat.fmus:
            yield port, value
            return
        for link in outof.get(port, []):
            change = self._through(link)
            yield from self._down(link.end, change(value) if _number(value) and change != Affine() else value, outof)


def _number(value: object) -> bool:
    return isinstance(value, (int, float)) and not isinstance(value, bool)


def _transform(node: etree._Element, where: str) -> Affine:
    for child in node:
        if isinstance(child.tag, str) and etree.QName(child).localname.endswith("Transformation"):
            name = etree.QName(child).localname
            if name != "LinearTransformation":
                raise DescriptionError(f"{where}: {name} is not supported; only LinearTransformation is.")
            return Affine(float(child.get("factor", "1")), float(child.get("offset", "0")))
    return Affine()


def _read_units(root: etree._Element) -> dict[str, Unit]:
    """Each ssc:Unit in an ssd or ssv document, by name."""
    units = {}
    for node in root.iter(tag("ssc:Unit")):
        base = node.find(tag("ssc:BaseUnit"))
        powers = {name: int(base.get(name, "0")) for name in BASES}
        units[node.get("name")] = of(float(base.get("factor", "1")), float(base.get("offset", "0")), **powers)
    return units


def _value(parameter: etree._Element, units: dict[str, Unit], what: str) -> tuple[object, Named | None]:
    """The value and unit of an ssv:Parameter."""
    for child in parameter:
        kind, text = etree.QName(child).localname, child.get("value")
        if kind == "Real":
            unit = child.get("unit")
            if unit is not None and unit not in units:
                raise DescriptionError(f"{what}: {parameter.get('name')} has unit {unit!r}, which is not in its Units.")
            return float(text), Named(unit, units) if unit else None
        if kind == "Integer":
            return int(text), None
        if kind == "Boolean":
            return text in ("true", "1"), None
        if kind == "String":
            return text, None
        raise DescriptionError(f"{what}: {parameter.get('name')} is of type {kind}, which is not supported.")
    raise DescriptionError(f"{what}: {parameter.get('name')} has no value.")
