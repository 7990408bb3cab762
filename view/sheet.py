"""A result to look at: a file of ours or of others, or a run that was just made."""

from __future__ import annotations

from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
import pyarrow as pa
import pyarrow.parquet as pq

from selflock.master import Result, Variable
from selflock.master.errors import ResultError
from selflock.master.files import read, seconds, told, torn
from selflock.master.seen import Seen

CELLS = 2e8  # numbers of a table that are read at most; they take 1.6 GB
BYTES = 4e9  # of a CSV file
BLOCK = 65536  # rows looked at together
NAMES = 12  # columns named in a sentence


@dataclass
class Sheet:
    """Columns of numbers over a time that never falls."""

    label: str
    time: np.ndarray  # s
    columns: dict[str, np.ndarray]  # float64, NaN where there is none
    units: dict[str, str]
    steps: set[str]  # columns that jump: whole numbers and truths
    about: dict[str, Any] = field(default_factory=dict)  # selflock.master.about
    notes: list[str] = field(default_factory=list)

    def variables(self) -> list[Variable]:
        return [Variable("time", "s"), *(Variable(name, self.units.get(name, ""), causality="output") for name in self.columns)]

    def look(self, seen: Seen) -> Seen:
        """Let what watches the columns of `variables` see all rows; where there is no number, 0, which is no peak."""
        for first in range(0, len(self.time), BLOCK):
            part = slice(first, first + BLOCK)
            seen.add(np.column_stack([self.time[part], *(np.nan_to_num(x[part]) for x in self.columns.values())]))
        return seen


def sheet(source: Path | Result, label: str) -> Sheet:
    """The numbers of a result. Raises ResultError, a sentence each."""
    notes: list[str] = []
    if isinstance(source, Result):
        frame, units, about = source.table, source.units, source.about
    else:
        _bounded(source)
        frame, units = _read(source, notes)
        about = told(source)
    frame = frame.rename(columns=str.strip)
    units = {name.strip(): unit for name, unit in units.items()}
    said = {name: found for name in frame if not units.get(name) and (found := _header(name))}  # a header as our CSV's
    units |= dict(said.values())
    frame = frame.rename(columns={name: bare for name, (bare, _) in said.items()})
    if frame.columns.has_duplicates:
        twice = sorted(set(frame.columns[frame.columns.duplicated()]))
        notes.append(f"{some(twice)}: there is more than one column of this name, and the first is shown.")
        frame = frame.loc[:, ~frame.columns.duplicated()]
    time = seconds(label, units.get("time", "")) * _time(frame, label)
    columns, steps, dropped, empty = {}, set(), [], []
    for name in frame.columns:
        if name == "time":
            continue
        column = _filled(frame[name])
        kind = column.dtype.kind
        x = column.to_numpy(float, na_value=np.nan) if kind in "fiub" else None
        if x is None:
            dropped.append(name)
        elif not np.isfinite(x).any():
            empty.append(name)
        else:
            columns[name] = np.where(np.isfinite(x), x, np.nan)
            if kind in "iub":
                steps.add(name)
    if not columns:
        raise ResultError(f"{label} holds no number beside its time; look at what wrote it.")
    if dropped:
        notes.append(f"Not shown, for they hold words: {some(dropped)}.")
    if empty:
        notes.append(f"Not shown, for they hold no number at all: {some(empty)}.")
    return Sheet(label, time, columns, {name: units.get(name, "") for name in columns}, steps, about, notes)


def _header(text: str) -> tuple[str, str] | None:
    """Name and unit of "name [unit]"."""
    bare, bracket, unit = text[:-1].rpartition(" [")
    return (bare, unit) if bare and bracket and text.endswith("]") else None


def _bounded(path: Path) -> None:
    try:
        if path.suffix.lower() == ".parquet" and path.is_file():
            size = pq.read_metadata(path)
            if size.num_rows * size.num_columns > CELLS:
                raise ResultError(
                    f"{path} has {size.num_rows} rows and {size.num_columns} columns, more than {CELLS:.0e} numbers: record fewer "
                    "columns, or rows at a longer interval, to see them."
                )
        elif path.is_file() and path.stat().st_size > BYTES:
            raise ResultError(f"{path} is larger than {BYTES / 1e9:g} GB: write it as .parquet, or fewer rows, to see it.")
    except (OSError, pa.ArrowException):
        return  # told when it is read


def _read(path: Path, notes: list[str]) -> tuple[pd.DataFrame, dict[str, str]]:
    """The file's table; a last line that is torn, as an interrupted run leaves it, is left out."""
    found = read(path)
    if path.suffix.lower() == ".csv" and torn(path):
        notes.append(f"The last line of {path.name} is torn, as an interrupted run leaves it; it is left out.")
    return found


def _filled(column: pd.Series) -> pd.Series:
    """A column of numbers in which cells are empty is one of numbers: other tools write it so."""
    if column.dtype.kind != "O" or not (empty := column.isna() | (column == "")).any() or empty.all():
        return column
    try:
        return pd.to_numeric(column.mask(empty))
    except (ValueError, TypeError):
        return column


def _time(frame: pd.DataFrame, label: str) -> np.ndarray:
    if "time" not in frame:
        there = f"It has {some(list(map(str, frame.columns)))}." if len(frame.columns) else "It has no column at all."
        raise ResultError(f"{label} has no column `time`, in s. {there}")
    if len(frame) < 2:
        raise ResultError(f"{label} has {'one row' if len(frame) else 'no row'}: there is nothing to draw.")
    if frame["time"].dtype.kind not in "fiu":
        raise ResultError(f"{label}: its column time holds what is no number; it is to be in s.")
    time = frame["time"].to_numpy(float, na_value=np.nan)
    if not np.isfinite(time).all():
        raise ResultError(f"{label}: its time is no number in row {int(np.argmin(np.isfinite(time))) + 1}.")
    falls = np.diff(time) < 0.0
    if falls.any():
        row = int(np.argmax(falls))
        raise ResultError(
            f"{label}: its time falls from {time[row]:g} to {time[row + 1]:g} s at row {row + 2}. Sort it, or show one run."
        )
    return time


def some(names: list[str]) -> str:
    """Names in a sentence, as many as one may hold."""
    shown = [name if len(name) <= 80 else f"{name[:79]}…" for name in names[:NAMES]]
    return ", ".join(shown) + (f" and {len(names) - NAMES} more" if len(names) > NAMES else "")
