"""The manoeuvre of the study (its figures 6 and 7), as exact functions of time.

10 s at constant forward speed. Angles are the holders' relative to the chassis, positive counter-clockwise in
the side view (x forward, y up); 0 points forward, pi points backward.

    0-2 s   both holders point forward                          hold A within it
    2-4 s   the rear holder turns backward over the top         lift, lower
    4-6 s   nothing turns                                       hold B
    6-8 s   both holders press down and raise the platform      raise
    8-10 s  nothing turns                                       hold C

A turn from rest to rest ramps its speed up, keeps it, and ramps it down. The ramp is the cubic 3x^2 - 2x^3, so
the acceleration is continuous and zero at both ends; before, between and after the turns the speed is exactly 0.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from master.face import Variable

DURATION = 10.0  # s

# The windows in which the claims look at the curves, in s.
WINDOWS = {
    "hold A": (1.0, 2.0),
    "lift": (2.2, 2.8),
    "lower": (3.2, 3.7),
    "hold B": (5.0, 6.0),
    "raise": (6.3, 7.7),
    "hold C": (9.0, 10.0),
}

TURN_RAMP = 0.1  # s, ramp of the 2-4 s turn: short, so that the holder meets the ground just before it stops
PRESS_RAMP = 0.1  # s
PRESS_ANGLE = math.radians(50.0)  # how far the holders press down


class Motion(NamedTuple):
    """Angle rad, speed rad/s, acceleration rad/s^2."""

    angle: float
    speed: float
    acceleration: float


class Turn(NamedTuple):
    """A turn by `angle` rad from rest at `start` s to rest at `stop` s, with speed ramps of `ramp` s."""

    start: float
    stop: float
    ramp: float
    angle: float

    def at(self, time: float) -> Motion:
        if time <= self.start:
            return Motion(0.0, 0.0, 0.0)
        if time >= self.stop:
            return Motion(self.angle, 0.0, 0.0)
        top = self.angle / (self.stop - self.start - self.ramp)  # the steady speed
        since, left = time - self.start, self.stop - time
        if since < self.ramp:
            return _ramp(since / self.ramp, top, self.ramp)
        if left < self.ramp:
            angle, speed, acceleration = _ramp(left / self.ramp, top, self.ramp)
            return Motion(self.angle - angle, speed, -acceleration)
        return Motion(top * (since - self.ramp / 2), top, 0.0)


def _ramp(x: float, top: float, ramp: float) -> Motion:
    """Speed top (3x^2 - 2x^3), its integral and its derivative; x from 0 to 1 during `ramp` seconds."""
    return Motion(top * ramp * x**3 * (1 - x / 2), top * x * x * (3 - 2 * x), top * 6 * x * (1 - x) / ramp)


FRONT = (Turn(6.0, 8.0, PRESS_RAMP, -PRESS_ANGLE),)
REAR = (Turn(2.0, 4.0, TURN_RAMP, math.pi), Turn(6.0, 8.0, PRESS_RAMP, PRESS_ANGLE))


def motion(turns: tuple[Turn, ...], time: float) -> Motion:
    """The motion that the turns, one after the other, add up to."""
    angle = 0.0
    for turn in turns:
        if time >= turn.stop:
            angle += turn.angle
        elif time > turn.start:
            moving = turn.at(time)
            return Motion(angle + moving.angle, moving.speed, moving.acceleration)
    return Motion(angle, 0.0, 0.0)


class Setpoints:
    """The manoeuvre as a part without inputs: its outputs are functions of time, so it can be asked at any time.

    `front_angle`, `front_speed`, `rear_angle`, `rear_speed`: the holders' desired motion. `*_input_angle`,
    `*_input_speed`: the same on the reducers' input shafts. `sprocket_angle`, `sprocket_speed`: the driving, from
    the start on at constant speed or with a smooth start; a negative speed drives forward.
    """

    can_roll_back = True

    def __init__(self, name: str = "setpoints", **options):
        if options:
            raise TypeError(f"{name}: the set-points take no options; got {', '.join(options)}.")
        self.name = name
        self.log: list[str] = []
        self.variables = {
            variable.name: variable
            for variable in (
                Variable("gear_ratio", "parameter", unit="1", start=50.0, description="input speed / output speed of the reducers"),
                Variable("sprocket_speed_set", "parameter", unit="rad/s", start=-1.6, description="constant speed of the sprockets"),
                Variable("sprocket_ramp", "parameter", unit="s", start=0.0, description="time to reach that speed; 0: from the start on"),
                *(
                    Variable(f"{end}_{kind}", "output", unit=unit, start=0.0, depends_on=(), description=text)
                    for end in ("front", "rear")
                    for kind, unit, text in (
                        ("angle", "rad", "desired holder angle relative to the chassis"),
                        ("speed", "rad/s", "desired holder speed"),
                        ("input_angle", "rad", "desired angle of the reducer's input shaft"),
                        ("input_speed", "rad/s", "desired speed of the reducer's input shaft"),
                    )
                ),
                Variable("sprocket_angle", "output", unit="rad", start=0.0, depends_on=(), description="desired sprocket angle"),
                Variable("sprocket_speed", "output", unit="rad/s", start=-1.6, depends_on=(), description="desired sprocket speed"),
            )
        }
        self.u = np.zeros(0)
        self.y = np.zeros(0)
        self.reset()

    def reset(self) -> None:
        self._parameters = {name: v.start for name, v in self.variables.items() if v.causality == "parameter"}
        self._time = 0.0

    def bind(self, inputs, outputs) -> None:
        self.u, self.y = np.zeros(len(inputs)), np.zeros(len(outputs))
        order = [name for name, variable in self.variables.items() if variable.causality == "output"]
        self._pick = [(k, order.index(name)) for k, name in enumerate(outputs)]
        self._view = memoryview(self.y)

    def set(self, name: str, value) -> None:
        self._parameters[name] = float(value)

    def get(self, name: str):
        if name in self._parameters:
            return self._parameters[name]
        order = [n for n, variable in self.variables.items() if variable.causality == "output"]
        return self._values(self._time)[order.index(name)]

    def _values(self, time: float) -> tuple[float, ...]:
        ratio, top, ramp = self._parameters["gear_ratio"], self._parameters["sprocket_speed_set"], self._parameters["sprocket_ramp"]
        front, rear = motion(FRONT, time), motion(REAR, time)
        driving = _ramp(time / ramp, top, ramp) if time < ramp else Motion(top * (time - ramp / 2), top, 0.0)
        return (
            front.angle, front.speed, front.angle * ratio, front.speed * ratio,
            rear.angle, rear.speed, rear.angle * ratio, rear.speed * ratio,
            driving.angle, driving.speed,
        )  # fmt: skip

    def at(self, time: float) -> None:
        """The outputs of this instant into y, without a step."""
        values, y = self._values(time), self._view
        for k, index in self._pick:
            y[k] = values[index]

    def enter_initialization(self, start: float, stop: float | None) -> None:
        self._time = start

    def exit_initialization(self) -> None:
        self.read()

    def write(self) -> None:
        pass

    def read(self) -> None:
        self.at(self._time)

    def step(self, time: float, size: float) -> None:
        self._time = time + size

    def save(self) -> float:
        return self._time

    def restore(self, state: float) -> None:
        self._time = state

    def terminate(self) -> None:
        pass

    def close(self) -> None:
        pass
