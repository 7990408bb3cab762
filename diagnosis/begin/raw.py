"""Logs as they come: their numeric columns on one axis of time, which column has the time, and in what unit; and the runs."""

from __future__ import annotations

import re
from collections.abc import Sequence
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np
import pandas as pd

from ..data.log import spread_out
from ..data.stamps import stamps_of
from ..data.table import table
from ..errors import DataError
from ..rules import RULES
from . import words
from .numbers import Columns
from .words import Word

SECONDS = {"s": 1.0, "ms": 1e-3, "us": 1e-6, "ns": 1e-9, "min": 60.0}
EPOCHS = ((1e9, 4.2e9, "s"), (1e12, 4.2e12, "ms"), (1e15, 4.2e15, "us"), (1e18, 4.2e18, "ns"))  # seconds since 1970, after 2001

TELLS = re.compile(
    r"sampl|interval|abtast|takt|period|rate\b|freq|ratio|gear|getriebe|untersetz|bersetz|nominal|nenn|rated|count|resol|encoder|inc\b|kt\b|inertia",
    re.IGNORECASE,
)
"""Lines before a table that may have a number of the data sheet, or the time between rows."""

BEYOND = 1e60  # what no sensor says
NUMBERED = re.compile(r"(.*\.)?\d+")  # columns of a table without a line of names, or of a matrix
MARKS = (words.RUN, words.INDEX, "")  # what tells runs apart and is no channel
NO_NAME = Word("")
MOST_LISTED = 20  # columns in a sentence

SURE, LIKELY, UNSURE = "sure", "likely", "unsure"


@dataclass
class TimeAxis:
    """Which column has the time, and how it is to be read. factor: s for each of its units; 0 where its unit is not known."""

    column: str = ""
    unit: str = ""  # as the rig says it; "" of dates, and where nothing is known
    factor: float = 0.0
    step: float = 0.0  # s between rows, where a number beside the columns says so, and no column has the time
    spread: bool = False
    sure: str = SURE
    why: str = ""
    guessed: bool = False  # nobody says the unit: the size of its steps was all that told it


@dataclass
class Raw:
    """All logs as one."""

    paths: list[Path]
    words: dict[str, Word]
    clock: TimeAxis
    run: str  # column that tells runs apart
    columns: Columns  # which are numbers, but for time and run
    rows: int
    scalars: dict[str, float]
    texts: dict[str, str] = field(default_factory=dict)  # columns that are no numbers, and what they hold
    notes: list[str] = field(default_factory=list)
    nameless: bool = False  # nobody says what its columns are called


def read(logs: Sequence[str | Path], names: Sequence[str] = ()) -> Raw:
    """Logs of one drive. names: what somebody calls their columns, in their order, "-" for one that does not matter.

    DataError where they have no column in common, or no numbers, or another number of columns than names.
    """
    files = [Path(path) for path in logs]
    tables = [table(path) for path in files]
    for path, one in zip(files, tables):
        if one.empty or not len(one.columns):
            raise DataError(f"{path}: is empty. Export the log again; it needs at least {RULES.data.shortest_log} samples.")
    common = [name for name in tables[0].columns if all(name in other.columns for other in tables[1:])]
    if not common:
        raise DataError(f"{files[0]} and {files[-1]} have no column in common: give logs of one drive, exported alike.")
    notes = []
    alone = {str(name) for one in tables for name in one.columns} - {str(name) for name in common}
    if alone:
        notes.append(f"only in some of the logs, and left out: {', '.join(sorted(alone)[:8])}")
    preamble = tables[0].attrs.get("preamble", [])
    most = max(1000, RULES.begin.rows // len(tables))
    tables = [one[common].head(most).reset_index(drop=True) for one in tables]
    scalars = dict(tables[0].attrs.get("scalars", {})) if len(files) == 1 else {}
    whole = pd.concat(tables, ignore_index=True)
    whole.columns = [str(name) for name in whole.columns]
    nameless = all(NUMBERED.fullmatch(name) for name in whole.columns)
    if names:
        called = _called(files[0], list(whole.columns), names)
        whole = whole[list(called)]
        notes.append("called by you: " + ", ".join(f"column {column!r} {name!r}" for column, name in called.items()))
    else:
        called = {name: _without_whole(name, whole.columns) for name in whole.columns}
    known = {column: words.read(name) for column, name in called.items()}
    numbers, stamps, texts = {}, {}, {}
    for name in whole.columns[: RULES.begin.columns]:
        found = _numeric(whole[name])
        if found is not None:
            numbers[name] = found
        elif (seconds := stamps_of(whole[name])) is not None:
            stamps[name] = seconds
        else:
            texts[name] = f"texts such as {str(whole[name].iloc[0])[:20]!r}"
    if not numbers:
        raise DataError(
            f"{files[0]}: holds no column of numbers, but {', '.join(f'{n!r} ({x})' for n, x in list(texts.items())[:3])}."
        )
    sizes = [len(one) for one in tables]
    ends = np.cumsum([0, *sizes])
    spans = [slice(int(a), int(b)) for a, b in zip(ends, ends[1:])]
    for name, x in list(numbers.items()):  # one number for all, written in the first row
        if np.isfinite(x).sum() == len(spans) < 0.5 * len(x):
            scalars = scalars | {name: float(x[np.isfinite(x)][0])}
    clock, time = _clock(numbers, stamps, known, spans, scalars)
    run, parts = _runs(whole, numbers, time, spans, known, clock)
    told = [line for line in preamble if TELLS.search(line)]
    if told:
        notes.append(f"before its table the file says: {' | '.join(line[:60] for line in told[:6])}")
    again = [part for part in parts if np.any(np.diff(time[part]) < 0.0)]
    if again:
        row = again[0].start + int(np.flatnonzero(np.diff(time[again[0]]) < 0.0)[0]) + 1
        notes.append(
            f"the time in {clock.column!r} runs backward (row {row}), and no column says which run a row is of: "
            "add one, or cut the file there"
        )
        time = np.arange(len(time), dtype=float)
    if clock.factor and time.size and clock.column:
        coarse = np.concatenate([np.diff(time[part]) == 0.0 for part in parts])
        if np.mean(coarse) > 0.02 and _changes(numbers, parts, coarse, clock.column):
            clock.spread = True
            clock.why += f"; {100 * np.mean(coarse):.0f} % of its values repeat while others change: rows are spread evenly"
            for part in parts:
                time[part] = spread_out(time[part])
    values = {}
    for name, x in numbers.items():
        if name not in (clock.column, run if known.get(run, NO_NAME).quantity in MARKS else "") and name not in scalars:
            whole_x = _filled(x, parts)
            if whole_x is None:
                texts[name] = f"numbers in {int(np.isfinite(x).sum())} of {len(x)} rows"
            else:
                values[name] = whole_x
    texts.pop(run, None)
    return Raw(files, known, clock, run, Columns(time, values, parts), len(whole), scalars, texts, notes, nameless and not names)


def _called(path: Path, columns: list[str], names: Sequence[str]) -> dict[str, str]:
    """What somebody calls each column that matters."""
    if len(names) != len(columns):
        listed = f" ({', '.join(columns)})" if len(columns) <= MOST_LISTED else ""
        raise DataError(
            f"{path}: has {len(columns)} columns{listed}, and --columns names {len(names)}: name each, in their order, and write - for one "
            "that does not matter."
        )
    called = {column: name.strip() for column, name in zip(columns, names) if name.strip() not in ("", "-")}
    if not called:
        raise DataError(
            "--columns: names none. Write what each column is, such as 'time [ms], load angle [deg], motor voltage [V]'."
        )
    return called


def _without_whole(name: str, columns: Sequence[str]) -> str:
    """A column's name without that of the structure all are in, where it says no more than that it is a test: run.u is a voltage."""
    whole = f"{name.partition('.')[0]}."
    if words.read(whole).quantity == words.RUN and all(one.startswith(whole) for one in columns):
        return name.removeprefix(whole)
    return name


def _filled(x: np.ndarray, parts: list[slice]) -> np.ndarray | None:
    """A column with lines across what is no number, within runs; None where little of it is one."""
    x = np.where(np.isfinite(x) & (abs(np.nan_to_num(x, posinf=0.0, neginf=0.0)) < BEYOND), x, np.nan)
    good = np.isfinite(x)
    if np.mean(good) < 0.05:
        return None
    if good.all():
        return x
    found, middle = x.copy(), float(np.median(x[good]))
    for part in parts:
        rows, here = np.arange(part.stop - part.start), good[part]
        found[part] = np.interp(rows, rows[here], x[part][here]) if here.any() else middle
    return found


def _numeric(values: pd.Series) -> np.ndarray | None:
    if values.dtype.kind in "fiub":
        found = values.to_numpy(float)
        return np.where(np.isfinite(found), found, np.nan)
    if values.dtype.kind in "mM":
        return None
    found = pd.to_numeric(values, errors="coerce").to_numpy(float)
    return found if np.mean(np.isfinite(found)) > 0.8 else None


def _forward(x: np.ndarray, files: list[slice]) -> float:
    """Share of the steps within files that do not go back; 0 of what never goes on."""
    steps = np.concatenate([np.diff(x[part]) for part in files]) if files else np.zeros(0)
    return float(np.mean(steps >= 0.0)) if len(steps) and np.any(steps > 0.0) and np.isfinite(x).all() else 0.0


def _clock(numbers: dict, stamps: dict, known: dict[str, Word], files: list[slice], scalars: dict) -> tuple[TimeAxis, np.ndarray]:
    """The column of the time and what it says in s, or in its own unit where that is not known."""
    rows = files[-1].stop
    named = [name for name in [*stamps, *numbers] if known[name].quantity == words.TIME]
    for name in sorted(named, key=lambda n: (-known[n].strength, n not in stamps)):
        if name in stamps:
            return TimeAxis(name, "", 1.0, why="dates and times"), stamps[name]
        filled = _filled(numbers[name], files)
        if filled is not None and _forward(filled, files) > 0.9:
            return _unit(name, filled, known[name], files)
    if stamps:
        name = next(iter(stamps))
        return TimeAxis(name, "", 1.0, why="dates and times"), stamps[name]
    for name, value in scalars.items():
        found = _step(name, value)
        if found and not any(_forward(x, files) == 1.0 and known[n].strength == 0 for n, x in numbers.items()):
            return TimeAxis(step=found[0], factor=1.0, why=found[1]), _even(found[0], files, rows)
    for name, x in numbers.items():  # the first column that goes on evenly
        word = known[name]
        steps = np.concatenate([np.diff(x[part]) for part in files])
        if _forward(x, files) == 1.0 and word.strength < 2 and word.quantity in ("", words.TIME):
            middle = float(np.median(steps))
            if middle > 0.0 and np.mean(abs(steps - middle) < 0.3 * middle) > 0.95 and not (middle == 1.0 and x[0] in (0.0, 1.0)):
                clock, time = _unit(name, x, word, files)
                clock.sure, clock.why = UNSURE if clock.sure == UNSURE else LIKELY, f"it goes on evenly; {clock.why}"
                return clock, time
    return TimeAxis(sure=UNSURE, why="no column has the time"), np.arange(rows, dtype=float)


def _step(name: str, value: float) -> tuple[float, str] | None:
    """Seconds between rows, where a single number's name says that it is that."""
    bare = "".join(words.tokens(name))
    if (
        bare.endswith(("ts", "dt", "tsamp", "sampletime", "samplingtime", "stepsize", "tstep", "abtastzeit"))
        and 0.0 < value < 1e4
    ):
        return value, f"{name} = {value:g}"
    if bare.endswith(("fs", "samplerate", "samplingrate", "samplingfrequency", "fsamp", "abtastrate")) and value > 0.0:
        return 1.0 / value, f"{name} = {value:g} Hz"
    return None


def _even(step: float, files: list[slice], rows: int) -> np.ndarray:
    time = np.empty(rows)
    for part in files:
        time[part] = step * np.arange(part.stop - part.start)
    return time


def _unit(name: str, x: np.ndarray, word: Word, files: list[slice]) -> tuple[TimeAxis, np.ndarray]:
    """Seconds of a column of numbers, by its name, by what 1970 is ago, by its steps."""
    steps = np.concatenate([np.diff(x[part]) for part in files])
    step = float(np.median(steps[steps > 0.0]))
    since = x - x[0] if len(files) == 1 else np.concatenate([x[part] - x[part.start] for part in files])
    if word.unit in SECONDS:
        return TimeAxis(name, word.unit, SECONDS[word.unit], why="its name says the unit"), since * SECONDS[word.unit]
    for low, high, unit in EPOCHS:
        if low < abs(float(np.median(x))) < high and np.ptp(x) < 0.1 * low:
            return TimeAxis(name, unit, SECONDS[unit], why=f"{unit} since 1970"), since * SECONDS[unit]
    whole = bool(np.all(abs(x[:10000] - np.round(x[:10000])) < 1e-6 * np.maximum(1.0, abs(x[:10000]))))
    if step < 0.5:
        return TimeAxis(name, "s", 1.0, sure=LIKELY, why=f"steps of {step:.3g} are s, by their size"), since
    unit = "ms" if step < 400.0 else "us" if step < 4e5 else "ns"
    lasts = float(np.sum(steps[steps > 0.0]))
    if not whole and step < RULES.begin.slowest_rows and lasts * SECONDS[unit] < RULES.begin.shortest_motion:
        why = f"steps of {step:.3g} that are no whole numbers: s, for in {unit} the log would last {SECONDS[unit] * lasts:.2g} s"
        return TimeAxis(name, "s", 1.0, sure=UNSURE, why=why, guessed=True), since
    sure = LIKELY if whole and step > 1.5 else UNSURE
    why = f"{'whole ' * whole}steps of {step:.3g}: {unit}, by their size; no s, for a drive is not recorded so slowly"
    return TimeAxis(name, unit, SECONDS[unit], sure=sure, why=why, guessed=True), since * SECONDS[unit]


def _runs(whole: pd.DataFrame, numbers: dict, time: np.ndarray, files: list[slice], known: dict[str, Word], clock: TimeAxis):
    """The column that tells runs apart, and the rows of each run."""
    steps = np.diff(time) < 0.0
    steps[[part.start - 1 for part in files[1:]]] = False
    anew = np.flatnonzero(steps) + 1
    within = np.setdiff1d(np.arange(1, len(time)), [part.start for part in files[1:]])
    found: list[tuple[int, str, np.ndarray]] = []
    for name in whole.columns:
        if name == clock.column:
            continue
        codes = pd.factorize(whole[name])[0]
        edges = within[codes[within] != codes[within - 1]]
        count = codes.max() + 1
        named = known[name].quantity == words.RUN
        blocks = len(edges) + len(files)
        if count < 2 or blocks > count * len(files) or count > len(time) / 20:
            continue
        if name in numbers and known[name].quantity not in MARKS:
            if len(anew) and set(anew) == set(edges):  # the duty of each step, say: a channel all the same
                found.append((3, name, edges))
        elif len(anew) and set(anew) <= set(edges):
            found.append((0 if named else 1, name, edges))
        elif named and not len(anew):
            found.append((2, name, edges))
    bounds = [part.start for part in files] + [len(time)]
    if not found:
        return "", files
    _, name, edges = min(found, key=lambda f: f[0])
    bounds = sorted({*bounds, *map(int, edges)})
    return name, [slice(a, b) for a, b in zip(bounds, bounds[1:])]


def _changes(numbers: dict, parts: list[slice], same: np.ndarray, clock: str) -> bool:
    """Whether other columns change where the time does not."""
    for name, x in numbers.items():
        if name == clock:
            continue
        moved = np.concatenate([np.diff(x[part]) != 0.0 for part in parts])
        if np.mean(moved[same]) > 0.3 * np.mean(moved) > 0.0:
            return True
    return False
