"""The state of a run in a file beside its results, `x.csv.state`, from which `--resume` goes on to the same bits.

It holds what decides all that comes: the state of each part as it puts it into bytes, the numbers that pass between parts,
energies counted, and which rows are in the file of results. No code is in it, and none is run of it.
"""

from __future__ import annotations

import hashlib
import io
import json
import os
import time as clock
from collections.abc import Iterator
from dataclasses import asdict
from importlib.metadata import version
from pathlib import Path
from typing import TYPE_CHECKING, Any
from zipfile import BadZipFile

import numpy as np

from ..fmus.cache import sha256
from .errors import DescriptionError, ResultError
from .files import File, Mark
from .folder import is_fmu, packed
from .stops import held

if TYPE_CHECKING:
    from .running import Running

EVERY = 5.0  # s of wall time between two states
SEAT = ("u", "out", "shown", "before", "origin")  # numbers that pass between parts
SEEN = ("least", "greatest", "last", "integral")
SOURCES = (".fmu", ".toml", ".csv", ".parquet")  # files that decide a run


class States:
    """Saves the state of a run now and then; knows the one that another process has left."""

    def __init__(self, path: Path, identity: str):
        self.path = path.with_name(path.name + ".state")
        self.identity = identity
        self.time: float | None = None  # of the state that is in the file, s
        self._next = clock.monotonic() + EVERY
        self.found = self._found(path)

    @property
    def mark(self) -> Mark | None:
        """How far the file of results was, where there is a state to go on from."""
        return None if self.found is None else Mark(*json.loads(bytes(self.found["head"]))["mark"])

    def _found(self, results: Path) -> dict[str, np.ndarray] | None:
        try:
            with np.load(io.BytesIO(self.path.read_bytes()), allow_pickle=False) as file:
                found = dict(file)
            head = json.loads(bytes(found["head"]))
        except FileNotFoundError:
            return None
        except (OSError, ValueError, KeyError, EOFError, BadZipFile) as error:
            raise ResultError(f"{self.path} is no saved state of a run ({error}). Remove it to begin anew.") from None
        if head["identity"] != self.identity:
            raise ResultError(
                f"{self.path} is the state of another run: its system, settings, files or version differ from what is asked for. "
                f"Give another place for the results, or remove it to begin anew; {results} was not touched."
            )
        self.time = head["time"]
        return found

    def due(self) -> bool:
        return clock.monotonic() >= self._next

    def write(self, running: Running) -> None:
        """The state at this communication point."""
        sink = running.sink
        assert isinstance(sink, File)
        with held():
            sink.save()
            named = dict(_numbers(running)) | {"block": sink.block[: sink.fill]}
            for seat in running.seats:
                named[f"part {seat.name}"] = np.frombuffer(seat.part.freeze(), np.uint8)
            head = {
                "identity": self.identity,
                "time": running.time,
                "index": running.index,
                "mark": sink.mark,
                "words": sink.words,
                "met": [watch.met for watch in sink.seen.watches],
            }
            named["head"] = np.frombuffer(json.dumps(head).encode(), np.uint8)
            packed = io.BytesIO()
            np.savez(packed, **named)  # type: ignore[arg-type]
            new = self.path.with_name(self.path.name + ".new")
            try:
                new.write_bytes(packed.getbuffer())
                os.replace(new, self.path)
            except OSError as error:
                new.unlink(missing_ok=True)
                raise ResultError(f"{self.path} cannot be written: {error.strerror}. The results so far are kept.") from None
            self.time = running.time
        self._next = clock.monotonic() + EVERY

    def restore(self, running: Running) -> None:
        """Bring a run that is initialized to the state that was found."""
        assert self.found is not None
        sink, found = running.sink, self.found
        assert isinstance(sink, File)
        head = json.loads(bytes(found["head"]))
        for seat in running.seats:
            seat.part.thaw(bytes(found[f"part {seat.name}"]))
        for name, array in _numbers(running):
            array[...] = found[name]
        fill = len(found["block"])
        sink.block[:fill] = found["block"]
        sink.words = head["words"]
        sink.resumed(fill)
        if np.isfinite(found["before"]).any():  # a block was full
            sink.seen.known(found["before"])
        for watch, met in zip(sink.seen.watches, head["met"]):
            watch.met = met
        running.index, running.time = head["index"], head["time"]
        self.found = None

    def forget(self) -> None:
        """The run is at its end."""
        self.path.unlink(missing_ok=True)


def _numbers(running: Running) -> Iterator[tuple[str, np.ndarray]]:
    """All numbers of a run beside its parts' own, by name, in place."""
    for seat in running.seats:
        for name in SEAT:
            yield f"{name} {seat.name}", np.asarray(getattr(seat, name))
        for k, port in enumerate(seat.ports):
            yield f"port {k} {seat.name}", np.asarray(port.state)
    assert running.coupling is not None  # it has been started
    for k, values in enumerate(running.coupling.numbers):
        yield f"circle {k}", values
    seen = running.sink.seen
    for name in SEEN:
        yield name, getattr(seen, name)
    yield "before", seen.before


def check(running: Running) -> None:
    """Refuse a run that cannot be gone on with, before anything is written."""
    system = running.system
    why = [f"{name} cannot save its state in bytes" for name, part in running.wiring.parts.items() if not part.can_freeze]
    for fault in system.faults:
        if fault.kind in ("noise", "delay") or (fault.kind == "stuck" and fault.value is None):
            why.append(f"the fault of {fault.variable}, {fault.kind}, remembers what was before")
    if system.run.step_control:
        why.append("a step that follows the error is not saved")
    if why:
        raise DescriptionError(f"--resume: this run cannot be gone on with: {'; '.join(why)}. Run it without --resume.")


def identity(running: Running, settings: Any, stop: float) -> str:
    """What makes a run this run: system, settings, the content of its files, the version."""
    system = running.system
    told = {**asdict(system), "folder": None, "allow_code": None, "unlimited": None, "notes": None}
    files: dict[str, str] = {}
    for component in system.components.values():
        names = [component.fmu, component.manoeuvre, *map(str, component.options.values())]
        for name in filter(None, names):
            path = system.folder / name
            if path.is_file() and name.lower().endswith(SOURCES) or is_fmu(path):
                files[name] = sha256(packed(path))
    whole = [told, settings, stop, files, version("selflock")]
    return hashlib.sha256(json.dumps(whole, default=str, sort_keys=True).encode()).hexdigest()
