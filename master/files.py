"""Files of results: one column "time" and one per "component.variable", units kept.

CSV for people: the unit stands in the header, `rear_motor.torque [N.m]`. Parquet for long runs: the unit is in the
field's metadata. A run that writes to a file does so in pieces, its memory does not grow with the log; and rows are in
the file within a second, whatever becomes of the run. A Parquet file can be read only once its end is written: until
then `x.parquet.arrows`, an Arrow stream, holds the rows, and is read in its place.
"""

from __future__ import annotations

import errno
import json
import os
import re
import shutil
from abc import abstractmethod
from collections.abc import Callable
from pathlib import Path
from threading import Event, Thread
from typing import IO, Any, NamedTuple

import pandas as pd
import pyarrow as pa
import pyarrow.csv as csv
import pyarrow.parquet as pq

from ..fmus.place import ending, named
from .archive import RATIO
from .errors import ResultError, warn
from .face import Variable
from .results import ROWS, Memory, Sink

SECONDS = {"": 1.0, "s": 1.0, "ms": 1e-3, "us": 1e-6, "µs": 1e-6, "ns": 1e-9, "min": 60.0, "h": 3600.0}

ABOUT = "selflock"  # the key in a Parquet file's metadata of what the run was of
PIECES = 8  # of ROWS in a row group of a Parquet file, whose writer keeps 900 bytes per column and row group to its end
EVERY = 0.5  # s between two looks for rows that are not in the file
LINE = 1 << 24  # bytes of the longest line
LARGEST = 4 << 30  # bytes in memory, from which on a table is not to be RATIO times its file
NUMBER = re.compile(r"[+-]?(\d+\.?\d*|\.\d+)([eE][+-]?\d+)?")
FULL = (errno.ENOSPC, errno.EDQUOT, errno.EFBIG)


def header(column: Variable) -> str:
    """A column's name and unit as they stand in the first line of a CSV file."""
    return f"{column.name} [{column.unit}]" if column.unit else column.name


class Mark(NamedTuple):
    """How far a file is."""

    rows: int
    size: int  # bytes
    until: float  # time of the last row, s


class File(Sink):
    """Rows that are in a file half a second after they came, also while a step takes for ever: another thread sees to it."""

    path: Path
    _file: IO[bytes]

    def __init__(self, columns: list[Variable], path: Path, mark: Mark | None = None, about: dict[str, Any] | None = None):
        """mark: go on with the file from there."""
        super().__init__(columns, about)
        self.path = path
        self._written, self._size, self._until = mark or Mark(0, 0, 0.0)
        self._broken: ResultError | None = None
        self._over = Event()
        self.whole = True  # False: another process goes on with it

    @property
    def mark(self) -> Mark:
        """How far the file is."""
        return Mark(self._written, self._size, self._until)

    def _open(self, path: Path, begin: bytes) -> IO[bytes]:
        """The file, cut off where it goes on, or begun."""
        if not self._size:
            self._file = path.open("wb", buffering=0)
            self._append(begin)
            return self._file
        try:
            file = path.open("r+b", buffering=0)
        except FileNotFoundError:
            raise ResultError(
                f"{path} is gone, with which the saved state goes on. Remove {self.path.name}.state to begin anew."
            ) from None
        if file.seek(0, os.SEEK_END) < self._size:
            file.close()
            raise ResultError(f"{path} is shorter than its saved state says. Remove {self.path.name}.state to begin anew.")
        file.truncate(self._size)
        file.seek(self._size)
        return file

    def begin(self) -> None:
        """From now on rows are kept as they come."""
        Thread(target=self._keep, name=f"rows of {self.path.name}", daemon=True).start()

    def _keep(self) -> None:
        while not self._over.wait(EVERY):
            try:
                self.save()
            except ResultError:  # which `checked` raises where the run is
                return

    def checked(self) -> None:
        super().checked()
        if self._broken:
            raise self._broken

    def put(self, frame: pd.DataFrame) -> None:
        if self._broken:
            return
        try:
            self._put(frame)
        except (OSError, pa.ArrowException) as error:
            raise self._failed(error) from None
        self._written += len(frame)
        self._until = float(frame["time"].iloc[-1])

    @abstractmethod
    def _put(self, frame: pd.DataFrame) -> None:
        """Write some rows. Raises OSError."""

    def _append(self, content: bytes | memoryview) -> None:
        """Write it at once, whole; where that fails, nothing of it stays."""
        rest = memoryview(content)
        try:
            while rest:
                rest = rest[self._file.write(rest) :]
        except BaseException:
            self._file.truncate(self._size)
            self._file.seek(self._size)
            raise
        self._size += memoryview(content).nbytes

    def _failed(self, error: Exception) -> ResultError:
        number = getattr(error, "errno", None)
        why = getattr(error, "strerror", None) or str(error)
        if number in FULL:
            why = "no file may be larger here" if number == errno.EFBIG else "the disk is full"
            try:
                why += f" ({shutil.disk_usage(self.path.parent).free >> 20} MiB are free)" * (number != errno.EFBIG)
            except OSError:
                pass
        kept = f"{self._written} rows until t = {self._until:.9g} s, {self._size / 2**20:.3g} MiB, are kept in {self._kept()}"
        self._broken = ResultError(f"{self.path} cannot be written on: {why}. {kept}. Make room, or give another place.")
        return self._broken

    def _kept(self) -> Path:
        """The file that holds the rows while the run goes on."""
        return self.path

    def close(self) -> None:
        self._over.set()
        try:
            super().close()
            if not self._broken and self.whole:
                self._end()
        except (OSError, pa.ArrowException) as error:
            raise self._failed(error) from None
        finally:
            self._file.close()

    def _end(self) -> None:
        """Bring the file to its end."""

    def table(self) -> pd.DataFrame:
        return read(self.path)[0]


class Csv(File):
    def __init__(self, columns: list[Variable], path: Path, mark: Mark | None = None, about: dict[str, Any] | None = None):
        super().__init__(columns, path, mark, about)
        first = pd.DataFrame(columns=[header(c) for c in columns]).to_csv(index=False)
        self._file = self._open(path, first.encode())

    def _put(self, frame: pd.DataFrame) -> None:
        self._append(frame.to_csv(index=False, header=False, na_rep="nan").encode())


class Parquet(File):
    def __init__(self, columns: list[Variable], path: Path, mark: Mark | None = None, about: dict[str, Any] | None = None):
        super().__init__(columns, path, mark, about)
        arrow = {"Real": pa.float64(), "Integer": pa.int64(), "Boolean": pa.bool_(), "String": pa.string()}
        units = json.dumps({c.name: c.unit for c in columns})
        told = {"units": units} | ({ABOUT: json.dumps(about)} if about else {})
        self._schema = pa.schema([pa.field(c.name, arrow[c.type], metadata={"unit": c.unit}) for c in columns], metadata=told)
        path.unlink(missing_ok=True)  # it would be read in place of what is written now
        self._file = self._open(_stream(path), self._schema.serialize())
        self._new = path.with_name(path.name + ".new")
        self._writer = pq.ParquetWriter(self._new, self._schema)
        self._pieces: list[pa.Table] = []
        if mark:
            with pa.OSFile(str(_stream(path))) as file, pa.ipc.open_stream(file) as stream:
                for batch in stream:
                    self._take(pa.Table.from_batches([batch]))

    def _put(self, frame: pd.DataFrame) -> None:
        table = pa.Table.from_pandas(frame, schema=self._schema, preserve_index=False).cast(self._schema)
        for batch in table.to_batches():
            self._append(batch.serialize())
        self._take(table)

    def _take(self, table: pa.Table) -> None:
        self._pieces.append(table)
        rows = sum(map(len, self._pieces))
        if rows >= PIECES * ROWS:
            self._write()
        elif len(self._pieces) > 8 * PIECES:  # of a slow run, a few rows each
            self._pieces = [pa.concat_tables(self._pieces).combine_chunks()]

    def _write(self) -> None:
        if self._pieces:
            self._writer.write_table(pa.concat_tables(self._pieces))
            self._pieces.clear()

    def _kept(self) -> Path:
        return _stream(self.path)

    def close(self) -> None:
        try:
            super().close()
        finally:
            if self._broken or not self.whole:
                self._forget()

    def _end(self) -> None:
        self._write()
        self._writer.close()
        os.replace(self._new, self.path)
        _stream(self.path).unlink()

    def _forget(self) -> None:
        """What is left of a Parquet file whose disk is full, or which another process goes on with."""
        try:
            self._writer.close()
        except (OSError, pa.ArrowException):
            pass
        self._new.unlink(missing_ok=True)


def _stream(path: Path) -> Path:
    return path.with_name(path.name + ".arrows")


FILES: dict[str, Callable[[list[Variable], Path, Mark | None, dict[str, Any] | None], File]] = {".csv": Csv, ".parquet": Parquet}


def sink(columns: list[Variable], path: Path | str | None, mark: Mark | None = None, about: dict[str, Any] | None = None) -> Sink:
    """Where rows go: into memory, or into a file by the ending of its name; from `mark` on where one is given.

    about: what the run is of (master.about).
    """
    if path is None:
        return Memory(columns, about)
    path = Path(path)
    kind = FILES.get(path.suffix.lower())
    if kind is None:
        raise ResultError(f"{path}: results are written as .csv or .parquet; choose one of these endings.")
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
        made = kind(columns, path, mark, about)
    except OSError as error:
        raise ResultError(f"{path} cannot be written: {error.strerror or error}.") from None
    except ValueError as error:  # a zero byte in its name
        raise ResultError(f"{str(path)!r} is no path of a file: {error}.") from None
    made.begin()
    return made


def read(path: Path | str, whole: bool = False) -> tuple[pd.DataFrame, dict[str, str]]:
    """A table of results and the units of its columns, from a .csv or .parquet file, at any instant of the run that writes it.

    What was not written whole, after a crash or at this very instant, is read over with a warning. whole: it is a person's
    table, whose last line counts without a line break, too.
    """
    path = named(Path(path))
    try:
        if path.suffix.lower() == ".parquet":
            return _once(_read_parquet(path))
        if path.suffix.lower() == ".csv":
            return _once(_read_csv(path, whole))
    except FileNotFoundError:
        raise ResultError(f"There is no result file {path}.") from None
    except UnicodeDecodeError:
        raise ResultError(
            f"{path} is no table of results: it is no UTF-8 text. What a recorder wrote selflock info and rig init read."
        ) from None
    except (OSError, ValueError, pa.ArrowException) as error:
        raise ResultError(f"{path} is no table of results: {(getattr(error, 'strerror', None) or str(error))[:160]}") from None
    raise ResultError(f"{path}: results are read from .csv or .parquet files.")


def _once(found: tuple[pd.DataFrame, dict[str, str]]) -> tuple[pd.DataFrame, dict[str, str]]:
    """What was read, where its columns have names, and none twice. Raises ValueError."""
    columns = found[0].columns
    if len(columns) and all(NUMBER.fullmatch(str(name)) for name in columns):
        raise ValueError(
            "its first line is one of numbers, where the names of its columns are to stand: write them above it, time first"
        )
    if not columns.is_unique:
        raise ValueError(f"its column {columns[columns.duplicated()][0]!r} is there twice")
    return found


def _read_parquet(path: Path) -> tuple[pd.DataFrame, dict[str, str]]:
    try:
        packed = ending(path).stat().st_size
        size = pq.read_metadata(path)
        if (whole := 8 * size.num_rows * size.num_columns) > max(LARGEST, RATIO * packed):
            raise ValueError(f"it would grow to {whole >> 20} MiB, {whole // max(packed, 1)} times its size")
        table = pq.read_table(path)
    except FileNotFoundError:
        table = _of_stream(path)
    units = {f.name: ((f.metadata or {}).get(b"unit") or b"").decode() for f in table.schema}
    return table.replace_schema_metadata(None).to_pandas(), units


def _of_stream(path: Path) -> pa.Table:
    """The rows of a run that is not at its end, or has none."""
    with pa.OSFile(str(_stream(path))) as file, pa.ipc.open_stream(file) as stream:
        batches: list[pa.RecordBatch] = []
        try:
            batches += iter(stream.read_next_batch, None)
        except (StopIteration, OSError, pa.ArrowInvalid):  # its end, or a torn piece
            pass
        table = pa.Table.from_batches(batches, stream.schema)
    warn(f"{path} is not finished: its run goes on, or was killed. {len(table)} rows are read from {_stream(path).name}.")
    return table


def _read_csv(path: Path, whole: bool) -> tuple[pd.DataFrame, dict[str, str]]:
    content = pa.py_buffer(path.read_bytes()) if ending(path).stat().st_size < 1 << 20 else pa.memory_map(str(path)).read_buffer()
    if not whole and (torn := _unended(bytes(memoryview(content)[-LINE:]))):
        warn(f"{path}: its last line has no end, as after a crash, and is not read. Where it is whole, end it with a line break.")
        content = content.slice(0, len(content) - torn)
        if not len(content):
            raise ValueError("not even its first line, the names of its columns, is whole; as after a crash, or on a full disk")
    parted, point = _habits(bytes(memoryview(content)[: 1 << 16]))
    options = csv.ConvertOptions(null_values=[], strings_can_be_null=False, decimal_point=point)
    frame = csv.read_csv(
        pa.BufferReader(content), parse_options=csv.ParseOptions(delimiter=parted), convert_options=options
    ).to_pandas()
    frame = frame if len(frame) else frame.astype(float)  # no rows yet: numbers, as they will be
    headers = [header.strip() for header in frame.columns]  # people put blanks around commas
    if whole:  # and write (V), too
        headers = [re.sub(r"\s*\(([^()]*)\)$", r" [\1]", header) for header in headers]
    split = [header[:-1].partition(" [") if header.endswith("]") else (header, "", "") for header in headers]
    frame.columns = pd.Index([name.strip() for name, _, _ in split])
    return frame, {name.strip(): unit.strip() for name, _, unit in split}


def _habits(begin: bytes) -> tuple[str, str]:
    """What parts the columns and what stands before decimals: as we write it, or as a spreadsheet of other countries does."""
    header, _, rest = begin.partition(b"\n")
    parted = next((sign for sign in (";", "\t") if sign.encode() in header and b"," not in header), ",")
    return parted, "," if parted != "," and b"," in rest else "."


def seconds(path: Path | str, unit: str) -> float:
    """How many s one of the unit of a table's time is. Raises ResultError."""
    if unit not in SECONDS:
        raise ResultError(f"{path}: its time is in {unit!r}; write it in {', '.join(filter(None, SECONDS))}.")
    return SECONDS[unit]


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


def torn(path: Path) -> bool:
    """Whether the last line of a CSV file has no end, so that `read` leaves it out."""
    with path.open("rb") as file:
        file.seek(-min(LINE, path.stat().st_size), os.SEEK_END)
        return _unended(file.read()) > 0


def _unended(tail: bytes) -> int:
    """Bytes behind the last line break; none of a line that is longer than LINE."""
    end = 1 + max(tail.rfind(b"\n"), tail.rfind(b"\r"))
    return len(tail) - end if end or len(tail) < LINE else 0
