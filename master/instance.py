"""What all instances of FMUs have in common, of whichever version of FMI and interface: life, values, exchange.

Subclasses give the calls of their version (`Fmi1`, `Fmi2`, `Fmi3`) and what a step is (co-simulation, model exchange,
scheduled execution). C functions are called directly, on buffers that are allocated once.
"""

from __future__ import annotations

import ctypes
import math
from collections.abc import Iterator, Mapping, Sequence
from ctypes import byref, c_double, c_int, c_size_t, c_uint, c_void_p
from itertools import groupby
from pathlib import Path
from typing import Any, ClassVar, NoReturn

import numpy as np

from . import binary
from .block import Block
from .described import Slot, negative, places_of, sizes_in, tolerance_of, units_of, variables_of
from .errors import DescriptionError, PartFailed
from .face import Part
from .native import BEYOND

OK, WARNING, DISCARD, ERROR, FATAL, PENDING = range(6)
SINGLE = 2.0**-23  # relative: numbers that a parameter's float cannot tell apart
EXACT = 2**53  # up to which a float is every whole number
INEXACT = 8  # no status: a whole number beyond that

HINTS = {
    DISCARD: "a smaller [run] step, or a smaller `step` for this component; its inputs may also be out of its range.",
    ERROR: "read what it said above; check its inputs and its parameters in the system file.",
    BEYOND: "a smaller factor or offset of what it is connected to.",
    INEXACT: "leave it out of what is recorded and connected.",
    FATAL: "`process = true` for this component keeps the master safe from it; report it to whoever made the FMU.",
}


class Fmu(Part):
    """One instance of an FMU.

    Integers, Booleans and enumerations cross as floats in `u` and `y`; strings only through `set` and `get`.
    """

    standard: ClassVar[str]  # in front of the names of its functions
    frozen = False  # its state stays in this process, but for what says otherwise
    instant = False  # FMI: after a step nothing may be read again for other inputs, but for what says otherwise
    events = False  # once it runs, what is discrete is set in event mode
    kinds: ClassVar[Mapping[str, tuple[Any, Any]]]  # by the names of types there: the C type, and numpy's for exchange

    def __init__(
        self,
        name: str,
        path: Path | str,
        tolerance: float | None = None,
        interface: str = "",
        sizes: Mapping[str, int] | None = None,
    ):
        """tolerance: relative, what its solver is told; 0: nothing, None: what its default experiment says.

        interface: "cs", "me" or "se"; the first that it has where none is named. sizes: of its structural parameters.
        """
        self._binary = binary.open_fmu(path)
        described = self._binary.description
        self.interface, self._way = self._binary.interface(interface)
        self._library = self._binary.library(self._way.modelIdentifier or "")
        self._sizes = dict(sizes or {})
        self._functions: dict[str, Any] = {}
        try:
            super().__init__(name, variables_of(described, self._sizes))
            self._places = places_of(described, self._sizes)
        except DescriptionError as error:
            raise DescriptionError(f"{path}: {error}") from None
        self.path = Path(path)
        self._asked = tolerance is not None
        self._tolerance = tolerance_of(described) if tolerance is None else tolerance
        self.variable_step = getattr(self._way, "canHandleVariableCommunicationStepSize", True)
        self.can_roll_back = self._way.canGetAndSetFMUstate
        self.units = units_of(described)
        self._writes: list[Block] = []
        self._reads: list[Block] = []
        self._held: dict[str, Any] = {}  # single values that were set while it runs
        self._waiting: dict[str, Any] = {}  # those of them for the event that is to come
        self._arrays: dict[int, Any] = {}  # by reference: what an array that was set holds
        self._time, self._size, self._free = c_double(0.0), c_double(0.0), c_int(1)
        self._instance = c_void_p()
        self._told_slopes = True  # as far as it was asked
        self._alive = False  # between exit of initialization and terminate
        self._given: dict[str, Any] | None = {}  # values set so far; None from initialization mode on
        self._wanted: dict[str, Any] = {}  # parameters among them
        self._number, self.log = binary.voice(name)
        self._instantiate()

    # --- calls ---------------------------------------------------------------------------------------------------

    def _function(self, name: str, result: Any = c_int) -> Any:
        if name in self._functions:
            return self._functions[name]
        try:
            function = self._library[self._symbol(name)]  # a fresh object: argument types of others do not reach it
        except AttributeError:
            raise DescriptionError(f"The binary of {self.path} lacks {name}, without which it cannot be stepped.") from None
        function.restype = result
        self._functions[name] = function
        return function

    def _has(self, name: str) -> bool:
        return hasattr(self._library, self._symbol(name))

    def _symbol(self, name: str) -> str:
        return name

    def _call(self, name: str, *arguments: Any) -> None:
        name = self.standard + name
        status = self._function(name)(self._instance, *arguments)
        if status > WARNING:
            self._fail(status, name)

    def _fail(self, status: int, function: str) -> NoReturn:
        inputs = {name: value for name, value in zip(self.inputs, self.u.tolist())}
        said = f"{binary.STATUS[status] if 0 <= status < 6 else status} to {function}"
        if status == BEYOND:
            said = f"nothing, for an Integer among its inputs would be beyond {self._width(function)} bits ({function}),"
        if status == INEXACT:
            said = f"a whole number beyond 2^53 ({function}), which a table of numbers does not hold,"
        if status == FATAL:
            self._instance = c_void_p()  # FMI: after Fatal nothing may be called any more, not even free
        raise PartFailed(self.name, self._time.value, self._size.value, said, inputs, list(self.log), HINTS.get(status, ""))

    def _width(self, function: str) -> int:
        return 8 * next((ctypes.sizeof(kind) for name, (kind, _) in self.kinds.items() if function.endswith(f"Set{name}")), 4)

    # --- life ----------------------------------------------------------------------------------------------------

    def _instantiate(self) -> None:
        """Make `_instance`."""
        raise NotImplementedError

    def _made(self, instance: Any) -> None:
        self._instance = c_void_p(instance)
        if not self._instance:
            hint = f"see whether {self.path} runs alone in another tool."
            if getattr(self._way, "needsExecutionTool", False):
                hint = f"{self.path} needs the tool that made it (needsExecutionTool); install that on this machine, with its licence."
            raise PartFailed(self.name, 0.0, 0.0, "no instance", {}, list(self.log), hint)

    def enter_initialization(self, start: float, stop: float | None) -> None:
        self._time.value = start
        given, self._given = self._given or {}, None
        self._begin(given, start, stop)
        self._wanted = {name: value for name, value in given.items() if self.variables[name].causality == "parameter"}

    def _begin(self, given: dict[str, Any], start: float, stop: float | None) -> None:
        """Enter initialization mode, and set again what may have been lost of what was given."""
        raise NotImplementedError

    def _again(self, given: dict[str, Any]) -> None:
        """Set once more what was set. An FMU that refuses that has it already, or is found out when it is read back."""
        for name, value in given.items():
            status = self._put(name, value)
            if status == FATAL:
                self._fail(status, self._named("Set", self._places[name].kind))

    def _late(self, name: str) -> bool:
        """Whether FMI 2.0 (section 4.2.4) and 3.0 let it be set in initialization mode."""
        variable = self.variables[name]
        return variable.causality == "input" or (variable.variability != "constant" and variable.initial == "exact")

    def exit_initialization(self) -> None:
        self._finish_initialization()
        self._alive = True
        found = {name: self._taken(name) for name in self._wanted}
        given = {name: self._as_taken(name, value) for name, value in self._wanted.items()}
        self.untaken = {name: found[name] for name, value in given.items() if not _same(value, found[name])}

    def _as_taken(self, name: str, value: Any) -> Any:
        """A value as it would be read back."""
        kind = self._place(name).kind
        return self._plain(kind, self._converted(name, kind, value))

    def _finish_initialization(self) -> None:
        self._call("ExitInitializationMode")

    def _taken(self, name: str) -> Any:
        """The value that a parameter has; None where the FMU does not tell."""
        status, value = self._ask(name)
        if status == FATAL:
            self._fail(status, self._named("Get", self._places[name].kind))
        return value if status <= WARNING else None

    def reset(self) -> None:
        self._call("Reset")
        self._alive, self._given, self.untaken = False, {}, {}
        self._arrays.clear()
        self._held.clear()
        self.ends.clear()

    def suits(self, given: Mapping[str, Any]) -> bool:
        return sizes_in(self._binary.description, given) == self._sizes

    def _over(self) -> bool:
        """Whether it has ended the run itself."""
        return any(name == self.name for name, _ in self.ends)

    def terminate(self) -> None:
        if self._alive:
            self._alive = False
            status = self._function(f"{self.standard}Terminate")(self._instance)
            if status > WARNING and not self._over():  # else it has ended already
                self._fail(status, f"{self.standard}Terminate")

    def close(self) -> None:
        if self._instance:
            self._alive = False
            self._function(f"{self.standard}FreeInstance", None)(self._instance)
            self._instance = c_void_p()
        binary.forget(self._number)

    # --- single values -------------------------------------------------------------------------------------------

    def set(self, name: str, value: Any) -> None:
        discrete = self.events and self._alive and self.variables[name].variability != "continuous"
        if discrete and name in self._held and self._held[name] == value:
            return
        if discrete and not self._over():
            self._held[name] = self._waiting[name] = value
            return self._changed(())
        self._set_now(name, value)

    def _changed(self, inputs: Sequence[Block]) -> None:
        """Take in discrete inputs that changed, as an event."""
        raise NotImplementedError

    def _take_waiting(self) -> None:
        for name, value in self._waiting.items():
            self._set_now(name, value)
        self._waiting.clear()

    def _set_now(self, name: str, value: Any) -> None:
        status = self._put(name, value)
        if status > WARNING:
            self._fail(status, self._named("Set", self._places[name].kind))
        if self._given is not None:
            self._given[name] = value

    def get(self, name: str) -> Any:
        status, value = self._ask(name)
        if status > WARNING:
            self._fail(status, self._named("Get", self._places[name].kind))
        return value

    def _place(self, name: str) -> Slot:
        if name not in self._places:
            raise DescriptionError(f"{self.name} has no variable {name}.")
        return self._places[name]

    def _named(self, way: str, kind: str) -> str:
        return f"{self.standard}{way}{kind}"

    def _put(self, name: str, value: Any) -> int:
        place = self._place(name)
        one = self._converted(name, place.kind, value)
        if not place.array:
            return self._set(place.kind, place.reference, [negative(place.kind, one) if place.negated else one])
        values = self._array(name, place)
        values[place.index] = one
        return self._set(place.kind, place.reference, values if isinstance(values, list) else values.tolist())

    def _ask(self, name: str) -> tuple[int, Any]:
        place = self._place(name)
        status, values = self._get(place.kind, place.reference, place.count)
        value = values[place.index]
        return status, self._plain(place.kind, negative(place.kind, value) if place.negated else value)

    def _array(self, name: str, place: Slot) -> Any:
        """The values of an array, as they were set or start: what its other elements are when one is set."""
        if place.reference not in self._arrays:
            stem = name[: name.rindex("[")]
            mine = [
                (p.index, self.variables[n].start)
                for n, p in self._places.items()
                if p.reference == place.reference and n.startswith(f"{stem}[")
            ]
            starts = [start for _, start in sorted(mine)]
            if any(start is None for start in starts):
                status, starts = self._get(place.kind, place.reference, place.count)
                if status > WARNING:
                    raise DescriptionError(f"{self.name}.{name}: the other elements of its array are not known; give them all.")
                starts = [self._plain(place.kind, start) for start in starts]
            given = [self._converted(name, place.kind, start) for start in starts]
            kept = self.kinds[place.kind][1]
            self._arrays[place.reference] = given if kept is None else np.array(given, dtype=kept)
        return self._arrays[place.reference]

    def _converted(self, name: str, kind: str, value: Any) -> Any:
        """A value as its C type takes it. Raises DescriptionError."""
        variable = self.variables[name]
        if variable.type == "String":
            return str(value).encode()
        if variable.type == "Real":
            return float(value)
        number = int(value)
        least, most = variable.integers
        if variable.type == "Integer" and not least <= number <= most:
            raise DescriptionError(f"{self.name}.{name} = {number} {variable.beyond}.")
        return number

    def _plain(self, kind: str, value: Any) -> Any:
        """A value of a C type as Python has it."""
        if isinstance(value, bytes) or value is None:
            return (value or b"").decode("utf-8", "replace")
        return bool(value) if kind == "Boolean" else value.item() if isinstance(value, np.generic) else value

    def _set(self, kind: str, reference: int, values: list[Any]) -> int:
        function = self._function(self._named("Set", kind))
        given = (self.kinds[kind][0] * len(values))(*values)
        return function(self._instance, byref(c_uint(reference)), c_size_t(1), given, *self._counted(len(values)))

    def _get(self, kind: str, reference: int, count: int) -> tuple[int, list[Any]]:
        function = self._function(self._named("Get", kind))
        taken = (self.kinds[kind][0] * count)()
        status = function(self._instance, byref(c_uint(reference)), c_size_t(1), taken, *self._counted(count))
        return status, list(taken)

    def _news(self, block: Block) -> bool:
        """Whether inputs are others than those that it has."""
        return block.renewed()

    def _counted(self, count: int) -> tuple[c_size_t, ...]:
        """What a call of the version says of the number of values."""
        return ()

    # --- the path of every step ----------------------------------------------------------------------------------

    def bind(self, inputs: Sequence[str], outputs: Sequence[str]) -> None:
        """Say which numbers go in through `u` and come out through `y`, in this order; best all of one type side by side."""
        self.inputs, self.outputs = tuple(inputs), tuple(outputs)
        self.u = np.array([float(self.variables[name].start or 0.0) for name in inputs], dtype=float)
        self.y = np.zeros(len(outputs))
        self._writes = list(self._blocks("Set", inputs, self.u))
        self._reads = list(self._blocks("Get", outputs, self.y))

    def _blocks(self, way: str, names: Sequence[str], values: np.ndarray) -> Iterator[Block]:
        """The runs of names that one call exchanges."""
        first = 0
        for _, run in groupby(names, lambda name: self._together(way, name)):
            block = Block(self, way, list(run), first, values)
            first += len(block.names)
            yield block

    def _together(self, way: str, name: str) -> Any:
        """What is the same of names that one call exchanges."""
        place = self._place(name)
        return place.kind, place.reference if place.array else None, place.negated

    def write(self) -> None:
        for block in self._writes:
            self._exchange_in(block)

    def _exchange_in(self, block: Block) -> None:
        function, arguments, copies, values, own, convert, name = block.call
        try:
            for i, k in copies:
                own[k] = convert(values[i])
        except (ValueError, OverflowError):
            self._fail(BEYOND, name)
        status = function(self._instance, *arguments)
        if status > 1:
            self._fail(status, name)

    def read(self) -> None:
        for block in self._reads:
            self._exchange_out(block)

    def _exchange_out(self, block: Block) -> None:
        function, arguments, copies, values, own, _, name = block.call
        status = function(self._instance, *arguments)
        if status > 1:
            self._fail(status, name)
        for i, k in copies:
            values[i] = negative(block.kind, own[k]) if block.negated else own[k]
        if block.wide and any(abs(own[k]) > EXACT for _, k in copies):
            self._fail(INEXACT, name)

    def probe(self) -> None:
        for block in self._writes:
            if not (self.events and block.discrete):
                self._exchange_in(block)
        self.read()

    def slopes(self, place: int) -> np.ndarray | None:
        """By the FMU's own directional derivatives."""
        if not getattr(self._way, "providesDirectionalDerivative", False) or not self._told_slopes:
            return None
        name = self.inputs[place]
        wanted = [k for k, output in enumerate(self.outputs) if self._follows(output, name)]
        references = (c_uint * len(wanted))(*(self._places[self.outputs[k]].reference for k in wanted))
        seed, found = c_double(1.0), (c_double * len(wanted))()
        given = references, c_size_t(len(wanted)), byref(c_uint(self._places[name].reference)), c_size_t(1), byref(seed)
        status = self._function(f"{self.standard}GetDirectionalDerivative")(
            self._instance, *given, *self._counted(1), found, *self._counted(len(wanted))
        )
        if status == FATAL:
            self._fail(status, f"{self.standard}GetDirectionalDerivative")
        self._told_slopes = status <= WARNING and bool(np.isfinite(found).all())
        slopes = np.zeros(len(self.y))
        slopes[wanted] = found
        return slopes if self._told_slopes else None

    def _follows(self, output: str, name: str) -> bool:
        """Whether an output is a continuous number, no element of an array, that may depend on an input at once."""
        variable, known = self.variables[output], self.variables[output].depends_on
        continuous = (variable.causality, variable.type, variable.variability) == ("output", "Real", "continuous")
        return continuous and not self._places[output].array and (known is None or name in known)

    def tilt(self, rates: Mapping[int, float]) -> None:
        count, places = len(rates), [self._places[self.inputs[place]].reference for place in rates]
        given = (c_uint * count)(*places), c_size_t(count), (c_int * count)(*[1] * count), (c_double * count)(*rates.values())
        self._call("SetRealInputDerivatives", *given)

    def rate(self, place: int) -> float:
        if not (getattr(self._way, "maxOutputDerivativeOrder", 0) or 0):
            return 0.0
        found = c_double(0.0)
        given = byref(c_uint(self._places[self.outputs[place]].reference)), c_size_t(1), byref(c_int(1)), byref(found)
        status = self._function(f"{self.standard}GetRealOutputDerivatives")(self._instance, *given)
        if status == FATAL:
            self._fail(status, f"{self.standard}GetRealOutputDerivatives")
        return found.value if status <= WARNING and math.isfinite(found.value) else 0.0

    # --- roll back -----------------------------------------------------------------------------------------------

    state_names: ClassVar[tuple[str, str, str]] = ("GetFMUstate", "SetFMUstate", "FreeFMUstate")

    def save(self) -> Any:
        self._free = c_int(0)  # from now on the master may come back to an earlier point
        state = State(self)
        self._call(self.state_names[0], byref(state.pointer))
        return state

    def restore(self, state: Any) -> None:
        self.ends.clear()
        self._held.clear()
        self._call(self.state_names[1], state.pointer)


class State:
    """A saved state of an FMU instance; freed with this object."""

    def __init__(self, part: Fmu):
        self.part, self.pointer = part, c_void_p()

    def __del__(self):
        if self.pointer and self.part._instance:
            self.part._function(f"{self.part.standard}{self.part.state_names[2]}")(self.part._instance, byref(self.pointer))


def _same(given: Any, taken: Any) -> bool:
    """Whether a parameter has the value given: to the digits of a float, in which some FMUs keep their numbers."""
    if not isinstance(taken, float):
        return given == taken
    return given == taken or abs(given - taken) <= SINGLE * abs(given)
