"""Logs: CSV, Parquet or MATLAB files read into runs of signals in SI units. Faults are marked elsewhere (check)."""

from __future__ import annotations

import re
from dataclasses import dataclass, field, replace
from pathlib import Path

import numpy as np
import pandas as pd
from pyarrow import Table, csv

from ..errors import DataError
from ..rules import RULES
from .rig import LogColumn, Rig, split, suggest
from .signals import SIGNALS, canonical, unit
from .units import conversion, is_unit

VALID = "rig.valid"
"""The signal of the rig's `valid` column."""

HELD = ("controller.voltage", "motor.voltage", "motor.duty")
"""In a table of `selflock run` a row has the command of the step that ends there; here that of the step that begins."""


@dataclass
class MeasuredRun:
    """One stretch of measurement: signals on one time axis. `good` is False where a channel is not to be trusted."""

    log: str
    name: str
    rows: np.ndarray  # row of each sample in the file, 0 is the first after the header
    time: np.ndarray  # s, strictly increasing
    signals: dict[str, np.ndarray]
    good: dict[str, np.ndarray] = field(default_factory=dict)
    repeated: np.ndarray = field(default_factory=lambda: np.zeros(0, int))  # rows left out: no time, or the time before again
    source: str = ""  # path of the log: two logs may have one name
    memory: dict = field(default_factory=dict, init=False, repr=False)  # what was derived from the signals, for all who look

    def __len__(self) -> int:
        return len(self.time)

    @property
    def key(self) -> str:
        """What tells this run from all others."""
        return f"{self.source or self.log}:{self.name}"

    @property
    def behind_gaps(self) -> np.ndarray:
        """Samples before which others are missing, bool."""
        steps = np.diff(self.time)
        return np.append(
            np.zeros(min(1, len(self)), bool), steps > RULES.data.gap * np.median(steps) if len(steps) else steps > 0.0
        )

    def head(self, samples: int) -> MeasuredRun:
        """The first samples, as a run of its own."""
        signals, good = ({name: x[:samples] for name, x in which.items()} for which in (self.signals, self.good))
        return MeasuredRun(self.log, self.name, self.rows[:samples], self.time[:samples], signals, good, source=self.source)

    def usable(self, *names: str) -> np.ndarray:
        """Samples at which all these channels can be trusted."""
        mask = np.ones(len(self), bool)
        for name in names:
            if name in self.good:
                mask &= self.good[name]
        return mask


def read(path: str | Path, rig: Rig) -> list[MeasuredRun]:
    """The runs of a log. DataError names file, line or column, and what to do."""
    path = Path(path)
    table = _table(path)
    if table.empty or not len(table.columns):
        raise DataError(
            f"{path}: is empty. Export the log again; it needs a header line and at least {RULES.data.shortest_log} samples."
        )
    named = _named(table, rig) if rig.named else []
    columns = list(rig.columns) + named
    data: dict[str, np.ndarray] = {}
    for column in columns:
        header = _find(path, table, column.column, rig)
        data[column.signal] = _si(path, _numbers(path, table, header), header, column, rig)
    time = _time(path, table, rig)
    if rig.valid:
        data[VALID] = (_numbers(path, table, _find(path, table, rig.valid, rig)) != 0.0).astype(float)
    names = table[_find(path, table, rig.run, rig)].astype(str).to_numpy() if rig.run else np.full(len(table), "")
    runs = []
    late = [
        column.signal
        for column in columns
        if column.late or (column in named and column.signal.endswith(HELD) and not rig.system)
    ]
    for name in pd.unique(names):
        rows = np.flatnonzero(names == name)
        for signal in late:
            data[signal][rows] = np.append(data[signal][rows[1:]], data[signal][rows[-1]])
        signals = {k: v[rows] for k, v in data.items()}
        runs.append(_ordered(path, MeasuredRun(path.name, str(name), rows, time[rows], signals, source=str(path.resolve())), rig))
    if sum(len(run) for run in runs) < RULES.data.shortest_log:
        raise DataError(
            f"{path}: has {len(table)} samples, too few to tell anything. Give a log of at least {RULES.data.shortest_log}, better some seconds."
        )
    return runs


def _table(path: Path) -> pd.DataFrame:
    if not path.exists():
        raise DataError(f"{path}: there is no such log.")
    if path.stat().st_size == 0:
        raise DataError(f"{path}: is empty (0 bytes). Export the log again.")
    ending = path.suffix.lower()
    try:
        if ending == ".csv":
            return _csv(path)
        if ending in {".parquet", ".pq"}:
            table = pd.read_parquet(path)
            return table if table.index.names == [None] else table.reset_index()
        if ending == ".mat":
            return _mat(path)
    except DataError:
        raise
    except UnicodeDecodeError:
        raise DataError(f"{path}: is not UTF-8 text. Save it as CSV in UTF-8.") from None
    except pd.errors.ParserError as error:
        raise DataError(f"{path}: {str(error).strip()}. Is the file cut off, or is that line damaged?") from None
    except pd.errors.EmptyDataError:
        raise DataError(f"{path}: has no columns. Export the log again, with a header line.") from None
    except Exception as error:
        raise DataError(f"{path}: cannot be read as {ending}: {error}. The file may be cut off; export it again.") from None
    raise DataError(f"{path}: logs are .csv, .parquet or .mat, not {ending or 'without ending'}.")


def _csv(path: Path) -> pd.DataFrame:
    """Separated by commas, semicolons or tabs, whichever the header has; a decimal comma where these are no commas."""
    with path.open(encoding="utf-8-sig") as text:
        header, first = text.readline(), text.readline()
    separator = max(",;\t", key=header.count)
    decimal = "," if separator != "," and re.search(r"\d,\d", first) else "."
    table = pd.read_csv(path, sep=separator, decimal=decimal, skipinitialspace=True)
    if not isinstance(table.index, pd.RangeIndex):  # pandas then takes the first column for names of the rows
        raise DataError(
            f"{path}: its lines have more values than the header has names ({len(table.columns)}). "
            f"Name every column, or remove what stands behind the last {separator!r} of each line."
        )
    return table


def _mat(path: Path) -> pd.DataFrame:
    """The longest vectors; attrs["left out"] tells of the shorter ones, and their lengths."""
    from scipy.io import loadmat

    try:
        held = {name: np.asarray(value) for name, value in loadmat(path).items() if not name.startswith("__")}
    except NotImplementedError:
        raise DataError(f"{path}: is a MATLAB file of version 7.3. Save it as version 7: save(..., '-v7').") from None
    found = {name: np.squeeze(value) for name, value in held.items() if value.dtype.kind in "fiub"}
    vectors = {name: value for name, value in found.items() if value.ndim == 1}
    if not vectors:
        holds = f" It holds {', '.join(held)}." if held else ""
        raise DataError(f"{path}: holds no vectors.{holds} Save each channel as a vector of its own, all of the same length.")
    longest = max(len(value) for value in vectors.values())
    table = pd.DataFrame({name: value.astype(float) for name, value in vectors.items() if len(value) == longest})
    table.attrs["left out"] = {name: len(value) for name, value in vectors.items() if len(value) < longest}
    return table


def _parts(header: str) -> tuple[str, str]:
    """'rear_motor.current [A]' as name and unit; in brackets whatever it is, in parentheses where it is known as one."""
    found = re.fullmatch(r"(.*?)\s*(?:\[([^\]]*)\]|\(([^)]*)\))\s*", str(header))
    if found is None or (found[3] is not None and not is_unit(found[3].strip())):
        return str(header).strip(), ""
    return found[1].strip(), (found[2] if found[3] is None else found[3]).strip()


def _bare(header: str) -> str:
    return _parts(header)[0]


def _named(table: pd.DataFrame, rig: Rig) -> list[LogColumn]:
    taken = {column.signal for column in rig.columns}
    found = []
    for name in map(_bare, table.columns):
        prefix, bare = split(name, rig.drives)
        signal = name if rig.system else prefix + canonical(bare)
        if "." in name and signal not in taken and (canonical(bare) in SIGNALS or signal in rig.units):
            taken.add(signal)
            found.append(LogColumn(name, signal))
    return found


def _find(path: Path, table: pd.DataFrame, name: str, rig: Rig) -> str:
    """The header of a column, by its whole text or without its unit."""
    headers = [str(header) for header in table.columns]
    if name in headers:
        return table.columns[headers.index(name)]
    found = [header for header in table.columns if _bare(header) == _bare(name)]
    if len(found) > 1:
        raise DataError(
            f"{path}: {' and '.join(map(repr, found))} are both {name!r}. Write the one that is meant in {rig.path.name}, with its unit."
        )
    if found:
        return found[0]
    shorter = table.attrs.get("left out", {})
    if name in shorter:
        raise DataError(
            f"{path}: {name!r} has {shorter[name]} samples where others have {len(table)}. Save vectors of one length."
        )
    raise DataError(f"{path}: there is no column {name!r}, which {rig.path.name} asks for.{suggest(name, headers)}")


def _numbers(path: Path, table: pd.DataFrame, header: str) -> np.ndarray:
    values = table[header]
    if values.dtype.kind in "fiub":
        return values.to_numpy(float)
    if values.dtype.kind in "mM":
        raise DataError(f"{path}: column {header!r} holds dates or times ({values.dtype}), not numbers.")
    try:
        numbers = pd.to_numeric(values, errors="coerce")
    except OverflowError:
        raise DataError(f"{path}: column {header!r} holds a whole number of hundreds of digits.") from None
    wrong = numbers.isna() & values.notna() & ~values.astype(str).str.strip().str.lower().isin(["nan", "inf", "-inf", "", "none"])
    if wrong.any():
        row = int(np.flatnonzero(wrong.to_numpy())[0])
        raise DataError(
            f"{path}: line {row + 2}, column {header!r}: {values.iloc[row]!r} is not a number. "
            "Mend or remove that line; a decimal point is '.'."
        )
    return numbers.to_numpy(float)


def _si(path: Path, values: np.ndarray, header: str, column: LogColumn, rig: Rig) -> np.ndarray:
    _, bare = split(column.signal, rig.drives)
    wanted = rig.units.get(column.signal, "") if rig.system else unit(bare, rig.linear)
    factor, offset = _conversion(path, header, column, wanted, rig)
    return column.factor * (factor * values + offset) + column.offset


def _conversion(path: Path, header: str, column: LogColumn, wanted: str, rig: Rig) -> tuple[float, float]:
    """To the wanted unit from the rig's or the header's, which must not contradict each other."""
    said = _parts(header)[1]
    try:
        factor, offset = conversion(column.unit or said, wanted)
    except ValueError as error:
        raise DataError(f"{path}: column {column.column!r}: {error}. Write the unit of the values in {rig.path.name}.") from None
    if column.unit and is_unit(said):
        try:
            agree = conversion(said, wanted) == (factor, offset)
        except ValueError:
            agree = False
        if not agree:
            raise DataError(
                f"{path}: the header {header!r} contradicts the unit {column.unit!r} in {rig.path.name}. Mend one of them."
            )
    return factor, offset


def _time(path: Path, table: pd.DataFrame, rig: Rig) -> np.ndarray:
    clock = rig.time
    if rig.kind == "steady" and _bare(clock.column) not in map(_bare, table.columns):
        return np.arange(len(table), dtype=float)
    header = _find(path, table, clock.column, rig)
    stamps = table[header]
    if stamps.dtype.kind in "mM":  # of a clock or of a stopwatch
        return (stamps - stamps.iloc[0]).dt.total_seconds().to_numpy(float)
    factor, _ = _conversion(path, header, clock, "s", rig)
    return factor * clock.factor * _numbers(path, table, header)


def _ordered(path: Path, run: MeasuredRun, rig: Rig) -> MeasuredRun:
    """Refuse time that runs backward; drop samples without a time or at the same time again (check reports them)."""
    where = f"{path}: run {run.name!r}, " if run.name else f"{path}: "
    finite = np.isfinite(run.time)
    if finite.sum() < 2 and rig.kind != "steady":
        raise DataError(
            f"{where}column {rig.time.column!r} has fewer than two times. "
            'Rows that are points of steady state belong to a rig of kind = "steady".'
        )
    steps = np.diff(run.time[finite])
    if rig.kind != "steady" and np.mean(steps == 0.0) > RULES.data.same_times:
        raise DataError(
            f"{where}column {rig.time.column!r} has only {len(np.unique(run.time[finite]))} different times in "
            f"{len(run)} rows. Export it with more digits."
        )
    if np.any(steps < 0):
        row = int(run.rows[finite][np.flatnonzero(steps < 0)[0] + 1])
        hint = "" if rig.run else ' If the file holds several runs, name the column that tells them apart: [rig] run = "...".'
        raise DataError(f"{where}line {row + 2}: time runs backward in column {rig.time.column!r}.{hint}")
    keep = finite.copy()
    keep[np.flatnonzero(finite)[1:][steps == 0]] = False
    if keep.all():
        return run
    signals = {k: v[keep] for k, v in run.signals.items()}
    return replace(run, rows=run.rows[keep], time=run.time[keep], signals=signals, repeated=run.rows[~keep])


def write_csv(table: pd.DataFrame, path: Path) -> None:
    """A table as text, in full precision; an hour of samples takes pandas a minute."""
    csv.write_csv(Table.from_pandas(table, preserve_index=False), path)
