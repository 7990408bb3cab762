"""The laws of the manoeuvre, in the standard library alone: they run in our master and as they are in Setpoints.fmu.

A turn from rest to rest ramps its speed up, keeps it, and ramps it down. The ramp is the cubic 3x^2 - 2x^3, so
the acceleration is continuous and zero at both ends; before, between and after the turns the speed is exactly 0.
"""

from __future__ import annotations

import math
from typing import NamedTuple

from ..fmus.variable import Variable

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


class Parameters(NamedTuple):
    """What of the manoeuvre can be chosen."""

    gear_ratio: float = 50.0  # input speed / output speed of the reducers
    sprocket_speed_set: float = -1.6  # rad/s, negative drives forward
    sprocket_ramp: float = 0.0  # s, time to reach that speed; 0: from the start on


class Output(NamedTuple):
    """Desired motion: angles rad, speeds rad/s; `*_input_*` on the reducers' input shafts, the others on the holders."""

    front_angle: float
    front_speed: float
    front_input_angle: float
    front_input_speed: float
    rear_angle: float
    rear_speed: float
    rear_input_angle: float
    rear_input_speed: float
    sprocket_angle: float
    sprocket_speed: float


def setpoints(p: Parameters, time: float) -> Output:
    """The set-points at a time in s."""
    ratio, top, slope = p
    front, rear = motion(FRONT, time), motion(REAR, time)
    driving = _ramp(time / slope, top, slope) if time < slope else Motion(top * (time - slope / 2), top, 0.0)
    return Output(
        front.angle, front.speed, front.angle * ratio, front.speed * ratio,
        rear.angle, rear.speed, rear.angle * ratio, rear.speed * ratio,
        driving.angle, driving.speed,
    )  # fmt: skip


# What both faces of these laws tell of their variables.
PARAMETERS = (
    Variable("gear_ratio", "", 50.0, "input speed / output speed of the reducers", causality="parameter"),
    Variable("sprocket_speed_set", "rad/s", -1.6, "constant speed of the sprockets", causality="parameter"),
    Variable("sprocket_ramp", "s", 0.0, "time to reach that speed; 0: from the start on", causality="parameter"),
)
_TOLD = (
    *(
        (f"{end}_{kind}", unit, 0.0, text)
        for end in ("front", "rear")
        for kind, unit, text in (
            ("angle", "rad", "desired holder angle relative to the chassis"),
            ("speed", "rad/s", "desired holder speed"),
            ("input_angle", "rad", "desired angle of the reducer's input shaft"),
            ("input_speed", "rad/s", "desired speed of the reducer's input shaft"),
        )
    ),
    ("sprocket_angle", "rad", 0.0, "desired sprocket angle"),
    ("sprocket_speed", "rad/s", -1.6, "desired sprocket speed"),
)
OUTPUTS = tuple(Variable(*told, depends_on=(), causality="output") for told in _TOLD)
