"""Arrays of FMI 3.0 written as SSP 2.0 has them: one connector, one connection, one parameter for all elements."""

from __future__ import annotations

from collections.abc import Mapping
from itertools import groupby

from lxml import etree

from ...fmus.variable import Variable
from ..binary import open_fmu
from ..wiring import Wiring, fmu_path
from .archive import tag
from .arrays import names

Shapes = dict[str, dict[str, tuple[int, ...]]]  # of the arrays of each component, by name


def shapes_in(wiring: Wiring) -> Shapes:
    """The arrays of the FMUs of a system."""
    found: Shapes = {}
    for name, component in wiring.system.components.items():
        if not component.fmu:
            continue
        described = open_fmu(fmu_path(component, wiring.system), wiring.system.unlimited).description
        stems = {v.name for v in described.modelVariables if v.dimensions}
        for told in wiring.parts[name].variables if stems else ():
            stem, _, place = told.rpartition("[")
            if stem in stems:
                found.setdefault(name, {})[stem] = tuple(map(int, place[:-1].split(",")))
    return found


def structure(root: etree._Element, shapes: Shapes) -> None:
    """Make one connector of those of the elements, and one connection where it is of all of them."""
    for component in root.iter(tag("ssd:Component")):
        arrays = shapes.get(component.get("name"), {})
        connectors = component.find(tag("ssd:Connectors"))
        seen = set()
        for connector in [] if connectors is None else list(connectors):
            stem = connector.get("name").rpartition("[")[0]
            if stem not in arrays:
                continue
            if stem in seen:
                connectors.remove(connector)
                continue
            seen.add(stem)
            connector.set("name", stem)
            for size in arrays[stem]:
                etree.SubElement(connector, tag("ssc:Dimension"), size=str(size))
    for connections in root.iter(tag("ssd:Connections")):
        for _, group in groupby(list(connections), lambda one: _alike(one, shapes)):
            _joined(connections, list(group), shapes)


def _stem(one: etree._Element, side: str, shapes: Shapes) -> str:
    stem = one.get(f"{side}Connector").rpartition("[")[0]
    return stem if stem in shapes.get(one.get(f"{side}Element"), {}) else ""


def _alike(one: etree._Element, shapes: Shapes) -> tuple:
    """What is the same of connections that may be one."""
    ends = [(one.get(f"{side}Element"), _stem(one, side, shapes) or one.get(f"{side}Connector")) for side in ("start", "end")]
    return *ends, one.get("suppressUnitConversion"), *(etree.tostring(child) for child in one)


def _joined(connections: etree._Element, group: list[etree._Element], shapes: Shapes) -> None:
    first = group[0]
    stems = {side: _stem(first, side, shapes) for side in ("start", "end")}
    wholes = [
        [one.get(f"{side}Connector") for one in group] == names(stem, shapes[first.get(f"{side}Element")][stem])
        for side, stem in stems.items()
        if stem
    ]
    whole = len(wholes) == 2 and all(wholes)
    for one in group[1:] if whole else []:
        connections.remove(one)
    for one in group[:1] if whole else group:
        for side, stem in stems.items():
            if stem and not whole:
                one.set(f"{side}Indices", one.get(f"{side}Connector")[len(stem) + 1 : -1].replace(",", " "))
            if stem:
                one.set(f"{side}Connector", stem)


def parameters(root: etree._Element, arrays: dict[str, tuple[int, ...]], variables: Mapping[str, Variable]) -> None:
    """Make one parameter of those of the elements; elements that are not given have their start values."""
    holder = root.find(tag("ssv:Parameters"))
    given = {one.get("name"): one for one in holder}
    for stem, shape in arrays.items():
        elements = names(stem, shape)
        mine = [given[name] for name in elements if name in given]
        starts = [variables[name].start for name in elements]
        if not mine or len(mine) < len(elements) and any(start is None for start in starts):
            continue  # by the names of the elements, as in 1.0
        texts = [given[name][0].get("value") if name in given else _text(start) for name, start in zip(elements, starts)]
        first = mine[0]
        first.set("name", stem)
        if first[0].tag == tag("ssv:String"):
            del first[0].attrib["value"]
            for text in texts:
                etree.SubElement(first[0], tag("ssv:Value")).text = text
        else:
            first[0].set("value", " ".join(texts))
        for size in shape:
            etree.SubElement(first, tag("ssc:Dimension"), size=str(size))
        for one in mine[1:]:
            holder.remove(one)


def _text(value: object) -> str:
    return str(value).lower() if isinstance(value, bool) else repr(value) if isinstance(value, float) else str(value)
