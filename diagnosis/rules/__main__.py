"""docs/rules.md, from the rules themselves."""

from __future__ import annotations

from itertools import groupby
from typing import Any

from . import RULES

HEAD = """# The rules of the diagnosis

All numbers that steer it, from `diagnosis/rules/`. `diagnosis.json` carries those that it was made with, under `rules`.
This page is made by `python -m selflock.diagnosis.rules > docs/rules.md`.

Where it says "not studied", a number was found to serve while the diagnosis was written, and no measurement says how much the
answers depend on it; the words are those of the commit that brought it. What the numbers together give is in
[power.md](power.md) and [measurements.md](measurements.md)."""


def page() -> str:
    """The page: a table for each room."""
    lines = [HEAD]
    for room, rules in groupby(RULES.listed(), lambda one: one.name.partition(".")[0]):
        lines += ["", f"## {room}", "", "| name | value | meaning | where it came from |", "|---|---|---|---|"]
        lines += [f"| `{one.name}` | {_text(one.value)} | {one.meaning} | {one.origin} |" for one in rules]
    return "\n".join(lines) + "\n"


def _text(value: Any) -> str:
    if isinstance(value, tuple):
        return "; ".join(map(_text, value)) if isinstance(value[0], tuple) else ", ".join(map(_text, value))
    return f"{value:,}".replace(",", " ") if isinstance(value, int) else f"{value:.6g}"


if __name__ == "__main__":
    print(page(), end="")
