"""What a run gives: its rows while they come, and the Result at its end. Files are in master.files."""

from __future__ import annotations

import math
from abc import ABC, abstractmethod
from collections.abc import Sequence
from dataclasses import dataclass, field
from pathlib import Path
from threading import Lock
from typing import Any

import numpy as np
import pandas as pd

from ..fmus.shown import one_line
from .face import Variable, view
from .seen import Seen
from .stops import held

ROWS = 4096  # in memory before they are written; a multiple of 16
KINDS = {"Real": np.dtype(float), "Integer": np.dtype("int64"), "Boolean": np.dtype(bool), "String": np.dtype(object)}


class Sink(ABC):
    """Takes rows of numbers and strings, keeps or writes them in pieces."""

    path: Path | None = None  # of the file, where it is one
    whole = True  # at its end, once it is closed

    def __init__(self, columns: list[Variable], about: dict[str, Any] | None = None):
        self.columns = columns
        self.about = about or {}  # what the run was of: master.about
        self._numbers = [c for c in columns if c.type != "String"]
        self._texts = [c.name for c in columns if c.type == "String"]
        self.width = len(self._numbers)
        self.block = np.empty((ROWS, self.width))
        self.flat = view(self.block.reshape(-1))  # row r starts at r · width
        self.words: list[list[str]] = []
        self.fill = self._good = self._saved = 0  # rows in the block; how many of them were looked at; and are kept
        self.wanted = np.ones(ROWS, bool)  # which of them are to be kept; all are looked at, and count for peaks and energies
        self.seen = Seen(columns)
        self._lock = Lock()

    def unchecked(self) -> np.ndarray:
        """The numbers of all rows since `checked` was called last."""
        return self.block[self._good : self.fill].reshape(-1)

    def checked(self) -> None:
        """All rows until here are good; write them when there are many."""
        self._good = self.fill
        if self.fill == ROWS:
            self.flush()

    def flush(self) -> None:
        """Keep all rows of the block, and begin another."""
        with held(), self._lock:
            if self.fill:
                self._save()
                self.seen.add(self.block[: self.fill])
                self.wanted[:] = True
                self.fill = self._good = self._saved = 0
                self.words.clear()

    def save(self) -> None:
        """Keep the rows that there are so far; from any thread."""
        with self._lock:
            self._save()

    def want_last(self) -> None:
        """Keep the last row, for the run ends with it."""
        with self._lock:
            if self.fill:
                self.wanted[self.fill - 1] = True

    def resumed(self, fill: int) -> None:
        """The block holds so many rows, which are kept already."""
        self.fill = self._good = self._saved = fill

    def _save(self) -> None:
        wanted = self._saved + np.flatnonzero(self.wanted[self._saved : self.fill])
        if len(wanted):  # what is not wanted behind the last of them may be the run's end
            rows = slice(self._saved, self.fill) if len(wanted) == self.fill - self._saved else wanted
            self.keep(self.block[rows], [self.words[k] for k in wanted] if self.words else [])
            self._saved = int(wanted[-1]) + 1

    def keep(self, numbers: np.ndarray, words: list[list[str]]) -> None:
        """Keep or write some rows: numbers, of which the block will hold others, and texts."""
        self.put(self._frame(numbers, words))

    def _frame(self, numbers: np.ndarray, words: list[list[str]]) -> pd.DataFrame:
        data: dict[str, Any] = {c.name: numbers[:, k].astype(KINDS[c.type]) for k, c in enumerate(self._numbers)}
        data |= {name: [row[k] for row in words] for k, name in enumerate(self._texts)}
        return pd.DataFrame({c.name: data[c.name] for c in self.columns})

    @abstractmethod
    def put(self, frame: pd.DataFrame) -> None:
        """Keep or write some rows."""

    @abstractmethod
    def table(self) -> pd.DataFrame:
        """All rows."""

    def column(self, name: str) -> np.ndarray:
        """All rows of a column of numbers, as floats."""
        return self.table()[name].to_numpy(float)

    def close(self) -> None:
        self.flush()


class Memory(Sink):
    """Keeps rows as they are; a table is made where one is asked for: who runs a system over and over asks for columns."""

    def __init__(self, columns: list[Variable], about: dict[str, Any] | None = None):
        super().__init__(columns, about)
        self._rows: list[tuple[np.ndarray, list[list[str]]]] = []
        self._table: pd.DataFrame | None = None
        self._place = {c.name: k for k, c in enumerate(self._numbers)}

    def keep(self, numbers: np.ndarray, words: list[list[str]]) -> None:
        self._rows.append((numbers.copy(), words))
        self._table = None

    def put(self, frame: pd.DataFrame) -> None: ...

    def table(self) -> pd.DataFrame:
        if self._table is None:
            numbers = np.concatenate([np.empty((0, self.width)), *(numbers for numbers, _ in self._rows)])
            self._table = self._frame(numbers, [row for _, words in self._rows for row in words])
        return self._table

    def column(self, name: str) -> np.ndarray:
        return np.concatenate([np.empty(0), *(numbers[:, self._place[name]] for numbers, _ in self._rows)])

    def copied(self) -> Any:
        """All rows as they are now, for `back`."""
        rows, wanted = self.block[: self.fill].copy(), self.wanted.copy()
        return list(self._rows), rows, wanted, self._good, self._saved, list(self.words), self.seen.copied()

    def back(self, state: Any) -> None:
        """To the rows that there were."""
        kept, rows, wanted, self._good, self._saved, words, seen = state
        self._rows, self.words, self.seen, self._table = list(kept), list(words), seen.copied(), None
        self.fill = len(rows)
        self.block[: self.fill], self.wanted[:] = rows, wanted


@dataclass
class Tally:
    """How a circle was solved (master.coupling)."""

    name: str
    way: str
    unknowns: int
    solved: int = 0
    rounds: int = 0  # evaluations in all
    most: int = 0  # in one solution
    residual: float = 0.0  # the largest left, relative
    loose: int = 0  # solutions beyond the tolerance, though not far

    def __str__(self) -> str:
        loose = f"; {self.loose} times beyond the tolerance" if self.loose else ""
        rounds = f"{self.rounds / max(self.solved, 1):.2g} evaluations on average, {self.most} at most"
        return f"{self.way} ({rounds}; residual {self.residual:.1g} at most{loose}): {self.name}"


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
    lagging: dict[str, str] = field(default_factory=dict)  # algebraic loops that are not solved: values lag by a step; and why
    circles: list[Tally] = field(default_factory=list)  # what was solved, and how well

    @property
    def table(self) -> pd.DataFrame:
        """The results; read from the file where they were written to one."""
        return self.sink.table()

    def column(self, name: str) -> np.ndarray:
        """All rows of a column of numbers, as floats: without the table, where that is in memory."""
        return self.sink.column(name)

    @property
    def coupling(self) -> pd.DataFrame:
        """A row for each circle that was solved: unknowns, times solved, evaluations (all, and most in one), largest residual left."""
        rows = [(one.way, one.unknowns, one.solved, one.rounds, one.most, one.residual, one.loose) for one in self.circles]
        names = ["way", "unknowns", "solved", "evaluations", "most", "residual", "loose"]
        return pd.DataFrame(rows, index=[one.name for one in self.circles], columns=names)

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
        from .files import sink

        table, written = self.table, sink(self.sink.columns, path, about=self.about)
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
        for loop, why in self.lagging.items():
            lines.append(f"  algebraic loop, its values lag by a step, for {why}: {loop}")
        lines += [f"  {one}" for one in self.circles if one.unknowns]
        for name, lacks in self.lacks.items():
            lines.append(f"  {name} was isolated only in part: not taken away were {'; '.join(lacks)}")
        lines += [f"  {note}" for note in self.notes]
        lines += self.sink.seen.lines()
        for name, bond in self.energy.iterrows():
            percent = f" ({100 * bond.relative:+.2g} % of its turnover)" if math.isfinite(bond.relative) else ""
            lines.append(f"  energy the coupling lost at {name}: {bond.lost:+.3g} J{percent}")
        if self.path:
            lines.append(f"  results: {self.path}")
        return "\n".join(map(one_line, lines))  # whatever its names hold
