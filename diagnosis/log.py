"""Logs: CSV, Parquet or MATLAB files read into runs of signals in SI units. Faults are marked elsewhere (check)."""

from __future__ import annotations

import re
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np
import pandas as pd
from pyarrow import Table, csv

from .errors import DataError
from .rig import Column, Rig, conversion, split, suggest
from .signals import SIGNALS, canonical, unit

VALID = "rig.valid"
"""The signal of the rig's `valid` column."""

HELD = ("controller.voltage", "motor.voltage", "motor.duty")
"""In a table of `selflock run` a row has the command of the step that ends there; here that of the step that begins."""

SHORTEST = 30
"""Fewer samples than this tell nothing."""


@dataclass
class Run:
    """One stretch of measurement: signals on one time axis. `good` is False where a channel is not to be trusted."""

    log: str
    name: str
    rows: np.ndarray  # row of each sample in the file, 0 is the first after the header
    time: np.ndarray  # s, strictly increasing
    signals: dict[str, np.ndarray]
    good: dict[str, np.ndarray] = field(default_factory=dict)
    repeated: np.ndarray = field(
        default_factory=lambda: np.zeros(0, int)
    )  # rows left out: no time, or the time before again
    memory: dict = field(
        default_factory=dict, init=False, repr=False
    )  # what was derived from the signals, for all who look

    def __len__(self) -> int:
        return len(self.time)

    def head(self, samples: int) -> Run:
        """The first samples, as a run of its own."""
        signals, good = ({name: x[:samples] for name, x in which.items()} for which in (self.signals, self.good))
        return Run(self.log, self.name, self.rows[:samples], self.time[:samples], signals, good)

    def usable(self, *names: str) -> np.ndarray:
        """Samples at which all these channels can be trusted."""
        mask = np.ones(len(self), bool)
        for name in names:
            if name in self.good:
                mask &= self.good[name]
        return mask


def read(path: str | Path, rig: Rig) -> list[Run]:
    """The runs of a log. DataError names file, line or column, and what to do."""
    path = Path(path)
    table = _table(path)
    if table.empty or not len(table.columns):
        raise DataError(
            f"{path}: is empty. Export the log again; it needs a header line and at least {SHORTEST} samples."
        )
    headers = {_bare(name): name for name in table.columns}
    units = {_bare(name): _unit(name) for name in table.columns}
    named = _named(headers, rig) if rig.named else []
    columns = list(rig.columns) + named
    data: dict[str, np.ndarray] = {}
    for column in columns:
        values = _numbers(path, table, _find(path, headers, column.column, rig), column)
        given = column.unit or units.get(_bare(column.column), "")
        data[column.signal] = _si(path, values, given, column, rig)
    time = _time(path, table, headers, units, rig)
    if rig.valid:
        switch = Column(rig.valid, VALID)
        data[VALID] = (_numbers(path, table, _find(path, headers, rig.valid, rig), switch) != 0.0).astype(float)
    names = table[_find(path, headers, rig.run, rig)].astype(str).to_numpy() if rig.run else np.full(len(table), "")
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
        runs.append(
            _ordered(path, Run(path.name, str(name), rows, time[rows], {k: v[rows] for k, v in data.items()}), rig)
        )
    if sum(len(run) for run in runs) < SHORTEST:
        raise DataError(
            f"{path}: has {len(table)} samples, too few to tell anything. "
            f"Give a log of at least {SHORTEST}, better some seconds."
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
            return pd.read_csv(path, skipinitialspace=True)
        if ending in {".parquet", ".pq"}:
            return pd.read_parquet(path)
        if ending == ".mat":
            return _mat(path)
    except DataError:
        raise
    except pd.errors.ParserError as error:
        raise DataError(f"{path}: {str(error).strip()}. Is the file cut off, or is that line damaged?") from None
    except pd.errors.EmptyDataError:
        raise DataError(f"{path}: has no columns. Export the log again, with a header line.") from None
    except Exception as error:
        raise DataError(
            f"{path}: cannot be read as {ending}: {error}. The file may be cut off; export it again."
        ) from None
    raise DataError(f"{path}: logs are .csv, .parquet or .mat, not {ending or 'without ending'}.")


def _mat(path: Path) -> pd.DataFrame:
    from scipy.io import loadmat

    found = {
        k: np.squeeze(v)
        for k, v in loadmat(path).items()
        if not k.startswith("__") and np.asarray(v).dtype.kind in "fiub"
    }
    vectors = {k: v for k, v in found.items() if v.ndim == 1}
    if not vectors:
        raise DataError(
            f"{path}: holds no vectors. Save each channel as a vector of the same length (format 7 or older)."
        )
    longest = max(len(v) for v in vectors.values())
    return pd.DataFrame({k: v.astype(float) for k, v in vectors.items() if len(v) == longest})


def _bare(header: str) -> str:
    """'rear_motor.current [A]' without its unit."""
    return re.sub(r"\s*\[[^\]]*\]\s*$", "", str(header)).strip()


def _unit(header: str) -> str:
    found = re.search(r"\[([^\]]*)\]\s*$", str(header))
    return found.group(1).strip() if found else ""


def _named(headers: dict[str, str], rig: Rig) -> list[Column]:
    taken = {column.signal for column in rig.columns}
    found = []
    for name in headers:
        prefix, bare = split(name, rig.drives)
        signal = name if rig.system else prefix + canonical(bare)
        if "." in name and signal not in taken and (canonical(bare) in SIGNALS or signal in rig.units):
            taken.add(signal)
            found.append(Column(name, signal))
    return found


def _find(path: Path, headers: dict[str, str], name: str, rig: Rig) -> str:
    if _bare(name) in headers:
        return headers[_bare(name)]
    raise DataError(f"{path}: there is no column {name!r}, which {rig.path.name} asks for.{suggest(name, headers)}")


def _numbers(path: Path, table: pd.DataFrame, header: str, column: Column) -> np.ndarray:
    values = table[header]
    if values.dtype.kind in "fiub":
        return values.to_numpy(float)
    numbers = pd.to_numeric(values, errors="coerce")
    wrong = (
        numbers.isna()
        & values.notna()
        & ~values.astype(str).str.strip().str.lower().isin(["nan", "inf", "-inf", "", "none"])
    )
    if wrong.any():
        row = int(np.flatnonzero(wrong.to_numpy())[0])
        raise DataError(f"{path}: line {row + 2}, column {header!r}: {values.iloc[row]!r} is not a number. "
                        "Mend or remove that line; a decimal point is '.'.")
    return numbers.to_numpy(float)


def _si(path: Path, values: np.ndarray, given: str, column: Column, rig: Rig) -> np.ndarray:
    _, bare = split(column.signal, rig.drives)
    try:
        factor, offset = conversion(given, rig.units.get(column.signal, "") if rig.system else unit(bare, rig.linear))
    except ValueError as error:
        raise DataError(
            f"{path}: column {column.column!r}: {error}. Write the unit of the values in {rig.path.name}."
        ) from None
    return column.factor * (factor * values + offset) + column.offset


def _time(path: Path, table: pd.DataFrame, headers: dict, units: dict, rig: Rig) -> np.ndarray:
    clock = rig.time
    if rig.kind == "steady" and _bare(clock.column) not in headers:
        return np.arange(len(table), dtype=float)
    time = _numbers(path, table, _find(path, headers, clock.column, rig), clock)
    given = clock.unit or units.get(_bare(clock.column), "")
    try:
        factor, _ = conversion(given, "s")
    except ValueError as error:
        raise DataError(f"{path}: column {clock.column!r}: {error}.") from None
    return factor * clock.factor * time


def _ordered(path: Path, run: Run, rig: Rig) -> Run:
    """Refuse time that runs backward; drop samples without a time or at the same time again (check reports them)."""
    where = f"{path}: run {run.name!r}, " if run.name else f"{path}: "
    finite = np.isfinite(run.time)
    if finite.sum() < 2 and rig.kind != "steady":
        raise DataError(f"{where}column {rig.time.column!r} holds no times.")
    steps = np.diff(run.time[finite])
    if np.any(steps < 0):
        row = int(run.rows[finite][np.flatnonzero(steps < 0)[0] + 1])
        hint = (
            ""
            if rig.run
            else ' If the file holds several runs, name the column that tells them apart: [rig] run = "...".'
        )
        raise DataError(f"{where}line {row + 2}: time runs backward in column {rig.time.column!r}.{hint}")
    keep = finite.copy()
    keep[np.flatnonzero(finite)[1:][steps == 0]] = False
    if keep.all():
        return run
    signals = {k: v[keep] for k, v in run.signals.items()}
    return Run(run.log, run.name, run.rows[keep], run.time[keep], signals, repeated=run.rows[~keep])


def write_csv(table: pd.DataFrame, path: Path) -> None:
    """A table as text, in full precision; an hour of samples takes pandas a minute."""
    csv.write_csv(Table.from_pandas(table, preserve_index=False), path)
