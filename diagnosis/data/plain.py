"""Tables of numbers alone, as most logs are, read and written without pandas: to load it is a seventh of what a replay takes.

Arrow's own ways to NumPy and back load it, too: they look whether what they are given is of pandas. So its buffers are taken.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from pyarrow import Array, ArrowInvalid, Table, bool_, csv, default_memory_pool, float64, large_string, py_buffer

if TYPE_CHECKING:
    import pandas as pd


@dataclass
class NumberTable:
    """What of a pandas table a log is read by: columns by their names, all of one length, and what is told beside them."""

    held: dict[str, np.ndarray]
    attrs: dict[str, Any]

    @property
    def columns(self) -> list[str]:
        """Names of the columns."""
        return list(self.held)

    @property
    def empty(self) -> bool:
        """Whether there is no row."""
        return not len(self)

    def pandas(self) -> pd.DataFrame:
        """The same as a pandas table."""
        import pandas as pd

        found = pd.DataFrame(self.held)
        found.attrs.update(self.attrs)
        return found

    def __len__(self) -> int:
        return len(next(iter(self.held.values()), ()))

    def __getitem__(self, name: str) -> np.ndarray:
        return self.held[name]


def numbers(path: Path, names: list[str], rows: list[list[str]], skipped: int, separator: str) -> dict[str, np.ndarray] | None:
    """The columns of a text behind so many lines; None where a cell is no number, or a line has more or fewer than names.

    rows: of cells, the first ones: a column that says true or false there does so to its end. NaN where a cell is empty, or
    says that there is none. Each number is the double that is closest to what is written.
    """
    told = lambda k: {row[k].lower() for row in rows if k < len(row)}
    types = {name: bool_() if told(k) and told(k) <= {"true", "false"} else float64() for k, name in enumerate(names)}
    table: Table | None = None
    yes, no = (["TRUE", "true", "True"], ["FALSE", "false", "False"])
    try:
        table = csv.read_csv(
            path,
            csv.ReadOptions(column_names=names, skip_rows=skipped),
            csv.ParseOptions(delimiter=separator),
            csv.ConvertOptions(column_types=types, true_values=yes, false_values=no),
        )
        if any(types[name] == bool_() and table.column(name).null_count for name in names):
            return None
        return {name: np.concatenate([_values(part) for part in table.column(name).chunks] or [np.zeros(0)]) for name in names}
    except ArrowInvalid:
        return None
    finally:
        table = None
        default_memory_pool().release_unused()  # else what a log took to be read stays taken


def _values(chunk: Array) -> np.ndarray:
    """An Arrow array of doubles or truths; NaN where it has none."""
    there, data = chunk.buffers()
    part = slice(chunk.offset, chunk.offset + len(chunk))
    bits = lambda buffer: np.unpackbits(np.frombuffer(buffer, np.uint8), bitorder="little")[part].astype(bool)
    if chunk.type == bool_():
        return bits(data)
    values = np.frombuffer(data)[part]
    return values if there is None else np.where(bits(there), values, np.nan)


def arrow(columns: Mapping[str, np.ndarray]) -> Table:
    """Columns of doubles, truths or texts as an Arrow table; NaN is nothing there."""
    return Table.from_arrays([_written(column) for column in columns.values()], list(columns))


def _written(column: np.ndarray) -> Array:
    bits = lambda x: py_buffer(np.packbits(x, bitorder="little"))
    if column.dtype.kind == "b":
        return Array.from_buffers(bool_(), len(column), [None, bits(column)])
    if column.dtype.kind in "iuf":
        values = np.ascontiguousarray(column, float)
        return Array.from_buffers(float64(), len(values), [bits(~np.isnan(values)), py_buffer(values)])
    texts = [str(text).encode() for text in column]
    ends = np.cumsum([0, *map(len, texts)], dtype=np.int64)
    return Array.from_buffers(large_string(), len(texts), [None, py_buffer(ends), py_buffer(b"".join(texts))])
