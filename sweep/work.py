"""Making runs, wherever: what a worker is given, what it gives back.

What every run needs (the context) is pickled once, named by its content and handed to each worker once; it is opened
there at its first use and closed with the worker.
"""

from __future__ import annotations

import hashlib
import importlib.metadata
import importlib.util
import pickle
import platform
import threading
import time
from collections.abc import Callable
from functools import cache
from pathlib import Path
from typing import Any, NamedTuple

from selflock.fmus.errors import SelflockError
from selflock.master.files import FULL

from .errors import SweepError

NUMBERS = ("numpy", "scipy", "pymunk", "numba", "pandas", "pyarrow")  # libraries that the bits of a result depend on


RUNS = tuple(f"selflock.{room}" for room in ("fmus", "master", "vehicle", "study"))
"""The packages that decide what a run of a system gives."""


class Outcome(NamedTuple):
    """What became of one run."""

    reason: str | None  # None: it went well
    figures: dict[str, Any]
    files: dict[str, bytes]


class Parcel:
    """A pickled context, opened where it is used."""

    def __init__(self, context: Any):
        content = pickle.dumps(context)
        self.__setstate__(("selflock-" + hashlib.sha256(content).hexdigest()[:32], content))

    def __getstate__(self) -> tuple:
        return self.name, self.content

    def __setstate__(self, state: tuple) -> None:
        self.name, self.content = state
        self.context: Any = None
        self.is_open, self.lock = False, threading.Lock()

    def open(self, folder: str | Path) -> Any:
        with self.lock:
            if not self.is_open:
                self.context = pickle.loads(self.content)
                if hasattr(self.context, "open"):
                    self.context.open(Path(folder))
                self.is_open = True
        return self.context

    def close(self) -> None:
        with self.lock:
            if self.is_open and hasattr(self.context, "close"):
                self.context.close()
            self.context, self.is_open = None, False


def work(function: Callable, context: Any, items: list) -> tuple[list[Outcome], float]:
    """Make some runs; gives what became of each, and the time it took in s."""
    begin = time.perf_counter()
    return [_one(function, context, item) for item in items], time.perf_counter() - begin


def _one(function: Callable, context: Any, item: Any) -> Outcome:
    try:
        result = function(context, item)
    except SelflockError as error:
        return Outcome(str(error), {}, {})
    except Exception as error:
        if isinstance(error, OSError) and error.errno in FULL:  # no fault of the run
            raise SweepError(
                f"The disk of worker {platform.node()} is full ({error}). Make room and give the same command again."
            ) from error
        return Outcome(f"{type(error).__name__}: {error}", {}, {})
    figures, files = result if isinstance(result, tuple) else (result, {})
    return Outcome(None, {name: value.item() if hasattr(value, "item") else value for name, value in figures.items()}, files)


@cache
def fingerprint(*packages: str) -> dict[str, str]:
    """What the bits of a result depend on: the sources, the interpreter, the numeric libraries."""
    sources = hashlib.sha256()
    for package in packages:
        spec = None if package == "__main__" else importlib.util.find_spec(package)
        if spec is None or spec.origin is None:  # a script's own functions, which travel with it
            continue
        files = Path(spec.origin).parent.rglob("*.py") if spec.submodule_search_locations else [Path(spec.origin)]
        for file in sorted(files):
            sources.update(file.name.encode() + b"\0" + file.read_bytes())
    versions = {name: importlib.metadata.version(name) for name in NUMBERS}
    return {
        "sources": sources.hexdigest()[:16],
        "python": platform.python_version(),
        "machine": platform.machine(),
        **versions,
    }
