"""A turn from rest to rest: its speed is ramped up, kept, and ramped down. Standard library alone, for FMUs carry it.

The ramp is the cubic 3x^2 - 2x^3, so the acceleration is continuous and zero at both ends.
"""

from __future__ import annotations

from typing import NamedTuple


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
            return ramp(since / self.ramp, top, self.ramp)
        if left < self.ramp:
            angle, speed, acceleration = ramp(left / self.ramp, top, self.ramp)
            return Motion(self.angle - angle, speed, -acceleration)
        return Motion(top * (since - self.ramp / 2), top, 0.0)


def ramp(x: float, top: float, lasts: float) -> Motion:
    """Speed top (3x^2 - 2x^3), its integral and its derivative; x from 0 to 1 during so many seconds."""
    return Motion(top * lasts * x**3 * (1 - x / 2), top * x * x * (3 - 2 * x), top * 6 * x * (1 - x) / lasts)


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
