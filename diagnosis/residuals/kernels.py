"""The loops of loops.py, compiled together with the laws."""

from __future__ import annotations

from functools import cache
from pathlib import Path
from types import SimpleNamespace

from selflock.fmus.laws import in_force
from selflock.master.compiled import compiled_loops


def kernels() -> SimpleNamespace:
    """All loops by name, with the laws in force, compiled on first use; what numba compiled once is kept in the user's cache."""
    return _kernels(in_force())


@cache
def _kernels(package: str) -> SimpleNamespace:
    return SimpleNamespace(**compiled_loops(Path(__file__).with_name("loops.py")))
