"""The modelDescription.xml of an FMU, slips that real ones have mended where the meaning is clear, each told in a sentence.

FMPy reads it. What FMPy cannot read is mended and read again; what it then still cannot is refused with its first word.
"""

from __future__ import annotations

import tempfile
import zipfile
from pathlib import Path
from typing import Any

import attrs
import fmpy
from fmpy.model_description import ModelDescription, SimpleType
from lxml import etree

from .described import number_of

PARSER = {"resolve_entities": False, "no_network": True, "load_dtd": False, "remove_comments": True, "remove_pis": True}
PARAMETERS = ("parameter", "calculatedParameter", "structuralParameter")
VARIABILITIES = {"independent": ("continuous",), "input": ("discrete", "continuous")}
BASES = ("kg", "m", "s", "A", "K", "mol", "cd", "rad")
CAPABILITIES = ("canHandleVariableCommunicationStepSize", "canBeInstantiatedOnlyOncePerProcess")


def read_description(path: Path) -> tuple[ModelDescription, list[str]]:
    """What an FMU, packed or unpacked, says of itself, and what was mended in it. Raises whatever a parser meets."""
    try:
        described = fmpy.read_model_description(str(path), validate=False)
    except Exception as error:
        try:
            return _mended(path)
        except Exception:
            raise error from None
    if described.fmiVersion == "1.0" and described.coSimulation is not None:
        for node in _root(path).iter("Capabilities"):  # which FMPy passes over
            for name in CAPABILITIES:
                setattr(described.coSimulation, name, node.get(name) in ("true", "1"))
    return described, []


def _root(path: Path) -> etree._Element:
    if path.is_dir():
        return etree.parse(str(path / "modelDescription.xml"), etree.XMLParser(**PARSER)).getroot()
    with zipfile.ZipFile(path) as archive, archive.open("modelDescription.xml") as file:
        return etree.parse(file, etree.XMLParser(**PARSER)).getroot()


def _mended(path: Path) -> tuple[ModelDescription, list[str]]:
    root, said = _root(path), dict[str, list[str]]()
    _mend(root, lambda what, name: said.setdefault(what, []).append(name))
    with tempfile.TemporaryDirectory() as folder:
        file = Path(folder) / "modelDescription.xml"
        etree.ElementTree(root).write(str(file), encoding="utf-8", xml_declaration=True)
        return fmpy.read_model_description(str(file), validate=False), [
            f"{what}: {', '.join(names[:5])}" + (f" and {len(names) - 5} more" if len(names) > 5 else "")
            for what, names in said.items()
        ]


def _mend(root: etree._Element, note: Any) -> None:
    version = root.get("fmiVersion", "")
    if version.startswith("2.0."):
        root.set("fmiVersion", "2.0")
    if number_of(root.get("numberOfEventIndicators", "0")) is None:
        note("numberOfEventIndicators is no number; it is taken as 0", root.get("numberOfEventIndicators"))
        del root.attrib["numberOfEventIndicators"]
    _units(root, note)
    types = _types(root)
    variables = root.find("ModelVariables")
    known = [] if variables is None else list(variables)
    for node in known:
        _variable(node, types, len(known), version, note)
    references = {node.get("valueReference") for node in known}
    for node in root.iterfind("ModelStructure//*"):
        _unknown(node, len(known), references, note)


def _units(root: etree._Element, note: Any) -> None:
    for node in root.iterfind("UnitDefinitions/Unit/*"):
        for name in (*BASES, "factor", "offset"):
            number = number_of(node.get(name, "0"))
            if name in BASES and number is not None and number == int(number):
                if name in node.attrib:
                    node.set(name, str(int(number)))
            elif number is None or name in BASES:
                parent = node.getparent()
                if parent is not None:
                    parent.remove(node)
                    note("a unit is defined by what is no number or no whole power; it goes by its name", parent.get("name", ""))
                break


def _types(root: etree._Element) -> set[str]:
    """The names of the types that FMPy will know; of what it does not take they are freed."""
    takes = {field.name for field in attrs.fields(SimpleType)}
    names = set()
    for node in root.iterfind("TypeDefinitions/*"):
        inner = node[0] if node.tag in ("SimpleType", "Type") and len(node) else node
        for name in [name for name in inner.attrib if name not in takes]:
            del inner.attrib[name]
        if node.tag != "ClockType":
            names.add(node.get("name", ""))
    return names


def _variable(node: etree._Element, types: set[str], count: int, version: str, note: Any) -> None:
    name = node.get("name", "")
    for holder in (node, *node):
        if holder.get("declaredType") is not None and holder.get("declaredType") not in types:
            note(f"the type {holder.get('declaredType')!r} is not defined; variables of it go without", name)
            del holder.attrib["declaredType"]
        derivative = number_of(holder.get("derivative", "1"))
        if version.startswith("2.") and (derivative is None or not 1 <= derivative <= count):
            note("the derivative of what is not there; it is the derivative of nothing", name)
            del holder.attrib["derivative"]
        if holder.get("clocks") is not None:
            holder.set("clocks", " ".join(holder.get("clocks", "").split()))
    causality, variability = node.get("causality", "local"), node.get("variability")
    if version.startswith("1.") or variability is None:
        return
    fits = ("fixed", "tunable") if causality in PARAMETERS else VARIABILITIES.get(causality)
    if causality in ("output", "local"):
        fits = (
            ("constant", "fixed", "tunable", "discrete", "continuous")
            if causality == "local"
            else ("constant", "discrete", "continuous")
        )
    if fits is not None and variability not in fits:
        node.set("variability", fits[0])
        note(f'causality "{causality}" does not go with variability "{variability}", which is taken as "{fits[0]}"', name)


def _unknown(node: etree._Element, count: int, references: set[str | None], note: Any) -> None:
    """An entry of the model structure: what names nothing is left out."""

    def there(text: str | None) -> bool:
        if "valueReference" in node.attrib:
            return text in references
        number = number_of(text)
        return number is not None and 1 <= number <= count

    if "index" not in node.attrib and "valueReference" not in node.attrib:
        return
    own = node.get("index", node.get("valueReference"))
    if not there(own):
        parent = node.getparent()
        if parent is not None:
            parent.remove(node)
        note("an entry of the model structure names no variable; it is left out", str(own))
        return
    if node.get("dependencies") is not None:
        words = node.get("dependencies", "").split()
        if all(map(there, words)):
            node.set("dependencies", " ".join(words))
        else:
            note("dependencies of the model structure name no variable; they are taken as not told", str(own))
            del node.attrib["dependencies"]
