"""Slips that real SSP files have: mended where the meaning is clear, each told in a sentence; all else is left to the schema.

What SSP 2.0 has more than 1.0 goes the same way: its number types become those of 1.0. What is left of a document without
arrays, clocks and its other news is held to the schema of 1.0, whose namespaces 2.0 has, too.

Source: System Structure and Parameterization 1.0 and 2.0, Modelica Association, with their schemas.
"""

from __future__ import annotations

import copy
import re
from pathlib import Path

from lxml import etree

from .. import xml
from ..errors import DescriptionError

BASE = "http://ssp-standard.org/SSP1/SystemStructure"
NAMESPACES = {
    "ssd": BASE + "Description",
    "ssc": BASE + "Common",
    "ssv": BASE + "ParameterValues",
    "ssm": BASE + "ParameterMapping",
    "ssb": BASE + "SignalDictionary",
}

REALS = ("Float64", "Float32")
INTEGERS = tuple(f"{sign}Int{bits}" for sign in ("", "U") for bits in (8, 16, 32, 64))
TYPES = ("Real", "Integer", "Boolean", "String", "Enumeration", "Binary", *REALS, *INTEGERS)
CHANGES = tuple(f"{kind}Transformation" for kind in ("Linear", "BooleanMapping", "IntegerMapping", "EnumerationMapping"))
DRAWN = ("ElementGeometry", "ConnectorGeometry", "ConnectionGeometry", "SystemGeometry", "GraphicalElements")
LATER = ("MetaData", "Signature", "SSDVariant")  # of 2.0; none of them bears on a number
ORDER = {  # of the elements in an element
    "SystemStructureDescription": ("System", "Enumerations", "Units", "DefaultExperiment", "Annotations"),
    "System": ("Connectors", "ParameterBindings", "Elements", "Connections", "SignalDictionaries", "Annotations"),
    "Component": ("Connectors", "ParameterBindings", "Annotations"),
    "Connector": (*TYPES, "Annotations"),
    "Connection": (*CHANGES, "Annotations"),
    "ParameterBinding": ("ParameterValues", "ParameterMapping", "Annotations"),
    "ParameterSet": ("Parameters", "Enumerations", "Units", "Annotations"),
}
HOLDERS = ("Connectors", "ParameterBindings", "Elements", "Connections", "Units", "Enumerations", "Parameters", "Annotations")
SOURCED = ("Component", "ParameterBinding", "ParameterMapping", "SignalDictionary")  # by a URI
EMPTY_IS_NONE = ("unit", "startElement", "endElement", "startTime", "stopTime", "suppressUnitConversion", "sourceBase",
                 "implementation", "type", "factor", "offset")  # fmt: skip
SIZED = "{urn:sized}type"  # where a node keeps the type that it had in 2.0
KNOWN = (*REALS, *INTEGERS, "Connector")  # where 2.0 differs
KINDS = {"local": "output", "constant": "output"}  # of 2.0: connected, they are as outputs
FIRST = {"structuralParameter": "parameter", "unspecified": "inout"}  # kinds of 2.0 for the schema of 1.0


class Slips(dict[str, list[int]]):
    """The slips of a document: what was done, with the lines where it was."""

    def add(self, what: str, node: etree._Element) -> None:
        self.setdefault(what, []).append(node.sourceline or 0)

    def sentences(self, file: str) -> list[str]:
        return [f"{file}, line{'s' * (len(set(at)) > 1)} {_several(at)}: {what}" for what, at in self.items()]


def _several(lines: list[int]) -> str:
    said = [str(line) for line in dict.fromkeys(lines)]
    return ", ".join(said[:5]) + (f" and {len(said) - 5} more" if len(said) > 5 else "")


def tree(path: Path, notes: list[str]) -> etree._Element:
    """The root of a document, prefixes that it uses without saying what they mean taken as what they usually mean."""
    content, mended = xml.sound(path.read_bytes())
    notes += [f"{path.name}: {what}" for what in mended]
    root, errors = _recovered(content)
    if errors:
        content, mended = xml.legible(content)
        notes += [f"{path.name}: {what}" for what in mended]
        root, errors = _recovered(content)
    if root is None or errors:
        return etree.fromstring(content, etree.XMLParser(**xml.PARSER))  # which says what is wrong
    slips = Slips()
    for node in root.iter():
        prefix, _, local = str(node.tag).rpartition(":")
        if not str(node.tag).startswith("{") and prefix:
            node.tag = f"{{{NAMESPACES.get(prefix, 'urn:unbound:' + prefix)}}}{local}"
            slips.add(f"the prefix {prefix} is not declared; it is taken as what it usually means", node)
    notes += slips.sentences(path.name)
    return xml.without_type(root)


def _recovered(content: bytes) -> tuple[etree._Element | None, bool]:
    """The root of a document, and whether more is wrong with it than a prefix that is not declared."""
    parser = etree.XMLParser(recover=True, **xml.PARSER)
    root = etree.fromstring(content, parser)
    return root, root is None or any(entry.domain_name != "NAMESPACE" for entry in parser.error_log)


def mend(root: etree._Element, file: str, notes: list[str]) -> None:
    """Mend a document, or one inside another, in place. Raises DescriptionError for what 2.0 has and we have not."""
    slips = Slips()
    _version(root, slips, file)
    waiting = [root]
    while waiting:
        node = waiting.pop()
        local = _local(node)
        _namespace(node, local, slips)
        _later(node, local)
        if node is root or node.getparent() is not None:
            _attributes(node, local, slips)
            _order(node, local, slips)
            if local != "Annotation":  # what is in it is not ours
                waiting += reversed(node)
    for node in list(root.iter(*(f"{{{space}}}{name}" for space in NAMESPACES.values() for name in HOLDERS))):
        parent = node.getparent()
        if len(node) == 0 and parent is not None and _local(node) != "Parameters" and _local(parent) != "Annotation":
            parent.remove(node)  # an empty list says what none says
    notes += slips.sentences(file)


def bare(root: etree._Element) -> etree._Element:
    """A copy without what bears on no number: it may be as it likes."""
    root = copy.deepcopy(root)
    gone = [f"{{{space}}}{name}" for space in NAMESPACES.values() for name in (*DRAWN, "Annotations", "Dimension", "Clock")]
    for node in list(root.iter(*gone)):
        if node.getparent() is not None:
            node.getparent().remove(node)
    for node in list(root.iter(tag=etree.Element)):
        if _local(node) == "Component" and node.get("source") is None:
            node.set("source", "none")  # which 2.0 allows
        if (node.get("source") or "").strip() and _local(node) in SOURCED:
            node.set("source", "some")  # what it names is found out where it is read
        for name in ("id", "generationDateAndTime", "startIndices", "endIndices"):
            node.attrib.pop(name, None)
        if _local(node) == "Connector" and node.get("kind") in FIRST:
            node.set("kind", FIRST[node.get("kind", "")])
        parent = node.getparent()
        if parent is not None and _local(parent) == "Parameter" and _local(node) in TYPES:
            _first_of_array(node)
        node.attrib.pop(SIZED, None)
    return root


def _first_of_array(node: etree._Element) -> None:
    """Of the values of an array the first, in the place of a scalar's."""
    listed = [child for child in node if _local(child) == "Value"]
    if listed and node.get("value") is None:
        node.set("value", listed[0].text or "")
    for child in listed:
        node.remove(child)
    if node.attrib.pop(SIZED, "").endswith(("Int64", "UInt32")) and node.get("value", "").lstrip("+-").isdecimal():
        node.set("value", "0")  # beyond what an Integer of 1.0 may be
    if _local(node) not in ("String", "Enumeration", "Binary") and len(words := node.get("value", "").split()) > 1:
        node.set("value", words[0])


def _local(node: etree._Element) -> str:
    return str(node.tag).rpartition("}")[2]


def _version(root: etree._Element, slips: Slips, file: str) -> None:
    said = (root.get("version") or "").strip()
    if not said:
        slips.add('it says no version; it is read as "1.0"', root)
    elif re.fullmatch("[12]", said):
        slips.add(f'version = "{said}" is read as "{said}.0"', root)
    elif not re.match(r"[12]\.\d+", said):
        raise DescriptionError(f"{file}: version {said!r} of SSP is not known here; 1.0 and 2.0 are.")
    root.set("version", "1.0")
    if root.get("name") is None and _local(root) not in ("ParameterMapping", "SignalDictionary"):
        slips.add("it has no name; its file's is taken", root)
        root.set("name", Path(file).stem)
    for system in root:
        if _local(system) == "System" and system.get("name") is None:
            slips.add("its system has no name; the document's is taken", system)
            system.set("name", root.get("name", ""))


def _namespace(node: etree._Element, local: str, slips: Slips) -> None:
    """Types and transformations under the prefix of their neighbours."""
    parent = node.getparent()
    above = "" if parent is None else _local(parent)
    wanted = None
    if local in TYPES and above in ("Connector", "DictionaryEntry", "Parameter"):
        wanted = "ssv" if above == "Parameter" else "ssc"
    elif local in (*CHANGES, "Unit", "BaseUnit", "Annotation") or local == "Enumeration" and above == "Enumerations":
        wanted = "ssc"
    space = None if wanted is None else etree.QName(node).namespace
    if wanted and space != NAMESPACES[wanted] and space in (None, *NAMESPACES.values()):
        slips.add(f"{local} is read as {wanted}:{local}", node)
        node.tag = f"{{{NAMESPACES[wanted]}}}{local}"


def _later(node: etree._Element, local: str) -> None:
    """What 2.0 has more."""
    parent = node.getparent()
    if parent is None or local not in KNOWN and local not in LATER:
        return
    space = etree.QName(node).namespace
    if space not in NAMESPACES.values():
        return
    if local in LATER:
        parent.remove(node)
    elif local in REALS + INTEGERS:
        node.tag = f"{{{space}}}{'Real' if local in REALS else 'Integer'}"
        node.set(SIZED, local)
    elif node.get("kind") in KINDS:
        node.set("kind", KINDS[node.get("kind", "")])


def _attributes(node: etree._Element, local: str, slips: Slips) -> None:
    for name, text in dict(node.attrib).items():
        if not text.strip() and name in EMPTY_IS_NONE:
            slips.add(f'{name}="" is taken as not given', node)
            del node.attrib[name]
        elif text in ("True", "False", "TRUE", "FALSE") and (name == "suppressUnitConversion" or local == "Boolean"):
            slips.add(f'{name}="{text}" is taken as {text.lower()}', node)
            node.set(name, text.lower())
        elif local == "Integer" and name == "value" and re.fullmatch(r"\s*[-+]?\d+\.0*\s*", text):
            slips.add(f'the Integer "{text}" is taken as {text.partition(".")[0].strip()}', node)
            node.set(name, text.partition(".")[0].strip())
        elif name == "kind" and text not in ("", text[:1].lower() + text[1:]):
            slips.add(f'kind="{text}" is taken as {text[:1].lower() + text[1:]}', node)
            node.set(name, text[:1].lower() + text[1:])
        elif name == "source" and local != "MappingEntry" and "\\" in text:
            slips.add(f'source="{text}" has the strokes of a Windows path', node)
            node.set(name, text.replace("\\", "/"))


def _order(node: etree._Element, local: str, slips: Slips) -> None:
    """The elements in an element in the order of the schema; of those that hold a list, one."""
    if local not in ORDER:
        return
    for child in list(node):
        name = _local(child)
        first = next(other for other in node if other.tag == child.tag)
        if name in HOLDERS and first is not child:
            slips.add(f"a second {name} of one {local} is taken as more of the first", child)
            first.extend(list(child))
            node.remove(child)
    known = {name: place for place, name in enumerate(ORDER[local])}
    places = [known[_local(child)] for child in node if _local(child) in known]
    if places != sorted(places):
        slips.add(f"the elements of a {local} are in another order than the standard's", node)
        node[:] = sorted(node, key=lambda child: known.get(_local(child), -1))
