"""What exporters write into a modelDescription.xml that FMPy cannot read, mended where the meaning is clear."""

from __future__ import annotations

from collections.abc import Callable

import attrs
from fmpy.model_description import Item, SimpleType
from lxml import etree

from .described import number_of
from .errors import DescriptionError

PARAMETERS = ("parameter", "calculatedParameter", "structuralParameter")
CAUSALITIES = (*PARAMETERS, "input", "output", "local", "independent")
VARIABILITIES = {"independent": ("continuous",), "input": ("discrete", "continuous")}
BASES = ("kg", "m", "s", "A", "K", "mol", "cd", "rad")

Note = Callable[[str, object], None]  # what was done, and to what


def mend(root: etree._Element, note: Note) -> None:
    """Mend a description in place; `note` is told what was done. Raises DescriptionError where nobody can guess."""
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
    types = _types(root, note)
    for node in root.iterfind("ModelVariables/*"):
        _causality(node, note)
        _variable(node, types, version, note)
    if version.startswith("3."):
        _references(root, note)


def _units(root: etree._Element, note: Note) -> None:
    for node in root.iter("DisplayUnitDefinition"):
        for name in ("gain", "offset"):
            if number_of(node.get(name, "0")) is None:
                del node.attrib[name]  # of how others show it
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


def _types(root: etree._Element, note: Note) -> set[str]:
    """The names of the types that FMPy will know; of what it does not take they are freed."""
    takes, of_items = ({field.name for field in attrs.fields(kind)} for kind in (SimpleType, Item))
    names = set()
    for node in root.iterfind("TypeDefinitions/*"):
        nested = node.tag in ("SimpleType", "Type")
        if nested and not len(node):
            node.getparent().remove(node)
            note("a type says of nothing what it is; variables of it go without", node.get("name", ""))
            continue
        inner = node[0] if nested else node
        for holder, known in [(inner, takes), *((item, of_items) for item in inner.iter("Item"))]:
            for name in [name for name in holder.attrib if name not in known]:
                del holder.attrib[name]
        if node.tag != "ClockType":
            names.add(node.get("name", ""))
    return names


def _causality(node: etree._Element, note: Note) -> None:
    """Words in capitals, and those of FMI 1.0."""
    for key in ("causality", "variability", "initial"):
        text = node.get(key)
        if text is not None and text != (word := text.strip()[:1].lower() + text.strip()[1:]):
            note(f'{key} "{text}" is taken as "{word}"', node.get("name"))
            node.set(key, word)
    if node.get("causality", "local") not in CAUSALITIES and node.get("causality") in ("none", "internal"):
        note(f'causality "{node.get("causality")}" is one of FMI 1.0; it is taken as "local"', node.get("name"))
        node.set("causality", "local")


def _references(root: etree._Element, note: Note) -> None:
    """FMI 3.0: what refers to a variable that is not there. Sizes of arrays are not guessed."""
    start = {node.get("valueReference"): node.get("start") for node in root.iterfind("ModelVariables/*")}
    for node in root.iterfind("ModelVariables/*"):
        name = node.get("name")
        if node.get("derivative") is not None and node.get("derivative") not in start:
            note("the derivative of what is not there; it is the derivative of nothing", name)
            del node.attrib["derivative"]
        if (clocks := node.get("clocks")) is not None and not start.keys() >= set(clocks.split()):
            note("clocks that are not there are left out", name)
            node.set("clocks", " ".join(clock for clock in clocks.split() if clock in start))
            if not node.get("clocks"):
                del node.attrib["clocks"]
        for size in node.iterfind("Dimension"):
            if size.get("start") is None and number_of(start.get(size.get("valueReference"))) is None:
                raise DescriptionError(
                    f"the size of its array {name} is that of a variable that is not there or has no start value."
                )


def _variable(node: etree._Element, types: set[str], version: str, note: Note) -> None:
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
        fits = ("continuous", "discrete", "constant") + ("fixed", "tunable") * (causality == "local")
    if fits is not None and variability not in fits:
        node.set("variability", fits[0])
        note(f'causality "{causality}" does not go with variability "{variability}", which is taken as "{fits[0]}"', name)
