"""The laws of the manoeuvre, in the standard library alone: they run in our master and as they are in Setpoints.fmu.

A turn is that of fmus/turn.py; before, between and after the turns the speed is exactly 0.
"""

from __future__ import annotations

import math
from typing import NamedTuple

from ..fmus.turn import Motion, Turn, motion, ramp
from ..fmus.variable import Variable

TURN_RAMP = 0.1  # s, ramp of the 2-4 s turn: short, so that the holder meets the ground just before it stops
PRESS_RAMP = 0.1  # s
PRESS_ANGLE = math.radians(50.0)  # how far the holders press down


FRONT = (Turn(6.0, 8.0, PRESS_RAMP, -PRESS_ANGLE),)
REAR = (Turn(2.0, 4.0, TURN_RAMP, math.pi), Turn(6.0, 8.0, PRESS_RAMP, PRESS_ANGLE))


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
    driving = ramp(time / slope, top, slope) if time < slope else Motion(top * (time - slope / 2), top, 0.0)
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
