"""The JSON schema of a system file, from the classes that its reader makes: editors complete and check the TOML by it."""

from __future__ import annotations

from dataclasses import MISSING, fields
from typing import Any

from .algorithms import ALGORITHMS
from .drives import ENDS, PARTS
from .system import CONTROLS, FAULTS, INTERFACES, Bond, Component, Connection, Fault, Run

DRAFT = "http://json-schema.org/draft-07/schema#"  # what editors for TOML know
NUMBER, TEXT, TRUTH = {"type": "number"}, {"type": "string"}, {"type": "boolean"}
FORMULA = {"anyOf": [NUMBER, {"type": "string", "pattern": "^="}]}
KINDS: dict[str, dict[str, Any]] = {
    "float": NUMBER,
    "int": {"type": "integer"},
    "str": TEXT,
    "bool": TRUTH,
    "list": {"type": "array", "items": TEXT},
    "dict": {"type": "object"},
}
CHOICES = {"algorithm": list(ALGORITHMS), "step_control": ["", *CONTROLS], "kind": list(FAULTS), "interface": ["", *INTERFACES]}


def table(properties: dict[str, Any], **more: Any) -> dict[str, Any]:
    """A table that has these keys and no others."""
    return {"type": "object", "properties": properties, "additionalProperties": False, **more}


def named(entry: dict[str, Any]) -> dict[str, Any]:
    """A table whose keys are names that somebody chose."""
    return {"type": "object", "additionalProperties": entry}


def document(title: str, properties: dict[str, Any], **more: Any) -> dict[str, Any]:
    """A whole file."""
    return {"$schema": DRAFT, "title": title, **table(properties, **more)}


def schema() -> dict[str, Any]:
    """Of a system file, docs/system.md."""
    connection = _of(Connection)
    connection["properties"]["from"] = connection["properties"].pop("source")
    connection["required"] = ["from"]
    source: dict[str, Any] = {"anyOf": [TEXT, connection]}
    # names may be written with dots without quotes: then they are tables in tables
    source["anyOf"].append(
        {"type": "object", "not": {"required": ["from"]}, "additionalProperties": {"$ref": "#/definitions/source"}}
    )
    component = _of(Component) | {"oneOf": [{"required": [one]} for one in ("fmu", "part", "manoeuvre")]}
    return document(
        "selflock system file",
        {
            "system": table({"name": TEXT, "description": TEXT}),
            "values": {**named({"anyOf": [*FORMULA["anyOf"], TRUTH]}), "propertyNames": {"pattern": r"^[^\W\d]\w*$"}},
            "run": _of(Run),
            "components": named(component),
            "drives": named(_drive()),
            "connections": named({"$ref": "#/definitions/source"}),
            "bonds": {"type": "array", "items": _of(Bond)},
            "faults": {"type": "array", "items": _of(Fault)},
        },
        required=["components"],
        definitions={"source": source},
    )


def _drive() -> dict[str, Any]:
    """A drive; its parts have the start values of their FMUs and keys of a component."""
    ends = {key: {"anyOf": [TEXT, table({one: TEXT for one in names}, required=list(names))]} for key, names in ENDS.items()}
    return table({"like": TEXT, "ratio": FORMULA, **ends, **dict.fromkeys(PARTS, KINDS["dict"])})


def _of(kind: Any) -> dict[str, Any]:
    """A table with the fields of one of the system's classes."""
    properties: dict[str, Any] = {}
    required: list[str] = []
    for one in fields(kind):
        said = str(one.type)
        if one.name in CHOICES:
            properties[one.name] = {"enum": CHOICES[one.name]}
        else:
            properties[one.name] = FORMULA if said == "float | str" else KINDS[said.split("[")[0].split(" ")[0]]
        if one.default is MISSING and one.default_factory is MISSING:
            required.append(one.name)
    return table(properties, **({"required": required} if required else {}))
