"""A run that goes on a step at a time while its user looks and writes: the master of `run`, with the steps in the user's hands."""

from __future__ import annotations

import logging
import math
from dataclasses import replace
from numbers import Real
from pathlib import Path
from types import TracebackType
from typing import Any

import pandas as pd

from .control import Snapshot
from .errors import PartFailed, SessionError
from .face import Variable
from .results import Memory, Result
from .running import Running
from .seat import Seat
from .simulation import check_times, failing, prepared, ready, stepping
from .slips import call, checked
from .stepping import Stepping
from .system import System
from .values import given, numbers
from .wiring import all_given, typed

log = logging.getLogger(__name__)


def session(
    system: System | Path | str,
    settings: dict[str, Any] | None = None,
    stop: float | None = None,
    step: float | None = None,
    algorithm: str | None = None,
    tolerance: float | None = None,
    inputs: Path | str | None = None,
    allow_code: bool = False,
    unlimited: bool = False,
    isolate: bool = False,
    interface: str | None = None,
) -> Session:
    """A live run of `system`, to be used in a `with`. The arguments are those of `run`; `stop` may be infinite.

        with selflock.session("bench.toml") as s:
            s["gear.friction_kinetic"] = 0.01       # before the first step parameters and inputs
            while s.time < 0.2:
                s["motor.voltage"] = 24.0 if s["weight.angle"] < 0.5 else 0.0
                s.step()
            s.save("bench.parquet")

    Raises DescriptionError for what `run` refuses, SessionError for what a session cannot do.
    """
    call(system, settings, stop, None)
    return Session(
        *prepared(system, stop, step, algorithm, tolerance, inputs, allow_code, unlimited, isolate, interface), settings or {}
    )


class Instant:
    """All of a session at one time, to come back to."""

    def __init__(self, session: Session, parts: Snapshot, rows: Any, steps: Any, counts: tuple[float, int, int, dict]):
        self.session, self.parts, self.rows, self.steps, self.counts = session, parts, rows, steps, counts
        self.time = counts[0]

    def __repr__(self) -> str:
        return f"<the session at t = {self.time:.9g} s>"


class Session:
    """A system between its steps. Made by `session`.

    Until the first step, or snapshot, what is written is as in the `settings` of `run`; reading initializes the system with it.
    From then on inputs that nothing feeds and tunable parameters can be written; they count from the next step on, and outputs
    follow at its end. The table stays in memory.
    """

    def __init__(self, system: System, stop: float, settings: dict[str, Any]):
        check_times(checked(system), stop, endless=True)
        self.system, self.stop = system, stop
        self._settings = dict(settings)
        self._steps: Stepping | None = None  # once it is initialized
        self._stale = False  # something was written since the parts were made
        self._begun = False  # a step was made, or a snapshot
        self._closed = False
        self._failure: PartFailed | None = None
        self._last: Result | None = None  # of a session that is closed
        self._running = self._wired()
        for name in settings:
            if name not in system.values:
                component, variable = self._running.wiring.variable(name, "settings")
                self._settings[f"{component}.{variable.name}"] = self._settings.pop(name)

    # --- looking -------------------------------------------------------------------------------------------------

    @property
    def time(self) -> float:
        """The present, s."""
        return self._running.time

    @property
    def ended(self) -> dict[str, float]:
        """The component that ended the run itself, and when, s; empty as long as none has."""
        return dict(self._running.ended)

    @property
    def result(self) -> Result:
        """What there is so far, as `run` returns it."""
        if self._last is not None:
            return self._last
        running = self._ready()
        running.sink.flush()
        return running.result()

    @property
    def table(self) -> pd.DataFrame:
        """The rows so far: `time`, and what is recorded."""
        return self.result.table

    def save(self, path: Path | str) -> Path:
        """Write the rows so far to a .csv or .parquet file."""
        return self.result.save(path)

    def __getitem__(self, name: str) -> Any:
        """The value of "component.variable" now, or of one of the system's values. An input is that of the last step, or what was written."""
        if name in self.system.values:
            return numbers(given(self.system, self._settings)[0])[name]
        running = self._ready()
        seat, variable = self._found(name)
        if variable.type == "String" or variable.name not in (*seat.outputs, *seat.inputs):
            if (seat.timed or seat.large > 1) and variable.causality in ("output", "local"):
                raise SessionError(
                    f"{name} is known between the steps of its component only as it is recorded: add it to [run] record."
                )
            return seat.part.get(variable.name)
        if variable.name in seat.outputs:
            if seat.timed and seat.evaluated != running.time:
                seat.evaluate(running.time)
            value = seat.shown[seat.outputs.index(variable.name)]
        else:
            value = seat.u[seat.inputs.index(variable.name)]
            value = seat.held.get(seat.inputs.index(variable.name), value)
        return {"Integer": int, "Boolean": bool}.get(variable.type, float)(value)

    def __repr__(self) -> str:
        return f"<session of {self.system.name} at t = {self.time:.9g} s>"

    # --- writing -------------------------------------------------------------------------------------------------

    def __setitem__(self, name: str, value: Any) -> None:
        """Write an input that nothing feeds, or a parameter. Raises SessionError, DescriptionError."""
        if not self._begun:
            self._set(name, value)
            return
        if name in self.system.values:
            raise SessionError(f"{name} is a value of the system: such are set before the first step.")
        self._ready()
        seat, variable = self._found(name)
        self._free(seat.name, variable)
        if variable.causality == "parameter" and variable.variability != "tunable":
            raise SessionError(f"{name} is a parameter: such are set before the first step, but for those that are tunable.")
        value = typed(variable, value, name)
        if variable.name not in seat.inputs or variable.causality != "input":
            seat.part.set(variable.name, value)
            return
        place = seat.inputs.index(variable.name)
        seat.u[place] = float(value)
        if place in seat.held:
            seat.held[place] = float(value)

    def _set(self, name: str, value: Any) -> None:
        """Before the first step: as a setting of `run`."""
        if name in self.system.values:
            given(self.system, {name: value})
        else:
            component, variable = self._open().wiring.variable(name, "session")
            self._free(component, variable)
            name = f"{component}.{variable.name}"
            typed(variable, value, name)
        self._settings[name] = value
        self._stale = True

    def _free(self, component: str, variable: Variable) -> None:
        """Refuse what a connection feeds."""
        for link in self._running.wiring.links:
            if (link.target, link.input) == (component, variable.name):
                name = f"{component}.{variable.name}"
                raise SessionError(
                    f"{name} is fed by the connection from {link.source}.{link.output}. To write it yourself leave that out: "
                    f'del system.connections["{name}"].'
                )

    # --- going on ------------------------------------------------------------------------------------------------

    def step(self, until: float | None = None) -> float:
        """One communication step, or as many as it takes to be at `until` [s] or just beyond. Returns the time then, s."""
        if until is not None and (isinstance(until, bool) or not isinstance(until, Real)):
            raise SessionError(
                f"until = {until!r} is no time: give the s at which to be, s.step(until=0.5); s.step() makes one step."
            )
        running = self._ready()
        slack = 1e-9 * self.system.run.step
        if until is not None and not running.time - slack <= until <= self.stop + slack:
            end = "" if until < running.time else f" Open it with stop={until:g}."
            raise SessionError(f"until = {until:g} s: this session is at {running.time:.9g} s and ends at {self.stop:g} s.{end}")
        if self._failure is not None:
            raise SessionError(
                f"{self._failure.part} failed at t = {running.time:.9g} s. Restore a snapshot, or open a session anew."
            )
        steps, limit = self._steps, running.time if until is None else until - slack
        assert steps is not None
        if steps.over:
            who = f"{next(iter(running.ended))} ended the run" if running.ended else "the session ended"
            raise SessionError(f"{who} at t = {running.time:.9g} s." + ("" if running.ended else " Open it with a later stop."))
        self._begun = True
        try:
            with failing(running), ready(running):
                while not steps.over and (running.time < limit or until is None):
                    steps.step()
                    if until is None:
                        break
                running.recorder.check(running.time)
        except PartFailed as failure:
            self._failure = failure
            raise
        return running.time

    def snapshot(self) -> Instant:
        """All as it is now, for `restore`, the table included. Raises SessionError where a part cannot roll back."""
        running, steps = self._ready(), self._steps
        assert steps is not None and isinstance(running.sink, Memory)
        if fixed := [seat.name for seat in steps.seats if not seat.part.can_roll_back]:
            raise SessionError(f"{', '.join(fixed)} cannot roll back, so that this session cannot, either.")
        if self.system.faults:
            raise SessionError(
                "A session with [[faults]] cannot roll back: they remember. Leave them out and write what they would."
            )
        self._sound()
        self._begun = True
        log.debug("snapshot at t = %g s", running.time)
        counts = running.time, running.index, running.rejected, dict(running.ended)
        return Instant(self, Snapshot(steps.seats), running.sink.copied(), steps.save(), counts)

    def restore(self, instant: Instant) -> None:
        """Back to a snapshot; it may be restored again. Raises SessionError."""
        if not isinstance(instant, Instant):
            raise SessionError(f"{instant!r} is no snapshot: give what s.snapshot() gave.")
        if instant.session is not self:
            raise SessionError("This snapshot is of another session.")
        running, steps = self._open(), self._steps
        assert steps is not None and isinstance(running.sink, Memory)
        if self._failure is not None and not self._failure.status.startswith("Discard"):
            self._sound()
        log.debug("back from t = %g s to %g s", running.time, instant.time)
        self._failure = None
        instant.parts.restore()
        running.sink.back(instant.rows)
        steps.restore(instant.steps)
        running.time, running.index, running.rejected, running.ended = *instant.counts[:3], dict(instant.counts[3])
        running.ends.clear()
        for seat in running.seats:
            seat.evaluated = math.nan

    def _sound(self) -> None:
        if self._failure is not None:
            raise SessionError(f"{self._failure.part} failed: its state is none to come back to. Open a session anew.")

    # --- beginning and end ---------------------------------------------------------------------------------------

    def close(self) -> None:
        """End it; the result stays. In a `with` this is done at its end."""
        if self._closed:
            return
        try:
            if self._steps is not None and not self._stale:
                self._last = self.result
                if self._failure is None:
                    for part in self._running.wiring.parts.values():
                        part.terminate()
        finally:
            self._closed = True
            self._release()

    def __enter__(self) -> Session:
        return self

    def __exit__(self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None) -> None:
        try:
            self.close()
        except PartFailed:
            if error is None:
                raise

    def _wired(self) -> Running:
        """The parts with the settings so far. What nobody gives yet may still be written."""
        system = replace(self.system, run=replace(self.system.run, open_inputs=True))
        return Running(system, self._settings, self.stop, None, None, None, None)

    def _release(self) -> None:
        self._running.sink.close()
        self._running.wiring.close()

    def _open(self) -> Running:
        if self._closed:
            raise SessionError("This session is closed; its `result` and `table` are there still, if it was begun.")
        return self._running

    def _ready(self) -> Running:
        """Initialized with all that was written, the row of the start written."""
        running = self._open()
        if self._stale:  # as new: what follows from values was found when the parts were made
            self._release()
            self._running = running = self._wired()
            self._steps, self._stale = None, False
        if self._steps is None:
            if not self.system.run.open_inputs:
                all_given(running.wiring)
            try:
                running.start()
                self._steps = stepping(running)
            except BaseException:
                self._stale = True
                raise
        return running

    def _found(self, name: str) -> tuple[Seat, Variable]:
        component, variable = self._running.wiring.variable(name, "session")
        return next(seat for seat in self._running.seats if seat.name == component), variable
