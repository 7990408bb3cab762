"""A system as the TOML file that describes it: what `load` would read again as the same."""

from __future__ import annotations

import json
import os
import re
from collections.abc import Iterator
from dataclasses import MISSING, fields
from numbers import Integral, Real
from pathlib import Path
from typing import Any

import numpy as np

from .code import importable, named
from .errors import ResultError
from .face import Part
from .system import Connection, Run, System


def save(system: System, path: Path | str, about: str = "") -> Path:
    """Write a system file. Paths of FMUs become relative to it. about: first lines, as comments.

    Raises ResultError where a value has no words in TOML, as an option of a part that is an array.
    """
    path = Path(path)
    text = [f"# {line}".rstrip() for line in about.splitlines()]
    text += ["", "[system]", f"name = {toml(system.name)}"]
    if system.description:
        text.append(f"description = {toml(system.description)}")
    if system.values:
        text += ["", "[values]", *(f"{name} = {toml(value)}" for name, value in system.values.items())]
    text += ["", "[run]", *_changed(system.run, Run())]
    for name, component in system.components.items():
        text += ["", f"[components.{_key(name)}]"]
        for key, value in _other(component):
            if key == "part":
                value = _found(name, value)
            text.append(f"{key} = {toml(_moved(value, system, path) if key in ('fmu', 'manoeuvre') else value)}")
    text += ["", "[connections]"]
    for target, connection in system.connections.items():
        text.append(f"{toml(target)} = {_source(connection)}")
    for table, entries in (("bonds", system.bonds), ("faults", system.faults)):
        for entry in entries:
            text += ["", f"[[{table}]]", *(f"{key} = {toml(value)}" for key, value in _other(entry))]
    path.write_text("\n".join(text).lstrip("\n") + "\n", encoding="utf-8")
    return path


def _found(name: str, part: str | type[Part]) -> str:
    """A part as its file names it."""
    if isinstance(part, str) or importable(part):
        return named(part)
    raise ResultError(
        f"{name} is {named(part)}, which a file cannot name. Put it into a module of its own, import it from there, and read the "
        "file with allow_code=True."
    )


def _other(entry: Any) -> Iterator[tuple[str, Any]]:
    """The fields that are not as they would be if nothing was said."""
    for one in fields(entry):
        value = getattr(entry, one.name)
        default = one.default_factory() if one.default_factory is not MISSING else one.default
        if default is MISSING or value != default:
            yield one.name, value


def _changed(run: Run, default: Run) -> list[str]:
    always = ("stop", "step")
    return [
        f"{one.name} = {toml(getattr(run, one.name))}"
        for one in fields(run)
        if one.name in always or getattr(run, one.name) != getattr(default, one.name)
    ]


def _moved(fmu: str, system: System, path: Path) -> str:
    """The path of an FMU as the new file must name it."""
    if not fmu or fmu.startswith("selflock:"):
        return fmu
    return Path(os.path.relpath((system.folder / fmu).resolve(), path.resolve().parent)).as_posix()


def _source(connection: Connection) -> str:
    more = {key: value for key, value in _other(connection) if key != "source"}
    return toml({"from": connection.source, **more}) if more else toml(connection.source)


def _key(name: str) -> str:
    """A name as a key: in quotes where it is not plain, as with a dot in it."""
    return name if re.fullmatch(r"[A-Za-z0-9_-]+", name) else toml(name)


def toml(value: Any) -> str:
    """A value as TOML has it."""
    if isinstance(value, str):
        return json.dumps(value, ensure_ascii=False).replace("\x7f", "\\u007f")
    if isinstance(value, (bool, np.bool_)):
        return "true" if value else "false"
    if isinstance(value, Integral):
        return repr(int(value))
    if isinstance(value, Real):
        return repr(float(value))
    if isinstance(value, (list, tuple)):
        return f"[{', '.join(map(toml, value))}]"
    if isinstance(value, dict):
        return f"{{ {', '.join(f'{_key(str(key))} = {toml(one)}' for key, one in value.items())} }}" if value else "{}"
    raise ResultError(f"{value!r} cannot be written to a system file: it is no text, number, list or table.")
