"""Any FMI 2.0 co-simulation FMU as a part: the C functions called directly, on buffers allocated once."""

from __future__ import annotations

import ctypes
import math
import time as clock
from collections.abc import Callable, Iterator, Sequence
from ctypes import byref, c_double, c_int, c_size_t, c_uint, c_void_p
from itertools import groupby
from pathlib import Path
from typing import Any, NoReturn

import numpy as np
from fmpy import fmi2
from fmpy.model_description import BaseUnit, ModelDescription, ModelVariable

from ..fmus.units import BASES, Unit
from ..fmus.variable import BEYOND as TOO_LARGE
from ..fmus.variable import INTEGERS
from . import binary
from .errors import DescriptionError, PartFailed
from .face import Part, Variable, view
from .native import BEYOND, Exchange, Native

OK, WARNING, DISCARD, ERROR, FATAL, PENDING = range(6)
SETTABLE = ("parameter", "structuralParameter", "input")
KIND: dict[str, type[c_double] | type[c_int] | type[ctypes.c_char_p]] = {
    "Real": c_double,
    "Integer": c_int,
    "Boolean": c_int,
    "String": ctypes.c_char_p,
}
SINGLE = 2.0**-23  # relative: numbers that a parameter's float cannot tell apart
FROZEN = 128 << 20  # bytes of the largest state that is saved
PARTIAL_STEPS = 1000  # how often an FMU may discard the rest of one step

HINTS = {
    DISCARD: "a smaller [run] step, or a smaller `step` for this component; its inputs may also be out of its range.",
    ERROR: "read what it said above; check its inputs and its parameters in the system file.",
    BEYOND: "a smaller factor or offset of what it is connected to.",
    FATAL: "`process = true` for this component keeps the master safe from it; report it to whoever made the FMU.",
}


class FmuPart(Part):
    """One instance of an FMU.

    Integers, Booleans and enumerations cross as floats in `u` and `y`; strings only through `set` and `get`.
    A step that the FMU discards after a last successful time is finished from there with the same inputs.
    tolerance: relative, what its own solver is told; 0: nothing, None: what its default experiment says.
    """

    def __init__(self, name: str, path: Path | str, tolerance: float | None = None):
        self._binary = binary.open_fmu(path)
        described = self._binary.description
        super().__init__(name, variables_of(described))
        self.path = Path(path)
        self._tolerance = _of_experiment(described) if tolerance is None else tolerance
        slave = described.coSimulation
        self.variable_step = slave.canHandleVariableCommunicationStepSize
        self.can_roll_back = slave.canGetAndSetFMUstate
        self.frozen = slave.canSerializeFMUstate
        self._known = {v.name: v for v in described.modelVariables}
        self.units = units_of(described)
        self._writes: list[_Block] = []
        self._reads: list[_Block] = []
        self._time, self._size, self._free = c_double(0.0), c_double(0.0), c_int(1)
        self._do_step = self._function("fmi2DoStep")
        self._instance = c_void_p()
        self._alive = False  # between exit of initialization and terminate
        self._given: dict[str, Any] | None = {}  # values set so far; None from initialization mode on
        self._wanted: dict[str, Any] = {}  # parameters among them
        self._callbacks, self.log = binary.callbacks(name)
        self._instantiate()

    # --- life ----------------------------------------------------------------------------------------------------

    def _function(self, name: str, result=c_int):
        try:
            function = self._binary.library[name]  # a fresh object: argument types of others do not reach it
        except AttributeError:
            raise DescriptionError(f"{self.path} is no FMI 2.0 co-simulation FMU: its binary lacks {name}.") from None
        function.restype = result
        return function

    def _instantiate(self) -> None:
        instantiate = self._function("fmi2Instantiate", c_void_p)
        guid = self._binary.description.guid.encode()
        resources = (self._binary.folder / "resources").as_uri().encode()
        self._instance = c_void_p(
            instantiate(self.name.encode(), c_int(1), guid, resources, byref(self._callbacks), c_int(0), c_int(1))
        )
        if not self._instance:
            raise PartFailed(
                self.name, 0.0, 0.0, "no instance", {}, list(self.log), f"see whether {self.path} runs alone in another tool."
            )

    def _call(self, name: str, *arguments) -> None:
        status = self._function(name)(self._instance, *arguments)
        if status > WARNING:
            self._fail(status, name)

    def enter_initialization(self, start: float, stop: float | None) -> None:
        self._time.value = start
        tolerance = c_int(self._tolerance > 0.0), c_double(self._tolerance)
        self._call("fmi2SetupExperiment", *tolerance, c_double(start), c_int(stop is not None), c_double(stop or 0.0))
        given, self._given = self._given or {}, None
        self._again(given)  # there are FMUs (20-sim's) that take their defaults back at fmi2SetupExperiment,
        self._call("fmi2EnterInitializationMode")
        self._again({name: value for name, value in given.items() if _late(self._known[name])})  # or here
        self._wanted = {name: value for name, value in given.items() if self.variables[name].causality == "parameter"}

    def _again(self, given: dict[str, Any]) -> None:
        """Set once more what was set. An FMU that refuses that has it already, or is found out when it is read back."""
        for name, value in given.items():
            status = self._put(name, value)
            if status == FATAL:
                self._fail(status, f"fmi2Set{_kind(self._known[name])}")

    def exit_initialization(self) -> None:
        self._call("fmi2ExitInitializationMode")
        self._alive = True
        found = {name: self._taken(name) for name in self._wanted}
        self.untaken = {name: found[name] for name, value in self._wanted.items() if not _same(value, found[name])}

    def _taken(self, name: str) -> Any:
        """The value that a parameter has; None where the FMU does not tell."""
        status, value = self._ask(name)
        if status == FATAL:
            self._fail(status, f"fmi2Get{_kind(self._known[name])}")
        return value if status <= WARNING else None

    def reset(self) -> None:
        self._call("fmi2Reset")
        self._alive, self._given, self.untaken = False, {}, {}
        self.ends.clear()

    def terminate(self) -> None:
        if self._alive:
            self._alive = False
            status = self._function("fmi2Terminate")(self._instance)
            if status > WARNING and all(name != self.name for name, _ in self.ends):  # else it has ended already
                self._fail(status, "fmi2Terminate")

    def close(self) -> None:
        if self._instance:
            self._alive = False
            self._function("fmi2FreeInstance", None)(self._instance)
            self._instance = c_void_p()
            binary.forget(self._callbacks)

    # --- single values -------------------------------------------------------------------------------------------

    def set(self, name: str, value: Any) -> None:
        status = self._put(name, value)
        if status > WARNING:
            self._fail(status, f"fmi2Set{_kind(self._known[name])}")
        if self._given is not None:
            self._given[name] = value

    def get(self, name: str) -> Any:
        status, value = self._ask(name)
        if status > WARNING:
            self._fail(status, f"fmi2Get{_kind(self._known[name])}")
        return value

    def _put(self, name: str, value: Any) -> int:
        variable = self._variable(name)
        kind = _kind(variable)
        given: Any = str(value).encode() if kind == "String" else float(value) if kind == "Real" else int(value)
        if kind == "Integer" and not INTEGERS[0] <= given <= INTEGERS[1]:
            raise DescriptionError(f"{self.name}.{name} = {given} {TOO_LARGE}.")
        set_ = self._function(f"fmi2Set{kind}")
        return set_(self._instance, byref(c_uint(variable.valueReference)), c_size_t(1), byref(KIND[kind](given)))

    def _ask(self, name: str) -> tuple[int, Any]:
        variable = self._variable(name)
        kind = _kind(variable)
        value: Any = KIND[kind]()
        get = self._function(f"fmi2Get{kind}")
        status = get(self._instance, byref(c_uint(variable.valueReference)), c_size_t(1), byref(value))
        if kind == "String":
            return status, (value.value or b"").decode("utf-8", "replace")
        return status, bool(value.value) if kind == "Boolean" else value.value

    def _variable(self, name: str) -> ModelVariable:
        if name not in self._known:
            raise DescriptionError(f"{self.name} has no variable {name}.")
        return self._known[name]

    # --- the path of every step ----------------------------------------------------------------------------------

    def bind(self, inputs: Sequence[str], outputs: Sequence[str]) -> None:
        """Say which numbers go in through `u` and come out through `y`, in this order; best all of one type side by side."""
        self.inputs, self.outputs = tuple(inputs), tuple(outputs)
        self.u = np.array([float(self.variables[name].start or 0.0) for name in inputs], dtype=float)
        self.y = np.zeros(len(outputs))
        self._writes = self._blocks("Set", inputs, self.u)
        self._reads = self._blocks("Get", outputs, self.y)

    def stepper(self) -> Callable[[float, float], None]:
        """write, step and read as one function: the C calls and no more, everything they need looked up before."""
        writes, reads = ([block.call for block in blocks] for blocks in (self._writes, self._reads))
        do_step, instance, now, span = self._do_step, self._instance, self._time, self._size
        if [block.real for block in self._writes] == [block.real for block in self._reads] == [True]:
            set_real, given, given_count, u, *_ = writes[0]
            get_real, taken, taken_count, y, *_ = reads[0]

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
            for function, references, count, pointer, copies, values, typed, name in writes:
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
            for function, references, count, pointer, copies, values, typed, name in reads:
                status = function(instance, references, count, pointer)
                if status > 1:
                    self._fail(status, name)
                for i, k in copies:
                    values[i] = typed[k]

        return cycle

    def _blocks(self, way: str, names: Sequence[str], values: np.ndarray) -> list[_Block]:
        """The runs of names of one type."""
        blocks, first = [], 0
        for kind, run in groupby((self._variable(name) for name in names), _kind):
            references = [variable.valueReference for variable in run]
            blocks.append(_Block(self, way, kind, first, references, values))
            first += len(references)
        return blocks

    def write(self) -> None:
        for function, references, count, pointer, copies, values, typed, name in (block.call for block in self._writes):
            try:
                for i, k in copies:
                    typed[k] = int(values[i])
            except (ValueError, OverflowError):
                self._fail(BEYOND, name)
            status = function(self._instance, references, count, pointer)
            if status > 1:
                self._fail(status, name)

    def read(self) -> None:
        for function, references, count, pointer, copies, values, typed, name in (block.call for block in self._reads):
            status = function(self._instance, references, count, pointer)
            if status > 1:
                self._fail(status, name)
            for i, k in copies:
                values[i] = typed[k]

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

    def _fail(self, status: int, function: str) -> NoReturn:
        inputs = {name: value for name, value in zip(self.inputs, self.u.tolist())}
        said = f"{binary.STATUS[status] if status < 6 else status} to {function}"
        if status == BEYOND:
            said = f"nothing, for an Integer among its inputs would be beyond 32 bits ({function}),"
        if status == FATAL:
            self._instance = c_void_p()  # FMI: after Fatal nothing may be called any more, not even free
        raise PartFailed(self.name, self._time.value, self._size.value, said, inputs, list(self.log), HINTS.get(status, ""))

    def native(self) -> Native | None:
        return Native(
            _address(self._instance),
            _address(self._do_step),
            self._free.value,
            tuple(block.native() for block in self._writes),
            tuple(block.native() for block in self._reads),
            self._finish_native,
            self._fail_native,
        )

    def _finish_native(self, status: int, time: float, size: float) -> None:
        self._time.value, self._size.value = time, size
        self._unfinished(status, time, time + size)

    def _fail_native(self, status: int, function: str, time: float, size: float) -> NoReturn:
        self._time.value, self._size.value = time, size
        self._fail(status, function)

    # --- roll back -----------------------------------------------------------------------------------------------

    def save(self) -> _State:
        self._free = c_int(0)  # from now on the master may come back to an earlier point
        state = _State(self)
        self._call("fmi2GetFMUstate", byref(state.pointer))
        return state

    def restore(self, state: _State) -> None:
        self.ends.clear()
        self._call("fmi2SetFMUstate", state.pointer)

    def freeze(self) -> bytes:
        state, size = self.save(), c_size_t(0)
        self._call("fmi2SerializedFMUstateSize", state.pointer, byref(size))
        if size.value > FROZEN:
            raise DescriptionError(f"The state of {self.name} has {size.value >> 20} MiB; at most {FROZEN >> 20} are saved.")
        content = ctypes.create_string_buffer(max(size.value, 1))
        self._call("fmi2SerializeFMUstate", state.pointer, content, size)
        return content.raw[: size.value]

    def thaw(self, frozen: bytes) -> None:
        state = self.save()  # a pointer to one, which is freed like it
        if state.pointer:
            self._call("fmi2FreeFMUstate", byref(state.pointer))
            state.pointer = c_void_p()
        self._call(
            "fmi2DeSerializeFMUstate",
            ctypes.create_string_buffer(frozen, max(len(frozen), 1)),
            c_size_t(len(frozen)),
            byref(state.pointer),
        )
        self.restore(state)


class _State:
    """A saved state of an FMU instance; freed with this object."""

    def __init__(self, part: FmuPart):
        self.part, self.pointer = part, c_void_p()

    def __del__(self):
        if self.pointer and self.part._instance:
            self.part._function("fmi2FreeFMUstate")(self.part._instance, byref(self.pointer))


class _Block:
    """Variables of one type, side by side in `u` or `y`, that go in or come out with one C call."""

    def __init__(self, part: FmuPart, way: str, kind: str, first: int, references: list[int], values: np.ndarray):
        if kind == "String":
            raise DescriptionError(f"{part.name}: strings do not travel with the numbers of a step.")
        self.name = f"fmi2{way}{kind}"
        self.real = kind == "Real"  # the C call works on `u` or `y` itself
        self.function = part._function(self.name)
        self._references = np.array(references, dtype=np.uint32)
        self.own: np.ndarray = values[first : first + len(references)] if self.real else np.zeros(len(references), dtype=np.intc)
        self.references = c_void_p(self._references.ctypes.data)
        self.count = c_size_t(len(references))
        self.pointer = c_void_p(self.own.ctypes.data)
        self.copies = [] if self.real else [(first + k, k) for k in range(len(references))]  # (in `u` or `y`, in `own`)
        self.call = (
            self.function,
            self.references,
            self.count,
            self.pointer,
            self.copies,
            view(values),
            self.own.data,
            self.name,
        )

    def native(self) -> Exchange:
        copies = tuple((place, self.own.ctypes.data + k * self.own.itemsize) for place, k in self.copies)
        addresses = _address(self.function), _address(self.references), len(self._references), _address(self.pointer)
        return Exchange(self.name, *addresses, copies)


def _address(pointer: Any) -> int:
    """Where a C function lies, or what a pointer points to."""
    return ctypes.cast(pointer, c_void_p).value or 0


def _of_experiment(described: ModelDescription) -> float:
    """The tolerance that an FMU's default experiment names; 0 where it names none."""
    try:
        told = float(described.defaultExperiment.tolerance or 0.0) if described.defaultExperiment else 0.0
    except ValueError:
        return 0.0
    return told if 0.0 < told < math.inf else 0.0


def _late(variable: ModelVariable) -> bool:
    """Whether FMI 2.0 (section 4.2.4) lets it be set in initialization mode."""
    return variable.causality == "input" or (variable.variability != "constant" and variable.initial == "exact")


def _same(given: Any, taken: Any) -> bool:
    """Whether a parameter has the value given: to the digits of a float, in which some FMUs keep their numbers."""
    if not isinstance(taken, float):
        return given == taken
    return given == taken or abs(given - taken) <= SINGLE * abs(given)


def _kind(variable: ModelVariable) -> str:
    return "Integer" if variable.type == "Enumeration" else variable.type


def units_of(described: ModelDescription) -> dict[str, Unit]:
    """What an FMU says of its units, by their names."""
    return {u.name: _si(u.baseUnit) for u in described.unitDefinitions if u.baseUnit is not None}


def _si(unit: BaseUnit) -> Unit:
    return Unit(tuple(int(getattr(unit, base) or 0) for base in BASES), float(unit.factor), float(unit.offset))


def variables_of(described: ModelDescription) -> Iterator[Variable]:
    """What an FMU says of its variables."""
    depends = {}
    for unknown in described.outputs:
        if unknown.variable is not None and unknown.dependencies is not None:
            depends[unknown.variable.name] = tuple(v.name for v in unknown.dependencies if v.causality == "input")
    for v in described.modelVariables:
        try:
            yield _face(v, depends.get(v.name))
        except (ValueError, OverflowError) as error:
            raise DescriptionError(
                f"The modelDescription.xml of {described.modelName} is wrong in its variable {v.name}: {error}"
            ) from None


def _face(v: ModelVariable, depends_on: tuple[str, ...] | None) -> Variable:
    kind, declared = _kind(v), v.declaredType

    def number(text):
        return None if text is None or kind not in ("Real", "Integer") else float(text)

    def attribute(name):
        own = getattr(v, name)
        return own if own is not None or declared is None else getattr(declared, name)

    start = v.start
    if start is not None and kind != "String":
        start = str(start).lower() in ("true", "1") if kind == "Boolean" else float(start) if kind == "Real" else int(start)
    return Variable(
        v.name,
        causality="parameter" if v.causality == "structuralParameter" else v.causality or "local",
        type=kind,
        unit=attribute("unit") or "",
        start=start,
        minimum=number(attribute("min")),
        maximum=number(attribute("max")),
        nominal=number(attribute("nominal")),
        variability=v.variability or "continuous",
        description=v.description or "",
        depends_on=depends_on if v.causality == "output" else None,
        initial=v.initial or "",
        derivative_of=v.derivative.name if v.derivative is not None else "",
    )
