"""The page of a track: changes in words and as a table, every number over time by unit, what diagnoses answered."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd

from selflock.fmus.place import whole
from selflock.view import page, thin

from ..data.log import write_csv
from .changes import NORMAL, AllUnits
from .series import Series, days
from .track import Track, amount, chance, day, size

UNITS = 60  # drawn
POINTS = 200  # of a curve
ROWS = 400  # of a table; the table beside the page has all
COLOURED = 8  # units with colours of their own
GREY = "#8a94a066"
SECONDS = 86_400.0  # of a day


def write(track: Track, path: Path) -> Path:
    """The page, and beside it, ending .csv, all numbers as a table. Neither grows beyond what a browser opens."""
    numbers = track.found.numbers
    changed = list(dict.fromkeys(one.unit for one in track.changes))
    units = list(dict.fromkeys([*changed, *(one.unit for watched in numbers for one in watched.series)]))
    drawn, notes = units[:UNITS], []
    if len(units) > UNITS:
        notes.append(f"{UNITS} of {len(units)} units are drawn: those that changed, and the first of the others.")
    runs, thinned = _runs(numbers, drawn)
    if thinned:
        notes.append(f"Of more than {POINTS} values of a unit every few are drawn.")
    latest = [_row(one, watched) for watched in numbers for one in watched.series]
    told = track.diagnoses.table
    answers = told[told["verdict"] != "none"]
    if len(latest) > ROWS or len(answers) > ROWS:
        notes.append(f"Tables show {ROWS} rows at most; all numbers are in {path.with_suffix('.csv').name}.")
    with whole(path.with_suffix(".csv")) as new:
        write_csv(_all(track), new)
    track.page = page.write(
        path,
        page.environment("selflock.diagnosis.tracking"),
        "track.html.j2",
        {"runs": runs, "dates": True, "choices": _choices(numbers, drawn, changed)} if runs else None,
        track=track,
        changes=[
            {"unit": c.unit, "parameter": c.parameter, "measure": c.measure, "size": size(c), "since": day(c.since), "shape": c.shape,
             "before": c.before, "after": c.after, "low": c.before + c.low, "high": c.before + c.high, "chance": chance(c)}
            for c in track.changes
        ],
        scatter=[(watched.parameter, amount(watched, watched.scatter).lstrip("+"), len(watched.series)) for watched in numbers],
        latest=latest[:ROWS],
        answers=[{**row, "day": f"{row['time']:%Y-%m-%d}"} for row in answers.head(ROWS).to_dict("records")],
        verdicts=told["verdict"].value_counts().to_dict(),
        notes=[*track.notes, *notes],
        versions=sorted(set(told["version"])),
    )  # fmt: skip
    return track.page


def _runs(numbers: list[AllUnits], units: list[str]) -> tuple[list[dict[str, Any]], bool]:
    """Of each unit its values over time, with their intervals, as the script has runs."""
    of = {unit: [one for watched in numbers for one in watched.series if one.unit == unit] for unit in units}
    found, thinned = [], False
    for unit, series in of.items():
        time = np.unique(np.concatenate([one.time for one in series]))
        every = -(-len(time) // POINTS)
        thinned |= every > 1
        columns = []
        for one in series:
            value, low, high = (np.full(len(time), np.nan) for _ in range(3))
            place, reach = np.searchsorted(time, one.time), NORMAL * one.error
            value[place], low[place], high[place] = one.value, one.value - reach, one.value + reach
            packed = {name: thin.packed(x[::every], "<f4") for name, x in (("values", value), ("low", low), ("high", high))}
            columns.append({"name": one.parameter, "unit": one.measure, "steps": False, **packed})
        found.append({"label": _called(unit), "time": thin.packed(SECONDS * time[::every], "<f8"), "columns": columns})
    return found, thinned


def _choices(numbers: list[AllUnits], units: list[str], changed: list[str]) -> list[dict[str, Any]]:
    """A choice for each parameter, and all of them; those that changed, or all of a few units, in colours, the others in grey."""
    bright = (changed or units if len(units) <= COLOURED else changed)[:COLOURED]
    choices = []
    for watched in numbers:
        have = {one.unit for one in watched.series}
        curves = [
            {"run": k, "name": watched.parameter, "panel": watched.parameter, "label": _called(unit), "quiet": unit not in bright,
             "colour": bright.index(unit) if unit in bright else GREY}
            for k, unit in enumerate(units) if unit in have
        ]  # fmt: skip
        if curves:
            choices.append({"label": watched.parameter, "curves": curves})
    return [*choices, {"label": "all", "curves": [curve for choice in choices for curve in choice["curves"]]}]


def _row(one: Series, watched: AllUnits) -> dict[str, Any]:
    """The last value of a number of a unit beside its first."""
    last, reach = float(one.value[-1]), float(NORMAL * one.error[-1])
    return {
        "unit": one.unit, "parameter": one.parameter, "measure": one.measure, "count": len(one), "first": float(one.value[0]),
        "since": day(one.time[0]), "last": last, "day": day(one.time[-1]), "low": last - reach, "high": last + reach,
    }  # fmt: skip


def _all(track: Track) -> pd.DataFrame:
    """Every number of every diagnosis."""
    table = track.diagnoses.values.rename(columns={"measure": "unit of it", "time": "recorded"})
    aside = {
        (watched.parameter, one.unit, when)
        for watched in track.found.numbers
        for one in watched.series
        for when in one.time[watched.aside[one.unit]]
    }
    keys = zip(table["parameter"], table["unit"], days(table["recorded"]))
    return table.assign(set_aside=[key in aside for key in keys])


def _called(unit: str) -> str:
    """A unit in a legend; one that is a mere number says what it is the number of."""
    return unit if unit.lower().startswith("unit") else f"unit {unit}"
