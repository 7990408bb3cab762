"""Tables in text, as strangers write them: preamble, separator, decimal comma, header, a row of units, all told by the cells.

The numbers decide, not the header: a dialect is the right one where lines fall into the most cells that are numbers.
"""

from __future__ import annotations

import csv
import re
from collections import Counter
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

from ..errors import DataError
from .plain import NumberTable, numbers
from .units import is_unit

if TYPE_CHECKING:
    import pandas as pd

SEPARATORS = (",", ";", "\t", "|", " ")  # " " stands for any white space
LOOKED_AT = 1 << 20  # bytes of a file's begin by which its form is told
LINES = 400  # of it, at most
ALIKE = 3  # lines of data in a row with which a table begins
MOST_COLUMNS = 10_000
UNIT_LINES = {"y_unit_label", "unit", "units", "einheit", "einheiten"}

_POINT = re.compile(r"[+-]?(\d+\.?\d*|\.\d+)([eE][+-]?\d+)?")
_COMMA = re.compile(r"[+-]?(\d+|\d*,\d+)([eE][+-]?\d+)?")
_NONE = {"", "nan", "inf", "-inf", "+inf", "none", "null", "na", "n/a", "#n/a", "-nan", "nan(ind)", "true", "false"}
_CLOCK = re.compile(r"(\d{1,4}[-./]\d{1,2}[-./]\d{1,4}[ T]?)?(\d{1,2}:\d{2}(:\d{2}([.,]\d+)?)?)?( ?[AP]M)?(Z|[+-]\d{2}:?\d{2})?")
_DATE, _TIME_OF_DAY = re.compile(r"\d{1,4}[-./]\d{1,2}[-./]\d{1,4}"), re.compile(r"\d{1,2}:\d{2}(:\d{2}([.,]\d+)?)?")
_PAGE = re.compile(r"\s*<(!doctype|html|\?xml)\b", re.IGNORECASE)
_UNITLESS = {"", "-", "1", "[-]", "[]", "()", "[1]", "(-)", "n/a", "none", "text", "bool"}


@dataclass(frozen=True)
class Form:
    """How a table stands in its rows of cells."""

    names: list[str]  # of columns, units in brackets behind them; "1", "2" where there are none
    first: int  # row of the first line of numbers
    width: int  # cells of its lines


def read_text(path: Path, plain: bool = False) -> pd.DataFrame | NumberTable:
    """A text file as a table. attrs["first line"]: the line of the file that its first row was; "preamble": lines before it.

    plain: where all of it is numbers, it may be a table of these alone.
    """
    encoding, lines = _begin(path)
    if _PAGE.match("\n".join(lines[:20])):
        raise DataError(f"{path}: holds a page or XML, and no table. Save the log itself: {LOGS}.")
    separator, comma = _dialect(lines)
    rows = _cells(lines, separator)
    form = form_of(rows, comma)
    names, width = form.names, form.width
    if width > MOST_COLUMNS:
        raise DataError(f"{path}: has {width} columns; {MOST_COLUMNS} at most are read. Export the channels that matter.")
    spare = [f"(unnamed {k + 1})" for k in range(len(names), width)]
    attrs = {
        "first line": form.first + 1,
        "preamble": ["; ".join(filter(None, row)) for row in rows[: form.first] if 1 < sum(map(bool, row)) < max(3, width)],
    }
    if plain and encoding == "utf-8-sig" and not (comma or spare or separator == " ") and all(map(_told, names)):
        if (found := numbers(path, names, rows[form.first :], form.first, separator)) is not None:
            return NumberTable(found, attrs)
    import pandas as pd

    try:
        table = pd.read_csv(
            path, sep=r"\s+" if separator == " " else separator, decimal="," if comma else ".", skipinitialspace=True,
            header=None, names=names + spare, skiprows=form.first, encoding=encoding, index_col=False, low_memory=False,
            true_values=["TRUE", "true", "True"], false_values=["FALSE", "false", "False"],
        )  # fmt: skip
    except pd.errors.ParserError as error:
        raise DataError(f"{path}: {str(error).strip()}. Is the file cut off, or is that line damaged?") from None
    except pd.errors.EmptyDataError:
        raise DataError(f"{path}: has no columns. Export the log again, with a header line.") from None
    if any(table[name].notna().any() for name in spare):
        raise DataError(
            f"{path}: its lines have more values than the header has names ({len(names)}). "
            f"Name every column, or remove what stands behind the last {separator!r} of each line."
        )
    for name in names if comma else ():
        if table[name].dtype.kind not in "fiub":  # a word among the numbers kept them from being read
            cells = table[name].astype(str)
            table[name] = cells.str.replace(",", ".").where(cells.str.fullmatch(_COMMA.pattern), table[name])
    table = table.drop(columns=[*spare, *(name for name in names if not _told(name) and table[name].isna().all())])
    table.attrs.update(attrs)
    return table


def _told(name: str) -> bool:
    """Whether a column has a name of its own."""
    return bool(name) and not name.startswith("(unnamed")


def _begin(path: Path) -> tuple[str, list[str]]:
    """Encoding and first lines of a text file; what is not UTF-8 is taken for Windows' own, in which every byte is a letter."""
    with path.open("rb") as file:
        data = file.read(LOOKED_AT)
        whole = not file.read(1)
    if b"\0" in data and data[:2] not in (b"\xff\xfe", b"\xfe\xff"):
        raise DataError(f"{path}: is not a text file. Logs are {LOGS}; save it as one of them.")
    encoding = "utf-16" if data[:2] in (b"\xff\xfe", b"\xfe\xff") else "utf-8-sig"
    try:
        text = data.decode(encoding, errors="strict" if whole else "ignore")
        if encoding == "utf-8-sig":
            _all_utf8(path)
    except UnicodeDecodeError:
        encoding = "cp1252" if encoding == "utf-8-sig" else encoding
        text = data.decode(encoding, errors="replace")
        encoding = "latin-1" if encoding == "cp1252" else encoding
    lines = re.split("\r\n|\n|\r", text)
    return encoding, (lines if whole else lines[:-1])[:LINES]


def _all_utf8(path: Path) -> None:
    """UnicodeDecodeError where a later part of the file is none."""
    with path.open(encoding="utf-8") as file:
        while file.read(LOOKED_AT):
            pass


LOGS = ".csv, .txt, .tsv, .dat, .log, .asc or .lvm text, .parquet, .mat, .h5, .json, .jsonl, .npy, .npz or .xlsx"


def _dialect(lines: list[str]) -> tuple[str, bool]:
    """Separator, and whether the decimal point is a comma: with them the lines are the most numbers and the least else."""
    best, found = -1.0, (",", False)
    later = lines[len(lines) // 2 :]
    for separator in SEPARATORS:
        rows = _cells(later, separator)
        for comma in (False, True)[: 1 if separator == "," else 2]:
            score = 0.0
            for row in rows:
                told = [cell for cell in row if cell]
                numbers = sum(is_number(cell, comma) for cell in told)
                if separator == " ":  # a date and its time of day are one cell where a tab stands behind them
                    numbers -= sum(bool(_DATE.fullmatch(a) and _TIME_OF_DAY.fullmatch(b)) for a, b in zip(told, told[1:]))
                score += numbers * (numbers / len(told)) ** 2 if told else 0.0
            if score > best * (1.0 + 1e-9):
                best, found = score, (separator, comma)
    if best <= 0.0:  # no numbers at all: the header says what separates
        header = next((line for line in lines if line.strip()), "")
        return max(SEPARATORS[:4], key=header.count), False
    return found


def _cells(lines: list[str], separator: str) -> list[list[str]]:
    if separator == " ":
        return [line.split() for line in lines]
    rows = []
    for line in lines:
        try:
            row = next(csv.reader([line], delimiter=separator, skipinitialspace=True), [])
        except csv.Error:
            row = line.split(separator)
        rows.append([cell.strip() for cell in row])
    return rows


def is_number(cell: str, comma: bool = False) -> bool:
    """Whether a cell holds a number, a date or a time of day, or says that there is none."""
    if cell.lower() in _NONE:
        return bool(cell)
    if (_COMMA if comma else _POINT).fullmatch(cell):
        return True
    return len(cell) > 4 and _CLOCK.fullmatch(cell) is not None


def form_of(rows: list[list[str]], comma: bool = False) -> Form:
    """Where the numbers begin, and what their columns are called."""
    filled = [k for k, row in enumerate(rows) if any(row)]
    later = [rows[k] for k in filled[len(filled) // 2 :]]
    usual = Counter(len(row) for row in later).most_common(1)
    width = usual[0][0] if usual else 0
    numeric = [
        sum(is_number(row[k], comma) for row in later if k < len(row)) > 0.5 * sum(bool(row[k]) for row in later if k < len(row))
        for k in range(width)
    ]

    def data(k: int) -> bool:
        row = rows[k]
        wanted = [cell for cell, number in zip(row, numeric) if number]
        told = [cell for cell in wanted if cell]
        return (
            bool(told)
            and len(told) >= 0.5 * len(wanted)
            and all(is_number(cell, comma) for cell in told)
            and len(row) >= width - 1
        )

    flags = [data(k) for k in filled]
    start = next((i for i, flag in enumerate(flags) if flag and all(flags[i : i + ALIKE])), len(filled))
    if not any(numeric):  # nothing but a header, or text
        start = min(1, len(filled))
    above = [rows[k] for k in filled[:start]]
    first = filled[start] if start < len(filled) else (filled[-1] + 1 if filled else 0)
    return Form(_names(above, width), first, width)


def _names(above: list[list[str]], width: int) -> list[str]:
    """Names of the columns from the lines above the numbers, with the units of a row of units."""
    wide = lambda row: sum(map(bool, row)) >= max(1, 0.6 * width)
    while above and not wide(above[-1]):
        above = above[:-1]  # a line drawn, or a word between the header and the numbers
    if not above:
        return _different([str(k + 1) for k in range(width)])
    labelled = {row[0].lower(): row for row in above if row[0].lower() in ("name", "unit") and wide(row)}
    if "name" in labelled and len(above) > 1:  # attributes of each channel, a row for each, as of TwinCAT's scope
        units = ["" if cell == "Unit" else cell for cell in labelled.get("unit", [""] * width)]
        header = ["time" if cell == "Name" else cell for cell in labelled["name"]]
        return _different(_with_units(header, units))
    header, units = above[-1], [""] * width
    if len(above) > 1 and wide(above[-2]) and _units(header):
        header, units = above[-2], header
    else:  # a line of units that says so in its first cell, above the header, as LabVIEW writes it
        units = next((["", *row[1:]] for row in above[:-1] if row[0].lower() in UNIT_LINES and _units(row[1:])), units)
    header = list(header)
    if header and header[0][:1] in "#%" or header[0].startswith("//"):
        header[0] = header[0].lstrip("#%/ ")
        if not header[0]:
            header = header[1:]
    return _different(_with_units(header, units))


def _with_units(header: list[str], units: list[str]) -> list[str]:
    """Names with their units in brackets."""
    bare = [unit.strip("[]() ") for unit in units]
    return [
        f"{name} [{unit}]" if unit and unit not in _UNITLESS else name for name, unit in zip(header, [*bare, *[""] * len(header)])
    ]


def _units(row: list[str]) -> bool:
    """Whether a line names units, and not columns."""
    told = [cell.strip("[]() ") for cell in row if cell.lower() not in _UNITLESS]
    bracketed = [cell for cell in row if re.fullmatch(r"\[.*\]|\(.*\)", cell)]
    return bool(told) and (len(bracketed) == len([c for c in row if c]) or sum(map(_like_unit, told)) > 0.6 * len(told))


def _like_unit(cell: str) -> bool:
    return cell in {"%", "‰", "rpm", "1/min", "U/min", "min-1", "°", "°C", "°/s", "inc", "counts", "Ω"} or is_unit(cell)


def _different(names: list[str]) -> list[str]:
    """No name twice: the second x is x.2."""
    seen: Counter[str] = Counter()
    found = []
    for k, name in enumerate(names):
        name = name.strip() or f"(unnamed {k + 1})"
        seen[name] += 1
        found.append(name if seen[name] == 1 else f"{name}.{seen[name]}")
    return found
