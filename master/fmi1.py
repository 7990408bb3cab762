"""FMUs of FMI 1.0, for co-simulation and for model exchange, as parts.

They are initialized in one call, with what was set before it; inputs that come from others reach them after it.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from ctypes import byref, c_byte, c_char_p, c_double, c_int, c_void_p
from typing import Any

import numpy as np
from fmpy import fmi1

from . import binary
from .block import Block
from .exchange import EVENTS, Integrated
from .fmi3 import Update
from .instance import WARNING, Fmu


class Fmi1(Fmu):
    """The calls of FMI 1.0."""

    standard = "fmi"
    kinds = {
        "Real": (c_double, float),
        "Integer": (c_int, np.intc),
        "Enumeration": (c_int, np.intc),
        "Boolean": (c_byte, np.int8),
        "String": (c_char_p, None),
    }
    ending: str  # Slave or Model: at the end of the names of what makes, initializes and frees it

    def _symbol(self, name: str) -> str:
        return f"{self._way.modelIdentifier}_{name}"

    def _named(self, way: str, kind: str) -> str:
        return super()._named(way, "Integer" if kind == "Enumeration" else kind)

    def _known(self) -> tuple[bytes, bytes]:
        """The name of the instance, and the GUID."""
        return self.name.encode(), (self._binary.description.guid or "").encode()

    def _parameters(self, given: dict[str, Any]) -> None:
        """Set again those that the initialization took back."""
        mine = {name: value for name, value in given.items() if self.variables[name].causality == "parameter"}
        self._again({name: value for name, value in mine.items() if self._taken(name) != value})

    def _finish_initialization(self) -> None:
        """It was initialized in one call."""

    def _fresh(self) -> None:
        self._alive, self._given, self.untaken = False, {}, {}
        self._held.clear()
        self.ends.clear()

    def close(self) -> None:
        if self._instance:
            self._alive = False
            self._function(f"fmiFree{self.ending}Instance", None)(self._instance)
            self._instance = c_void_p()
        binary.forget(self._number)


class CoSimulation1(Fmi1):
    """One instance of an FMI 1.0 co-simulation FMU."""

    ending = "Slave"

    def _instantiate(self) -> None:
        instantiate = self._function("fmiInstantiateSlave", c_void_p)
        self._do_step = self._function("fmiDoStep")
        self.interpolates = bool(self._way.canInterpolateInputs)
        self._callbacks = binary.callbacks1(self._number)
        flags = c_double(0.0), c_byte(0), c_byte(0)  # timeout, visible, interactive
        place = self._binary.folder.as_uri().encode(), b"application/x-fmu-sharedlibrary"
        self._made(instantiate(*self._known(), *place, *flags, self._callbacks, c_byte(1)))

    def _begin(self, given: dict[str, Any], start: float, stop: float | None) -> None:
        self._call("InitializeSlave", c_double(start), c_byte(stop is not None), c_double(stop or 0.0))
        self._parameters(given)

    def reset(self) -> None:
        self._fresh()
        self._call("ResetSlave")

    def terminate(self) -> None:
        if self._alive:
            self._alive = False
            self._function("fmiTerminateSlave")(self._instance)

    def step(self, time: float, size: float) -> None:
        self._time.value, self._size.value = time, size
        status = self._do_step(self._instance, self._time, self._size, c_byte(1))
        if status > WARNING:
            self._fail(status, "fmiDoStep")


class ModelExchange1(Integrated, Fmi1):
    """One instance of an FMI 1.0 model exchange FMU: it has no modes, and an event is one call."""

    ending = "Model"
    boolean = c_byte
    nominals_name = "GetNominalContinuousStates"
    needs = ("SetTime", "EventUpdate")

    def _instantiate(self) -> None:
        for name in self.needs:
            self._function(self.standard + name)
        self._callbacks = binary.callbacks1(self._number)
        instantiate = self._function("fmiInstantiateModel", c_void_p)
        self._first: Any = None  # what it said of events when it was initialized
        self._made(instantiate(*self._known(), self._callbacks, c_byte(1)))

    def _begin(self, given: dict[str, Any], start: float, stop: float | None) -> None:
        self._call("SetTime", c_double(start))
        self._first = fmi1.fmi1EventInfo()
        self._call("Initialize", c_byte(self._tolerance > 0.0), c_double(self._tolerance), byref(self._first))
        self._parameters(given)

    def reset(self) -> None:
        self._fresh()
        self._function("fmiFreeModelInstance", None)(self._instance)
        self._instantiate()

    def terminate(self) -> None:
        if self._alive:
            self._alive = False
            self._function("fmiTerminate")(self._instance)

    def _count(self) -> tuple[int, int]:
        return self._binary.description.numberOfContinuousStates, self._binary.description.numberOfEventIndicators

    def _to_events(self) -> None: ...

    def _to_equations(self) -> None: ...

    def _completed(self) -> bool:
        self._event_flag.value = 0
        self._call("CompletedIntegratorStep", byref(self._event_flag))
        return bool(self._event_flag.value)

    def _settle(self, inputs: Sequence[Block] = ()) -> Update:
        self._take_waiting()
        for block in inputs:
            self._exchange_in(block)
        told, self._first = None if self._writes else self._first, None
        for _ in range(EVENTS):
            if told is None:
                told = fmi1.fmi1EventInfo()
                self._call("EventUpdate", c_byte(0), byref(told))
            done, over, timed = (
                field != b"\x00" for field in (told.iterationConverged, told.terminateSimulation, told.upcomingTimeEvent)
            )
            if over:
                self.end(self.now)
            if done or over:
                return Update(False, over, False, False, told.nextEventTime if timed else math.inf)
            told = None
        self._endless()
