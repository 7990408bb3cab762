"""What one C call of an FMU exchanges: variables of one type that lie side by side in `u` or `y`."""

from __future__ import annotations

import ctypes
from ctypes import c_size_t, c_void_p
from typing import TYPE_CHECKING, Any

import numpy as np

from .described import negative
from .errors import DescriptionError
from .face import view
from .native import Exchange

if TYPE_CHECKING:
    from .instance import Fmu


class Block:
    """Variables of one type, side by side in `u` or `y`, that go in or come out with one C call; or elements of an array."""

    def __init__(self, part: Fmu, way: str, names: list[str], first: int, values: np.ndarray):
        places = [part._place(name) for name in names]
        self.kind, array, count, self.negated = places[0].kind, places[0].array, len(names), places[0].negated
        if part.variables[names[0]].type == "String":
            raise DescriptionError(f"{part.name}: strings do not travel with the numbers of a step.")
        self.names, self.first = names, first
        self.name = part._named(way, self.kind)
        self.function = part._function(self.name)
        dtype = np.dtype(part.kinds[self.kind][1])
        self.real = dtype == np.float64 and not array and not self.negated  # the C call works on `u` or `y` itself
        self._references = np.array([place.reference for place in places[: 1 if array else None]], dtype=np.uint32)
        self.own: np.ndarray
        if self.real:
            self.own = values[first : first + count]
        elif array:
            self.own = part._array(names[0], places[0]) if way == "Set" else np.zeros(places[0].count, dtype)
        else:
            self.own = np.zeros(count, dtype)
        self.references = c_void_p(self._references.ctypes.data)
        self.count = c_size_t(len(self._references))
        self.pointer = c_void_p(self.own.ctypes.data)
        at = [place.index for place in places] if array else range(count)
        self.copies = [] if self.real else [(first + k, place) for k, place in enumerate(at)]  # (in `u` or `y`, in `own`)
        self.wide = way == "Get" and dtype.kind in "iu" and dtype.itemsize == 8
        plain: Any = float if dtype.kind == "f" else int
        convert = (lambda value: plain(negative(self.kind, value))) if self.negated else plain
        arguments = self.references, self.count, self.pointer, *part._counted(len(self.own))
        self.call: tuple[Any, ...] = self.function, arguments, self.copies, view(values), self.own.data, convert, self.name
        self.discrete = part.variables[names[0]].variability != "continuous"
        self.last: np.ndarray | None = None
        self._values = values[first : first + count]

    def renewed(self) -> bool:
        """Whether the numbers in `u` are others than when this was asked last."""
        if self.last is not None and np.array_equal(self.last, self._values):
            return False
        self.last = self._values.copy()
        return True

    def native(self) -> Exchange:
        copies = tuple((place, self.own.ctypes.data + k * self.own.itemsize) for place, k in self.copies)
        addresses = address(self.function), address(self.references), len(self._references), address(self.pointer)
        return Exchange(self.name, *addresses, copies)


def address(pointer: Any) -> int:
    """Where a C function lies, or what a pointer points to."""
    return ctypes.cast(pointer, c_void_p).value or 0
