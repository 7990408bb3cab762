"""A rule: a number that steers the diagnosis, with what it means and where it came from."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import field, fields
from typing import Any, NamedTuple


class Rule(NamedTuple):
    """One rule as documents have it."""

    name: str  # room.name
    value: Any
    meaning: str
    origin: str


def rule(value: Any, meaning: str, origin: str) -> Any:
    """A field of a room's rules."""
    return field(default=value, metadata={"meaning": meaning, "origin": origin})


def developed(words: str = "") -> str:
    """The origin of what no study stands behind; `words`: those of the commit that brought it."""
    return "chosen in development (seeds from 1001 on); not studied" + (f'; with "{words}"' if words else "")


def of(room: Any, prefix: str) -> Iterator[Rule]:
    """All rules of a room, in their order."""
    for one in fields(room):
        yield Rule(prefix + one.name, getattr(room, one.name), one.metadata.get("meaning", ""), one.metadata.get("origin", ""))
