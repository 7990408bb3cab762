"""The logs of a fleet in their folder: whose each is, and when it was recorded, by names alone."""

from __future__ import annotations

import re
from dataclasses import dataclass
from datetime import datetime
from pathlib import Path

from ..data.table import ENDINGS
from ..errors import DataError

USUAL = ("{unit}/*{date}*", "{unit}/*")
"""Without a pattern: a folder for each unit, in it logs with a date in their names where there is one."""

DATE = r"(?<!\d)(?P<date>\d{4}-\d{2}(?:-\d{2}(?:[T_ ]\d{2}[-:]?\d{2}(?:[-:]?\d{2})?)?)?|\d{8}(?:[T_-]?\d{4}(?:\d{2})?)?)(?!\d)"
STARS = 4  # of a pattern; more would try a name in more ways than anybody waits for
PIECES = {"{unit}": r"(?P<unit>[^/]+?)", "{date}": DATE, "*": r"[^/]*?"}


@dataclass(frozen=True)
class FleetLog:
    """A log of a fleet."""

    path: str  # from the fleet's folder, with "/"
    unit: str
    recorded: str  # ISO 8601; "" where its name tells no date


def logs_of(folder: Path, pattern: str = "") -> list[FleetLog]:
    """The logs below a folder, by unit and name. pattern: how they are called there (docs/track.md); USUAL when "".

    DataError where the folder or the pattern is none, or nothing fits.
    """
    if not folder.is_dir():
        raise DataError(f"{folder}: is no folder. Give that of the fleet's logs, in it a folder for each unit.")
    wanted = [_compiled(one) for one in ([pattern] if pattern else USUAL)]
    paths = sorted(path.relative_to(folder).as_posix() for path in folder.rglob("*") if path.suffix.lower() in ENDINGS)
    found = [one for path in paths if (one := _log(path, wanted)) and (folder / path).is_file()]
    if not found:
        said = repr(pattern) if pattern else "'{unit}/*', a folder for each unit"
        there = f"there is {paths[0]}" if paths else "there is no log at all"
        raise DataError(
            f"{folder}: no log in it fits {said}; {there}. Say in the rig how logs lie, such as\n"
            '[fleet]\nlogs = "{unit}_{date}.csv"'
        )
    return sorted(found, key=lambda one: (one.unit, one.recorded, one.path))


def _compiled(pattern: str) -> re.Pattern[str]:
    """A pattern as a regular expression."""
    if pattern.count("{unit}") != 1 or pattern.count("{date}") > 1 or pattern.count("*") > STARS:
        raise DataError(
            f"[fleet] logs = {pattern!r}: write {{unit}} once, where the name of the unit stands, and {{date}} where its date does, if anywhere; "
            f"* is anything but a slash, {STARS} times at most."
        )
    pieces = re.split(r"(\{unit\}|\{date\}|\*)", pattern)
    return re.compile("".join(PIECES.get(piece, re.escape(piece)) for piece in pieces))


def _log(path: str, patterns: list[re.Pattern[str]]) -> FleetLog | None:
    """A log by the first pattern that it fits."""
    for pattern in patterns:
        if fits := pattern.fullmatch(path):
            told = fits.groupdict()
            date = _date(told.get("date", ""))
            if date is not None:
                return FleetLog(path, told["unit"], date)
    return None


def _date(text: str) -> str | None:
    """ISO 8601 of a date in a name, the first of a month that has no day; None where it is none."""
    digits = re.sub(r"\D", "", text)
    if not digits:
        return ""
    if len(digits) == 6:
        digits += "01"
    form = "%Y%m%d%H%M%S"[: {8: 6, 12: 10, 14: 12}[len(digits)]]
    try:
        return datetime.strptime(digits, form).isoformat(timespec="seconds")
    except ValueError:
        return None
