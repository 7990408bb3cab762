"""What every FMU of ours shares: a slave made of a law and plain tables of variables.

A face is a subclass that names its law and its variables:

    class Motor(Slave):
        law = dc                                    # Parameters, State, Output, start(p), advance(p, s, *inputs, dt)
        inputs = (Variable("voltage", "V", 0.0, "…"), …)        # in the order of advance's arguments, Real first
        outputs = (Variable("current", "A", 0.0, "…", depends_on=("voltage",)), …)    # in the order of law.Output
        parameters = (Variable("resistance", "Ohm", 0.5, "…", minimum=0.0), …)        # at least law.Parameters

Values lie in one list, numbers as floats (Boolean: 0.0 and 1.0); a value reference is a place in it: inputs
first, then outputs, then parameters. So the set, step and get of a communication step are a few list accesses.

No exception may reach pythonfmu (it answers with a use after free). What is wrong is told in one logged sentence
and remembered: every later step answers false, until the slave is reset or a sound state is restored.

Only the standard library and pythonfmu's Fmi2Slave may be used here and in the laws: it all runs in any host.
"""

from __future__ import annotations

import json
import sys
from _thread import get_ident
from dataclasses import replace
from hashlib import sha256
from math import inf, nan
from typing import Any, Callable

from pythonfmu import Fmi2Slave
from pythonfmu.enums import Fmi2Status

from .effect import SWITCH
from .variable import Variable


def rows(base: tuple, effects: tuple = ()) -> tuple[Variable, ...]:
    """Parameter rows of a face from a law's own parameters and those of its effects.

    A law's bounds are physics' and hold. An effect's bounds are those of a fit: only a magnitude's zero is kept.
    """
    table = {}
    for parameter in base:
        if parameter.role == SWITCH:
            table[parameter.name] = Variable(parameter.name, parameter.unit, bool(parameter.off), parameter.description)
            continue
        low = None if parameter.low == -inf else parameter.low
        high = None if parameter.high == inf else parameter.high
        table[parameter.name] = Variable(parameter.name, parameter.unit, float(parameter.off), parameter.description, low, high)
    for effect in effects:
        for parameter in effect.parameters:
            low = 0.0 if parameter.low >= 0.0 else None
            text = f"{effect.name}: {parameter.description}"
            table.setdefault(parameter.name, Variable(parameter.name, parameter.unit, float(parameter.off), text, low))
    return tuple(table.values())


def _unready(*given: Any) -> Any:
    """No step before initialization."""
    raise RuntimeError("not initialized")


INSTANTIATED, INITIALIZING, STEPPING, TERMINATED, TUNED = range(5)
RUNNING = (
    STEPPING,
    TUNED,
)  # TUNED: a parameter changed, which the next step takes over; whoever sets two may set one after the other
CHECK = 64  # bytes behind a state that is kept as bytes, by which it is known again


class Slave(Fmi2Slave):
    """An FMI 2.0 co-simulation slave around a law. Subclasses give the tables; see the module's text."""

    law: Any = None
    inputs: tuple[Variable, ...] = ()
    outputs: tuple[Variable, ...] = ()
    parameters: tuple[Variable, ...] = ()
    tunable: tuple[str, ...] = ()  # parameters that may change between steps: the state goes on with the new ones
    needs: tuple[str, ...] = ()  # files of other components that the face imports
    explained: tuple[Any, ...] = ()  # modules whose text the documentation shows; the law's if empty
    starts: dict[str, Any] = {}  # other start values, baked in by the build
    identity = "unpacked"  # the content of the packed FMU, set by the build
    laws = ""  # the content of its sources alone, set by the build
    experiment = (0.0, 10.0, 1e-3)  # start, stop and step of the default experiment, s

    _plain = 0  # so many leading inputs need no look beyond "is it finite?"
    _other: frozenset[int] = frozenset()  # places of what is no Real
    _booleans: tuple[int, ...] | None = ()  # places of outputs that are Boolean; None where one is neither that nor Real

    pure = True  # a step is a function of numbers alone, which may be made again; False: whoever calls must go through `do_step`

    script_globals: list[dict] = []  # see fmus.build.SCRIPT

    def __init_subclass__(cls, **kwargs: Any):
        super().__init_subclass__(**kwargs)
        tables = {"input": cls.inputs, "output": cls.outputs, "parameter": cls.parameters}
        table = tuple(cls._row(row, causality) for causality, rows in tables.items() for row in rows)
        cls._table = table
        cls._place = {row.name: place for place, row in enumerate(table)}
        cls._first_output, cls._first_parameter = len(cls.inputs), len(cls.inputs) + len(cls.outputs)
        plain = 0
        while plain < len(cls.inputs) and table[plain].type == "Real" and table[plain].minimum is table[plain].maximum is None:
            plain += 1
        cls._plain = plain
        cls._other = frozenset(place for place, row in enumerate(table) if row.type != "Real")
        outputs = range(cls._first_output, cls._first_parameter)
        sound = all(table[place].type in ("Real", "Boolean") for place in outputs)
        cls._booleans = tuple(place for place in outputs if place in cls._other) if sound else None

    @classmethod
    def _row(cls, row: Variable, causality: str) -> Variable:
        """A row of a face's tables with what follows from the table that it stands in, and the start value of the build."""
        start = type(row.start)(cls.starts.get(row.name, row.start))
        tunable = "tunable" if row.variability == "tunable" or row.name in cls.tunable else ""
        return replace(row, start=start, causality=causality, variability=tunable, depends_on=row.depends_on or ())

    def __init__(self, **kwargs: Any):
        super().__init__(**kwargs)
        self._values = [float(row.start) if row.type != "String" else nan for row in self._table]
        self._texts = {place: row.start for place, row in enumerate(self._table) if row.type == "String"}
        self._phase, self._stale, self._fault, self._unfit = INSTANTIATED, False, "", ""
        self._parameters: Any = None
        self._state: Any = None
        self._advance: Callable = _unready
        made = sys.__dict__.setdefault("_selflock_made", {})
        made[get_ident()] = self  # whoever makes slaves finds it there: loader/door.c
        while self.resources in sys.path:  # pythonfmu's library put it there: other FMUs' imports would look there
            sys.path.remove(self.resources)

    # What a face may override.

    def complete(self, p: Any) -> Any:
        """Parameters with those filled in that follow from others."""
        return p

    def check(self, p: Any) -> str:
        """What is wrong with these parameters together, as a sentence; "" when they are fit. Effects have checks of their own."""
        return ""

    def begin(self, p: Any, *inputs: float) -> Any:
        """The state at the start."""
        return self.law.start(p)

    def explain(self, p: Any, state: Any, *inputs: float) -> str:
        """Why a step from this state had no finite result, and what to do, as a sentence; "" where the face knows nothing.

        `inputs` are those of the step, in order, and its size, s.
        """
        return ""

    def stepper(self) -> Any:
        """The function (p, state, *inputs, dt) -> (state, outputs) that makes a step; dt = 0 gives the outputs alone."""
        return self.law.advance

    # FMI 2.0, in the order of a slave's life.

    def value(self, name: str) -> Any:
        """The value of a variable by its name."""
        place = self._place[name]
        return self._texts.get(place, self._values[place])

    def setup_experiment(self, start_time: float = 0.0, stop_time: float | None = None, tolerance: float | None = None) -> None:
        if self._phase != INSTANTIATED:
            self.complain("the experiment is set up before initialization mode")
        elif start_time - start_time != 0.0:
            self.complain(f"start time {start_time} is not a finite number")

    def enter_initialization_mode(self) -> None:
        if self._phase != INSTANTIATED:
            return self.complain("initialization mode is entered once, after instantiation or reset")
        self._phase, self._stale = INITIALIZING, True
        return None

    def exit_initialization_mode(self) -> None:
        if self._phase != INITIALIZING:
            return self.complain("initialization mode was not entered, it cannot be left")
        self._initialize()
        if self._unfit:
            self.complain(self._unfit)
        self._phase = STEPPING
        return None

    def _initialize(self) -> None:
        """State and outputs from the start values as they are now."""
        v, first, last = self._values, self._first_output, self._first_parameter
        self._stale = False
        try:
            self._parameters, self._unfit = self._fit_parameters()
            if not self._unfit:
                self._advance = self.stepper()
                self._state = self.begin(self._parameters, *v[:first])
                self._state, out = self._advance(self._parameters, self._state, *v[:first], 0.0)
                v[first:last] = out
                if sum(out) - sum(out) != 0.0:
                    self._unfit = f"outputs at the start are not finite: {self._shown(self.outputs, first)}"
        except Exception as error:
            self._unfit = f"cannot start: {type(error).__name__}: {error}"
        if self._unfit:
            v[first:last] = [nan] * (last - first)

    def _fit_parameters(self) -> tuple[Any, str]:
        values = [self.value(name) for name in self.law.Parameters._fields]
        p = self.complete(self.law.Parameters(*values))
        unfit = self.check(p)
        for effect in getattr(self.law, "EFFECTS", ()):
            unfit = unfit or effect.check(p)
        return p, unfit

    def do_step(self, current_time: float, step_size: float) -> bool:
        if self._fault or self._phase != STEPPING or not 0.0 < step_size < inf or current_time - current_time != 0.0:
            return self._refuse(current_time, step_size)
        v, first = self._values, self._first_output
        try:
            state, out = self._advance(self._parameters, self._state, *v[:first], step_size)
        except Exception as error:
            return self._fail(current_time, step_size, self._explained(step_size, f"{type(error).__name__}: {error}"))
        total = sum(out)
        if total - total != 0.0:
            return self._fail(current_time, step_size, self._explained(step_size, "its result is not finite"))
        self._state = state
        v[first : self._first_parameter] = out
        return True

    def door(self) -> tuple | None:
        """What a step needs, for a host that calls `advance` itself: it, parameters, state, how many inputs and outputs, their values,
        the places of those that are Boolean.

        Where somebody in this process has the same law compiled (`sys._selflock_twins`), further: its address, that of the
        parameters' numbers, that of the state's, and how many these are; the state then is what keeps both.
        None where a step is more than that, or something stands against it. `shut` is called before anything else is.
        """
        plain = self.pure and type(self).do_step is Slave.do_step and self._plain == self._first_output
        if not plain or self._booleans is None or self._fault or self._unfit or self._phase != STEPPING:
            return None
        values = tuple(self._values[: self._first_parameter])
        state, compiled = self._state, []
        twins = sys.__dict__.get("_selflock_twins")
        if twins is not None:
            state, *compiled = twins(self.laws, self._advance, self._parameters, state, values[: self._first_output]) or (state,)
        outputs = self._first_parameter - self._first_output
        return (self._advance, self._parameters, state, self._first_output, outputs, values, self._booleans, *compiled)

    def shut(self, state: Any, values: tuple[float, ...]) -> None:
        """Take over the state, inputs and outputs that steps through `door` led to."""
        # what keeps a compiled law's numbers: parameters, then the state
        self._state = state if isinstance(state, tuple) else self.law.State(*state[-len(self.law.State._fields) :])
        self._values[: self._first_parameter] = values

    def _refuse(self, time: float, size: float) -> bool:
        """No step, and why; or one with parameters that were tuned."""
        if self._phase == TUNED and not self._fault:
            self._phase = STEPPING
            self._tune()
            if not self._fault:
                return self.do_step(time, size)
        if self._fault:
            self.say(f"no step from t = {time:.9g} s: {self._fault}")
        elif self._phase != STEPPING:
            self.complain("a step is possible only between initialization and termination")
        elif time - time != 0.0:
            self.complain(f"communication point {time} is not a finite number")
        else:
            self.complain(f"step size {size} s is not a positive finite number")
        return False

    def _fail(self, time: float, size: float, what: str) -> bool:
        inputs = self._shown(self.inputs, 0)
        self.complain(f"the step from t = {time:.9g} s of {size:.9g} s failed: {what}; inputs: {inputs}")
        return False

    def _explained(self, size: float, otherwise: str) -> str:
        try:
            return self.explain(self._parameters, self._state, *self._values[: self._first_output], size) or otherwise
        except Exception:  # numbers so great that even the explanation overflows
            return otherwise

    def _shown(self, rows: tuple[Variable, ...], first: int) -> str:
        return ", ".join(f"{row.name} = {value:.6g}" for row, value in zip(rows, self._values[first:])) or "none"

    def terminate(self) -> None:
        if self._phase not in RUNNING:
            return self.complain("nothing runs that could be terminated")
        self._phase, self._plain = TERMINATED, 0  # nothing is set any more without a look at this
        return None

    # What is wrong.

    def complain(self, sentence: str) -> None:
        """Log the sentence and refuse every later step with it."""
        self._fault = self._fault or sentence
        self.say(sentence)

    def say(self, sentence: str, status: Fmi2Status = Fmi2Status.error) -> None:
        self.log(sentence.replace("%", " percent"), status)  # hosts take the text as a format

    # Values.

    def set_real(self, vrs: list[int], values: list[float]) -> None:
        v, plain = self._values, self._plain
        for vr, value in zip(vrs, values):
            if 0 <= vr < plain and value - value == 0.0:
                v[vr] = value
            else:
                self._set(vr, value, "Real")
        self._stale = self._phase == INITIALIZING

    def set_integer(self, vrs: list[int], values: list[int]) -> None:
        self._set_all(vrs, values, "Integer")

    def set_boolean(self, vrs: list[int], values: list[bool]) -> None:
        self._set_all(vrs, values, "Boolean")

    def set_string(self, vrs: list[int], values: list[str]) -> None:
        self._set_all(vrs, values, "String")

    def _set_all(self, vrs: list[int], values: list, type: str) -> None:
        for vr, value in zip(vrs, values):
            self._set(vr, value, type)
        self._stale = self._phase == INITIALIZING

    def _set(self, vr: int, value: Any, type: str) -> None:
        """Set one value with every check; a value that is not fit is not taken."""
        if not 0 <= vr < len(self._table):
            return self.complain(f"no variable has the value reference {vr}")
        row = self._table[vr]
        if self._phase == TERMINATED:
            return self.complain(f"{row.name} cannot be set any more: this run is terminated")
        if row.type != type:
            return self.complain(f"{row.name} is of type {row.type}, not {type}")
        if self._first_output <= vr < self._first_parameter:
            return self.complain(f"{row.name} is an output and cannot be set")
        if vr >= self._first_parameter and self._phase in RUNNING and row.variability != "tunable":
            return self.complain(f"{row.name} is a fixed parameter and cannot change after initialization")
        if type == "String":
            self._texts[vr] = value
            return None
        unfit = row.unfit(value)
        if unfit:
            shown = f"{value:.9g} {row.unit}".strip() if value - value == 0.0 else f"{value}"
            return self.complain(f"{row.name} = {shown} {unfit}")
        self._values[vr] = float(value)
        if vr >= self._first_parameter and self._phase == STEPPING:
            self._phase = TUNED
        return None

    def _tune(self) -> None:
        """Take over parameters that changed between steps; the state goes on."""
        try:
            parameters, unfit = self._fit_parameters()
        except Exception as error:
            parameters, unfit = self._parameters, f"{type(error).__name__}: {error}"
        if unfit:
            self.complain(unfit)
        else:
            self._parameters, self._advance = parameters, self.stepper()

    def get_real(self, vrs: list[int]) -> list[float]:
        if self._stale:
            self._initialize()
        v = self._values
        if self._other and not self._other.isdisjoint(vrs):
            return self._get(vrs, "Real", nan)
        try:
            return [v[vr] for vr in vrs]
        except IndexError:
            return self._get(vrs, "Real", nan)

    def _get(self, vrs: list[int], type: str, none: Any) -> list[Any]:
        """Values with every check; `none` in the place of one that is of another type, or not there."""
        if self._stale:
            self._initialize()
        found = []
        for vr in vrs:
            row = self._table[vr] if 0 <= vr < len(self._table) else None
            if row is None:
                self.complain(f"no variable has the value reference {vr}")
            elif row.type != type:
                self.complain(f"{row.name} is of type {row.type}, not {type}")
            value = none if row is None or row.type != type else self._texts.get(vr, self._values[vr])
            found.append(none if value != value else value)
        return found

    def get_integer(self, vrs: list[int]) -> list[int]:
        return [int(value) for value in self._get(vrs, "Integer", 0)]

    def get_boolean(self, vrs: list[int]) -> list[bool]:
        return [value != 0.0 for value in self._get(vrs, "Boolean", False)]

    def get_string(self, vrs: list[int]) -> list[str]:
        return self._get(vrs, "String", "")

    # The whole state: values, law's state, phase, fault.

    def _get_fmu_state(self) -> tuple:
        values, texts = list(self._values), dict(self._texts)
        return (self.identity, values, texts, self._state, self._phase, self._stale, self._fault, self._unfit)

    def _set_fmu_state(self, state: tuple) -> None:
        if wrong := self._unsound(state):
            return self.complain(wrong)
        _, values, texts, law_state, self._phase, self._stale, self._fault, self._unfit = state
        self._values, self._texts = list(values), dict(texts)
        self._plain = 0 if self._phase == TERMINATED else type(self)._plain
        self._state = None if law_state is None else self.law.State(*law_state)
        if self._phase in RUNNING and not self._unfit:
            self._parameters, self._unfit = self._fit_parameters()
            self._advance = self.stepper()
        return None

    def _unsound(self, state: Any) -> str:
        """What is wrong with a state that is to be restored, looked at field by field; "" where it is sound."""
        if isinstance(state, str):
            return state  # what was wrong with its bytes
        if not isinstance(state, (tuple, list)) or len(state) != 8 or state[0] != self.identity:
            return "the state to restore is not one of this FMU"
        _, values, texts, law_state, phase, stale, fault, unfit = state
        numbers = isinstance(values, list) and len(values) == len(self._table) and all(type(one) is float for one in values)
        words = isinstance(texts, dict) and texts.keys() == self._texts.keys() and all(type(one) is str for one in texts.values())
        told = type(stale) is bool and type(fault) is str and type(unfit) is str and phase in range(5)
        if not (numbers and words and told and self._is_state(law_state)):
            return "the state to restore is damaged"
        return ""

    def _is_state(self, state: Any) -> bool:
        """Whether it has the fields of the law's state, each a number."""
        if state is None:
            return True
        fields = getattr(self.law.State, "_fields", ())
        return (
            isinstance(state, (tuple, list)) and len(state) == len(fields) and all(isinstance(one, (int, float)) for one in state)
        )

    @staticmethod
    def _fmu_state_to_bytes(state: tuple) -> bytes:
        content = json.dumps(state).encode()  # floats as repr: exact
        return content + sha256(content).hexdigest().encode()

    @staticmethod
    def _fmu_state_from_bytes(data: bytes) -> Any:
        content, check = data[:-CHECK], data[-CHECK:]
        if sha256(content).hexdigest().encode() != check:
            return "the state to restore is damaged: its checksum is another"
        try:
            identity, values, texts, *rest = json.loads(content.decode())
            return (identity, values, {int(place): text for place, text in texts.items()}, *rest)
        except (ValueError, TypeError, AttributeError):
            return None  # restoring it complains: an exception must not leave here
