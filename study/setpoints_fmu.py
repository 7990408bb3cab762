"""Setpoints.fmu: the manoeuvre's set-points for hosts other than our master; standard library alone."""

from __future__ import annotations

from pathlib import Path
from typing import Any, NamedTuple

from ..fmus.slave import Slave
from . import turns


class Time(NamedTuple):
    """The state: time in s."""

    time: float


class Course:
    """A turn: its speed rises by 3x^2 - 2x^3 over the ramp, stays, and falls likewise; at rest it is exactly 0."""

    Parameters, State, Output = turns.Parameters, Time, turns.Output

    @staticmethod
    def start(p: turns.Parameters) -> Time:
        return Time(0.0)

    @staticmethod
    def advance(p: turns.Parameters, s: Time, dt: float) -> tuple[Time, turns.Output]:
        return Time(s.time + dt), turns.setpoints(p, s.time + dt)


class SetpointsFmu(Slave):
    """Set-points of the study's manoeuvre: the motion of the track holders and the driving of the sprockets."""

    law = Course
    outputs = turns.OUTPUTS
    parameters = turns.PARAMETERS
    _start = 0.0

    def setup_experiment(self, start_time: float = 0.0, stop_time: float | None = None, tolerance: float | None = None) -> None:
        super().setup_experiment(start_time, stop_time, tolerance)
        self._start = start_time

    def begin(self, p: turns.Parameters, *inputs: float) -> Time:
        return Time(self._start)

    def do_step(self, current_time: float, step_size: float) -> bool:
        self._state = Time(current_time)  # the host's clock: no drift
        return super().do_step(current_time, step_size)


def build(out: str | Path, **starts: Any) -> Path:
    """Build Setpoints.fmu into the folder `out`; `starts`: other start values."""
    from ..fmus.build import ROOT, SHARED, pack

    names = [*SHARED, "fmus/errors.py", "fmus/turn.py", "study/turns.py", "study/setpoints_fmu.py"]
    files = {name: (ROOT / name).read_bytes() for name in names}
    return pack(SetpointsFmu, files, Path(out) / "Setpoints.fmu", starts)
