"""The JSON schema of a study file, from the names that its reader knows (docs/sweep.md)."""

from __future__ import annotations

from typing import Any

from selflock.master.schema import NUMBER, TEXT, TRUTH, document, named, table

from .record import KINDS
from .study import KEYS, METHODS, SPACINGS, WAYS, WORDS

GRID = table(
    {"from": NUMBER, "to": NUMBER, "count": {"type": "integer", "minimum": 1}, "spacing": {"enum": list(SPACINGS)}},
    required=["from", "to", "count"],
)
WAY: dict[str, Any] = {
    "values": {"type": "array", "minItems": 1},
    "grid": GRID,
    "range": {"type": "array", "items": NUMBER, "minItems": 2, "maxItems": 2},
    "choices": named({"type": "object"}),
}


def schema() -> dict[str, Any]:
    """Of a study file."""
    vary = table(
        {
            **dict.fromkeys(WORDS, TEXT),
            "set": {"anyOf": [TEXT, {"type": "array", "items": TEXT}]},
            **{way: WAY[way] for way in WAYS},
        }
    )
    figure = table(
        {**dict.fromkeys(KINDS, TEXT), "from": NUMBER, "to": NUMBER, "unit": TEXT},
        oneOf=[{"required": [kind]} for kind in KINDS],
    )
    tables: dict[str, Any] = {
        "name": TEXT,
        "description": TEXT,
        "system": TEXT,
        "stop": NUMBER,
        "table": TRUTH,
        "set": {"type": "object"},
        "vary": {**named(vary), "minProperties": 1},
        "list": {"type": "array", "items": {"type": "object"}},
        "sample": table(
            {"method": {"enum": list(METHODS)}, "count": {"type": "integer", "minimum": 1}, "seed": {"type": "integer"}}
        ),
        "record": named(figure),
        "report": {"type": "object"},
    }
    return document("selflock study file", {key: tables[key] for key in KEYS}, required=["system", "vary"])
