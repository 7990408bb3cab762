"""The folder of a sweep: one row a run, on disk as soon as the run is finished.

    study.json      what was asked; a folder belongs to one study for good
    parts/*.parquet rows that came since the last compaction, one file for each batch that came back
    runs.parquet    all rows in the order of the study
    tables/         whole tables of runs, where the study asks for them
    work/           where workers of this machine unpack things; gone when the sweep ends

Every file appears by a rename, so it is there whole or not at all. Nothing in the rows depends on when, where or in
which order the runs were made: the finished runs.parquet is the same file, byte for byte.
"""

from __future__ import annotations

import hashlib
import json
import os
import shutil
from collections.abc import Iterable, Mapping
from importlib import import_module
from pathlib import Path
from types import ModuleType
from typing import Any

import pyarrow as pa
import pyarrow.parquet as pq

from .errors import SweepError

fcntl: ModuleType | None
try:
    fcntl = import_module("fcntl")
except ImportError:  # not on Windows: there two sweeps at once in one folder are not noticed
    fcntl = None

COMPACT_AT = 500  # part files
OURS = ("parts", "lock", "study.json.new")  # all that a sweep killed before its study.json has made

Row = dict[str, Any]


def canonical(value: Any) -> str:
    """The one JSON text of a plain value: sorted, exact floats."""
    return json.dumps(value, sort_keys=True, separators=(",", ":"))


def digest(*values: Any) -> str:
    """SHA-256 of plain values, by their content."""
    return hashlib.sha256(canonical(values).encode()).hexdigest()


class Store:
    """The rows of one study in one folder; `about`, all but its notes, is what makes it that study."""

    def __init__(self, folder: str | Path, about: Mapping[str, Any]):
        self.folder = Path(folder)
        self.parts = self.folder / "parts"
        self.work = self.folder / "work"
        self._refuse()
        self._writing("making the folder", lambda: self.parts.mkdir(parents=True, exist_ok=True))
        self._lock = self._hold()
        shutil.rmtree(self.work, ignore_errors=True)  # of a sweep that was killed
        self._claim(json.loads(json.dumps(about)))
        for torn in [*self.folder.glob("*.new"), *self.folder.glob("*/*.new")]:
            torn.unlink()
        self.rows = rows_in(self.folder)

    def add(self, rows: Iterable[Row], files: Mapping[str, bytes] | None = None) -> None:
        """Put finished rows on disk, the files that belong to them first."""
        rows = list(rows)
        for name, content in (files or {}).items():
            self._write(self.folder / name, lambda to, content=content: to.write_bytes(content))
        part = self.parts / f"{rows[0]['key'][:32]}.parquet"
        self._write(part, lambda to: pq.write_table(pa.Table.from_pylist(_filled(rows)), to))
        self.rows.update((row["key"], row) for row in rows)

    def compact(self, keys: Iterable[str], force: bool = False) -> Path:
        """Gather all rows into runs.parquet, in the order of keys; rows of other keys after them."""
        whole, parts = self.folder / "runs.parquet", list(self.parts.iterdir())
        if not force and len(parts) < COMPACT_AT:
            return whole
        mine = dict.fromkeys(keys := list(keys))
        keys += [key for key in self.rows if key not in mine]
        rows = [{"run": number, **self.rows[key]} for number, key in enumerate(keys) if key in self.rows]
        if rows:
            self._write(whole, lambda to: pq.write_table(pa.Table.from_pylist(_filled(rows)), to))
            for part in parts:
                part.unlink()
        return whole

    def close(self) -> None:
        if self._lock is not None:
            os.close(self._lock)
            self._lock = None

    def _refuse(self) -> None:
        """Refuse a folder that is no sweep's before anything in it is touched."""
        if self.folder.is_dir() and not (self.folder / "study.json").exists():
            if strange := sorted(
                p.name for p in self.folder.iterdir() if p.name not in OURS or (p.name == "parts" and any(p.iterdir()))
            ):
                raise SweepError(
                    f"{self.folder} is not the folder of a sweep: it holds {strange[0]}. Nothing in it was touched. Give an empty folder or "
                    "a new one."
                )

    def _claim(self, about: dict) -> None:
        """Mark the folder as this study's, or refuse it if it is another's."""
        file = self.folder / "study.json"
        if file.exists():
            known = json.loads(file.read_text(encoding="utf-8"))
            changed = sorted(key for key in (known.keys() | about.keys()) - {"notes"} if known.get(key) != about.get(key))
            if changed:
                self.close()
                raise SweepError(
                    f"{self.folder} belongs to another study: it differs in {', '.join(changed)}. "
                    "Nothing in it was touched. Give another folder, or the study it was made with."
                )
            if known == about:
                return
        self._write(file, lambda to: to.write_text(json.dumps(about, indent=1), encoding="utf-8"))

    def _hold(self) -> int | None:
        if fcntl is None:
            return None
        lock = os.open(self.folder / "lock", os.O_CREAT | os.O_RDWR)
        try:
            fcntl.flock(lock, fcntl.LOCK_EX | fcntl.LOCK_NB)
        except OSError:
            os.close(lock)
            raise SweepError(
                f"Another sweep is writing to {self.folder} just now. Wait for it, or give another folder."
            ) from None
        return lock

    def _write(self, file: Path, write) -> None:
        new = file.with_name(file.name + ".new")

        def whole() -> None:
            file.parent.mkdir(parents=True, exist_ok=True)
            write(new)
            with open(new, "rb+") as handle:
                os.fsync(handle.fileno())
            os.replace(new, file)

        try:
            self._writing(f"writing {file.name}", whole)
        finally:
            new.unlink(missing_ok=True)

    def _writing(self, what: str, action) -> None:
        try:
            action()
        except OSError as error:
            finished = len(getattr(self, "rows", ()))
            raise SweepError(
                f"{self.folder}: {what} failed ({error.strerror or error}). {finished} finished runs are kept there. "
                "Put it right (is the disk full?) and give the same command again: it goes on where it was."
            ) from error


def rows_in(folder: Path) -> dict[str, Row]:
    """All finished rows in a sweep's folder, by key."""
    found: dict[str, Row] = {}
    for file in [folder / "runs.parquet", *sorted((folder / "parts").glob("*.parquet"))]:
        try:
            rows = pq.read_table(file).to_pylist()
        except (pa.ArrowInvalid, OSError):  # not there, or torn by a power cut: such runs are made again
            continue
        for row in rows:
            row.pop("run", None)
            found[row["key"]] = row
    return found


def _filled(rows: list[Row]) -> list[Row]:
    """Rows with the same columns each, for the columns of a table are those of its first row."""
    columns = {name: None for row in rows for name in row}
    return [{**columns, **row} for row in rows]
