"""The master: couples FMI 2.0 co-simulation FMUs and in-process parts.

import master
result = master.run("robot.toml", settings={"rear_reducer.friction_kinetic": 0.02}, out="robot.parquet")
print(result.summary())
"""

from master.errors import DescriptionError, PartFailed, ResultError
from master.results import Result, read
from master.simulation import run
from master.system import Bond, Component, Connection, Fault, Run, System, from_dict, load

__all__ = [
    "Bond", "Component", "Connection", "DescriptionError", "Fault", "PartFailed", "Result", "ResultError", "Run", "System",
    "from_dict", "load", "read", "run",
]  # fmt: skip
