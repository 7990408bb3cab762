"""Files as tables: one column for each channel, whatever they were written with. Nothing in them is run, and sizes end.

attrs["first line"]: the line of a text file that the first row was. attrs["left out"]: vectors of another length, with it.
attrs["scalars"]: single numbers beside the columns, such as a sampling time.

pandas is loaded by what needs it, which a text of numbers alone does not.
"""

from __future__ import annotations

import json
import re
import struct
import zipfile
import zlib
from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Any, Literal, overload

import numpy as np

from selflock.fmus.place import named

from ..errors import DataError
from .plain import NumberTable
from .structures import DEEPEST, LONGEST, MOST_NAMES, WIDEST, fields, of_hdf, of_matlab
from .text import LOGS, form_of, read_text

if TYPE_CHECKING:
    import pandas as pd

LARGEST = 4 << 30  # bytes of a file, and of what is unpacked of it
LARGEST_JSON = 512 << 20  # which is in memory several times over
LARGEST_PACKED = 512 << 20  # of what is compressed in a MATLAB file, whose numbers may have a byte there and eight in memory
LARGEST_BOOK = 50_000_000  # cells of a workbook
COMPRESSED, PIECE = 15, 1 << 20  # an element's type in a MATLAB file; bytes
TEXTS = {".csv", ".txt", ".tsv", ".dat", ".log", ".asc", ".lvm", ".tab", ".prn"}
HDF = b"\x89HDF\r\n\x1a\n"
BOOKS = {".xlsx", ".xlsm"}
SECONDS, NANOSECONDS = re.compile(r"(.*?)secs?"), ("nanosec", "nanosecs", "nsec", "nsecs")  # of a stamp in two parts
ENDINGS = TEXTS | BOOKS | {".parquet", ".pq", ".mat", ".h5", ".hdf5", ".json", ".jsonl", ".ndjson", ".npy", ".npz"}
"""Of files that are read as logs."""


@overload
def table(path: str | Path, plain: Literal[False] = False) -> pd.DataFrame: ...
@overload
def table(path: str | Path, plain: bool) -> pd.DataFrame | NumberTable: ...
def table(path: str | Path, plain: bool = False) -> pd.DataFrame | NumberTable:
    """The table in a file; `plain`: where it is numbers alone, without pandas. DataError says what is wrong, and what to do."""
    path = named(Path(path))
    if not path.exists():
        raise DataError(f"{path}: there is no such log.")
    if path.is_dir():
        raise DataError(f"{path}: is a folder. Give the log in it: {LOGS}.")
    size = path.stat().st_size
    if size == 0:
        raise DataError(f"{path}: is empty (0 bytes). Export the log again.")
    ending = path.suffix.lower()
    most = LARGEST_JSON if ending in {".json", ".jsonl", ".ndjson"} else LARGEST
    if size > most:
        raise DataError(f"{path}: has {size / 2**20:.0f} MiB; {most >> 20} at most are read. Cut the log into parts.")
    try:
        found = _read(path, ending, plain)
        if long := [name for name in map(str, found.columns) if len(name) > LONGEST]:
            raise DataError(f"{path}: a column's name has {len(long[0])} characters, {LONGEST} at most are read: {long[0][:40]}…")
        return _stamped(found)
    except DataError:
        raise
    except UnicodeDecodeError:
        raise DataError(f"{path}: is not UTF-8 text. Save it as CSV in UTF-8.") from None
    except ModuleNotFoundError:
        raise  # an extra is missing: the command line says which
    except Exception as error:
        raise DataError(f"{path}: cannot be read as {ending}: {error}. The file may be cut off; export it again.") from None


def _read(path: Path, ending: str, plain: bool) -> pd.DataFrame | NumberTable:
    if ending in TEXTS or not ending.strip("."):  # a program that writes numbers seldom cares for an ending
        return read_text(path, plain)
    if ending in {".parquet", ".pq"}:
        return _parquet(path)
    if ending == ".mat":
        return _mat(path)
    if ending in {".h5", ".hdf5"}:
        return _hdf(path)
    if ending in {".json", ".jsonl", ".ndjson"}:
        return _json(path)
    if ending in {".npy", ".npz"}:
        return _numpy(path, ending)
    if ending in BOOKS:
        return _book(path)
    if ending == ".xls":
        raise DataError(f"{path}: is a workbook of Excel before 2007. Save it as .xlsx or .csv.")
    raise DataError(f"{path}: logs are {LOGS}, not {ending}.")


def _stamped(found: pd.DataFrame | NumberTable) -> pd.DataFrame | NumberTable:
    """Seconds and nanoseconds in two columns, as of ROS, as one column in s."""
    for name in [str(name) for name in found.columns]:
        if (parts := SECONDS.fullmatch(name)) is None:
            continue
        rest = next((f"{parts[1]}{word}" for word in NANOSECONDS if f"{parts[1]}{word}" in found.columns), "")
        stamp = parts[1].rstrip("._/ ") or "time"
        if rest and stamp not in found.columns and all(found[one].dtype.kind in "fiu" for one in (name, rest)):
            found = found.pandas() if isinstance(found, NumberTable) else found
            below = found[rest].to_numpy(float)
            if np.all((below >= 0.0) & (below < 1e9)):
                found[name] = found[name].to_numpy(float) + 1e-9 * below
                found = found.drop(columns=rest).rename(columns={name: stamp})
    return found


def _bounded(path: Path, size: int, most: int) -> None:
    """Refuse what would be larger in memory."""
    if size > most:
        raise DataError(
            f"{path}: holds more than {most >> 20} MiB unpacked. Save the channels that matter, or cut the log into parts."
        )


def _parquet(path: Path) -> pd.DataFrame:
    import pandas as pd
    from pyarrow.parquet import read_metadata, read_schema

    size, schema = read_metadata(path), read_schema(path)
    _bounded(path, 8 * size.num_rows * size.num_columns, LARGEST)
    found = pd.read_parquet(path)
    found = found if found.index.names == [None] else found.reset_index()
    units = {field.name: (field.metadata or {}).get(b"unit", b"").decode() for field in schema}  # as a run of ours writes them
    found = found.rename(columns={name: f"{name} [{unit}]" for name, unit in units.items() if unit and "[" not in name})
    lists = [name for name in found.columns if found[name].dtype == object and _is_list(found[name])]
    if not lists:
        return found
    arrays = {str(name): found[name].to_numpy() for name in found.columns if name not in lists}
    for name in lists:
        arrays |= _listed(str(name), found[name].to_list())
    return pd.DataFrame(arrays)


def _is_list(values: pd.Series) -> bool:
    return len(values) > 0 and isinstance(values.iloc[0], (list, tuple, np.ndarray))


def _listed(name: str, rows: list) -> dict[str, np.ndarray]:
    """Rows that hold lists of one length, as columns name.1, name.2; nothing where they do not."""
    lengths = {len(row) for row in rows if row is not None}
    if len(lengths) != 1 or not 0 < (width := lengths.pop()) <= WIDEST:
        return {}
    none = [np.nan] * width
    try:
        matrix = np.array([none if row is None else row for row in rows], float)
    except (TypeError, ValueError):
        return {}
    return {f"{name}.{k + 1}": matrix[:, k] for k in range(width)} if matrix.ndim == 2 else {}


def _mat(path: Path) -> pd.DataFrame:
    from scipy.io import loadmat

    with path.open("rb") as file:
        if HDF in file.read(512 + len(HDF)):
            return _hdf(path)  # version 7.3
    _bounded(path, _unpacked(path), LARGEST_PACKED)
    try:
        held = {name: value for name, value in loadmat(path).items() if not name.startswith("__")}
    except NotImplementedError:
        return _hdf(path)
    return together(path, dict(fields({name: of_matlab(value) for name, value in held.items()})), holds=", ".join(held))


def _unpacked(path: Path) -> int:
    """Bytes of what is compressed in a MATLAB file of version 5 to 7, until they are too many."""
    total = 0
    with path.open("rb") as file:
        order = "<" if file.read(128)[126:] == b"IM" else ">"
        while len(head := file.read(8)) == 8 and total <= LARGEST_PACKED:
            kind, left = struct.unpack(f"{order}II", head)
            if kind != COMPRESSED:
                file.seek(left, 1)
                continue
            stream = zlib.decompressobj()
            while left > 0 and total <= LARGEST_PACKED and (piece := file.read(min(left, PIECE))):
                left -= len(piece)
                while piece and total <= LARGEST_PACKED:
                    total += len(stream.decompress(piece, 8 * PIECE))
                    piece = stream.unconsumed_tail
    return total


def _hdf(path: Path) -> pd.DataFrame:
    """HDF5, as which MATLAB writes its version 7.3."""
    import h5py

    total = 0

    def count(size: int) -> None:
        nonlocal total
        total += size
        _bounded(path, total, LARGEST)

    try:
        file = h5py.File(path, "r")
    except OSError:
        raise DataError(f"{path}: is neither a MATLAB file of version 7 or 7.3 nor HDF5. Export it again.") from None
    with file:
        held = of_hdf(file, count)
    return together(path, dict(fields(held)), holds=", ".join(held))


def _numpy(path: Path, ending: str) -> pd.DataFrame:
    if ending == ".npz":
        with zipfile.ZipFile(path) as archive:
            _bounded(path, sum(entry.file_size for entry in archive.infolist()), LARGEST)
        with np.load(path, allow_pickle=False) as held:
            return together(path, {name: held[name] for name in list(held)[:MOST_NAMES]})
    values = np.load(path, mmap_mode="r", allow_pickle=False)
    if values.dtype.names:
        return together(path, {name: np.asarray(values[name]) for name in values.dtype.names})
    return together(path, {"": np.asarray(values)})


def _json(path: Path) -> pd.DataFrame:
    """Columns, records, or records below a name; with a line for each record, too."""
    text = path.read_text(encoding="utf-8-sig")
    try:
        data = json.loads(text)
    except RecursionError:
        raise DataError(f"{path}: its brackets are nested too deep.") from None
    except json.JSONDecodeError as error:
        lines = [line for line in text.splitlines() if line.strip()]
        if len(lines) < 2 or not lines[0].lstrip().startswith(("{", "[")):
            raise DataError(f"{path}: is not JSON: {error}. Export it again.") from None
        try:
            data = [json.loads(line) for line in lines]
        except json.JSONDecodeError as bad:
            raise DataError(f"{path}: a line of it is not JSON: {bad}. Is the file cut off?") from None
    arrays, beside = _from_json(data)
    if not arrays:
        raise DataError(
            f'{path}: holds no table. Write columns, {{"time": [0, 0.1], "speed": [0, 1]}}, or records, [{{"time": 0, "speed": 0}}, ...].'
        )
    return together(path, arrays | beside)


def _from_json(data: Any, depth: int = 0) -> tuple[dict[str, Any], dict[str, Any]]:
    """Columns, and what stands beside them."""
    if isinstance(data, list):
        if data and all(isinstance(row, dict) for row in data):
            rows = [dict(_flat(row)) for row in data]
            names = dict.fromkeys(name for row in rows for name in row)
            found: dict[str, Any] = {}
            for name in list(names)[:MOST_NAMES]:
                values = [row.get(name) for row in rows]
                found |= _listed(name, values) if any(isinstance(v, list) for v in values) else {name: _column(values)}
            return found, {}
        if data and all(isinstance(row, list) for row in data):
            return _listed("", data), {}
        return {}, {}
    if not isinstance(data, dict) or depth > DEEPEST:
        return {}, {}
    if isinstance(data.get("columns"), list) and isinstance(data.get("data"), list):
        rows = [dict(zip(map(str, data["columns"]), row)) for row in data["data"] if isinstance(row, list)]
        return _from_json(rows)
    if data and all(isinstance(v, dict) and v and all(k.isdigit() for k in v) for v in data.values()):  # as pandas writes it
        return {name: _column(list(values.values())) for name, values in data.items()}, {}
    lists = {name: value for name, value in _flat(data) if isinstance(value, list)}
    beside = {name: value for name, value in _flat(data) if isinstance(value, (int, float))}
    records = {name: v for name, v in lists.items() if v and all(isinstance(row, dict) for row in v)}
    if records:
        return _from_json(max(records.values(), key=len))[0], beside
    arrays: dict[str, Any] = {}
    for name, value in lists.items():
        arrays |= _listed(name, value) if value and isinstance(value[0], list) else {name: _column(value)}
    return arrays, beside


def _flat(row: dict, prefix: str = "", depth: int = 0) -> Iterator[tuple[str, Any]]:
    for name, value in row.items():
        if isinstance(value, dict) and depth < DEEPEST:
            yield from _flat(value, f"{prefix}{name}.", depth + 1)
        else:
            yield f"{prefix}{name}", value


def _column(values: list) -> np.ndarray:
    if all(v is None or isinstance(v, (int, float)) for v in values):
        return np.array([np.nan if v is None else float(v) for v in values])
    return np.array([str(v) if isinstance(v, (str, int, float)) else None for v in values], object)


def _book(path: Path) -> pd.DataFrame:
    """The longest sheet of a workbook, by its values; formulas and macros are not run."""
    import pandas as pd
    from openpyxl import load_workbook

    with zipfile.ZipFile(path) as archive:
        if sum(entry.file_size for entry in archive.infolist()) > LARGEST_JSON:
            raise DataError(f"{path}: holds more than {LARGEST_JSON >> 20} MiB unpacked. Save the sheet as .csv.")
    sheets: list[list[tuple[Any, ...]]] = []
    cells = 0
    with path.open("rb") as file:  # ours to close: a sheet that is not read to its end holds it open
        book = load_workbook(file, read_only=True, data_only=True, keep_links=False)
        for sheet in book.worksheets:
            sheets.append([])
            for row in sheet.iter_rows(values_only=True):
                if (cells := cells + len(row)) > LARGEST_BOOK:
                    raise DataError(f"{path}: has more than {LARGEST_BOOK} cells. Save the sheet as .csv.")
                sheets[-1].append(row)
        book.close()
    rows = max(sheets, key=len, default=[])
    width = max((k + 1 for row in rows for k, cell in enumerate(row) if cell is not None), default=0)
    if not width:
        raise DataError(f"{path}: its sheets are empty. Export the log again.")
    rows = [row[:width] for row in rows]
    form = form_of([["" if cell is None else str(cell).strip() for cell in row] for row in rows[:400]])
    names = [*form.names, *(f"(unnamed {k + 1})" for k in range(len(form.names), width))]
    found = pd.DataFrame(rows[form.first :], columns=names[:width])
    found = found.dropna(axis="columns", how="all").dropna(axis="index", how="all").infer_objects().reset_index(drop=True)
    found.attrs["first line"] = form.first + 1
    return found


def together(path: Path, held: Mapping[str, Any], holds: str = "") -> pd.DataFrame:
    """Arrays as one table: vectors of the most common great length, and matrices that have it as one of their sides."""
    import pandas as pd

    arrays = {name: np.squeeze(np.asarray(value)) for name, value in held.items()}
    arrays = {name: value for name, value in arrays.items() if value.dtype.kind in "fiubUSO"}
    numbers = {name: value for name, value in arrays.items() if value.dtype.kind in "fiub"}
    sides = [max(value.shape) for value in numbers.values() if value.ndim in (1, 2)]
    if not sides:
        said = f" It holds {holds or ', '.join(map(str, held))}." if holds or held else ""
        raise DataError(f"{path}: holds no vectors.{said} Save each channel as a vector of its own, all of the same length.")
    length = max(sides)
    columns: dict[str, np.ndarray] = {}
    left: dict[str, int] = {}
    for name, value in arrays.items():
        if value.ndim == 1 and len(value) == length:
            columns[name] = value.astype(float) if value.dtype.kind in "fiub" else value
        elif value.ndim == 2 and length in value.shape and min(value.shape) <= WIDEST:
            rows = value if value.shape[0] == length else value.T
            columns |= {f"{name}.{k + 1}".lstrip("."): rows[:, k].astype(float) for k in range(rows.shape[1])}
        elif value.ndim in (1, 2):
            left[name] = max(value.shape)
    found = pd.DataFrame(columns)
    found.attrs["left out"] = left
    found.attrs["scalars"] = {name: float(value) for name, value in numbers.items() if value.ndim == 0}
    return found
