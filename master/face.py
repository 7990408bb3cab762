"""The one face of whatever the master couples: an FMU, the vehicle, a load on a bench.

A part is described by its variables and stepped from communication point to communication point.
Numbers cross the face as float64, Booleans as 0.0 and 1.0; strings only through `set` and `get`.

Meaning of time: at a step from t to t + h a part is given its inputs as known at t. A part that is
given an angle together with its speed carries the angle on with the speed inside the step.
"""

from __future__ import annotations

import json
from collections.abc import Callable, Iterable, Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any, cast

import numpy as np

from ..fmus.variable import Variable as Variable
from .errors import DescriptionError

if TYPE_CHECKING:
    from ..fmus.units import Unit
    from .native import Native


class Part:
    """What the master couples, with defaults for all of it: a part overrides what it does otherwise.

        class Mass(Part):
            described = (
                Variable("mass", "kg", 1.0, "of what moves", minimum=0.0, causality="parameter"),
                Variable("force", "N", 0.0, "on it", causality="input"),
                Variable("speed", "m/s", 0.0, "of it", causality="output", depends_on=()),
            )
            can_roll_back = True

            def step(self, time, size):
                v = self.values
                v["speed"] += v["force"] / v["mass"] * size

    The defaults keep the numbers of a part in `values`, by name, parameters, inputs and outputs alike: `write` puts
    inputs there, `read` takes outputs from there after `compute`, `save` and `restore` copy it. Whoever keeps them
    elsewhere overrides these.

    Life: constructed · bind · set parameters and starts · enter_initialization · exit_initialization ·
    (write · step · read)* · terminate · close. `reset` returns to the state after construction.
    """

    described: Sequence[Variable] = ()  # the variables of every part of this class

    can_roll_back: bool = False  # `restore` brings all back to where `save` was called
    variable_step: bool = True  # False: steps of one size only
    frozen: bool = True  # False: what `save` gives cannot be put into bytes
    timed: bool = False  # outputs are functions of time alone: `at` tells them, it is never stepped; a class with an `at` is
    tells_ahead: bool = False  # of a part that is `timed`: `ahead` tells a stretch of time at once, of Reals
    instant: bool = True  # outputs follow inputs without a step: `probe`
    passes: bool = False  # what it gives follows from what it is given alone, at once: under Jacobi it comes last in a step
    interpolates: bool = False  # the derivatives of inputs over a step can be given with them: `tilt`
    parallel: bool = False  # `begin` starts a step that others need not wait for
    header: str = ""  # the file of whose table the outputs are columns: their units are mended there, not at connections
    lacks: Sequence[str] = ()  # what isolation, where it was asked for, could not take away
    untaken: Mapping[
        str, Any
    ] = {}  # parameters that are not what they were set to after initialization: what they are, None if unsaid
    units: Mapping[str, Unit] = {}  # what the part says itself of its units, by name; a name not here is known by everyone

    name: str  # the component's name in the system
    variables: Mapping[str, Variable]
    log: Sequence[str]  # what the part said last, newest at the end
    values: dict[str, Any]
    ends: list[tuple[str, float]]  # parts that ended the run, and when in s; one list of all parts of a run

    u: np.ndarray  # float64, inputs in the order given to bind; made by bind, then only changed in place
    y: np.ndarray  # float64, outputs in the order given to bind; likewise

    def __init_subclass__(cls, **more: Any):
        super().__init_subclass__(**more)
        if "at" in vars(cls):
            cls.timed = True

    def __init__(self, name: str, described: Iterable[Variable] = ()):
        self.name = name
        self.variables = {variable.name: variable for variable in described or self.described}
        self.log = []
        self.ends = []
        self.inputs: tuple[str, ...] = ()
        self.outputs: tuple[str, ...] = ()
        self.u, self.y = np.zeros(0), np.zeros(0)
        self.values = {variable.name: variable.start for variable in self.variables.values()}

    # --- life ----------------------------------------------------------------------------------------------------

    def bind(self, inputs: Sequence[str], outputs: Sequence[str]) -> None:
        """Say which numbers go in through `u` and come out through `y`, in this order."""
        self.inputs, self.outputs = tuple(inputs), tuple(outputs)
        self.u = np.array([float(self.get(name) or 0.0) for name in inputs], dtype=float)
        self.y = np.zeros(len(outputs))

    def enter_initialization(self, start: float, stop: float | None) -> None: ...
    def exit_initialization(self) -> None: ...
    def terminate(self) -> None: ...
    def close(self) -> None: ...

    def reset(self) -> None:
        self.values = {variable.name: variable.start for variable in self.variables.values()}

    def suits(self, given: Mapping[str, Any]) -> bool:
        """Whether the part can be reset for a run with these values, and need not be made anew."""
        return True

    # --- single values -------------------------------------------------------------------------------------------

    def set(self, name: str, value: Any) -> None:
        self._told(name)
        self.values[name] = value

    def get(self, name: str) -> Any:
        self._told(name)
        self.compute()
        return self.values[name]

    def _told(self, name: str) -> None:
        if name not in self.variables:
            raise DescriptionError(f"{self.name} has no variable {name}.")

    # --- the path of every step ----------------------------------------------------------------------------------

    def write(self) -> None:
        """u goes in."""
        self.values.update(zip(self.inputs, self.u.tolist()))

    def step(self, time: float, size: float) -> None:
        """From `time` on by `size`, in s. Raises PartFailed."""

    def read(self) -> None:
        """y comes out."""
        self.compute()
        for place, name in enumerate(self.outputs):
            self.y[place] = self.values[name]

    def compute(self) -> None:
        """Bring the outputs in `values` up to what inputs and state are now, without a step."""

    def at(self, time: float) -> None:
        """y as it is at `time`, without a step: of a part that is `timed` at any time, of others now."""
        self.read()

    def on_trial(self, begins: bool) -> None:
        """Before and after `probe` and `slopes`, once for many of them."""

    def probe(self) -> None:
        """y for u as it is now, without a step or an event; inputs on trial, for which nothing else changes. If `instant`."""
        self.write()
        self.read()

    def slopes(self, place: int) -> np.ndarray | None:
        """How y changes with the input at `place` of u, at this instant; None where the part does not tell."""
        return None

    def tilt(self, rates: Mapping[int, float]) -> None:
        """Inputs by their places in u change at these rates, per s, during the next step; after `write`. If it `interpolates`."""
        raise NotImplementedError

    def rate(self, place: int) -> float:
        """The derivative of the output at `place` of y as the part tells it at the end of a step, per s; 0 where it does not."""
        return 0.0

    def ahead(self, times: np.ndarray) -> np.ndarray:
        """What `at` would put into y at each of these times, a row each; only of a part that `tells_ahead`. y stays."""
        now, found = self.y.copy(), np.empty((len(times), len(self.y)))
        for row, time in zip(found, times.tolist()):
            self.at(time)
            row[:] = self.y
        self.y[:] = now
        return found

    def cycle(self, time: float, size: float) -> None:
        """write, step and read."""
        self.write()
        self.step(time, size)
        self.read()

    def stepper(self) -> Callable[[float, float], None]:
        """What the master calls as `cycle`, asked for once after `bind`; of a part that has looked everything up before."""
        return self.cycle

    def end(self, time: float) -> None:
        """Called by the part itself in a step: it ends the run here, regularly, with its outputs as they are at `time`."""
        self.ends.append((self.name, time))

    def begin(self, time: float, size: float) -> None:
        """Start write, step and read, which `cycle` then ends; only of a part that is `parallel`."""

    def native(self) -> Native | None:
        """What the compiled loop needs to step the part without Python; None where only Python can. See master.native."""
        return None

    # --- roll back -----------------------------------------------------------------------------------------------

    def save(self) -> Any:
        """The state, for `restore`; asked for only where `can_roll_back`."""
        return dict(self.values)

    def restore(self, state: Any) -> None:
        self.values = dict(state)

    def drawing(self) -> dict[str, Any] | None:
        """What of the part is to be seen, and which outputs move it, as `master.about.Drawing` says; None: nothing.

        Asked for after parameters are set, before the start.
        """
        return None

    @property
    def can_freeze(self) -> bool:
        """Whether `freeze` and `thaw` carry the state into another process."""
        return self.timed or (self.can_roll_back and self.frozen)

    def freeze(self) -> bytes:
        """The state in bytes, for `thaw`; asked for only where `can_freeze`, of a part that is initialized."""
        return b"" if self.timed else json.dumps(self.save(), default=lambda array: array.tolist()).encode()  # floats are exact

    def thaw(self, frozen: bytes) -> None:
        """Go on from the state of another process, in a part that is initialized as that was. Raises PartFailed."""
        if not self.timed:
            self.restore(json.loads(frozen))

    # --- elsewhere -----------------------------------------------------------------------------------------------

    @staticmethod
    def pack(out: Path, **options: Any) -> Path | None:
        """The part as an FMU in the folder `out`; None where it runs in our master only."""
        return None


def view(values: np.ndarray) -> memoryview[float]:
    """The numbers of a buffer one by one as Python floats, to read and to write: faster so than through numpy."""
    return cast("memoryview[float]", values.data)
