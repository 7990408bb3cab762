"""What a document of an SSP says of units, enumerations, values and transformations, as plain data."""

from __future__ import annotations

import math
from dataclasses import dataclass, field
from typing import Any, TypeGuard

from fmpy.model_description import ModelVariable
from lxml import etree

from ...fmus.units import BASES, Unit, of
from ..errors import DescriptionError
from .archive import tag
from .arrays import shape_of
from .flat import Affine, Change, Items, Mapping, Named, Renaming


@dataclass(frozen=True)
class Item:
    """A value of an enumeration: by its name, or its number in digits."""

    text: str
    items: Items = field(default_factory=dict)  # what the document that says it says of its enumeration

    def __str__(self) -> str:
        return self.text


READ: dict[str, Any] = {
    "Real": float,
    "Integer": int,
    "Boolean": lambda text: text in ("true", "1"),
    "String": str,
    "Enumeration": str,
    "Binary": str,  # in hexadecimal digits
}


def items_of(variable: ModelVariable) -> Items:
    """The items of an FMU's variable that is an enumeration; of all others none."""
    if variable.type != "Enumeration" or variable.declaredType is None:
        return {}
    return {item.name: int(item.value) for item in variable.declaredType.items or ()}


def is_number(value: object) -> TypeGuard[float]:
    return isinstance(value, (int, float)) and not isinstance(value, bool)


def transform(node: etree._Element, where: str) -> Change:
    """The transformation of a connection or mapping."""
    for child in node:
        if isinstance(child.tag, str) and etree.QName(child).localname.endswith("Transformation"):
            name = etree.QName(child).localname
            if name != "LinearTransformation":
                return _mapping(child, name, where)
            change = Affine(float(child.get("factor", "1")), float(child.get("offset", "0")))
            if not math.isfinite(change.factor) or not math.isfinite(change.offset):
                raise DescriptionError(f"{where}: factor {change.factor} and offset {change.offset} give no number.")
            return change
    return Affine()


def _mapping(node: etree._Element, kind: str, where: str) -> Mapping | Renaming:
    """A table of values that become others."""
    pairs = [(entry.get("source", ""), entry.get("target", "")) for entry in node.iterfind(tag("ssc:MapEntry"))]
    if len(dict(pairs)) != len(pairs):
        raise DescriptionError(f"{where}: its {kind} maps one value twice.")
    if kind == "EnumerationMappingTransformation":
        return Renaming(tuple(pairs))
    if kind == "BooleanMappingTransformation":
        truth = {"true": 1, "1": 1, "false": 0, "0": 0}
        return Mapping(tuple((truth[old], truth[new]) for old, new in pairs))
    return Mapping(tuple((int(old), int(new)) for old, new in pairs))


def composed(first: Affine | Mapping, second: Affine | Mapping, where: str) -> Affine | Mapping:
    """One change behind the other. Raises DescriptionError for a linear one and a table together."""
    if first == Affine() or second == Affine():
        return second if first == Affine() else first
    if isinstance(first, Affine) and isinstance(second, Affine):
        return first.then(second)
    if isinstance(first, Mapping) and isinstance(second, Mapping):
        return first.then(second)
    raise DescriptionError(
        f"{where}: a linear transformation and a mapping of whole numbers, one behind the other, are not supported."
    )


def changed(value: object, change: Change, where: str) -> object:
    """A given value behind a transformation: a number, an item of an enumeration, or the values of an array."""
    if change == Affine():
        return value
    if isinstance(value, tuple):
        return tuple(changed(one, change, where) for one in value)
    if isinstance(change, Renaming):
        if not isinstance(value, Item):
            raise DescriptionError(f"{where} = {value} is no item of an enumeration, its mapping cannot change it.")
        return Item(dict(change.entries).get(value.text, value.text), {} if value.text in dict(change.entries) else value.items)
    if isinstance(change, Mapping) and isinstance(value, Item) and value.text in value.items:
        return change(value.items[value.text])
    if isinstance(change, Mapping) and isinstance(value, bool):
        return bool(change(value))
    if not is_number(value):
        raise DescriptionError(f"{where} = {value} is no number, its mapping cannot change it.")
    return change(value)


def units_in(root: etree._Element) -> dict[str, Unit]:
    """Each ssc:Unit in an ssd or ssv document, by name."""
    units = {}
    for node in root.iter(tag("ssc:Unit")):
        base = node.find(tag("ssc:BaseUnit"))
        powers = {name: int(base.get(name, "0")) for name in BASES}
        units[node.get("name")] = of(float(base.get("factor", "1")), float(base.get("offset", "0")), **powers)
    return units


def enumerations_in(root: etree._Element) -> dict[str, Items]:
    """Each definition of an enumeration in an ssd or ssv document, by name."""
    return {
        node.get("name"): {item.get("name"): int(item.get("value")) for item in node.findall(tag("ssc:Item"))}
        for node in root.findall(f"{_list_of(root)}/{tag('ssc:Enumeration')}")
    }


def _list_of(root: etree._Element) -> str:
    return f"{{{etree.QName(root).namespace}}}Enumerations"


def unit_of(node: etree._Element, units: dict[str, Unit], notes: list[str]) -> Named | None:
    """The unit that a Real has; one that is not in Units goes by its name."""
    text = node.get("unit")
    if text and text not in units:
        said = f"unit {text!r} is not in the Units of its file; it is taken as what the FMU, or everybody, calls so"
        notes += [said] if said not in notes else []
    return Named(text, units) if text else None


def value_of(
    parameter: etree._Element, units: dict[str, Unit], enumerations: dict[str, Items], what: str, notes: list[str]
) -> tuple[object, Named | None]:
    """The value and unit of an ssv:Parameter, of an array a tuple of them."""
    name = parameter.get("name")
    shape = shape_of(parameter, f"{what}: {name}")
    for child in parameter:
        if not isinstance(child.tag, str):
            continue
        kind, text = etree.QName(child).localname, child.get("value")
        if kind not in READ:
            raise DescriptionError(f"{what}: {name} is of type {kind}, which is not supported.")
        listed = [one.text or "" for one in child if str(one.tag).endswith("}Value")]
        texts = listed or ([text or ""] if kind in ("String", "Enumeration", "Binary") else (text or "").split())
        items = enumerations.get(child.get("name", ""), {})
        values = tuple(Item(one, items) if kind == "Enumeration" else READ[kind](one) for one in texts)
        unit = unit_of(child, units, notes) if kind == "Real" else None
        if shape and math.prod(size or 1 for size in shape) != len(values):
            raise DescriptionError(f"{what}: {name} is an array of {' · '.join(map(str, shape))} and has {len(values)} values.")
        return (values if shape or len(values) != 1 else values[0]), unit
    raise DescriptionError(f"{what}: {parameter.get('name')} has no value.")


def as_item(value: object, items: Items | None, where: str) -> object:
    """A value for an FMU's variable: the number of an enumeration's item, checked against those of the variable.

    items: of the variable; None: it is of another type. Raises DescriptionError.
    """
    if items and is_number(value) and value not in items.values():
        raise DescriptionError(f"{where}: its enumeration has no item {value:g}; there is: {_said(items)}.")
    if not isinstance(value, Item):
        return value
    if items and value.text in items:
        return items[value.text]
    digits = value.text.strip().lstrip("+-").isdecimal()
    if items:
        if digits and int(value.text) in items.values():
            return int(value.text)
        raise DescriptionError(f"{where}: its enumeration has no item {value.text!r}; there is: {_said(items)}.")
    if value.text in value.items or digits:  # for an Integer, or an enumeration whose FMU does not tell its items
        return value.items.get(value.text, int(value.text) if digits else 0)
    raise DescriptionError(f"{where}: it is no enumeration, so {value.text!r} is no value for it; say its number.")


def _said(items: Items) -> str:
    return ", ".join(f"{name} = {number}" for name, number in items.items())
