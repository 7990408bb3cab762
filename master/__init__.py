"""The master: couples FMUs (FMI 1.0 to 3.0, co-simulation and model exchange) and in-process parts.

from selflock import master
result = master.run("robot.toml", settings={"rear_reducer.friction_kinetic": 0.02}, out="robot.parquet")
print(result.summary())
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from selflock.rooms import offered

if TYPE_CHECKING:
    from .errors import DescriptionError, PartFailed, ResultError, RunInterrupted, SessionError, TimeUp
    from .face import Part, Variable
    from .files import read
    from .function import part
    from .live import Session, session
    from .opening import system_of as load
    from .results import Result
    from .simulation import run
    from .system import Bond, Component, Connection, Fault, Run, System, from_dict

__all__ = [
    "Bond", "Component", "Connection", "DescriptionError", "Fault", "RunInterrupted", "Part", "PartFailed", "Result", "ResultError",
    "Run", "Session", "SessionError", "System", "TimeUp", "Variable", "from_dict", "load", "part", "read", "run", "session",
]  # fmt: skip

__getattr__, __dir__ = offered(__name__)  # an FMU's own process needs no tables
