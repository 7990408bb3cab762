"""What diagnoses say of each number of each unit, over the time of recording."""

from __future__ import annotations

import json
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from datetime import datetime
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
from scipy.special import ndtri

from selflock.fmus.place import DOCUMENT, ending, named
from selflock.fmus.shown import one_line

from ..errors import DataError
from ..judge.cause import label

NAME = "diagnosis.json"


@dataclass(frozen=True, eq=False)
class Series:
    """A number of one unit over time, ascending."""

    unit: str
    parameter: str
    measure: str  # its unit of measurement
    time: np.ndarray  # days since 1970
    value: np.ndarray
    error: np.ndarray  # standard error, from the interval of each diagnosis

    def __len__(self) -> int:
        return len(self.time)


@dataclass
class Diagnoses:
    """What was read: a row for each number of each diagnosis, a row for each diagnosis."""

    values: pd.DataFrame  # unit, time, parameter, measure, value, low, high, folder
    table: pd.DataFrame  # unit, time, told_by, verdict, causes, rig, version, folder
    notes: list[str]


def read(folders: Sequence[str | Path], since: str = "") -> Diagnoses:
    """All diagnoses in folders, and below them. since: only of what was recorded from this date on."""
    first = _since(since)
    found: dict[tuple[str, ...], tuple[dict[str, Any], list[dict[str, Any]]]] = {}
    count = early = untold = 0
    for path in _files(folders):
        row, logs, numbers = _told(path)
        if first and row["time"] < first:
            early += 1
            continue
        count += 1
        sound = [one for one in numbers if one["low"] is not None and one["high"] is not None and one["high"] > one["low"]]
        untold += len(numbers) - len(sound)
        found[(row["unit"], *(logs or [row["folder"]]))] = row, sound
    if not found:
        of = f" of what was recorded since {since}" if early else ""
        where = ", ".join(map(str, folders))
        raise DataError(f"{where}: there is no diagnosis{of}. Give folders that selflock diagnose wrote to.")
    table = pd.DataFrame([row for row, _ in found.values()]).sort_values(["unit", "time"], ignore_index=True)
    values = pd.DataFrame(
        [{key: row[key] for key in ("unit", "time", "folder")} | one for row, numbers in found.values() for one in numbers],
        columns=["unit", "time", "folder", "parameter", "measure", "value", "low", "high"],
    )
    notes = []
    if count > len(found):
        notes.append(f"{count - len(found)} logs were diagnosed more than once; the diagnosis that was read last counts.")
    if early:
        notes.append(f"{early} diagnoses of what was recorded before {since} are left out.")
    if untold:
        notes.append(f"{untold} numbers have no interval and are left out.")
    for what in ("version", "rig"):
        if len(several := sorted(set(table[what]))) > 1:
            notes.append(
                f"The diagnoses are of {len(several)} {what}s ({', '.join(several[:4])}): where one follows another a number may jump for that."
            )
    if changed := int((table["told_by"] == "file").sum()):
        notes.append(
            f"{changed} of {len(table)} dates are when a file was last changed: nothing else tells when it was recorded."
        )
    return Diagnoses(values.sort_values(["parameter", "unit", "time"], ignore_index=True), table, notes)


def series_of(values: pd.DataFrame) -> list[Series]:
    """The series in a table of `read`."""
    found = []
    for (parameter, unit), rows in values.groupby(["parameter", "unit"], sort=True):
        far = np.maximum(rows["high"] - rows["value"], rows["value"] - rows["low"])  # the side that no range cuts short
        time = days(rows["time"])
        error = far.to_numpy(float) / ndtri(0.975)
        found.append(Series(str(unit), str(parameter), rows["measure"].iloc[0], time, rows["value"].to_numpy(float), error))
    return found


def days(times: pd.Series) -> np.ndarray:
    """Dates as days since 1970."""
    return (times.to_numpy("datetime64[s]") - np.datetime64(0, "s")) / np.timedelta64(1, "D")


def _since(text: str) -> datetime | None:
    try:
        return datetime.fromisoformat(text) if text else None
    except ValueError:
        raise DataError(f"--since {text}: is no date; write it as 2026-05-31.") from None


def _files(folders: Sequence[str | Path]) -> Iterable[Path]:
    for folder in map(Path, folders):
        if not folder.is_dir():
            raise DataError(f"{folder}: is no folder. Give folders that selflock diagnose wrote to.")
        yield from map(named, sorted(folder.rglob(NAME)))


def _told(path: Path) -> tuple[dict[str, Any], list[str], list[dict[str, Any]]]:
    """Of a diagnosis.json its row, its logs by their bytes, and its numbers."""
    try:
        told = json.loads(ending(path, DOCUMENT).read_text(encoding="utf-8"))
    except (OSError, ValueError, RecursionError) as error:
        raise DataError(f"{path}: cannot be read ({error}). Make that diagnosis again, or take its folder away.") from None
    about = told.get("about") if isinstance(told, dict) else None
    if not isinstance(about, dict) or not about.get("recorded"):
        raise DataError(
            f"{path}: does not say when its logs were recorded: it is of an older version, or its logs were no files. Diagnose them again."
        )
    try:
        row = {
            "unit": one_line(about["unit"] or about["rig"]),
            "time": datetime.fromisoformat(about["recorded"]).replace(tzinfo=None),
            "told_by": str(about["told_by"]),
            "verdict": str(told["verdict"]),
            "causes": ", ".join(
                label(one["component"], one["effect"], one["parameters"], one.get("channel", "")) for one in told["causes"]
            ),
            "rig": str(about["rig"]),
            "version": str(about["version"]),
            "folder": path.parent.as_posix(),
        }
        return row, sorted(str(log["sha256"]) for log in about["logs"]), list(_numbers(told))
    except (ArithmeticError, AttributeError, KeyError, TypeError, ValueError) as error:
        raise DataError(f"{path}: is not what a diagnosis writes ({error!r}). Make that diagnosis again.") from None


def _numbers(told: dict[str, Any]) -> Iterable[dict[str, Any]]:
    """Each fitted number: those that the rig calls uncertain, then those of causes."""
    every = [(one["name"], one) for one in told.get("uncertain", [])]
    every += [pair for cause in told["causes"] for pair in cause["parameters"].items()]
    for name, one in every:
        ends = {key: None if one[key] is None else float(one[key]) for key in ("value", "low", "high")}
        yield {"parameter": str(name), "measure": str(one["unit"]), **ends}
