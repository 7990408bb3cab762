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

from . import archive, xml
from .described import number_of
from .errors import DescriptionError

PARAMETERS = ("parameter", "calculatedParameter", "structuralParameter")
VARIABILITIES = {"independent": ("continuous",), "input": ("discrete", "continuous")}
BASES = ("kg", "m", "s", "A", "K", "mol", "cd", "rad")
REFERENCES = 2**32 - 1
TYPES = ("Real", "Integer", "Boolean", "String", "Enumeration")
CAPABILITIES = ("canHandleVariableCommunicationStepSize", "canBeInstantiatedOnlyOncePerProcess")


def read_description(path: Path) -> tuple[ModelDescription, list[str]]:
    """What an FMU, packed or unpacked, says of itself, and what was mended in it. Raises whatever a parser meets."""
    root, notes = xml.root_of(_content(path))
    said = dict[str, list[str]]()

    def note(what: str, name: str) -> None:
        said.setdefault(what, []).append(name)

    _complete(root)
    _unheard(root, note)
    try:
        described = _read(root)  # without comments, which FMPy takes for a type where they stand in front of one
    except Exception as error:
        try:
            _mend(root, note)
            described = _read(root)
        except Exception:
            raise error from None
    notes += [f"{what}: {', '.join(n[:5])}" + (f" and {len(n) - 5} more" if len(n) > 5 else "") for what, n in said.items()]
    if described.fmiVersion == "1.0" and described.coSimulation is not None:
        for node in root.iter("Capabilities"):  # which FMPy passes over
            for name in CAPABILITIES:
                setattr(described.coSimulation, name, node.get(name) in ("true", "1"))
        described.coSimulation.needsExecutionTool = next(root.iter("CoSimulation_Tool"), None) is not None
    return described, notes + _doubles(described)


def _content(path: Path) -> bytes:
    if path.is_dir():
        return (path / "modelDescription.xml").read_bytes()
    with zipfile.ZipFile(path) as packed:
        if (size := packed.getinfo("modelDescription.xml").file_size) > archive.XML:
            raise DescriptionError(f"it has {size >> 20} MiB; at most {archive.XML >> 20} MiB are read.")
        return packed.read("modelDescription.xml")


def _read(root: etree._Element) -> ModelDescription:
    with tempfile.TemporaryDirectory() as folder:
        file = Path(folder) / "modelDescription.xml"
        etree.ElementTree(root).write(str(file), encoding="utf-8", xml_declaration=True)
        return fmpy.read_model_description(str(file), validate=False)


def _complete(root: etree._Element) -> None:
    """Refuse by name what lacks what nobody can guess: FMPy passes over it, or takes a type from the variable before."""
    if root.tag != "fmiModelDescription":
        raise DescriptionError(f"its root element is {root.tag}, not fmiModelDescription.")
    variables = root.find("ModelVariables")
    if variables is None:
        raise DescriptionError("it has no ModelVariables.")
    typed = not root.get("fmiVersion", "").startswith("3.")
    for node in variables:
        name = node.get("name")
        if name is None:
            raise DescriptionError(f"line {node.sourceline}: a variable has no name.")
        reference = node.get("valueReference", "").strip()
        if not reference.isdecimal() or int(reference) > REFERENCES:
            raise DescriptionError(f"its variable {name} has the valueReference {node.get('valueReference')!r}, which is none.")
        if typed and not any(child.tag in TYPES for child in node):
            raise DescriptionError(f"its variable {name} is of no type.")


def _unheard(root: etree._Element, note: Any) -> None:
    """Mend what FMPy reads as something else: an index below 1 counts from the end in Python, and True is no true."""
    for way in root.iter("CoSimulation", "ModelExchange", "ScheduledExecution"):
        for name, text in way.attrib.items():
            if (
                name.startswith(("can", "needs", "provides", "has", "is"))
                and text.lower() in ("true", "false")
                and text != text.lower()
            ):
                note(f"{text} is taken as {text.lower()}", name)
                way.set(name, text.lower())
    known = list(root.iterfind("ModelVariables/*"))
    references = {node.get("valueReference") for node in known}
    for node in list(root.iterfind("ModelStructure//*")):
        _unknown(node, len(known), references, note)
    if root.get("fmiVersion", "").startswith("2."):
        for node in known:
            for holder in node:
                derivative = number_of(holder.get("derivative", "1"))
                if derivative is None or not 1 <= derivative <= len(known):
                    note("the derivative of what is not there; it is the derivative of nothing", node.get("name"))
                    del holder.attrib["derivative"]


def _doubles(described: ModelDescription) -> list[str]:
    """Variables of one name: each but the first gets a number behind it, so that none stands in another's place."""
    seen, notes = dict[str, int](), []
    for variable in described.modelVariables:
        name = variable.name
        seen[name] = seen.get(name, 0) + 1
        if seen[name] > 1:
            variable.name = f"{name} ({seen[name]})"
            notes.append(f"several variables are named {name!r}; the first is that, this one is {variable.name!r}")
    return notes


def _mend(root: etree._Element, note: Any) -> None:
    version = root.get("fmiVersion", "")
    if version.startswith("2.0."):
        root.set("fmiVersion", "2.0")
    for node in root.iter("CoSimulation", "ModelExchange"):
        order = node.get("maxOutputDerivativeOrder")
        if order is not None and not order.strip().isdecimal():
            note("maxOutputDerivativeOrder is no number; it is taken as 0", order)
            del node.attrib["maxOutputDerivativeOrder"]
    if number_of(root.get("numberOfEventIndicators", "0")) is None:
        note("numberOfEventIndicators is no number; it is taken as 0", root.get("numberOfEventIndicators"))
        del root.attrib["numberOfEventIndicators"]
    _units(root, note)
    types = _types(root)
    for node in root.iterfind("ModelVariables/*"):
        _variable(node, types, version, note)


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


def _variable(node: etree._Element, types: set[str], version: str, note: Any) -> None:
    name = node.get("name", "")
    for holder in (node, *node):
        if holder.get("declaredType") is not None and holder.get("declaredType") not in types:
            note(f"the type {holder.get('declaredType')!r} is not defined; variables of it go without", name)
            del holder.attrib["declaredType"]
        if holder.get("clocks") is not None:
            holder.set("clocks", " ".join(holder.get("clocks", "").split()))
    causality, variability = node.get("causality", "local"), node.get("variability")
    if variability is None and version.startswith("2.") and causality in PARAMETERS:
        node.set("variability", "fixed")
        note('a parameter without a variability would be continuous, which none can be; it is taken as "fixed"', name)
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
