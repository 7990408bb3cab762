"""Robot.fmu: the vehicle behind the face of an FMU. The Python that runs it needs pymunk, numba and numpy.

    from .robot_fmu import build
    build("out/fmus")                                # Robot.fmu, or with other start values: build("out", track="belt")

The FMU holds the vehicle's sources as they are here, so its numbers are those of the part `selflock.vehicle.Robot` bit for
bit. Nothing but the standard library is imported before an instance is made, so that a host whose Python lacks what is needed
is told so in a sentence, and has none.
"""

from __future__ import annotations

import sys
from dataclasses import replace
from pathlib import Path
from typing import Any

from ..fmus import cache
from ..fmus.slave import TERMINATED, Slave
from . import tables

HERE = Path(__file__).parent
NOMINAL = {"N": 100.0, "N.m": 10.0}  # by unit; 1 is FMI's own, which fits the rest


class Vehicle:
    """The bodies, pins and hinges are pymunk's; what acts between them and the ground is added to it.

    Normal to the ground, with x the depth below it, x' its rate and h the depth of full damping:

        F = max(0, k x^e - c(x) x')                               (eq 23)
        c(x) = c_max (3 x^2/h^2 - 2 x^3/h^3) up to h, then c_max  (eq 24)

    Along the ground a bristle holds up to |T| = mu N and then slides. Guide and teeth are penalty springs and
    dampers between segments, holder and sprocket.

    All forces are those at the positions where the inner step arrives, x + v dt. Angles count counter-clockwise in
    the side view, x forward and y up. Torques are those of one side's drives; ground forces those of the whole robot.
    """


class RobotFmu(Slave):
    """Tracked robot with two pairs of track holders on uneven ground, seen from the side; needs pymunk, numba and numpy."""

    law = Vehicle
    inputs = tuple(replace(row, nominal=NOMINAL.get(row.unit)) for row in tables.INPUTS)
    outputs = tuple(replace(row, nominal=NOMINAL.get(row.unit)) for row in map(tables.output, tables.OUTPUTS))
    parameters = tables.PARAMETERS

    pure = False  # the vehicle is its own state

    def __init__(self, **kwargs: Any):
        super().__init__(**kwargs)
        _vehicle(self.identity)  # what is missing is told here, where a host stops: no instance

    def _fit_parameters(self) -> tuple[dict[str, Any], str]:
        return {row.name: type(row.start)(self.value(row.name)) for row in self.parameters}, ""

    def stepper(self):
        return self._step

    def begin(self, p: dict[str, Any], *inputs: float) -> Any:
        """The vehicle, settled on its ground; it is its own state and moves on in place."""
        model = _vehicle(self.identity)("robot", **p, **dict(zip((row.name for row in self.inputs), inputs))).model
        return model

    def _step(self, p: dict[str, Any], model: Any, *values: float) -> tuple[Any, list[float]]:
        model.inputs[: len(values) - 1] = values[:-1]
        if values[-1] == 0.0:
            return model, model.tell().tolist()
        if wrong := model.too_long(values[-1]):
            raise ArithmeticError(wrong)
        if not model.advance(values[-1]):
            raise ArithmeticError("bodies ran away; try a shorter step or inner_step, softer contacts or a softer drive shaft")
        return model, model.outputs.tolist()

    def _get_fmu_state(self) -> tuple:
        model = None
        if self._state is not None:
            if not self._state.exact:
                self.complain("this state cannot be saved: pymunk's memory has another layout than expected")
            else:
                memory, own, dt = self._state.save()
                model = (memory.tolist(), [array.tolist() for array in own], dt)
        return (self.identity, list(self._values), dict(self._texts), model, self._phase, self._stale, self._fault, self._unfit)

    def _is_state(self, state: Any) -> bool:
        """Memory, our own arrays, and the step of the solver."""
        return state is None or isinstance(state, (tuple, list)) and len(state) == 3 and isinstance(state[2], (int, float))

    def _set_fmu_state(self, state: tuple) -> None:
        if wrong := self._unsound(state):
            return self.complain(wrong)
        first = self._first_parameter
        same = self._state is not None and (self._values[first:], self._texts) == (list(state[1][first:]), dict(state[2]))
        _, values, texts, model, self._phase, self._stale, self._fault, self._unfit = state
        self._values, self._texts = list(values), dict(texts)
        self._plain = 0 if self._phase == TERMINATED else type(self)._plain
        self._parameters, self._advance = self._fit_parameters()[0], self._step
        if model is None:
            self._state = None
            return None
        try:
            if not same:
                self._state = self.begin(self._parameters, *self._values[: self._first_output])
            self._state.restore(model)
        except Exception as error:
            self.complain(f"the state cannot be restored: {error}")
        return None


def _vehicle(identity: str) -> type:
    """The class of the vehicle; in an FMU from a copy of its sources in the user's cache, where numba keeps what it compiles."""
    package = sys.modules[__package__]
    if identity != RobotFmu.identity and hasattr(package, "__path__"):
        package.__path__ = [str(_copied(identity))]
    try:
        from .robot import Robot as part
    except ImportError as error:
        raise ImportError(
            f"the Python that runs this FMU ({sys.executable or sys.version.split()[0]}) lacks {error.name or error}. "
            "Robot.fmu needs pymunk 7, numba and numpy there: python -m pip install 'pymunk>=7.3,<8' numba numpy"
        ) from None
    return part


def _copied(identity: str) -> Path:
    """The folder of the copy; where none can be made, the FMU's own."""
    files = {file.name: file.read_bytes() for file in HERE.glob("*.py")}
    try:
        return cache.copied(f"vehicle_{identity}", files)
    except OSError:
        return HERE


def sources() -> dict[str, bytes]:
    """The files that the FMU needs, by their path below the project."""
    from ..fmus.build import ROOT, SHARED

    names = [
        *SHARED,
        "fmus/cache.py",
        "fmus/errors.py",
        "master/addresses.py",
        "master/errors.py",
        "master/face.py",
        "master/native.py",
        *(f"vehicle/{file.name}" for file in sorted(HERE.glob("[!_]*.py"))),
    ]
    return {name: (ROOT / name).read_bytes() for name in names}


def build(out: str | Path, **starts: Any) -> Path:
    """Build Robot.fmu into the folder `out`, or as the file `out` if that ends in .fmu; `starts`: other start values."""
    from ..fmus.build import pack

    path = Path(out) if str(out).endswith(".fmu") else Path(out) / "Robot.fmu"
    return pack(RobotFmu, sources(), path, starts)
