"""The master: couples FMUs (FMI 1.0 to 3.0, co-simulation and model exchange) and in-process parts.

from selflock import master
result = master.run("robot.toml", settings={"rear_reducer.friction_kinetic": 0.02}, out="robot.parquet")
print(result.summary())
"""

from __future__ import annotations

from importlib import import_module
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from .errors import DescriptionError, PartFailed, ResultError, RunInterrupted, SessionError, TimeUp
    from .face import Part, Variable
    from .files import read
    from .function import part
    from .live import Session, session
    from .results import Result
    from .simulation import run
    from .ssp.structure import system_of as load
    from .system import Bond, Component, Connection, Fault, Run, System, from_dict

__all__ = [
    "Bond", "Component", "Connection", "DescriptionError", "Fault", "RunInterrupted", "Part", "PartFailed", "Result", "ResultError",
    "Run", "Session", "SessionError", "System", "TimeUp", "Variable", "from_dict", "load", "part", "read", "run", "session",
]  # fmt: skip

_FROM = {
    "errors": ("DescriptionError", "PartFailed", "ResultError", "RunInterrupted", "SessionError", "TimeUp"),
    "face": ("Part", "Variable"),
    "files": ("read",),
    "function": ("part",),
    "live": ("Session", "session"),
    "results": ("Result",),
    "simulation": ("run",),
    "ssp.structure": ("load",),
    "system": ("Bond", "Component", "Connection", "Fault", "Run", "System", "from_dict"),
}
_OTHERWISE = {"load": "system_of"}


def __getattr__(name: str) -> Any:
    """What is offered here is loaded when it is first asked for: an FMU's own process needs no tables."""
    for module, names in _FROM.items():
        if name in names:
            return globals().setdefault(name, getattr(import_module(f"{__name__}.{module}"), _OTHERWISE.get(name, name)))
    raise AttributeError(f"module {__name__!r} has no attribute {name!r}")


def __dir__() -> list[str]:
    return sorted({*globals(), *__all__})
