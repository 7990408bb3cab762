"""Tables of pages for a narrow screen: each cell carries its column's name, so that a row may stand as a few lines of its own.

The style does it (style.css, .rows); a phone shows the whole of a table by scrolling down alone. Matrices stay as they are.
"""

from __future__ import annotations

import re

TABLE = re.compile(r'(<div class="wide"><table)((?: class="\w+")?)>(.*?)</table>', re.DOTALL)
ROW = re.compile(r"(<tr\b[^>]*>)(.*?)(</tr>)", re.DOTALL)
CELL = re.compile(r"<t([dh])\b([^>]*)>(.*?)</t[dh]>", re.DOTALL)
KEPT = ("shares", "peaks", "params")  # a matrix, and those that have lines of their own
LEAST = 4  # columns: fewer have room beside each other


def stacked(html: str) -> str:
    """A page whose tables of LEAST columns or more say in each cell what it is of."""
    return TABLE.sub(lambda found: _table(*found.groups()), html)


def _table(begin: str, kind: str, inside: str) -> str:
    rows = list(ROW.finditer(inside))
    heads = [cells for row in rows if (cells := CELL.findall(row[2])) and all(tag == "h" for tag, _, _ in cells)]
    names = _names(heads)
    numbers = any(tag == "d" and 'class="n"' in how for row in rows for tag, how, _ in CELL.findall(row[2])[:1])
    if any(word in kind for word in KEPT) or len(names) < LEAST or numbers:
        return f"{begin}{kind}>{inside}</table>"

    def labelled(row: re.Match[str]) -> str:
        if not any(tag == "d" for tag, _, _ in CELL.findall(row[2])):
            return f'<tr class="head">{row[2]}{row[3]}'
        place = -1

        def cell(found: re.Match[str]) -> str:
            nonlocal place
            place += 1
            span = int((re.search(r'colspan="(\d+)"', found[2]) or ("", "1"))[1])
            label = names[place] if span == 1 and place < len(names) else ""
            place += span - 1
            mark = f' data-is="{label}"' if label and place and _words(found[3]) else ""
            return f"<t{found[1]}{found[2]}{mark}>{found[3]}</t{found[1]}>"

        return row[1] + CELL.sub(cell, row[2]) + row[3]

    kind = kind.replace('class="', 'class="rows ') or ' class="rows"'
    return f"{begin}{kind}>{ROW.sub(labelled, inside)}</table>"


def _names(heads: list[list[tuple[str, str, str]]]) -> list[str]:
    """What each column is called by one row of heads or two, of which one may span several columns or rows."""
    grid: dict[tuple[int, int], str] = {}
    for row, cells in enumerate(heads):
        column = 0
        for _, how, text in cells:
            spans = {name: int((re.search(rf'{name}="(\d+)"', how) or ("", "1"))[1]) for name in ("rowspan", "colspan")}
            while (row, column) in grid:
                column += 1
            for down in range(spans["rowspan"]):
                for right in range(spans["colspan"]):
                    grid[row + down, column + right] = _words(text) if not down else ""
            column += spans["colspan"]
    width = 1 + max((column for _, column in grid), default=-1)
    return [", ".join(filter(None, (grid.get((row, column), "") for row in range(len(heads))))) for column in range(width)]


def _words(text: str) -> str:
    """Text without elements, for an attribute."""
    return " ".join(re.sub(r"<[^>]*>", "", text).split()).replace('"', "&quot;")
