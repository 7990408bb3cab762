"""What an FMU offers to be stepped in the compiled loop: the addresses of its C functions and of what they work on.

Whoever gives a `Native` (Part.native) promises:

- All addresses stay valid, and mean the same, as long as the part is bound and open.
- A step from t by h is: the `writes` in their order, one call do_step(instance, t, h, free), the `reads` in their
  order, each call answered with an fmi2Status. Nothing else is needed, and nothing in between.
- Reals are exchanged with `u` and `y` themselves. Integers and Booleans lie in a buffer of C ints; `copies` says which
  place of `u` or `y` belongs to which of them: converted before a write, after a read.
- The loop goes on after OK and Warning. Any other status is handed back: `finish` brings a step to its end or raises
  PartFailed, `fail` raises PartFailed for an exchange.

- An Integer beyond 32 bits is handed back with the status BEYOND before the call.
- An FMU of FMI 3.0 exchanges Float64 alone, scalars. Where a step tells of an event, an end or an early return, it is handed back
  with the status MORE, what was told lying at `told`.

The loop promises to call from one thread at a time, and between initialization and termination only.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import NoReturn

MORE = 9  # no status either: a step of FMI 3.0 told of an event, an end or an early return
BEYOND = 7  # no fmi2Status: a number for an Integer that none can hold


@dataclass(frozen=True, slots=True)
class Exchange:
    """One call function(instance, references, count, values): fmi2SetXxx or fmi2GetXxx of variables of one type."""

    name: str  # such as fmi2SetReal
    function: int
    references: int  # of `count` uint32
    count: int
    values: int  # of `count` doubles, which lie in `u` or `y`, or of `count` C ints
    copies: tuple[tuple[int, int], ...]  # (place in `u` or `y`, address of the C int); empty where the values lie there


@dataclass(frozen=True, slots=True)
class Native:
    """An instance of an FMU for co-simulation, 2.0 or 3.0, as addresses; see the module's text."""

    instance: int
    do_step: int
    free: int  # fmi2DoStep's noSetFMUStatePriorToCurrentPoint
    writes: tuple[Exchange, ...]
    reads: tuple[Exchange, ...]
    finish: Callable[[int, float, float], None]  # (status of do_step, time, size)
    fail: Callable[[int, str, float, float], NoReturn]  # (status, name of the exchange, time, size)
    python: bool = False  # its calls need Python's lock, which may be held over many of them
    told: int = (
        0  # of FMI 3.0: where fmi3DoStep tells of an event, an end, an early return (a byte each), and 8 bytes on how far it went
    )
