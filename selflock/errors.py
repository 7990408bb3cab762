"""All errors that selflock raises for a user's mistake; the tree stands in selflock.fmus.errors."""

from __future__ import annotations

from importlib import import_module
from typing import TYPE_CHECKING, Any

from selflock.fmus.errors import BuildError, SelflockError

if TYPE_CHECKING:
    from selflock.diagnosis.errors import DataError
    from selflock.master.errors import DescriptionError, PartFailed, ResultError
    from selflock.sweep.errors import SweepError

__all__ = ["BuildError", "DataError", "DescriptionError", "PartFailed", "ResultError", "SelflockError", "SweepError"]

_FROM = {
    "DataError": "diagnosis",
    "DescriptionError": "master",
    "PartFailed": "master",
    "ResultError": "master",
    "SweepError": "sweep",
}


def __getattr__(name: str) -> Any:
    if name in _FROM:
        return getattr(import_module(f"selflock.{_FROM[name]}.errors"), name)
    raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
