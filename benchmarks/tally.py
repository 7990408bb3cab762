"""What long campaigns have counted, kept in docs/reliability.json: each adds to it, and puts its table into docs/reliability.md."""

from __future__ import annotations

import json
from collections.abc import Iterable, Mapping
from pathlib import Path

PAGE = Path(__file__).parents[1] / "docs" / "reliability.md"
KEPT = PAGE.with_suffix(".json")


def add(campaign: str, counts: Mapping[str, Mapping[str, int]]) -> dict[str, dict[str, int]]:
    """All that this campaign has counted, by area and by word, with these added."""
    told = json.loads(KEPT.read_text()) if KEPT.exists() else {}
    whole = told.setdefault(campaign, {})
    for area, words in counts.items():
        mine = whole.setdefault(area, {})
        for word, count in words.items():
            mine[word] = mine.get(word, 0) + count
    KEPT.write_text(json.dumps(told, indent=1, sort_keys=True) + "\n")
    return whole


def table(head: Iterable[str], rows: Iterable[Iterable[object]]) -> str:
    """Rows in Markdown."""
    heads = list(head)
    lines = [heads, ["---"] * len(heads), *([str(cell) for cell in row] for row in rows)]
    return "\n".join("| " + " | ".join(line) + " |" for line in lines)


def put(campaign: str, text: str) -> None:
    """Text into the page, between the marks of a campaign."""
    first, last = f"<!-- {campaign} -->\n", f"<!-- end of {campaign} -->"
    page = PAGE.read_text()
    before, rest = page.split(first)
    PAGE.write_text(before + first + "\n" + text.strip() + "\n\n" + last + rest.split(last)[1])
