"""Tables of results: one column "time" and one per "component.variable", units kept.

CSV for people: the unit stands in the header, `rear_motor.torque [N.m]`. Parquet for long runs: the unit is in the
field's metadata. A run that writes to a file does so in pieces: its memory does not grow with the log.
"""

from __future__ import annotations

import json
import math
import re
from abc import ABC, abstractmethod
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
import pyarrow as pa
import pyarrow.csv as csv
import pyarrow.parquet as pq

from .errors import ResultError
from .face import Variable, view
from .seen import Seen

ROWS = 4096  # in memory before they are written; a multiple of 16
ABOUT = "selflock"  # the key in a Parquet file's metadata of what the run was of
PIECES = 8  # of ROWS in a row group of a Parquet file, whose writer keeps 900 bytes per column and row group to its end
KINDS = {"Real": np.dtype(float), "Integer": np.dtype("int64"), "Boolean": np.dtype(bool), "String": np.dtype(object)}


def header(column: Variable) -> str:
    """A column's name and unit as they stand in the first line of a CSV file."""
    return f"{column.name} [{column.unit}]" if column.unit else column.name


class Sink(ABC):
    """Takes rows of numbers and strings, keeps or writes them in pieces."""

    path: Path | None = None  # of the file, where it is one

    def __init__(self, columns: list[Variable], about: dict[str, Any] | None = None):
        self.columns = columns
        self.about = about or {}  # what the run was of: master.about
        self._numbers = [c for c in columns if c.type != "String"]
        self._texts = [c.name for c in columns if c.type == "String"]
        self.width = len(self._numbers)
        self.block = np.empty((ROWS, self.width))
        self.flat = view(self.block.reshape(-1))  # row r starts at r · width
        self.words: list[list[str]] = []
        self.fill = self._good = 0  # rows in the block, and how many of them were looked at
        self.seen = Seen(columns)

    def unchecked(self) -> np.ndarray:
        """The numbers of all rows since `checked` was called last."""
        return self.block[self._good : self.fill].reshape(-1)

    def checked(self) -> None:
        """All rows until here are good; write them when there are many."""
        self._good = self.fill
        if self.fill == ROWS:
            self.flush()

    def flush(self) -> None:
        if self.fill:
            self.seen.add(self.block[: self.fill])
            self.put(self._frame())
            self.fill = self._good = 0
            self.words.clear()

    def _frame(self) -> pd.DataFrame:
        block = self.block[: self.fill]
        data: dict[str, Any] = {c.name: block[:, k].astype(KINDS[c.type]) for k, c in enumerate(self._numbers)}
        data |= {name: [row[k] for row in self.words] for k, name in enumerate(self._texts)}
        return pd.DataFrame({c.name: data[c.name] for c in self.columns})

    @abstractmethod
    def put(self, frame: pd.DataFrame) -> None:
        """Keep or write some rows."""

    @abstractmethod
    def table(self) -> pd.DataFrame:
        """All rows."""

    def close(self) -> None:
        self.flush()


class Memory(Sink):
    def __init__(self, columns: list[Variable], about: dict[str, Any] | None = None):
        super().__init__(columns, about)
        self._frames: list[pd.DataFrame] = []

    def put(self, frame: pd.DataFrame) -> None:
        self._frames.append(frame)

    def table(self) -> pd.DataFrame:
        if not self._frames:
            return pd.DataFrame({c.name: np.empty(0, KINDS[c.type]) for c in self.columns})
        if len(self._frames) > 1:
            self._frames = [pd.concat(self._frames, ignore_index=True)]
        return self._frames[0]

    def save(self) -> Any:
        """All rows as they are now, for `restore`."""
        return list(self._frames), self.block[: self.fill].copy(), self._good, list(self.words), self.seen.copied()

    def restore(self, state: Any) -> None:
        frames, rows, self._good, words, seen = state
        self._frames, self.words, self.seen = list(frames), list(words), seen.copied()
        self.fill = len(rows)
        self.block[: self.fill] = rows


class File(Sink):
    path: Path

    def __init__(self, columns: list[Variable], path: Path, about: dict[str, Any] | None = None):
        super().__init__(columns, about)
        self.path = path

    def table(self) -> pd.DataFrame:
        return read(self.path)[0]


class Csv(File):
    def __init__(self, columns: list[Variable], path: Path, about: dict[str, Any] | None = None):
        super().__init__(columns, path, about)
        self._file = path.open("w", encoding="utf-8", newline="")
        pd.DataFrame(columns=[header(c) for c in columns]).to_csv(self._file, index=False)

    def put(self, frame: pd.DataFrame) -> None:
        frame.to_csv(self._file, index=False, header=False, na_rep="nan")

    def close(self) -> None:
        super().close()
        self._file.close()


class Parquet(File):
    def __init__(self, columns: list[Variable], path: Path, about: dict[str, Any] | None = None):
        super().__init__(columns, path, about)
        arrow = {"Real": pa.float64(), "Integer": pa.int64(), "Boolean": pa.bool_(), "String": pa.string()}
        units = json.dumps({c.name: c.unit for c in columns})
        told = {"units": units} | ({ABOUT: json.dumps(about)} if about else {})
        self._schema = pa.schema([pa.field(c.name, arrow[c.type], metadata={"unit": c.unit}) for c in columns], metadata=told)
        self._writer = pq.ParquetWriter(path, self._schema)
        self._pieces: list[pa.Table] = []

    def put(self, frame: pd.DataFrame) -> None:
        self._pieces.append(pa.Table.from_pandas(frame, schema=self._schema, preserve_index=False).cast(self._schema))
        if len(self._pieces) == PIECES:
            self._write()

    def _write(self) -> None:
        if self._pieces:
            self._writer.write_table(pa.concat_tables(self._pieces))
            self._pieces.clear()

    def close(self) -> None:
        super().close()
        self._write()
        self._writer.close()


FILES: dict[str, Callable[[list[Variable], Path, dict[str, Any] | None], File]] = {".csv": Csv, ".parquet": Parquet}


def sink(columns: list[Variable], path: Path | str | None, about: dict[str, Any] | None = None) -> Sink:
    """Where rows go: into memory, or into a file by the ending of its name. `about`: what the run is of (master.about)."""
    if path is None:
        return Memory(columns, about)
    path = Path(path)
    kind = FILES.get(path.suffix.lower())
    if kind is None:
        raise ResultError(f"{path}: results are written as .csv or .parquet; choose one of these endings.")
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
        return kind(columns, path, about)
    except OSError as error:
        raise ResultError(f"{path} cannot be written: {error.strerror or error}.") from None


def read(path: Path | str) -> tuple[pd.DataFrame, dict[str, str]]:
    """A table of results and the units of its columns, from a .csv or .parquet file."""
    path = Path(path)
    try:
        if path.suffix.lower() == ".parquet":
            table = pq.read_table(path)
            units = {f.name: ((f.metadata or {}).get(b"unit") or b"").decode() for f in table.schema}
            return table.replace_schema_metadata(None).to_pandas(), units
        if path.suffix.lower() == ".csv":
            return of_csv(path)
    except FileNotFoundError:
        raise ResultError(f"There is no result file {path}.") from None
    except (OSError, ValueError, pa.ArrowException) as error:
        raise ResultError(f"{path} is no table of results: {str(error)[:160]}") from None
    raise ResultError(f"{path}: results are read from .csv or .parquet files.")


def of_csv(source: Any) -> tuple[pd.DataFrame, dict[str, str]]:
    """A table of results and the units of its columns, of a path or a file object. Raises what pyarrow does."""
    frame = csv.read_csv(source, convert_options=csv.ConvertOptions(null_values=[], strings_can_be_null=False)).to_pandas()
    split = [re.sub(r" \[.*\]$", "", header) for header in frame.columns]
    units = {name: header.removeprefix(name)[2:-1] for name, header in zip(split, frame.columns)}
    frame.columns = pd.Index(split)
    return frame, units


def told(path: Path | str) -> dict[str, Any]:
    """What a result file says of its run (master.about); {} where it says nothing that can be read."""
    if Path(path).suffix.lower() != ".parquet":
        return {}
    try:
        said = (pq.read_schema(path).metadata or {}).get(ABOUT.encode(), b"{}")
        data = json.loads(said)
    except (OSError, ValueError, RecursionError, pa.ArrowException):
        return {}
    return data if isinstance(data, dict) else {}


@dataclass
class Result:
    """What a run gave."""

    system: str
    units: dict[str, str]
    energy: pd.DataFrame  # per bond: given, taken, lost [J], relative (lost / turnover)
    loops: list[str]  # algebraic loops
    time: float  # simulated until, s
    steps: int  # communication steps made
    rejected: int  # steps done again, under step control
    duration: float  # wall time in s
    path: Path | None
    sink: Sink = field(repr=False)
    lacks: dict[str, Sequence[str]] = field(default_factory=dict)  # by isolated component: what could not be taken away from it
    notes: list[str] = field(default_factory=list)  # what else a reader of the numbers should know, a sentence each
    ended: dict[str, float] = field(default_factory=dict)  # a component that ended the run itself, and when, s

    @property
    def table(self) -> pd.DataFrame:
        """The results; read from the file where they were written to one."""
        return self.sink.table()

    @property
    def peaks(self) -> pd.DataFrame:
        """A row for each column of the results: unit, least, greatest, last, and integral over time."""
        return self.sink.seen.table

    @property
    def about(self) -> dict[str, Any]:
        """What the run was of: limits, and what is to be seen of it; a Parquet file holds it, too (master.about)."""
        return self.sink.about

    @property
    def reached(self) -> list[str]:
        """Limits that were reached: outputs at theirs, motors at their stall current, gears that lock themselves; a sentence each."""
        return self.sink.seen.reached()

    def save(self, path: Path | str) -> Path:
        """Write the table to a .csv or .parquet file, as `run` does with `out`. Raises ResultError."""
        if self.path is not None and Path(path).resolve() == self.path.resolve():
            return self.path  # it is there
        table, written = self.table, sink(self.sink.columns, path, self.about)
        try:
            for first in range(0, len(table), ROWS):
                written.put(table.iloc[first : first + ROWS])
        finally:
            written.close()
        return Path(path)

    def plot(self, *names: str, ax: Any = None) -> list[Any]:
        """Draw columns over time with matplotlib: names or patterns such as "motor.*", all where none is given.

        Those of one unit share an axes, or all the given one, `ax`. Returns the axes. Raises ResultError.
        """
        from .glance import plot

        return plot(self, names, ax)

    def _repr_html_(self) -> str:
        """A small table with curves, for a notebook."""
        from .glance import page

        return page(self)

    def summary(self) -> str:
        """Times, what was seen of each component, limits reached, and what the coupling lost, as text."""
        speed = f", {self.time / self.duration:.3g} x real time" if self.duration > 0 else ""
        lines = [f"{self.system}: {self.time:.6g} s in {self.steps} steps, {self.duration:.2f} s of computing{speed}"]
        lines += [f"  {name} ended the run itself at t = {time:.9g} s" for name, time in self.ended.items()]
        if self.rejected:
            lines.append(f"  {self.rejected} steps were made again with a smaller step")
        for loop in self.loops:
            lines.append(f"  algebraic loop, its values lag by a step: {loop}")
        for name, lacks in self.lacks.items():
            lines.append(f"  {name} was isolated only in part: not taken away were {'; '.join(lacks)}")
        lines += [f"  {note}" for note in self.notes]
        lines += self.sink.seen.lines()
        for name, bond in self.energy.iterrows():
            percent = f" ({100 * bond.relative:+.2g} % of its turnover)" if math.isfinite(bond.relative) else ""
            lines.append(f"  energy the coupling lost at {name}: {bond.lost:+.3g} J{percent}")
        if self.path:
            lines.append(f"  results: {self.path}")
        return "\n".join(lines)
