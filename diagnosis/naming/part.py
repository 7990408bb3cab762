"""A correction that steps in the compiled loop beside native FMUs: what the fits are made with.

The law is that of Correction.fmu (selflock.fmus.correction.law), compiled from the same source.
"""

from __future__ import annotations

from functools import cache
from pathlib import Path
from typing import Any, NoReturn

import numpy as np
from numba import carray, cfunc, types

from selflock.fmus.correction import law
from selflock.fmus.variable import Variable
from selflock.master.compiled import compiled_loops
from selflock.master.errors import PartFailed
from selflock.master.face import Part
from selflock.master.native import Native

from . import kernels

HEAD = {"since": law.SINCE, "until": law.UNTIL, "ahead": law.AHEAD, "ahead_beside": law.AHEAD_W}
BLOCK = types.CPointer(types.float64)


@cache
def _compiled() -> tuple[Any, Any]:
    """The step of a block, and the address of it as a C function."""
    advance: Any = compiled_loops(Path(kernels.__file__))["advance"]
    size = kernels.SIZE

    def do_step(instance, time, size_of_step, free):
        advance(carray(instance, size), size_of_step)
        return 0

    return advance, cfunc(types.int32(BLOCK, types.float64, types.float64, types.int32))(do_step)


def places(name: str, points: int = 0) -> dict[str, int]:
    """Where the numbers of a law lie in p, by their names."""
    known = law.BY_NAME[name]
    if known.code == law.TABLE:
        told = [f"{axis}{k + 1}" for k in range(points) for axis in "xy"]
    else:
        told = list(known.numbers)
    return HEAD | {word: law.FIRST + k for k, word in enumerate(told)}


class CompiledCorrection(Part):
    """signal, x and w in, corrected out."""

    can_roll_back = True
    instant = False  # it follows in a step

    def __init__(self, name: str, kind: str, multiplies: bool = False, taken: int = 0, own: bool = False, points: int = 0):
        """kind: the name of a law; taken: what of x, or of x and w; own: x is the signal; points: of a table."""
        self.places = places(kind, points)
        found = [
            Variable("signal", "", 0.0, "what is corrected", causality="input"),
            Variable("x", "", 0.0, "what the law goes with", causality="input"),
            Variable("beside", "", 0.0, "what it goes with beside x", causality="input"),
            # x counts from the first step on: an FMU that does not tell what acts at once is no loop then
            Variable("corrected", "", 0.0, "the signal as it is passed on", causality="output", depends_on=("signal",)),
            *(Variable(word, "", 0.0, "", causality="parameter") for word in self.places),
        ]
        self._head = float(law.BY_NAME[kind].code), float(multiplies), float(taken), float(own), float(points)
        self.block = np.zeros(kernels.SIZE)
        super().__init__(name, found)
        self._begin()

    def _begin(self) -> None:
        p = self.block[kernels.P : kernels.M]
        p[:] = 0.0
        p[law.LAW], p[law.MULTIPLIES], p[law.OVER], p[law.OWN], p[law.COUNT] = self._head
        p[law.UNTIL] = 1e300
        self.block[kernels.M :] = 0.0

    def bind(self, inputs, outputs) -> None:
        assert list(inputs) == ["signal", "x", "beside"][: len(inputs)], inputs
        self.inputs, self.outputs = tuple(inputs), tuple(outputs)
        self.u, self.y = self.block[: len(inputs)], self.block[kernels.OUT : kernels.OUT + len(outputs)]

    def reset(self) -> None:
        self.block[: kernels.P] = 0.0
        self._begin()

    def set(self, name: str, value: Any) -> None:
        self._told(name)
        self.block[self._place(name)] = value

    def get(self, name: str) -> float:
        self._told(name)
        return float(self.block[self._place(name)])

    def _place(self, name: str) -> int:
        fixed = {"signal": kernels.SIGNAL, "x": kernels.X, "beside": kernels.W, "corrected": kernels.OUT}
        return fixed[name] if name in fixed else kernels.P + self.places[name]

    def write(self) -> None: ...

    def read(self) -> None:
        _compiled()[0](self.block, 0.0)

    def cycle(self, time: float, size: float) -> None:
        self.step(time, size)

    def step(self, time: float, size: float) -> None:
        _compiled()[0](self.block, size)

    def native(self) -> Native:
        return Native(self.block.ctypes.data, _compiled()[1].address, 1, (), (), self._finish, self._fail)

    def _finish(self, status: int, time: float, size: float) -> None:
        self._fail(status, "fmi2DoStep", time, size)

    def _fail(self, status: int, name: str, time: float, size: float) -> NoReturn:
        raise PartFailed(self.name, time, size, f"{name}: {status}", {}, [])

    def save(self) -> np.ndarray:
        return self.block.copy()

    def restore(self, state: np.ndarray) -> None:
        given = self.u.copy()
        self.block[:] = state
        self.u[:] = given  # as of any part: what it is given is no state of it, and a loop puts a trial value there before
