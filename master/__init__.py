"""The master: couples FMI 2.0 co-simulation FMUs and in-process parts.

from selflock import master
result = master.run("robot.toml", settings={"rear_reducer.friction_kinetic": 0.02}, out="robot.parquet")
print(result.summary())
"""

from .errors import DescriptionError, PartFailed, ResultError, TimeUp
from .face import Part, Variable
from .files import read
from .results import Result
from .simulation import run
from .ssp.structure import system_of as load
from .system import Bond, Component, Connection, Fault, Run, System, from_dict

__all__ = [
    "Bond", "Component", "Connection", "DescriptionError", "Fault", "Part", "PartFailed", "Result", "ResultError", "Run",
    "System", "TimeUp", "Variable", "from_dict", "load", "read", "run",
]  # fmt: skip
