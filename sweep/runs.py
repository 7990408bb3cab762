"""Runs of a system, one after the other on one worker: FMUs by content, unpacked once, reset between runs."""

from __future__ import annotations

import copy
import hashlib
import io
import math
import threading
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq

from selflock import master
from selflock.master.face import Part
from selflock.master.system import System
from selflock.master.values import given
from selflock.master.wiring import fmu_path

from .errors import SweepError
from .record import SLACK, Figure, figures
from .store import digest


class Bench:
    """All that the runs of one study have in common. Travels to each worker once, with its FMUs' bytes in it."""

    def __init__(self, system: System, record: list[Figure], stop: float | None = None, table: bool = False):
        self.system, self.record, self.stop, self.table = copy.deepcopy(system), record, stop, table
        self.fmus: dict[str, bytes] = {}  # and manoeuvres, by the name of the file that they become
        self.versions: dict[str, str] = {}  # component → SHA-256 of its FMU
        for name, component in self.system.components.items():
            if component.fmu:
                content = fmu_path(component, system).read_bytes()
                self.versions[name] = hashlib.sha256(content).hexdigest()
                component.fmu = f"{self.versions[name][:16]}.fmu"
                self.fmus[component.fmu] = content
            elif component.manoeuvre:
                path = system.folder / component.manoeuvre
                content = path.read_bytes()
                self.versions[name] = hashlib.sha256(content).hexdigest()
                component.manoeuvre = f"{self.versions[name][:16]}{path.suffix}"
                self.fmus[component.manoeuvre] = content
        self.system.folder = Path(".")
        if not table:  # only what the figures need
            self.system.run.record = sorted({column for one in record for column in one.columns})

    def open(self, folder: Path) -> None:
        for name, content in self.fmus.items():
            (folder / name).write_bytes(content)
        self.system.folder = folder
        self._threads = threading.local()
        self._all: list[dict[str, Part]] = []

    def close(self) -> None:
        for parts in self._all:
            while parts:
                parts.popitem()[1].close()
        for name in self.fmus:
            (self.system.folder / name).unlink(missing_ok=True)

    @property
    def parts(self) -> dict[str, Part]:
        """The parts that this thread keeps from run to run."""
        if not hasattr(self._threads, "parts"):
            self._threads.parts = {}
            self._all.append(self._threads.parts)
        return self._threads.parts


def adapt(system: System, settings: dict[str, Any]) -> tuple[System, dict[str, Any]]:
    """The system with the settings of its values and connections, "connections.TARGET.factor", and the other settings."""
    system, settings = given(system, settings)
    wires = {name: value for name, value in settings.items() if name.startswith("connections.")}
    connections = dict(system.connections)
    for name, value in wires.items():
        target, _, key = name.removeprefix("connections.").rpartition(".")
        if target not in connections or key not in ("factor", "offset"):
            raise SweepError(f"{name}: there is no such connection; write connections.component.input.factor, or .offset.")
        change: dict[str, Any] = {key: float(value)}
        connections[target] = replace(connections[target], **change)
    return replace(system, connections=connections), {name: value for name, value in settings.items() if name not in wires}


def run_one(bench: Bench, item: dict[str, Any]) -> tuple[dict[str, Any], dict[str, bytes]]:
    """One run: its figures, and its table where that is wanted."""
    try:
        system, settings = adapt(bench.system, item["settings"])
        every = system.run.every
        system = replace(system, run=replace(system.run, interval=0.0))  # figures are of all steps, whatever rows are kept
        result = master.run(system, settings=settings, stop=bench.stop, keep=bench.parts)
    except master.PartFailed as error:
        raise SweepError(str(error).partition("\n  the results until")[0]) from error
    for name, end in result.ended.items():
        late = [one.name for one in bench.record if one.kind != "value" and end + SLACK < one.end < math.inf]
        if late:
            raise SweepError(f"{name} ended the run itself at t = {end:.9g} s, before the window of {late[0]} is over.")
    row = figures(bench.record, result.table, item["parameters"])
    if not bench.table:
        return row, {}
    name = f"tables/{digest(item)[:16]}.parquet"
    return {**row, "table": name}, {name: _parquet(result, every)}


def _parquet(result: master.Result, every: int) -> bytes:
    """The run's table as the master writes it, each `every`th row and the last, units in the metadata."""
    rows = np.arange(len(result.table))
    kept = result.table[(rows % every == 0) | (rows == len(rows) - 1)]
    table = pa.Table.from_pandas(kept, preserve_index=False).replace_schema_metadata(None)
    fields = [field.with_metadata({"unit": result.units.get(field.name, "")}) for field in table.schema]
    buffer = io.BytesIO()
    pq.write_table(table.cast(pa.schema(fields)), buffer)
    return buffer.getvalue()
