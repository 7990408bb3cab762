"""The JSON schema of a rig file, from the names that its reader knows (docs/rig.md)."""

from __future__ import annotations

from typing import Any

from selflock.fmus import laws
from selflock.fmus.effect_file import LAWS
from selflock.fmus.slave import rows
from selflock.master.schema import KINDS as TYPES
from selflock.master.schema import NUMBER, TEXT, document, named, table

from . import rig
from .signals import ALIASES, SIGNALS


def schema() -> dict[str, Any]:
    """Of a rig file. Names of a drive's variables and parameters are checked where the rig has no others."""
    ends = {"type": "array", "items": NUMBER, "minItems": 2, "maxItems": 2}
    column = {"anyOf": [TEXT, _of(rig.COLUMN) | {"anyOf": [{"required": ["column"]}, {"required": ["value"]}]}]}
    wanted = {"anyOf": [ends, _of(rig.WANTED)]}
    head = _of(rig.HEAD)
    head["properties"] |= {key: {"enum": list(allowed)} for key, allowed in rig.CHOICES.items()} | {
        "kind": {"enum": list(rig.KINDS)}
    }
    value = {"anyOf": [NUMBER, {"type": "boolean"}]}
    tables: dict[str, Any] = {
        "rig": head | {"anyOf": [{"required": ["kind"]}, {"required": ["system"]}]},
        "time": _of(rig.TIME),
        "columns": {"type": "object", "properties": dict.fromkeys([*SIGNALS, *ALIASES], column), "additionalProperties": column},
        "parameters": named(value),
        "uncertain": named(ends),
        "calibrate": named(wanted),
        "logs": named(named(value)),
        "fleet": _of(rig.FLEET),
    }
    own = table(dict.fromkeys(_parameters(), value))
    others = {"anyOf": [{"required": [key]} for key in ("system", "drives", "effects")]}  # then names are those of others, too
    return document(
        "selflock rig file",
        {name: tables[name] for name in rig.TABLES},
        required=["rig"],
        **{"if": {"properties": {"rig": others}}, "else": {"properties": {"parameters": own}}},
    )


def _of(types: dict[str, type]) -> dict[str, Any]:
    return table({key: TYPES[kind.__name__] for key, kind in types.items()})


def _parameters() -> list[str]:
    """component.parameter of all that our drive's FMUs have."""
    found = []
    for component in ("controller", "motor", "reducer", "load"):
        law = laws.module(LAWS[component])
        found += [f"{component}.{row.name}" for row in rows(law.BASE, law.EFFECTS)]
    return found
