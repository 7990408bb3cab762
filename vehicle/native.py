"""The vehicle in the master's compiled loop: its step, what goes in and what comes out, as C functions on addresses."""

from __future__ import annotations

from collections.abc import Callable
from functools import cache

from numba import typeof, types

from ..master.addresses import entry
from ..master.native import Exchange, Native
from . import kernel
from .model import Model

PLACE, NUMBER, STATUS = types.int64, types.float64, types.int64
EXCHANGE = STATUS(PLACE, PLACE, PLACE, PLACE)
STEP = STATUS(PLACE, NUMBER, NUMBER, types.int32)


@cache
def _entries() -> tuple[int, int, int]:
    """Addresses of what sets, gets and steps."""
    return entry(kernel.set_inputs, EXCHANGE), entry(kernel.get_outputs, EXCHANGE), entry(kernel.do_step, STEP)


def native(model: Model, given: tuple, taken: tuple, finish: Callable, fail: Callable) -> Native | None:
    """What the compiled loop needs of a model. given, taken: a buffer of numbers, and their places in its inputs or outputs, uint32.

    None where pymunk's memory is not known, or an array is not what the kernel takes it for.
    """
    if not model.layout or typeof(model.arrays).types != kernel.ARRAYS:
        return None
    put, get, step = _entries()
    at = lambda array: array.ctypes.data
    exchange = lambda name, function, numbers, places: Exchange(name, function, at(places), len(places), at(numbers), ())
    writes = (exchange("inputs", put, *given),) if len(given[1]) else ()
    return Native(at(model.head), step, 0, writes, (exchange("outputs", get, *taken),), finish, fail)
