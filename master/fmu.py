"""FMUs of FMI 2.0, and those for co-simulation as parts: they are stepped in the compiled loop, too."""

from __future__ import annotations

import math
import time as clock
from collections.abc import Callable
from ctypes import byref, c_char_p, c_double, c_int, c_size_t, c_void_p, create_string_buffer
from typing import Any, NoReturn

import numpy as np
from fmpy import fmi2

from . import binary
from .block import address
from .errors import DescriptionError
from .instance import DISCARD, ERROR, FATAL, PENDING, WARNING, Fmu
from .native import BEYOND, Native

FROZEN = 128 << 20  # bytes of the largest state that is saved
PARTIAL_STEPS = 1000  # how often an FMU may discard the rest of one step
CO_SIMULATION, MODEL_EXCHANGE = 1, 0  # fmi2Type


class Fmi2(Fmu):
    """The calls of FMI 2.0."""

    standard = "fmi2"
    kinds = {
        "Real": (c_double, float),
        "Integer": (c_int, np.intc),
        "Boolean": (c_int, np.intc),
        "String": (c_char_p, None),
    }
    called = CO_SIMULATION

    def _instantiate(self) -> None:
        instantiate = self._function("fmi2Instantiate", c_void_p)
        guid = (self._binary.description.guid or "").encode()
        resources = (self._binary.folder / "resources").as_uri().encode()
        self._callbacks = binary.callbacks(self._number)
        name, callbacks = self.name.encode(), byref(self._callbacks)
        self._made(instantiate(name, c_int(self.called), guid, resources, callbacks, c_int(0), c_int(1)))

    def _begin(self, given: dict[str, Any], start: float, stop: float | None) -> None:
        tolerance = c_int(self._tolerance > 0.0), c_double(self._tolerance)
        self._call("SetupExperiment", *tolerance, c_double(start), c_int(stop is not None), c_double(stop or 0.0))
        self._again(given)  # there are FMUs (20-sim's) that take their defaults back at fmi2SetupExperiment,
        self._call("EnterInitializationMode")
        self._again({name: value for name, value in given.items() if self._late(name)})  # or here


class FmuPart(Fmi2):
    """One instance of an FMI 2.0 co-simulation FMU.

    A step that the FMU discards after a last successful time is finished from there with the same inputs.
    """

    def _instantiate(self) -> None:
        self._do_step = self._function("fmi2DoStep")
        self.interpolates = bool(self._way.canInterpolateInputs)
        self.frozen = self._binary.description.coSimulation.canSerializeFMUstate
        super()._instantiate()

    # --- the path of every step ----------------------------------------------------------------------------------

    def stepper(self) -> Callable[[float, float], None]:
        """write, step and read as one function: the C calls and no more, everything they need looked up before."""
        writes, reads = ([block.call for block in blocks] for blocks in (self._writes, self._reads))
        do_step, instance, now, span = self._do_step, self._instance, self._time, self._size
        if [block.real for block in self._writes] == [block.real for block in self._reads] == [True]:
            set_real, (given, given_count, u), *_ = writes[0]
            get_real, (taken, taken_count, y), *_ = reads[0]

            def reals(time: float, size: float) -> None:
                now.value = time
                span.value = size
                status = set_real(instance, given, given_count, u)
                if status > 1:
                    self._fail(status, "fmi2SetReal")
                status = do_step(instance, now, span, self._free)
                if status > 1:
                    self._unfinished(status, time, time + size)
                status = get_real(instance, taken, taken_count, y)
                if status > 1:
                    self._fail(status, "fmi2GetReal")

            return reals

        def cycle(time: float, size: float) -> None:
            now.value = time
            span.value = size
            for function, (references, count, pointer), copies, values, typed, _, name in writes:
                try:
                    for i, k in copies:
                        typed[k] = int(values[i])
                except (ValueError, OverflowError):
                    self._fail(BEYOND, name)
                status = function(instance, references, count, pointer)
                if status > 1:
                    self._fail(status, name)
            status = do_step(instance, now, span, self._free)
            if status > 1:
                self._unfinished(status, time, time + size)
            for function, (references, count, pointer), copies, values, typed, _, name in reads:
                status = function(instance, references, count, pointer)
                if status > 1:
                    self._fail(status, name)
                for i, k in copies:
                    values[i] = typed[k]

        return cycle

    def step(self, time: float, size: float) -> None:
        self._time.value = time
        self._size.value = size
        status = self._do_step(self._instance, self._time, self._size, self._free)
        if status > 1:
            self._unfinished(status, time, time + size)

    def _unfinished(self, status: int, time: float, end: float) -> None:
        """A step that did not end with OK: wait for a pending one, go on from where a discarded one stopped."""
        tiny = 1e-9 * (end - time)
        for _ in range(PARTIAL_STEPS):
            if status == PENDING:
                status = self._wait()
            if status <= WARNING:
                return
            if status != DISCARD:
                break
            complained = self._complained()  # before it is asked for more, which it may not know
            reached = self._status("fmi2GetRealStatus", c_double(math.nan), fmi2.fmi2LastSuccessfulTime)
            if self._status("fmi2GetBooleanStatus", c_int(0), fmi2.fmi2Terminated):
                if complained:
                    break
                return self.end(min(max(reached, time), end) if math.isfinite(reached) else time)
            if reached >= end - tiny:
                return
            if not reached > time + tiny:
                break
            time = self._time.value = reached
            self._size.value = end - reached
            status = self._do_step(self._instance, self._time, self._size, self._free)
        self._size.value = end - time
        self._fail(status, "fmi2DoStep")

    def _complained(self) -> bool:
        """Whether it named an error last: pythonfmu says "terminated" of every step that its slave did not make."""
        return bool(self.log) and self.log[-1].startswith((binary.STATUS[ERROR], binary.STATUS[FATAL]))

    def _wait(self) -> int:
        while (status := self._status("fmi2GetStatus", c_int(PENDING), fmi2.fmi2DoStepStatus)) == PENDING:
            clock.sleep(1e-4)
        return status

    def _status(self, name: str, value, what: int):
        self._function(name)(self._instance, c_int(what), byref(value))
        return value.value

    def native(self) -> Native | None:
        return Native(
            address(self._instance),
            address(self._do_step),
            self._free.value,
            tuple(block.native() for block in self._writes),
            tuple(block.native() for block in self._reads),
            self._finish_native,
            self._fail_native,
            python=hasattr(self._library, "selflock_python") or hasattr(self._library, "finalizePythonInterpreter"),
        )

    def _finish_native(self, status: int, time: float, size: float) -> None:
        self._time.value, self._size.value = time, size
        self._unfinished(status, time, time + size)

    def _fail_native(self, status: int, function: str, time: float, size: float) -> NoReturn:
        self._time.value, self._size.value = time, size
        self._fail(status, function)

    # --- into another process --------------------------------------------------------------------------------------

    def freeze(self) -> bytes:
        state, size = self.save(), c_size_t(0)
        self._call("SerializedFMUstateSize", state.pointer, byref(size))
        if size.value > FROZEN:
            raise DescriptionError(f"The state of {self.name} has {size.value >> 20} MiB; at most {FROZEN >> 20} are saved.")
        content = create_string_buffer(max(size.value, 1))
        self._call("SerializeFMUstate", state.pointer, content, size)
        return content.raw[: size.value]

    def thaw(self, frozen: bytes) -> None:
        state = self.save()  # a pointer to one, which is freed like it
        if state.pointer:
            self._call("FreeFMUstate", byref(state.pointer))
            state.pointer = c_void_p()
        given = create_string_buffer(frozen, max(len(frozen), 1))
        self._call("DeSerializeFMUstate", given, c_size_t(len(frozen)), byref(state.pointer))
        self.restore(state)
