"""FMUs of ours in this process, stepped by their compiled laws: the same numbers to the bit, without Python in a step.

An FMU of ours runs its law, a pure function on floats, as Python. Where its sources are those of this package, the master has
that very function compiled (compiled.py). While a run goes on it offers these to the FMUs (`sys._selflock_twins`, of which
Slave.door and loader/door.c know); whatever is not a plain step is still the FMU's own, and so is a step that fails.

Each twin is held against its FMU's law once, from where that stands: where one bit differs, it is not used.
"""

from __future__ import annotations

import ctypes
import logging
import sys
from array import array
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from functools import cache
from pathlib import Path
from typing import Any

from numba import types

from selflock.fmus import build
from selflock.fmus.laws import in_force

from .addresses import entry
from .compiled import compiled_loops

log = logging.getLogger(__name__)

SIGNATURE = types.int64(types.int64, types.int64, types.int64, types.float64, types.int64, types.int64)
LOOPS = {  # by an FMU's name, and the function that it steps with
    ("Controller", "advance"): "controller",
    ("Load", "advance"): "load_",
    ("Motor", "advance"): "motor",
    ("Reducer", "_dynamic"): "reducer_dynamic",
    ("Reducer", "_kinematic"): "reducer_kinematic",
    ("Sensor", "advance"): "sensor_",
}
PROBE = tuple((size, part) for size in (1e-3, 2.5e-4, 0.02) for part in (0.0, 1.0, -1.0, 0.1))  # steps, s, and how inputs change
OUTPUTS = 64  # at most
KNOWN = 4096  # parameters that were held against each other
Twin = tuple[array, int, int, int, int]


@contextmanager
def offered() -> Iterator[None]:
    """While this lasts, FMUs of ours in this process are stepped by their compiled laws."""
    before = sys.__dict__.get("_selflock_twins")
    sys.__dict__["_selflock_twins"] = _twin
    try:
        yield
    finally:
        sys.__dict__["_selflock_twins"] = before


def _twin(laws: str, advance: Callable, parameters: tuple, state: tuple, inputs: Sequence[float]) -> Twin | None:
    """What Slave.door tells of a compiled law; None where there is none, or it is not the same."""
    name = _faces(in_force()).get(laws)
    loop = LOOPS.get((name or "", advance.__name__))
    if loop is None:
        return None
    function = _address(in_force(), loop)
    asked = function, parameters
    if asked not in _same:
        while len(_same) >= KNOWN:
            _same.pop(next(iter(_same)))
        _same[asked] = _agree(function, advance, parameters, state, inputs)
        if not _same[asked]:
            log.warning("%s: its law, compiled, gives other numbers here than as Python; it is stepped as it is", name)
    if not _same[asked]:
        return None
    kept = array("d", [*parameters, *state])
    place = kept.buffer_info()[0]
    return kept, function, place, place + kept.itemsize * len(parameters), len(state)


_same: dict[tuple[int, tuple], bool] = {}


def _agree(function: int, advance: Callable, parameters: tuple, state: tuple, inputs: Sequence[float]) -> bool:
    """Whether some steps from here, with inputs as they are and others, give the same bits."""
    compiled = ctypes.CFUNCTYPE(ctypes.c_int, *[ctypes.c_void_p] * 3, ctypes.c_double, *[ctypes.c_void_p] * 2)(function)
    at = lambda numbers: numbers.buffer_info()[0]
    p, s, to, out = (array("d", numbers) for numbers in (parameters, state, state, [0.0] * OUTPUTS))
    for size, part in PROBE:
        u = array("d", [x + part * (1.0 + abs(x)) for x in inputs])
        try:
            state, values = advance(parameters, state, *u, size)
        except Exception:  # what fails as Python is made again as Python
            continue
        if compiled(at(p), at(s), at(u), size, at(to), at(out)) != 1:
            return False
        if to.tobytes() + out[: len(values)].tobytes() != array("d", [*state, *values]).tobytes():
            return False
        s[:] = to
    return True


@cache
def _faces(package: str) -> dict[str, str]:
    """The names of our FMUs by what their sources are, with the laws in force."""
    return {build.laws_of(build.sources_of(build.face_of(name))): name for name in build.FACES}


@cache
def _loops(package: str) -> dict[str, Any]:
    return compiled_loops(Path(__file__).with_name("twin_laws.py"))


@cache
def _address(package: str, loop: str) -> int:
    """Where the machine code of a loop begins, as C calls it."""
    return entry(_loops(package)[loop], SIGNATURE)
