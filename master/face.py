"""The one face of whatever the master couples: an FMU, the vehicle, a load on a bench.

A part is described by its variables and stepped from communication point to communication point.
Numbers cross the face as float64, Booleans as 0.0 and 1.0; strings only through `set` and `get`.

Meaning of time: at a step from t to t + h a part is given its inputs as known at t. A part that is
given an angle together with its speed carries the angle on with the speed inside the step.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any, Protocol, runtime_checkable

import numpy as np

from ..fmus.variable import Variable as Variable


@runtime_checkable
class Part(Protocol):
    """What the master needs of a part.

    Life: constructed · bind · set parameters and starts · enter_initialization · exit_initialization ·
    (write · step · read)* · terminate · close. `reset` returns to the state after construction.

    A part may also have `at(time)`: then its outputs are functions of time alone; `at` fills y for any time, and
    it is never stepped. `units` may tell what its units are (as BaseUnit in FMI), `variable_step = False` that it
    takes steps of one size only, `cycle(time, size)` do write, step and read in one call,
    which `begin(time, size)` may have started before.
    """

    name: str  # the component's name in the system
    variables: dict[str, Variable]
    can_roll_back: bool
    log: Sequence[str]  # what the part said last, newest at the end

    u: np.ndarray  # float64, inputs in the order given to bind; made by bind, then only changed in place
    y: np.ndarray  # float64, outputs in the order given to bind; likewise

    def bind(self, inputs: Sequence[str], outputs: Sequence[str]) -> None: ...
    def set(self, name: str, value: Any) -> None: ...
    def get(self, name: str) -> Any: ...
    def enter_initialization(self, start: float, stop: float | None) -> None: ...
    def exit_initialization(self) -> None: ...
    def write(self) -> None: ...  # u goes in
    def read(self) -> None: ...  # y comes out
    def step(self, time: float, size: float) -> None: ...  # raises PartFailed
    def save(self) -> Any: ...
    def restore(self, state: Any) -> None: ...
    def reset(self) -> None: ...
    def terminate(self) -> None: ...
    def close(self) -> None: ...
