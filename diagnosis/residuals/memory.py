"""What was computed and may be asked for again, as far as memory goes."""

from __future__ import annotations

import ctypes
import sys
from collections.abc import Callable, Hashable
from typing import Any


def kept(found: dict, key: Hashable, make: Callable[[], Any], most: int) -> Any:
    """What `make` gives, remembered in `found` with the `most` that were asked for last; with most < 1 it is not.

    Threads may share `found`: at worst something is made twice.
    """
    known = found.pop(key, None)
    if known is None:
        known = make()
    if most >= 1:
        for old in [*found][: max(0, len(found) + 1 - most)]:
            found.pop(old, None)
        found[key] = known
    return known


def give_back() -> None:
    """What is free goes back to the system: the C library of Linux keeps arrays of an hour, in holes among those that are held."""
    trim = getattr(ctypes.CDLL(None), "malloc_trim", None) if sys.platform == "linux" else None  # not every one has it
    if trim is not None:
        trim(0)
