"""The manoeuvre of the study (its figures 6 and 7), as exact functions of time.

10 s at constant forward speed. Angles are the holders' relative to the chassis, positive counter-clockwise in
the side view (x forward, y up); 0 points forward, pi points backward.

    0-2 s   both holders point forward                          hold A within it
    2-4 s   the rear holder turns backward over the top         lift, lower
    4-6 s   nothing turns                                       hold B
    6-8 s   both holders press down and raise the platform      raise
    8-10 s  nothing turns                                       hold C

The laws are in selflock.study.turns.
"""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np

from selflock.master.face import Part, view
from selflock.master.manoeuvre import Setpoint

from .turns import FRONT, OUTPUTS, PARAMETERS, REAR, Output, Parameters, setpoints

DURATION = 10.0  # s
COURSES = tuple(Setpoint("the study's manoeuvre", 0.0, turns) for turns in (FRONT, REAR))
"""Of the front and of the rear holder."""

# The windows in which the claims look at the curves, in s.
WINDOWS = {
    "hold A": (1.0, 2.0),
    "lift": (2.2, 2.8),
    "lower": (3.2, 3.7),
    "hold B": (5.0, 6.0),
    "raise": (6.3, 7.7),
    "hold C": (9.0, 10.0),
}


class Setpoints(Part):
    """The manoeuvre as a part without inputs: its outputs are functions of time, so it can be asked at any time.

    `front_angle`, `front_speed`, `rear_angle`, `rear_speed`: the holders' desired motion. `*_input_angle`,
    `*_input_speed`: the same on the reducers' input shafts. `sprocket_angle`, `sprocket_speed`: the driving, from
    the start on at constant speed or with a smooth start; a negative speed drives forward.
    """

    described = (*PARAMETERS, *OUTPUTS)
    can_roll_back = True
    tells_ahead = True

    def __init__(self, name: str = "setpoints", **options):
        if options:
            raise TypeError(f"{name}: the set-points take no options; got {', '.join(options)}.")
        super().__init__(name)
        self.reset()

    def reset(self) -> None:
        self._parameters = Parameters()
        self._time = 0.0

    def bind(self, inputs, outputs) -> None:
        super().bind(inputs, outputs)
        self._pick = [(k, Output._fields.index(name)) for k, name in enumerate(outputs)]
        self._view = view(self.y)

    def set(self, name: str, value) -> None:
        self._parameters = self._parameters._replace(**{name: float(value)})

    def get(self, name: str):
        return getattr(self._parameters if name in Parameters._fields else setpoints(self._parameters, self._time), name)

    def at(self, time: float) -> None:
        """The outputs of this instant into y, without a step."""
        values, y = setpoints(self._parameters, time), self._view
        for k, index in self._pick:
            y[k] = values[index]

    def ahead(self, times: np.ndarray) -> np.ndarray:
        ratio, top, slope = self._parameters
        front, rear = (course.ahead(times) for course in COURSES)
        ends = (column * factor for end in (front, rear) for factor in (1.0, ratio) for column in end)
        told = *ends, top * (times - slope / 2), np.full(len(times), top)  # as Output has them
        found = np.empty((len(times), len(self._pick)))
        for k, index in self._pick:
            found[:, k] = told[index]
        starts = times < slope
        if starts.any():
            found[starts] = super().ahead(times[starts])
        return found

    def enter_initialization(self, start: float, stop: float | None) -> None:
        self._time = start

    def exit_initialization(self) -> None:
        self.read()

    def read(self) -> None:
        self.at(self._time)

    def step(self, time: float, size: float) -> None:
        self._time = time + size

    def save(self) -> float:
        return self._time

    def restore(self, state: float) -> None:
        self._time = state

    @staticmethod
    def pack(out: Path, **starts: Any) -> Path:
        """Setpoints.fmu in the folder `out`: the same set-points for other hosts."""
        from .setpoints_fmu import build

        return build(out, **starts)
