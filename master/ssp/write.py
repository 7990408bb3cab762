"""A system as an SSP archive, 1.0 or 2.0: FMUs, connections, parameter sets, units, default experiment, documentation.

What SSP has no place for (communication step, algorithm, order) goes into an annotation that our reader knows and
others pass over. In-process parts are packed as FMUs by the `pack` of their class; a part without one is refused.
"""

from __future__ import annotations

import hashlib
import json
import tempfile
import zipfile
from dataclasses import asdict, fields, replace
from html import escape
from pathlib import Path

from lxml import etree

from selflock.fmus.shown import policy

from ...fmus.units import Unit, of
from ..binary import open_fmu
from ..code import named
from ..errors import DescriptionError
from ..face import Part, Variable
from ..system import Component, Run, System, check_choice
from ..units import unit as known_unit
from ..wiring import Link, Wiring, fmu_path, wire
from . import whole
from .archive import ANNOTATION, NAMESPACES, check, tag
from .mend import bare
from .read import INTERFACES
from .values import Items, items_of

Enumerations = dict[tuple[str, str], tuple[str, Items]]  # component, variable → name, items

DATE = (2020, 1, 1, 0, 0, 0)  # of every file in the archive: the same system gives the same bytes
SET = "parameters"  # of every parameter set: some tools (Ecos) apply the sets of one name over all components
VERSIONS = ("1.0", "2.0")  # 2.0 has arrays more, and the same elements else
CONNECTORS = ("input", "output", "parameter")


def export(system: System | Path | str, out: Path | str, allow_code: bool = False, version: str = "1.0") -> Path:
    """Write `system` (a System, or a path to its file) to `out` (.ssp). Returns the path. Raises DescriptionError.

    version: of SSP, "1.0" or "2.0".

    allow_code: parts of other packages may be loaded (docs/security.md).
    """
    from ..opening import system_of  # which opens system structures, too

    system, out = (replace(system) if isinstance(system, System) else system_of(system)), Path(out)
    system.allow_code |= allow_code
    if out.suffix.lower() != ".ssp":
        raise DescriptionError(f"{out}: the name of a system structure ends in .ssp.")
    check_choice("version of SSP", version, VERSIONS)
    if system.faults:
        raise DescriptionError("[[faults]] have no place in SSP; take them out of the system before exporting it.")
    wiring = wire(system)
    try:
        files = _fmus(wiring)
        enumerations = _enumerations(wiring)
        documents = {"SystemStructure.ssd": _structure(wiring, files, enumerations)}
        for name in system.components:
            if wiring.values.get(name):
                documents[_set_file(system, name)] = _parameter_set(wiring, name, enumerations)
        if version != "1.0":
            shapes = whole.shapes_in(wiring)
            whole.structure(documents["SystemStructure.ssd"], shapes)
            for name, arrays in shapes.items():
                if wiring.values.get(name):
                    whole.parameters(documents[_set_file(system, name)], arrays, wiring.parts[name].variables)
    finally:
        wiring.close()
    for name, root in documents.items():
        check(bare(root), name)
        root.set("version", version)
    out.parent.mkdir(parents=True, exist_ok=True)
    with zipfile.ZipFile(out, "w", zipfile.ZIP_DEFLATED) as archive:
        for name, root in documents.items():
            _add(archive, name, etree.tostring(root, xml_declaration=True, encoding="UTF-8", pretty_print=True))
        for name, data in sorted({name: data for name, data in files.values()}.items()):
            _add(archive, f"resources/{name}", data)
        _add(archive, "documentation/index.html", _documentation(wiring, files).encode())
    return out


def _add(archive: zipfile.ZipFile, name: str, data: bytes) -> None:
    entry = zipfile.ZipInfo(name, DATE)
    entry.compress_type, entry.external_attr = zipfile.ZIP_DEFLATED, 0o644 << 16
    archive.writestr(entry, data)


def _plain(name: str) -> str:
    return "".join(c if c.isascii() and c.isalnum() or c in "-_" else "_" for c in name)


def _set_file(system: System, name: str) -> str:
    """The parameter set of a component: a plain name, so that no tool stumbles over its URI; with a number where two are alike."""
    alike = [other for other in system.components if _plain(other).lower() == _plain(name).lower()]
    return f"resources/{_plain(name)}{alike.index(name) + 1 if alike[1:] else ''}.ssv"


def _fmus(wiring: Wiring) -> dict[str, tuple[str, bytes]]:
    """For each component the name its FMU has in the archive, and the FMU's bytes; equal FMUs are kept once."""
    found: dict[str, tuple[str, bytes]] = {}
    names: dict[str, str] = {}
    with tempfile.TemporaryDirectory() as folder:
        for name, component in wiring.system.components.items():
            if component.manoeuvre:
                raise DescriptionError(
                    f"{name}: a manoeuvre runs inside our master only; leave it out, and its inputs to who runs the archive."
                )
            if component.host:
                raise DescriptionError(
                    f"{name}: its FMU lies at {component.host}; name a file of yours as its fmu, without host."
                )
            if component.part:
                path = wiring.parts[name].pack(Path(folder), **component.options)
                if path is None:
                    raise DescriptionError(
                        f"{name}: {named(component.part)} runs inside our master only; it cannot be packed as an FMU."
                    )
            else:
                path = fmu_path(component, wiring.system)
            data = Path(path).read_bytes()
            content, stem = hashlib.sha256(data).hexdigest(), _plain(Path(path).stem)
            taken = names.setdefault(
                content, f"{stem}.fmu" if f"{stem}.fmu" not in names.values() else f"{stem}_{content[:8]}.fmu"
            )
            found[name] = taken, data
    return found


def _enumerations(wiring: Wiring) -> Enumerations:
    """The variables of FMUs that are enumerations: the enumeration's name, the same for the same items, and its items."""
    found: Enumerations = {}
    for name, component in wiring.system.components.items():
        if not component.fmu:
            continue
        for variable in open_fmu(fmu_path(component, wiring.system), wiring.system.unlimited).description.modelVariables:
            if items := items_of(variable):
                label = variable.declaredType.name
                while any(other == label and its != items for other, its in found.values()):
                    label += "_"
                found[name, variable.name] = label, items
    return found


def _structure(wiring: Wiring, files: dict[str, tuple[str, bytes]], enumerations: Enumerations) -> etree._Element:
    system = wiring.system
    root = etree.Element(
        tag("ssd:SystemStructureDescription"),
        version="1.0",
        name=system.name,
        nsmap={key: NAMESPACES[key] for key in ("ssd", "ssc", "ssv", "ssm")},
        generationTool="selflock",
    )
    if system.description:
        root.set("description", system.description)
    top = etree.SubElement(root, tag("ssd:System"), name=_plain(system.name))
    elements = etree.SubElement(top, tag("ssd:Elements"))
    for place, (name, part) in enumerate(wiring.parts.items()):
        element = etree.SubElement(
            elements,
            tag("ssd:Component"),
            name=name,
            source=f"resources/{files[name][0]}",
            implementation=_implementation(wiring, name),
        )
        connectors = etree.SubElement(element, tag("ssd:Connectors"))
        for variable in part.variables.values():
            if variable.causality in CONNECTORS:
                connectors.append(_connector(variable, enumerations.get((name, variable.name), ("", {}))[0]))
        column, row = place % 4, place // 4
        etree.SubElement(
            element,
            tag("ssd:ElementGeometry"),
            x1=str(column * 40.0),
            y1=str(-row * 30.0),
            x2=str(column * 40.0 + 30),
            y2=str(20 - row * 30.0),
        )
        if wiring.values.get(name):
            bindings = etree.SubElement(element, tag("ssd:ParameterBindings"))
            etree.SubElement(bindings, tag("ssd:ParameterBinding"), source=_set_file(system, name))
    _connections(top, wiring)
    shown = {key for key in enumerations if wiring.parts[key[0]].variables[key[1]].causality in CONNECTORS}
    _define(root, dict(enumerations[key] for key in shown), "ssd")
    _units(root, {unit: declared for part in wiring.parts.values() for unit, declared in _named_units(part).items()}, "ssd")
    etree.SubElement(root, tag("ssd:DefaultExperiment"), startTime=repr(system.run.start), stopTime=repr(system.run.stop))
    annotation = etree.SubElement(etree.SubElement(root, tag("ssd:Annotations")), tag("ssc:Annotation"), type=ANNOTATION)
    etree.SubElement(annotation, "run").text = json.dumps(_ours(system))
    return root


def _implementation(wiring: Wiring, name: str) -> str:
    """The interface of a component in SSP's word."""
    component = wiring.system.components[name]
    if not component.fmu:
        return "CoSimulation"  # a part that is packed as one
    way, _ = open_fmu(fmu_path(component, wiring.system), wiring.system.unlimited).interface(component.interface)
    return next(word for word, mine in INTERFACES.items() if mine == way)


def _ours(system: System) -> dict:
    """What SSP has no place for, in the words of a system file."""

    def differing(thing, plain, names) -> dict:
        return {name: getattr(thing, name) for name in names if getattr(thing, name) != getattr(plain, name)}

    run, names = system.run, [f.name for f in fields(Run) if f.name not in ("start", "stop", "open_inputs")]
    said = differing(run, Run(), names) | {
        "step": run.step,
        "algorithm": run.algorithm,
        "order": run.order or list(system.components),
    }
    components = {
        name: differing(c, Component(), ("step", "samples", "tolerance", "process", "isolate", "step_timeout"))
        for name, c in system.components.items()
    }
    return {
        "run": said,
        "components": {name: c for name, c in components.items() if c},
        "bonds": [asdict(b) for b in system.bonds],
    }


def _connector(variable: Variable, enumeration: str) -> etree._Element:
    connector = etree.Element(tag("ssd:Connector"), name=variable.name, kind=variable.causality)
    if variable.description:
        connector.set("description", variable.description)
    kind = etree.SubElement(connector, tag("ssc:Enumeration" if enumeration else f"ssc:{variable.type}"))
    if enumeration:
        kind.set("name", enumeration)
    if variable.type == "Real" and variable.unit:
        kind.set("unit", variable.unit)
    return connector


def _connections(top: etree._Element, wiring: Wiring) -> None:
    if not wiring.links:
        return
    connections = etree.SubElement(top, tag("ssd:Connections"))
    for link in wiring.links:
        said = wiring.system.connections[f"{link.target}.{link.input}"]
        connection = etree.SubElement(
            connections,
            tag("ssd:Connection"),
            startElement=link.source,
            startConnector=link.output,
            endElement=link.target,
            endConnector=link.input,
        )
        if not said.convert:
            connection.set("suppressUnitConversion", "true")
        if link.mapping:
            _mapping(connection, link, wiring)
        elif (said.factor, said.offset) != (1.0, 0.0):
            etree.SubElement(connection, tag("ssc:LinearTransformation"), factor=repr(said.factor), offset=repr(said.offset))


def _mapping(connection: etree._Element, link: Link, wiring: Wiring) -> None:
    """Values that become others, as Booleans where both ends are."""
    ends = wiring.parts[link.source].variables[link.output], wiring.parts[link.target].variables[link.input]
    truth = all(end.type == "Boolean" for end in ends)
    table = etree.SubElement(connection, tag(f"ssc:{'Boolean' if truth else 'Integer'}MappingTransformation"))
    for pair in link.mapping:
        old, new = (str(bool(one)).lower() if truth else str(int(one)) for one in pair)
        etree.SubElement(table, tag("ssc:MapEntry"), source=old, target=new)


def _parameter_set(wiring: Wiring, name: str, enumerations: Enumerations) -> etree._Element:
    part = wiring.parts[name]
    root = etree.Element(tag("ssv:ParameterSet"), version="1.0", name=SET, nsmap={key: NAMESPACES[key] for key in ("ssv", "ssc")})
    parameters = etree.SubElement(root, tag("ssv:Parameters"))
    used: dict[str, Unit] = {}
    named: dict[str, Items] = {}
    for variable, value in wiring.values[name].items():
        described = part.variables[variable]
        parameter = etree.SubElement(parameters, tag("ssv:Parameter"), name=variable)
        label, items = enumerations.get((name, variable), ("", {}))
        if item := next((item for item, number in items.items() if number == value), ""):
            etree.SubElement(parameter, tag("ssv:Enumeration"), value=item, name=label)
            named[label] = items
            continue
        text = str(value).lower() if isinstance(value, bool) else repr(value) if isinstance(value, float) else str(value)
        element = etree.SubElement(parameter, tag(f"ssv:{described.type}"), value=text)
        if described.type == "Real" and described.unit:
            element.set("unit", described.unit)
            used[described.unit] = _named_units(part)[described.unit]
    _define(root, named, "ssv")
    _units(root, used, "ssv")
    return root


def _named_units(part: Part) -> dict[str, Unit]:
    """What each unit of a part's variables means, from the FMU, or by its name."""
    return {name: known_unit(name, part.units) or of() for name in {v.unit for v in part.variables.values() if v.unit}}


def _define(root: etree._Element, enumerations: dict[str, Items], prefix: str) -> None:
    if not enumerations:
        return
    holder = etree.SubElement(root, tag(f"{prefix}:Enumerations"))
    for name, items in sorted(enumerations.items()):
        enumeration = etree.SubElement(holder, tag("ssc:Enumeration"), name=name)
        for item, number in items.items():
            etree.SubElement(enumeration, tag("ssc:Item"), name=item, value=str(number))


def _units(root: etree._Element, units: dict[str, Unit], prefix: str) -> None:
    if not units:
        return
    element = etree.SubElement(root, tag(f"{prefix}:Units"))
    for name, unit in sorted(units.items()):
        attributes = {base: str(exponent) for base, exponent in sorted(unit.exponents.items())}
        changes = (("factor", unit.factor, 1.0), ("offset", unit.offset, 0.0))
        attributes |= {key: repr(value) for key, value, plain in changes if value != plain}
        etree.SubElement(etree.SubElement(element, tag("ssc:Unit"), name=name), tag("ssc:BaseUnit"), attributes)


def _documentation(wiring: Wiring, files: dict[str, tuple[str, bytes]]) -> str:
    system = wiring.system
    rows = "".join(
        f"<tr><td>{escape(name)}</td><td>{escape(files[name][0])}</td><td>"
        + ", ".join(
            f"{escape(key)} = {escape(str(value))} {escape(wiring.parts[name].variables[key].unit)}"
            for key, value in wiring.values.get(name, {}).items()
        )
        + "</td></tr>"
        for name in system.components
    )
    links = "".join(
        f"<tr><td>{escape(f'{link.source}.{link.output}')}</td><td>{escape(f'{link.target}.{link.input}')}</td></tr>"
        for link in wiring.links
    )
    run = system.run
    return (
        f"<!doctype html><html lang=en><meta charset=utf-8>{policy()}<title>{escape(system.name)}</title>"
        "<style>body{font:16px/1.5 system-ui,sans-serif;max-width:60rem;margin:2rem auto;padding:0 1rem}"
        "table{border-collapse:collapse}td,th{border-top:1px solid #ccc;padding:.3rem .8rem;text-align:left;vertical-align:top}</style>"
        f"<h1>{escape(system.name)}</h1><p>{escape(system.description)}</p>"
        f"<p>Simulated from {run.start:g} s to {run.stop:g} s, communication step {run.step:g} s, algorithm {run.algorithm}.</p>"
        f"<h2>Components</h2><table><tr><th>name<th>FMU<th>values</tr>{rows}</table>"
        f"<h2>Connections</h2><table><tr><th>from<th>to</tr>{links}</table></html>"
    )
