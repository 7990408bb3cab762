"""The loops of loops.py, compiled together with the laws."""

from __future__ import annotations

from functools import cache
from pathlib import Path
from types import SimpleNamespace

from selflock.master.compiled import compiled_loops


@cache
def kernels() -> SimpleNamespace:
    """All loops by name, compiled on first use; what numba compiled once is kept in the user's cache."""
    return SimpleNamespace(**compiled_loops(Path(__file__).with_name("loops.py")))
