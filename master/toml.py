"""TOML as strangers write it: whatever is wrong with a text is one ValueError with a sentence."""

from __future__ import annotations

import re
import tomllib
from pathlib import Path
from typing import Any

from ..fmus.place import ending

LARGEST = 2**63  # TOML's integers have 64 bits
BYTES = 16 << 20  # of a file
DEEPEST = 100  # dots of a key; what they cost grows with their square
PIECES = re.compile(r"[=,\[\]{}\n]")  # between which a key stands


def read(path: Path) -> dict[str, Any]:
    """The content of a TOML file. Raises OSError, and ValueError as `parse` does."""
    return parse(ending(path, BYTES).read_text(encoding="utf-8-sig"))


def parse(text: str) -> dict[str, Any]:
    """The content of a TOML text. Raises ValueError."""
    if max(piece.count(".") for piece in PIECES.split(text)) > DEEPEST:
        raise ValueError(f"it has more than {DEEPEST} dots in a row, where a key of few is wanted")
    try:
        data = tomllib.loads(text)
        _check(data, "")
    except RecursionError:
        raise ValueError("its brackets are nested too deep") from None
    except tomllib.TOMLDecodeError as error:
        raise ValueError(_told(text, str(error))) from None
    except ValueError as error:  # of Python's own int
        raise ValueError("it has a number of thousands of digits" if "digits" in str(error) else str(error)) from None
    return data


USES = {
    "rig": "a rig: selflock replay {0} LOG, or selflock diagnose {0} LOG",
    "sweep": "a sweep: selflock sweep {0}",
    "system": "a system: selflock run {0}",
}


def kind(data: dict[str, Any]) -> str:
    """Which file of ours has these tables: a rig, a sweep, a system; "" of none."""
    if isinstance(data.get("rig"), dict):
        return "rig"
    if {"vary", "list", "sample"} & data.keys():
        return "sweep"
    return "system" if {"components", "drives"} & data.keys() else ""


def of_another_kind(path: Path, data: dict[str, Any], wanted: str) -> str:
    """A sentence where somebody gave a file of ours to a command of another, else ""."""
    found = kind(data)
    return f"{path} is {USES[found].format(path)}." if found not in ("", wanted) else ""


def _told(text: str, said: str) -> str:
    """What tomllib says of a text, with what people write there most often."""
    place = re.search(r"at line (\d+)|at end of document", said)
    lines = text.splitlines()
    number = int(place[1]) if place and place[1] else len(lines)
    line = lines[number - 1].strip() if 0 < number <= len(lines) else ""
    where = f"line {number}, {line[:80]}"
    if "overwrite" in said or "twice" in said or "already" in said:
        return f"{where}: it stands there a second time. Keep one of them"
    if re.search("[\u2018\u2019\u201c\u201d\u201e]", line):
        return f'{where}: write straight quotes, as in "text"'
    if re.search(r"=\s*[+-]?\d+,\d+\s*(#.*)?$", line):
        return f"{where}: write a decimal point, and no comma"
    if re.fullmatch(r"[\w.\"-]+\s*=\s*[A-Za-z][^\"'\[{]*", line):
        return f"{where}: text stands in quotes ({said})"
    return said


def _check(value: Any, name: str) -> None:
    if isinstance(value, dict):
        for key, inner in value.items():
            _check(inner, f"{name}.{key}" if name else key)
    elif isinstance(value, list):
        for inner in value:
            _check(inner, name)
    elif isinstance(value, int) and not -LARGEST <= value < LARGEST:
        raise ValueError(f"{name} is an integer beyond 64 bits; write a real number, such as 1e30")
