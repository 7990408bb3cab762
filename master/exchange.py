"""Model exchange, of every version, as parts like others: the equations of the FMU integrated here, between communication
points, by CVODE.

Inputs are held over a communication step; where one changes, the solver starts anew. State events are located as roots of
the event indicators, time events met as the FMU names them, step events taken as it asks after each internal step. An
indicator whose sign an input changes makes an event, too.
"""

from __future__ import annotations

import ctypes
import math
from collections import deque
from collections.abc import Sequence
from ctypes import byref, c_double, c_int, c_size_t, c_void_p
from typing import Any, ClassVar, NoReturn

import numpy as np
from fmpy import fmi2

from . import binary
from .block import Block
from .cvode import Solver
from .errors import PartFailed
from .fmi3 import EVENTS, Fmi3, Update
from .fmu import MODEL_EXCHANGE, Fmi2
from .instance import DISCARD, WARNING, Fmu

TOLERANCE = 1e-6  # relative, of the solver where nobody tells one; what a default experiment tells is not taken looser
SHARE = 50  # no internal step is longer than this share of the run, or events may lie between two of its ends
STILL, CLOSE = 1000, 1e-3  # so many events in that share of a communication step: time does not go on, as where a ball rests
INTERNAL = 10_000_000  # steps of the solver in one communication step


class Integrated(Fmu):
    """What model exchange is in every version."""

    variable_step = True
    instant = True
    boolean: Any = c_int  # C's type
    derivatives_name, nominals_name = "GetDerivatives", "GetNominalsOfContinuousStates"
    needs: ClassVar[tuple[str, ...]] = ("SetTime", "EnterEventMode", "EnterContinuousTimeMode")
    now = 0.0  # s
    next = math.inf  # time event, s

    def _count(self) -> tuple[int, int]:
        """How many continuous states and event indicators it has."""
        raise NotImplementedError

    def _settle(self, inputs: Sequence[Block] = ()) -> Update:
        """In event mode: take in inputs, iterate until nothing changes any more."""
        raise NotImplementedError

    # --- life ----------------------------------------------------------------------------------------------------

    def _instantiate(self) -> None:
        for name in self.needs:
            self._function(self.standard + name)  # found out now, not in the midst of a run
        super()._instantiate()

    def enter_initialization(self, start: float, stop: float | None) -> None:
        self.now = start
        self._length = (stop - start) if stop is not None and stop > start else math.inf
        self._solved = self._tolerance or TOLERANCE
        if not self._asked:
            self._tolerance = self._solved = min(self._solved, TOLERANCE)  # the FMU is told it, too
        super().enter_initialization(start, stop)

    def _finish_initialization(self) -> None:
        super()._finish_initialization()
        self.states, self.roots = self._count()
        self._close_solver()
        self._solver = Solver(max(self.states, 1), self.roots, self._derivatives, self._indicators, self._solved)
        self._solver.longest(self._length / SHARE)
        self._x, self._nominals = np.ones(max(self.states, 1)), np.ones(max(self.states, 1))
        self._z, self._z_new = np.zeros(self.roots), np.zeros(self.roots)
        self._event_flag, self._end_flag = self.boolean(0), self.boolean(0)
        steps = getattr(self._way, "needsCompletedIntegratorStep", True)
        self._told_of_steps = bool(steps) and self._has(f"{self.standard}CompletedIntegratorStep")
        self._after_event(self._settle())

    def exit_initialization(self) -> None:
        super().exit_initialization()
        for block in self._writes:
            block.renewed()  # it has these

    def _close_solver(self) -> None:
        solver: Solver | None = getattr(self, "_solver", None)
        if solver is not None:
            solver.close()

    def close(self) -> None:
        self._close_solver()
        super().close()

    # --- equations -----------------------------------------------------------------------------------------------

    def _vector(self, name: str, values: np.ndarray) -> int:
        """A call with a vector of numbers: its status."""
        function = self._function(f"{self.standard}{name}")
        return function(self._instance, c_void_p(values.ctypes.data), c_size_t(len(values)))

    def _at(self, time: float, states: np.ndarray) -> int:
        """Go to a time with these states."""
        status = self._function(f"{self.standard}SetTime")(self._instance, c_double(time))
        if status <= WARNING and self.states:
            status = max(status, self._vector("SetContinuousStates", states))
        return status

    def _derivatives(self, time: float, states: np.ndarray, found: np.ndarray) -> int:
        if not self.states:
            found[:] = 0.0
            return 0
        status = self._at(time, states)
        if status <= WARNING:
            status = max(status, self._vector(self.derivatives_name, found))
        return self._told_solver(status, self.derivatives_name, found)

    def _indicators(self, time: float, states: np.ndarray, found: np.ndarray) -> int:
        status = self._at(time, states)
        if status <= WARNING:
            status = max(status, self._vector("GetEventIndicators", found))
        return self._told_solver(status, "GetEventIndicators", found)

    def _told_solver(self, status: int, name: str, found: np.ndarray) -> int:
        """What CVODE is to do: 1, try a smaller step, where the FMU could not compute it here."""
        if status > DISCARD:
            self._fail(status, self.standard + name)
        return 1 if status == DISCARD or not np.isfinite(found).all() else 0

    def _arrive(self) -> None:
        """Where the solver is: the FMU is there, too."""
        status = self._at(self.now, self._solver.x)
        if status > WARNING:
            self._fail(status, f"{self.standard}SetContinuousStates")

    # --- events --------------------------------------------------------------------------------------------------

    events = True

    def _changed(self, inputs: Sequence[Block]) -> None:
        self._event(inputs)

    def _event(self, inputs: Sequence[Block] = ()) -> None:
        """An event here and now."""
        self._to_events()
        self._after_event(self._settle(inputs))

    def _to_events(self) -> None:
        self._call("EnterEventMode")

    def _to_equations(self) -> None:
        self._call("EnterContinuousTimeMode")

    def _after_event(self, update: Update) -> None:
        self.next = update.next
        if update.over or self._over():
            return
        self._to_equations()
        self._restart()

    def _restart(self) -> None:
        """The solver starts from what the FMU is now."""
        if self.states:
            if (status := self._vector("GetContinuousStates", self._x)) > WARNING:
                self._fail(status, f"{self.standard}GetContinuousStates")
            name = self.nominals_name
            if not self._has(self.standard + name) or self._vector(name, self._nominals) > WARNING:
                self._nominals[:] = 1.0
            sound = np.isfinite(self._nominals) & (self._nominals != 0.0)
            self._nominals[:] = np.where(sound, np.abs(self._nominals), 1.0)
        self._solver.begin(self.now, self._x, self._nominals)
        self._look(self._z)

    def _look(self, found: np.ndarray) -> None:
        """The event indicators as they are now."""
        if self.roots and (status := self._vector("GetEventIndicators", found)) > WARNING:
            self._fail(status, f"{self.standard}GetEventIndicators")

    # --- steps ---------------------------------------------------------------------------------------------------

    def write(self) -> None:
        if not self._alive or self._over():
            return super().write()
        changed = [block for block in self._writes if self._news(block)]
        if not changed:
            return
        if any(block.discrete for block in changed):
            self._event(changed)
            return
        for block in changed:
            self._exchange_in(block)
        self._look(self._z_new)
        if ((self._z_new > 0.0) != (self._z > 0.0)).any():
            self._event()
        else:
            self._restart()

    def step(self, time: float, size: float) -> None:
        if self._over():
            return
        self._time.value, self._size.value = time, size
        end, slack = time + size, 1e-9 * size
        recent: deque[float] = deque(maxlen=STILL)  # when the last events were
        for _ in range(INTERNAL):
            due = self._due() <= end + slack
            goal = max(self.now, self._due()) if due else end
            root, asked, timed = False, False, due
            if goal > self.now + slack:
                root, asked = self._internal_step(goal)
                timed = due and self.now >= goal - slack
            if timed:
                self._solver_at(goal)
            if self._over():
                return
            if root or asked or timed:
                recent.append(self.now)
                standing = len(recent) == STILL and self.now - recent[0] <= CLOSE * size
                if standing and not timed:
                    self._endless()
                self._event()
                if standing:
                    self.next = math.inf  # it names a time that is past again and again
                if self._over():
                    return
            if self.now >= end - slack and not self._due() <= end + slack:
                self._look(self._z)
                return
        self._stuck(f"{INTERNAL} steps are not enough")

    def _due(self) -> float:
        return self.next

    def _solver_at(self, time: float) -> None:
        """At the very time that the FMU named: a rounding less and it would not be its event yet."""
        self.now = max(self.now, time)
        self._arrive()

    def _internal_step(self, goal: float) -> tuple[bool, bool]:
        """One step of the solver towards `goal`: whether a root is there, and whether the FMU asks for an event."""
        try:
            self.now, root = self._solver.advance(goal)
        except RuntimeError as error:
            self._stuck(str(error))
        self._arrive()
        return root, self._told_of_steps and self._completed()

    def _completed(self) -> bool:
        """Tell the FMU that a step is accepted: whether it asks for an event."""
        flags = byref(self._event_flag), byref(self._end_flag)
        self._event_flag.value = self._end_flag.value = 0
        self._call("CompletedIntegratorStep", self.boolean(self._free.value), *flags)
        if self._end_flag.value:
            self.end(self.now)
        return bool(self._event_flag.value)

    def _stuck(self, said: str) -> NoReturn:
        inputs = dict(zip(self.inputs, self.u.tolist()))
        hint = "a looser or a tighter tolerance of this component; what its equations do there may have no solution."
        lines = [*self.log, f"the solver: {said}"]
        raise PartFailed(self.name, self.now, self._size.value, "no further step of the solver", inputs, lines, hint) from None

    def _endless(self) -> NoReturn:
        hint = "other parameters, or its interface for co-simulation; its events follow each other ever closer, without end."
        raise PartFailed(self.name, self.now, self._size.value, "events without end", {}, list(self.log), hint)

    # --- roll back -----------------------------------------------------------------------------------------------

    def save(self) -> Any:
        return super().save(), self.now, self.next

    def restore(self, state: Any) -> None:
        held, now, self.next = state
        super().restore(held)
        self.now = now
        for block in self._writes:
            block.last = None
        self._restart()


class ModelExchange2(Integrated, Fmi2):
    """One instance of an FMI 2.0 model exchange FMU."""

    called = MODEL_EXCHANGE

    def _count(self) -> tuple[int, int]:
        return self._binary.description.numberOfContinuousStates, self._binary.description.numberOfEventIndicators

    def _together(self, way: str, name: str) -> Any:
        return super()._together(way, name), way == "Set" and self.variables[name].variability != "continuous"

    def _settle(self, inputs: Sequence[Block] = ()) -> Update:
        self._take_waiting()
        for block in inputs:
            self._exchange_in(block)
        whole = Update(False, False, False, False, math.inf)
        for _ in range(EVENTS):
            told = fmi2.fmi2EventInfo()
            self._call("NewDiscreteStates", byref(told))
            whole.nominals |= bool(told.nominalsOfContinuousStatesChanged)
            whole.states |= bool(told.valuesOfContinuousStatesChanged)
            whole.next = told.nextEventTime if told.nextEventTimeDefined else math.inf
            whole.over = bool(told.terminateSimulation)
            if whole.over:
                self.end(self.now)
            if whole.over or not told.newDiscreteStatesNeeded:
                return whole
        self._endless()


class ModelExchange3(Integrated, Fmi3):
    """One instance of an FMI 3.0 model exchange FMU."""

    boolean = ctypes.c_bool
    derivatives_name = "GetContinuousStateDerivatives"

    def _instance_of(self, name: bytes, token: bytes, resources: bytes) -> Any:
        instantiate = self._function("fmi3InstantiateModelExchange", c_void_p)
        flags = ctypes.c_bool(False), ctypes.c_bool(True)
        return instantiate(name, token, resources, *flags, c_void_p(self._number), binary.hear3)

    def _finish_initialization(self) -> None:
        self._begin_clocks()
        super()._finish_initialization()

    def _count(self) -> tuple[int, int]:
        told = self._binary.description
        asked = self._asked_count("NumberOfContinuousStates"), self._asked_count("NumberOfEventIndicators")
        known = told.numberOfContinuousStates, told.numberOfEventIndicators
        return tuple(k if a is None else a for a, k in zip(asked, known))  # type: ignore[return-value]  # two each

    def _asked_count(self, name: str) -> int | None:
        if not self._has(f"fmi3Get{name}"):
            return None
        count = c_size_t()
        return count.value if self._function(f"fmi3Get{name}")(self._instance, byref(count)) <= WARNING else None

    def _settle(self, inputs: Sequence[Block] = ()) -> Update:
        return Fmi3._settle(self, inputs)

    def step(self, time: float, size: float) -> None:
        for reference in self._ticked:
            self._ticked[reference] = False
        super().step(time, size)

    def _due(self) -> float:
        return min(self.next, self._ticks.next)
