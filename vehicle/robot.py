"""The tracked robot as a part that the master couples."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any, NoReturn

import numpy as np

from ..master.errors import DescriptionError, PartFailed
from ..master.face import Part
from . import munk
from .drawing import drawing
from .model import Geometry, Model
from .parameters import INPUTS, VARIABLES, checked
from .posture import posture
from .tables import OUTPUTS

if TYPE_CHECKING:
    from ..master.about import Drawing
    from ..master.native import Native


class Robot(Part):
    """A robot with tracks around front and rear holders that turn about the chassis, seen from the side.

    One planar holder stands for the left and the right one: torques go in for one side and count twice.
    Parameters may be given by name: `Robot("robot", track="belt", ground="slope:20")`.
    A step of any size is divided into equal inner steps not longer than `inner_step`; torques are held over it.
    Rolling back is exact where pymunk's memory could be read (see munk.py); `can_roll_back` says so.
    """

    described = tuple(VARIABLES.values())

    def __init__(self, name: str = "robot", **settings: Any):
        super().__init__(name)
        self.log: list[str] = []
        self.can_roll_back = munk.layout() is not None
        self._settings = settings
        self._in, self._out = np.zeros(0, np.uint32), np.zeros(0, np.uint32)
        self.reset()

    def reset(self) -> None:
        self.log.clear()
        self.values = {v.name: v.start for v in VARIABLES.values() if v.causality in ("parameter", "input")}
        self._model: Model | None = None
        self._running = False
        for name, value in self._settings.items():
            self.set(name, value)

    @property
    def model(self) -> Model:
        """The vehicle built from the parameters and settled on its ground; built when first asked for."""
        if self._model is None:
            model = Model(self.values)
            model.inputs[: len(INPUTS)] = [self.values[name] for name in INPUTS]
            model.settle(self.values["settling_time"])
            if not model.sound():
                raise DescriptionError(
                    f"{self.name}: the robot does not come to rest on its ground; a shorter inner_step, softer contacts "
                    "or another start_x may help."
                )
            model.tell()
            self._model = model
        return self._model

    def bind(self, inputs: Sequence[str], outputs: Sequence[str]) -> None:
        for name in (*inputs, *outputs):
            if name not in INPUTS and name not in OUTPUTS:
                raise DescriptionError(f"{self.name}: there is no input or output {name!r}.")
        self._in = np.array([INPUTS.index(name) for name in inputs], np.uint32)
        self._out = np.array([OUTPUTS.index(name) for name in outputs], np.uint32)
        self.u, self.y = np.array([self.values[name] for name in inputs], float), np.zeros(len(outputs))

    def set(self, name: str, value: Any) -> None:
        value = checked(self.name, name, value)
        if name in INPUTS:
            if self._model is not None:
                self._model.inputs[INPUTS.index(name)] = value
        elif self._running:
            raise DescriptionError(f"{self.name}.{name} is a parameter and can be set only before the start.")
        if not self._running:
            self._model = None if name not in INPUTS or name == "sprocket_speed" else self._model
        self.values[name] = value

    def get(self, name: str) -> Any:
        if name == "sprocket_radius":
            return Geometry(self.values).pitch_radius
        if name in OUTPUTS:
            return float(self.model.outputs[OUTPUTS.index(name)])
        if name in INPUTS and self._model is not None:
            return float(self._model.inputs[INPUTS.index(name)])
        if name not in self.values:
            raise DescriptionError(f"{self.name}: there is no variable {name!r}.")
        return self.values[name]

    def exit_initialization(self) -> None:
        self.model.tell()
        self._running = True

    def write(self) -> None:
        if self._running:
            self.model.inputs[self._in] = self.u
        else:
            for place, value in zip(self._in, self.u):
                if value != self.values[INPUTS[place]]:
                    self.set(INPUTS[place], float(value))

    def read(self) -> None:
        self.y[:] = self.model.outputs[self._out]

    def step(self, time: float, size: float) -> None:
        if not size > 0.0:
            raise DescriptionError(f"{self.name}: a step of {size!r} s cannot be made; give a positive one.")
        if not self.model.advance(size):
            self._fail(time, size)

    def native(self) -> Native | None:
        if not self._running:
            return None
        from .native import native

        finish = lambda status, time, size: self._fail(time, size)
        return native(self.model, (self.u, self._in), (self.y, self._out), finish, self._never)

    def _never(self, status: int, what: str, time: float, size: float) -> NoReturn:
        raise AssertionError(f"{self.name}: {what} always go.")

    def _fail(self, time: float, size: float) -> NoReturn:
        """Why a step was not made, or went wrong."""
        if wrong := self.model.too_long(size):
            raise DescriptionError(f"{self.name}: {wrong}.")
        inputs = {name: float(value) for name, value in zip(INPUTS, self.model.inputs)}
        if np.isfinite(list(inputs.values())).all():
            self.log.append(
                f"the bodies' positions or speeds are no longer sane (inner step {self.model.constants['dt'][0]:.3g} s)"
            )
            hint = "a shorter inner_step or communication step, softer contacts or guides, a softer drive shaft or less torque."
        else:
            self.log.append("an input is not finite")
            hint = "find the part whose output is not finite."
        raise PartFailed(self.name, time, size, "error", inputs, self.log, hint)

    def posture(self) -> dict[str, np.ndarray]:
        """Polylines of shape (points, 2) in m to draw the robot with: chassis, holders, tracks, wheels, ground."""
        return posture(self.model)

    def drawing(self) -> Drawing:
        """Shapes that its outputs move, on its ground."""
        return drawing(self.values)

    def save(self) -> Any:
        if not self.can_roll_back:
            raise DescriptionError(
                f"{self.name} cannot be saved: pymunk's memory has another layout than expected. Run without rollback."
            )
        return self.model.save()

    def restore(self, state: Any) -> None:
        self.model.restore(state)
        self.model.tell()

    @staticmethod
    def pack(out: Path, **starts: Any) -> Path:
        """Robot.fmu in the folder `out`: the same vehicle for other hosts."""
        from .robot_fmu import build

        return build(out, **starts)

    def close(self) -> None:
        self._model = None
