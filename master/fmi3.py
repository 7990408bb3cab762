"""FMUs of FMI 3.0: their calls, events and clocks, and those for co-simulation and scheduled execution as parts.

Where an FMU has event mode it is used: a step then returns early at each event, which is handled there, and discrete
inputs are set in event mode where they change.
"""

from __future__ import annotations

import ctypes
import math
import os
from collections.abc import Mapping, Sequence
from ctypes import byref, c_bool, c_char_p, c_double, c_int, c_size_t, c_uint, c_void_p
from dataclasses import dataclass
from typing import Any, NoReturn

import numpy as np
from fmpy import fmi3

from . import binary
from .block import Block, address
from .clocks import Ticks, clocks_in
from .errors import DescriptionError, PartFailed
from .instance import WARNING, Fmu
from .native import MORE, Native

EVENTS = 100_000  # most in one step, and most iterations of one event: beyond them it does not end
CLOCK = "Clock"


@dataclass
class Update:
    """What an FMU says after an iteration of an event."""

    again: bool
    over: bool  # it ends the run
    nominals: bool  # of its continuous states changed
    states: bool  # changed
    next: float  # time event, s; inf: none


class Fmi3(Fmu):
    """The calls of FMI 3.0."""

    standard = "fmi3"
    kinds = {
        "Float32": (ctypes.c_float, np.float32),
        "Float64": (c_double, np.float64),
        "Int8": (ctypes.c_int8, np.int8),
        "UInt8": (ctypes.c_uint8, np.uint8),
        "Int16": (ctypes.c_int16, np.int16),
        "UInt16": (ctypes.c_uint16, np.uint16),
        "Int32": (ctypes.c_int32, np.int32),
        "UInt32": (ctypes.c_uint32, np.uint32),
        "Int64": (ctypes.c_int64, np.int64),
        "UInt64": (ctypes.c_uint64, np.uint64),
        "Boolean": (c_bool, np.bool_),
        "String": (c_char_p, None),
        "Binary": (c_char_p, None),
        CLOCK: (c_bool, np.bool_),
    }
    state_names = ("GetFMUState", "SetFMUState", "FreeFMUState")
    events = True  # inputs that are discrete are set in event mode
    now = 0.0  # how far it is, s

    # --- life ----------------------------------------------------------------------------------------------------

    def _instantiate(self) -> None:
        known = self._binary.description.modelVariables
        self._structural = {v.name for v in known if v.causality == "structuralParameter"}
        clocks = clocks_in(self._binary.folder) if any(v.type == CLOCK for v in known) else []
        self._ticks = Ticks([clock for clock in clocks if clock.variability != "output"], self._interval)
        self._ticked = {clock.reference: False for clock in clocks if clock.variability == "output"}  # since the last point
        resources = str(self._binary.folder / "resources") + os.sep
        token = (self._binary.description.instantiationToken or "").encode()
        self._made(self._instance_of(self.name.encode(), token, resources.encode()))
        self._configure()

    def _instance_of(self, name: bytes, token: bytes, resources: bytes) -> Any:
        raise NotImplementedError

    def _configure(self) -> None:
        """Give the structural parameters that were asked for their values."""
        if self._sizes:
            self._call("EnterConfigurationMode")
            for name, value in self._sizes.items():
                if (status := super()._put(name, value)) > WARNING:
                    self._fail(status, self._named("Set", self._places[name].kind))
            self._call("ExitConfigurationMode")

    def reset(self) -> None:
        super().reset()
        self._configure()

    def _begin(self, given: dict[str, Any], start: float, stop: float | None) -> None:
        self.now = start
        tolerance = c_bool(self._tolerance > 0.0), c_double(self._tolerance)
        self._call("EnterInitializationMode", *tolerance, c_double(start), c_bool(stop is not None), c_double(stop or 0.0))
        self._again({name: value for name, value in given.items() if self._late(name) and name not in self._structural})

    def exit_initialization(self) -> None:
        super().exit_initialization()
        for block in self._writes:
            block.renewed()  # it has these

    # --- values --------------------------------------------------------------------------------------------------

    def _put(self, name: str, value: Any) -> int:
        if name not in self._structural or not self._instance or self._given is None:
            return super()._put(name, value)
        if name in self._sizes and self._sizes[name] == value:
            return WARNING  # it has it
        start = self.variables[name].start
        if any(
            d.valueReference == self._places[name].reference
            for v in self._binary.description.modelVariables
            for d in v.dimensions
        ):
            if value == self._sizes.get(name, start):
                return WARNING
            raise DescriptionError(
                f"{self.name}.{name} is the size of an array: give it under start, before the run, not to a part that is there."
            )
        self._call("EnterConfigurationMode")
        status = super()._put(name, value)
        self._call("ExitConfigurationMode")
        return status

    def _converted(self, name: str, kind: str, value: Any) -> Any:
        if kind == "Binary":
            try:
                return bytes.fromhex(str(value))
            except ValueError:
                raise DescriptionError(
                    f"{self.name}.{name} = {str(value)[:40]!r}: a Binary is given as hexadecimal digits, such as 666f6f."
                ) from None
        return super()._converted(name, kind, value)

    def _plain(self, kind: str, value: Any) -> Any:
        if kind == "Binary":
            return (value or b"").hex() if not isinstance(value, str) else value
        return bool(value) if kind == CLOCK else super()._plain(kind, value)

    def _set(self, kind: str, reference: int, values: list[Any]) -> int:
        if kind == CLOCK:
            return WARNING  # it ticks in event mode only
        if kind != "Binary":
            return super()._set(kind, reference, values)
        sizes = (c_size_t * len(values))(*map(len, values))
        pointers = (c_char_p * len(values))(*values)
        function = self._function("fmi3SetBinary")
        return function(self._instance, byref(c_uint(reference)), c_size_t(1), sizes, pointers, c_size_t(len(values)))

    def _get(self, kind: str, reference: int, count: int) -> tuple[int, list[Any]]:
        if kind == CLOCK:
            return 0, [self._ticked.get(reference, False)]
        if kind != "Binary":
            return super()._get(kind, reference, count)
        sizes, pointers = (c_size_t * count)(), (c_void_p * count)()
        function = self._function("fmi3GetBinary")
        status = function(self._instance, byref(c_uint(reference)), c_size_t(1), sizes, pointers, c_size_t(count))
        return status, [ctypes.string_at(p, n) if p and n else b"" for p, n in zip(pointers, sizes)]

    def _counted(self, count: int) -> tuple[c_size_t, ...]:
        return (c_size_t(count),)

    def _together(self, way: str, name: str) -> Any:
        variable, clock = self.variables[name], self._place(name).kind == CLOCK
        return super()._together(way, name), way == "Set" and variable.variability != "continuous", name if clock else None

    def write(self) -> None:
        if not self._alive or self._over():
            for block in self._writes:
                if block.kind != CLOCK:
                    self._exchange_in(block)
            return
        discrete = []
        for block in self._writes:
            if not (self.events and block.discrete):
                self._exchange_in(block)
            elif self._news(block):
                discrete.append(block)
        if discrete:
            self._changed(discrete)

    def _news(self, block: Block) -> bool:
        return bool(self.u[block.first] > 0.5) if block.kind == CLOCK else block.renewed()

    def read(self) -> None:
        if self._ticked:
            for block in self._reads:
                if block.kind == CLOCK:
                    self.y[block.first] = self._ticked.get(self._places[block.names[0]].reference, False)
            for block in self._reads:
                if block.kind != CLOCK:
                    self._exchange_out(block)
        else:
            super().read()

    # --- events --------------------------------------------------------------------------------------------------

    def _interval(self, what: str, reference: int) -> tuple[float, int] | None:
        """What a clock says of its interval or shift; None where it does not."""
        if not self._has(f"fmi3{what}"):
            return None
        value, qualifier = c_double(math.nan), c_int(0)
        more = (byref(qualifier),) if what == "GetIntervalDecimal" else ()
        status = self._function(f"fmi3{what}")(self._instance, byref(c_uint(reference)), c_size_t(1), byref(value), *more)
        return (value.value, qualifier.value) if status <= WARNING else None

    def _update(self) -> Update:
        """fmi3UpdateDiscreteStates."""
        flags, time = [c_bool(False) for _ in range(5)], c_double(math.inf)
        self._call("UpdateDiscreteStates", *map(byref, flags), byref(time))
        again, over, nominals, states, defined = (flag.value for flag in flags)
        return Update(again, over, nominals, states, time.value if defined else math.inf)

    def _tick(self, references: Sequence[int]) -> None:
        """Let input clocks tick, in event mode."""
        for reference in references:
            given = byref(c_uint(reference)), c_size_t(1), byref(c_bool(True))
            self._call("SetClock", *given)

    def _hear_clocks(self) -> None:
        """See which output clocks tick, in event mode."""
        for reference in self._ticked:
            active = c_bool(False)
            status = self._function("fmi3GetClock")(self._instance, byref(c_uint(reference)), c_size_t(1), byref(active))
            if status <= WARNING and active.value:
                self._ticked[reference] = True

    def _settle(self, inputs: Sequence[Block] = ()) -> Update:
        """In event mode: take in inputs, let clocks tick that are due, iterate until nothing changes any more."""
        self._take_waiting()
        ticks = []
        for block in inputs:
            if block.kind != CLOCK:
                self._exchange_in(block)
            elif self.u[block.first] > 0.5:
                ticks.append(self._places[block.names[0]].reference)
        whole = Update(False, False, False, False, math.inf)
        slack = 1e-9 * max(self._size.value, 1e-9)
        for _ in range(EVENTS):
            ticks += [clock.reference for clock in self._ticks.due(self.now + slack)]
            self._tick(ticks)
            ticks = []
            self._hear_clocks()
            self._ticks.look(self.now)
            one = self._update()
            whole.nominals |= one.nominals
            whole.states |= one.states
            whole.next, whole.over = one.next, one.over
            self._ticks.look(self.now)
            if one.over:
                self.end(self.now)
            if one.over or not (one.again or self._ticks.next <= self.now + slack):
                return whole
        self._endless()

    def _endless(self) -> NoReturn:
        hint = "other parameters; an event of it calls for the next one at once, without end."
        raise PartFailed(self.name, self.now, self._size.value, "events without end", {}, list(self.log), hint)

    def _begin_clocks(self) -> None:
        if lacking := self._ticks.begin(self.now):
            raise DescriptionError(f"{self.name}: its clock {lacking} says no interval, at which it ticks.")

    # --- roll back -----------------------------------------------------------------------------------------------

    def save(self) -> Any:
        return super().save(), self.now, self._ticks.save(), dict(self._ticked)

    def restore(self, state: Any) -> None:
        held, self.now, ticks, ticked = state
        super().restore(held)
        self._ticks.restore(ticks)
        self._ticked.update(ticked)
        for block in self._writes:
            block.last = None


class StepEnd(ctypes.Structure):
    """What fmi3DoStep tells; the compiled loop knows these places."""

    _fields_ = [("event", c_bool), ("ended", c_bool), ("early", c_bool), ("reached", c_double)]


class CoSimulation3(Fmi3):
    """One instance of an FMI 3.0 co-simulation FMU."""

    def _instance_of(self, name: bytes, token: bytes, resources: bytes) -> Any:
        self.events = self.instant = bool(getattr(self._way, "hasEventMode", False))
        early = self.events and self.variable_step
        instantiate = self._function("fmi3InstantiateCoSimulation", c_void_p)
        self._do_step = self._function("fmi3DoStep")
        flags = c_bool(False), c_bool(True), c_bool(self.events), c_bool(early)
        self._said = StepEnd()
        self._between = self._intermediate() if getattr(self._way, "providesIntermediateUpdate", False) else []
        self.interpolates = bool(self._between)
        self._bent: list[tuple[int, float, float]] = []  # inputs that change in this step: reference, value at its start, rate
        self._from, self._refused = 0.0, 0
        self._update_call = fmi3.fmi3IntermediateUpdateCallback(self._updated)
        told = self._update_call if getattr(self._way, "providesIntermediateUpdate", False) else None
        required = (c_uint * max(1, len(self._between)))(*self._between), c_size_t(len(self._between))
        log = c_void_p(self._number), binary.hear3
        return instantiate(name, token, resources, *flags, *required, *log, told)

    def _intermediate(self) -> list[int]:
        """Continuous inputs that it lets be set inside a step."""
        known = self._binary.description.modelVariables
        return [
            v.valueReference
            for v in known
            if (v.causality, v.type, v.variability) == ("input", "Float64", "continuous")
            and v.intermediateUpdate
            and not v.dimensions
        ]

    def tilt(self, rates: Mapping[int, float]) -> None:
        places = {place: self._places[self.inputs[place]].reference for place in rates}
        self._bent = [
            (places[place], float(self.u[place]), rate) for place, rate in rates.items() if places[place] in self._between
        ]

    def _updated(self, _: Any, time: float, wanted: bool, *others: Any) -> None:
        """The FMU is at `time`, inside a step: its inputs are where they are by then. Nobody asks it to return."""
        returns = others[3]
        if returns:
            returns[0] = False
        if wanted:
            for reference, start, rate in self._bent:
                value = c_double(start + rate * (time - self._from))
                status = self._function("fmi3SetFloat64")(
                    self._instance, byref(c_uint(reference)), c_size_t(1), byref(value), c_size_t(1)
                )
                self._refused = max(self._refused, status)

    def _finish_initialization(self) -> None:
        super()._finish_initialization()
        if self.events:
            self._begin_clocks()
            self._settle()
            if not self._over():
                self._call("EnterStepMode")
        elif self._ticks.clocks:
            raise DescriptionError(f"{self.name}: it has clocks but no event mode, in which they would tick.")

    def _changed(self, inputs: Sequence[Block]) -> None:
        self._call("EnterEventMode")
        self._settle(inputs)
        if not self._over():
            self._call("EnterStepMode")

    def on_trial(self, begins: bool) -> None:
        """FMI 3.0 lets outputs be read for new inputs in event mode alone."""
        if begins:
            return self._call("EnterEventMode")
        self._settle()
        if not self._over():
            self._call("EnterStepMode")

    def step(self, time: float, size: float) -> None:
        if self._over():
            return
        for reference in self._ticked:
            self._ticked[reference] = False
        self._size.value, self.now, self._from = size, time, time
        self._go(time + size, size)
        self._bent = []

    def _go(self, end: float, size: float, made: bool = False) -> None:
        """On to `end`, from event to event. made: the first fmi3DoStep is made already."""
        slack = 1e-9 * size
        for _ in range(EVENTS):
            goal = min(end, max(self._ticks.next, self.now)) if self._ticks.next <= end + slack and self.variable_step else end
            if made or goal > self.now + slack:
                reached = self._far(goal) if made else self._advance(goal)
                made = False
                if self._said.ended:
                    self.now = reached
                    return self.end(min(reached, end))
                self.now = reached
            if self._said.event and self.events or self._ticks.next <= self.now + slack:
                self._said.event = False
                self._changed(())
                if self._over():
                    return
            if self.now >= end - slack:
                return
        self._endless()

    def _advance(self, goal: float) -> float:
        """One fmi3DoStep: how far it went."""
        self._time.value, self._size.value = self.now, goal - self.now
        said = self._said
        said.event = said.ended = said.early = False
        said.reached = math.nan
        told = byref(said), byref(said, 1), byref(said, 2), byref(said, 8)
        status = self._do_step(self._instance, self._time, self._size, c_bool(self._free.value != 0), *told)
        if self._refused > WARNING:
            status, self._refused = self._refused, 0
            self._fail(status, "fmi3SetFloat64, inside a step")
        if status > WARNING:
            self._fail(status, "fmi3DoStep")
        return self._far(goal)

    def _far(self, goal: float) -> float:
        """How far the last fmi3DoStep went."""
        said = self._said
        stopped = (said.early or said.ended) and math.isfinite(said.reached)
        return min(max(said.reached, self.now), goal) if stopped else goal

    def native(self) -> Native | None:
        plain = all(block.kind == "Float64" and block.real for block in (*self._writes, *self._reads))
        if not plain or self._ticks.clocks or self._ticked or self.events and any(block.discrete for block in self._writes):
            return None
        return Native(
            address(self._instance),
            address(self._do_step),
            int(self._free.value != 0),
            tuple(block.native() for block in self._writes),
            tuple(block.native() for block in self._reads),
            self._finish_native,
            self._fail_native,
            told=ctypes.addressof(self._said),
        )

    def _finish_native(self, status: int, time: float, size: float) -> None:
        self._time.value, self._size.value, self.now = time, size, time
        if status != MORE:
            self._fail(status, "fmi3DoStep")
        self._go(time + size, size, made=True)

    def _fail_native(self, status: int, function: str, time: float, size: float) -> NoReturn:
        self._time.value, self._size.value = time, size
        self._fail(status, function)


class Scheduled(Fmi3):
    """One instance of an FMI 3.0 FMU for scheduled execution: its partitions are run when their clocks tick."""

    variable_step = True

    def _instance_of(self, name: bytes, token: bytes, resources: bytes) -> Any:
        instantiate = self._function("fmi3InstantiateScheduledExecution", c_void_p)
        self._activate = self._function("fmi3ActivateModelPartition")
        flags = c_bool(False), c_bool(True)
        calls = binary.hear3, binary.clock_update, binary.lock, binary.lock
        return instantiate(name, token, resources, *flags, c_void_p(self._number), *calls)

    def _finish_initialization(self) -> None:
        super()._finish_initialization()
        self._begin_clocks()
        self._run_due(self.now)

    def _changed(self, inputs: Sequence[Block]) -> None:
        self._take_waiting()
        for block in inputs:
            if block.kind != CLOCK:
                self._exchange_in(block)
        for block in inputs:
            if block.kind == CLOCK:
                self._run(self._places[block.names[0]].reference)
        self._run_due(self.now)

    def step(self, time: float, size: float) -> None:
        for reference in self._ticked:
            self._ticked[reference] = False
        self._time.value, self._size.value, end = time, size, time + size
        for _ in range(EVENTS):
            if not self._ticks.next <= end + 1e-9 * size:
                self.now = end
                return
            self.now = max(self._ticks.next, self.now)
            self._run_due(self.now)
        self._endless()

    def _run_due(self, time: float) -> None:
        for _ in range(EVENTS):
            due = self._ticks.due(time + 1e-9 * self._size.value)
            for clock in due:
                self._run(clock.reference)
            if not due:
                return
        self._endless()

    def _run(self, reference: int) -> None:
        status = self._activate(self._instance, c_uint(reference), c_double(self.now))
        if status > WARNING:
            self._fail(status, "fmi3ActivateModelPartition")
        self._hear_clocks()
        self._ticks.look(self.now)
