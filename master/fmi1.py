"""FMUs of FMI 1.0 for co-simulation as parts.

They are initialized in one call, with what was set before it; inputs that come from others reach them after it.
"""

from __future__ import annotations

from ctypes import c_byte, c_char_p, c_double, c_int, c_void_p
from typing import Any

import numpy as np

from . import binary
from .instance import WARNING, Fmu


class CoSimulation1(Fmu):
    """One instance of an FMI 1.0 co-simulation FMU."""

    standard = "fmi"
    kinds = {
        "Real": (c_double, float),
        "Integer": (c_int, np.intc),
        "Enumeration": (c_int, np.intc),
        "Boolean": (c_byte, np.int8),
        "String": (c_char_p, None),
    }

    def _symbol(self, name: str) -> str:
        return f"{self._way.modelIdentifier}_{name}"

    def _instantiate(self) -> None:
        instantiate = self._function("fmiInstantiateSlave", c_void_p)
        self._do_step = self._function("fmiDoStep")
        described, folder = self._binary.description, self._binary.folder.as_uri().encode()
        self._callbacks = binary.callbacks1(self._number)
        flags = c_double(0.0), c_byte(0), c_byte(0)  # timeout, visible, interactive
        kind = b"application/x-fmu-sharedlibrary"
        name, guid = self.name.encode(), (described.guid or "").encode()
        self._made(instantiate(name, guid, folder, kind, *flags, self._callbacks, c_byte(1)))

    def _named(self, way: str, kind: str) -> str:
        return super()._named(way, "Integer" if kind == "Enumeration" else kind)

    def _begin(self, given: dict[str, Any], start: float, stop: float | None) -> None:
        self._call("InitializeSlave", c_double(start), c_byte(stop is not None), c_double(stop or 0.0))
        parameters = {name: value for name, value in given.items() if self.variables[name].causality == "parameter"}
        self._again({name: value for name, value in parameters.items() if self._taken(name) != value})

    def _finish_initialization(self) -> None:
        """It was initialized in one call."""

    def reset(self) -> None:
        self._alive, self._given, self.untaken = False, {}, {}
        self.ends.clear()
        status = self._function("fmiResetSlave")(self._instance)
        if status > WARNING:
            self._fail(status, "fmiResetSlave")

    def terminate(self) -> None:
        if self._alive:
            self._alive = False
            self._function("fmiTerminateSlave")(self._instance)

    def close(self) -> None:
        if self._instance:
            self._alive = False
            self._function("fmiFreeSlaveInstance", None)(self._instance)
            self._instance = c_void_p()
        binary.forget(self._number)

    def step(self, time: float, size: float) -> None:
        self._time.value, self._size.value = time, size
        status = self._do_step(self._instance, self._time, self._size, c_byte(1))
        if status > WARNING:
            self._fail(status, "fmiDoStep")
