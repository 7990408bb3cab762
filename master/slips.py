"""What a person may slip into a system in Python, where no file's reader looked at it: one sentence each, before anything runs."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import fields
from numbers import Real
from pathlib import Path
from typing import Any

from .errors import DescriptionError
from .system import WANTED, Bond, Component, Connection, Fault, Run, System, fits, one_line_each

KINDS: dict[type, list[tuple[str, str, type | None]]] = {}  # of tables that were looked at


def checked(system: System) -> System:
    """The system, every entry of which is of the kind that its field says."""
    if not isinstance(system.run, Run):
        raise DescriptionError(
            f"system.run is {_said(system.run)}: it is a master.Run; change its fields, as system.run.stop = 2.0."
        )
    _all_fit("[run]", system.run)
    for table, kind, as_ in (
        ("components", Component, 'master.Component(fmu="selflock:Motor", start={...})'),
        ("connections", Connection, 'master.Connection("component.variable")'),
    ):
        entries = getattr(system, table)
        if not isinstance(entries, Mapping):
            raise DescriptionError(f"system.{table} is {_said(entries)}: it is a dictionary by name.")
        one_line_each(f"[{table}]", entries)
        for name, entry in entries.items():
            if not isinstance(entry, kind):
                raise DescriptionError(f"system.{table}[{name!r}] is {_said(entry)}: write {as_}.")
            _all_fit(f"[{table}] {name}" if kind is Connection else f"[components.{name}]", entry)
    for table, one in (("bonds", Bond), ("faults", Fault)):
        for entry in getattr(system, table):
            if not isinstance(entry, one):
                raise DescriptionError(f"system.{table} holds {_said(entry)}: write master.{one.__name__}(...).")
            _all_fit(f"[[{table}]]", entry)
    return system


def call(system: Any, settings: Any, stop: Any, out: Any) -> None:
    """Refuse arguments of `run` that are of another kind, as where one was left out."""
    if isinstance(system, Mapping):
        raise DescriptionError("run takes a path or a System, and this is a dictionary: give it to master.from_dict first.")
    if not isinstance(system, (System, str, Path)):
        raise DescriptionError(f"run takes the path of a system, or a System; {_said(system)} is neither.")
    if settings is not None and not isinstance(settings, Mapping):
        raise DescriptionError(f'settings is {_said(settings)}: it is a dictionary, {{"component.variable": value}}.')
    if stop is not None and (isinstance(stop, bool) or not isinstance(stop, Real)):
        named = (
            f' Name what is meant: run(system, settings, out="{stop}").' if Path(str(stop)).suffix in (".csv", ".parquet") else ""
        )
        raise DescriptionError(f"stop = {stop!r} is no number of seconds.{named}")
    if out is not None and not isinstance(out, (str, Path)):
        raise DescriptionError(f"out is {_said(out)}: it is the path of a .csv or .parquet file.")


def _all_fit(where: str, entry: Any) -> None:
    for name, kind, plain in _kinds(type(entry)):
        value = getattr(entry, name)
        if type(value) is plain or (value is None and kind.endswith("None")) or fits(value, kind):
            continue
        raise DescriptionError(f"{where} {name} = {value!r}: {WANTED[kind.split('[')[0].split(' ')[0]]} is wanted here.")


def _kinds(table: type) -> list[tuple[str, str, type | None]]:
    """The fields of a table: name, kind, and a type any value of which is of that kind."""
    if table not in KINDS:
        plain = {"float": float, "int": int, "bool": bool, "str": str, "dict": dict}
        kinds = [(one.name, str(one.type)) for one in fields(table)]
        KINDS[table] = [(name, kind, plain.get(kind.split("[")[0].split(" ")[0])) for name, kind in kinds]
    return KINDS[table]


def _said(value: Any) -> str:
    text = repr(value)
    kind = {str: "text", dict: "a dictionary", list: "a list", type(None): "nothing"}.get(type(value), type(value).__name__)
    return f"{kind} ({text if len(text) <= 60 else text[:60] + '…'})" if value is not None else kind
