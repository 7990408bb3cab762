"""Python's collector of what cannot be reached any more, where there is nothing for it to find."""

from __future__ import annotations

import gc
from collections.abc import Iterator
from contextlib import contextmanager


@contextmanager
def left_alone() -> Iterator[None]:
    """The collector waits: while a thousand FMUs are made it would go through all that is made already again and again.

    That is a third of what loading them takes, and the more the more there are.
    """
    if not gc.isenabled():
        yield
        return
    gc.disable()
    try:
        yield
    finally:
        gc.enable()
