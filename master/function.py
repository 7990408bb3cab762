"""A part of a few lines: a function, a generator or a class of the user's own, told what goes in and what comes out.

@selflock.part(inputs={"angle": "rad"}, outputs={"voltage": "V"})
def controller(t, angle, gain=8.0):
    return gain * (1.0 - angle)

system.components["controller"] = master.Component(part=controller)
system.connections["controller.angle"] = master.Connection("weight.angle")
"""

from __future__ import annotations

import inspect
import traceback
from collections.abc import Callable, Mapping, Sequence
from copy import deepcopy
from numbers import Real
from typing import Any, NoReturn

from ..fmus.errors import SelflockError
from ..fmus.variable import Variable
from .errors import DescriptionError, PartFailed, SessionError
from .face import Part


class Written(Part):
    """A part that somebody wrote as a function, a generator or a class; `part` derives the class of each."""

    function: Callable[..., Any]  # as it was written
    takes: Sequence[str] = ()  # inputs in the order of its arguments
    gives: Sequence[str] = ()
    tells: Sequence[str] = ()  # parameters
    instant = False  # it is asked at the end of a step
    lasts: bool = False  # made once, with the parameters, then called: a class

    def __init__(self, name: str):
        super().__init__(name)
        self._time, self._begun = 0.0, False
        self._call: Callable[..., Any] | None = None  # with t and the inputs

    def enter_initialization(self, start: float, stop: float | None) -> None:
        self._time = start

    def reset(self) -> None:
        super().reset()
        self._time, self._begun, self._call = 0.0, False, None

    def compute(self) -> None:
        if not self._begun:  # whoever remembers begins anew, as often as the start is asked for
            self._call = None
            self._ask(self._time, 0.0)

    def step(self, time: float, size: float) -> None:
        self._begun = True
        self._ask(time + size, size)

    def save(self) -> Any:
        try:
            return dict(self.values), self._time, self._begun, deepcopy(self._call) if self.lasts else self._call
        except Exception as error:
            raise SessionError(f"{self.name} cannot roll back, because it cannot be copied: {error}.") from error

    def restore(self, state: Any) -> None:
        values, self._time, self._begun, call = state
        self.values = dict(values)
        self._call = deepcopy(call) if self.lasts else call

    def _ask(self, time: float, size: float) -> None:
        v = self.values
        given = [v[name] for name in self.takes]
        try:
            if self._call is None:
                self._call = self._begin()
            answer = self._call(time, *given)
        except StopIteration:
            return self.end(time)
        except SelflockError:
            raise
        except Exception as error:
            last = traceback.extract_tb(error.__traceback__)[-1]
            said = [f"{last.filename}, line {last.lineno}, in {last.name}: {last.line}"]
            self._fail(time, size, f"{type(error).__name__} ({error})", said, error)
        if isinstance(answer, Mapping):
            named = dict(answer)
        else:
            several = isinstance(answer, (tuple, list))
            named = dict(zip(self.gives, answer)) if several and len(answer) == len(self.gives) else {self.gives[0]: answer}
        if set(named) != set(self.gives) or not all(map(_number, named.values())):
            wanted = ", ".join(self.gives)
            self._fail(time, size, f"{answer!r:.200}, where {wanted} {'are' if self.gives[1:] else 'is'} wanted,", [], None)
        for name, value in named.items():
            v[name] = float(value)

    def _begin(self) -> Callable[..., Any]:
        """What is called from now on, with t and the inputs."""
        function = type(self).function

        def ask(t: float, *given: float) -> Any:
            values = self.values  # another dictionary after each return to a snapshot
            return function(t, **dict(zip(self.takes, given)), **{name: values[name] for name in self.tells})

        if self.lasts:
            return function(**{name: self.values[name] for name in self.tells})
        if not inspect.isgeneratorfunction(function):
            return ask
        generator = None

        def go_on(t: float, *given: float) -> Any:
            nonlocal generator
            if generator is None:
                generator = ask(t, *given)
                return next(generator)
            return generator.send((t, *given) if given else t)

        return go_on

    def _fail(self, time: float, size: float, status: str, said: list[str], cause: Exception | None) -> NoReturn:
        given = {name: self.values[name] for name in self.takes}
        raise PartFailed(self.name, time - size, size, status, given, said, "its function alone, with these inputs.") from cause


def part(
    inputs: Mapping[str, str],
    outputs: Mapping[str, str] | None = None,
    parameters: Mapping[str, str] | None = None,
    held: bool = False,
) -> Callable[[Callable[..., Any]], type[Written]]:
    """Make a part of a function f(t, inputs…) that returns its outputs: a number, a tuple in their order, or a dictionary.

    inputs, outputs: name = unit, "" where there is none. The function's first argument is the time in s at the end of a step, the
        others are called as the inputs, as the master knows them there.
    parameters: units of its other arguments, all of which have defaults: they are the part's parameters.
    held: between steps of its own that are longer than the communication step the outputs stay, as of a digital controller; else
        they are shown on a line to the next ones.

    What is returned is a class, for `Component(part=…)`; `.function` is the function as it was. One that remembers is a generator
    (`t, angle = yield voltage`; when it returns, it ends the run) or a class, made with the parameters and called as a function
    is. All but generators can roll back. Raises DescriptionError.
    """
    if callable(inputs):
        raise DescriptionError('Say what goes in and out: @selflock.part(inputs={"angle": "rad"}, outputs={"voltage": "V"}).')
    outputs = outputs or {}
    tables = {"inputs": inputs, "outputs": outputs, "parameters": parameters or {}}
    for table, names in tables.items():
        if not isinstance(names, Mapping) or not all(isinstance(word, str) for pair in names.items() for word in pair):
            raise DescriptionError(f'part: {table} is a dictionary of names and units, such as {{"angle": "rad"}}.')
    if not outputs:
        raise DescriptionError("part: without outputs nobody would see anything of it.")
    if twice := set(inputs) & set(outputs):
        raise DescriptionError(f"part: {', '.join(sorted(twice))} cannot go in and come out under one name.")

    def made(function: Callable[..., Any]) -> type[Written]:
        lasts = inspect.isclass(function)
        where, law = f"part {function.__name__}", getattr(function, "__call__", None) if lasts else function  # noqa: B004
        called = list(inspect.signature(law).parameters.values())[lasts:] if callable(law) else []
        if not called:
            raise DescriptionError(f"{where}: its first argument is the time, t.")
        more = {argument.name: argument for argument in called[1:]}
        if missing := [name for name in inputs if name not in more]:
            raise DescriptionError(f"{where} takes no {', '.join(missing)}: its arguments are t and the inputs by their names.")
        takes = tuple(name for name in more if name in inputs)
        others = (
            list(inspect.signature(function).parameters.values()) if lasts else [a for n, a in more.items() if n not in inputs]
        )
        for argument in [a for n, a in more.items() if n not in inputs and lasts] + others:
            if lasts and argument.name in more or not _start(argument.default):
                raise DescriptionError(
                    f"{where}: {argument.name} is none of the inputs. A parameter is an argument with a number as its default"
                    + (", of __init__." if lasts else ".")
                )
        starts = {a.name: a.default if isinstance(a.default, (bool, str)) else float(a.default) for a in others}
        if unknown := [name for name in tables["parameters"] if name not in starts]:
            raise DescriptionError(f"{where} has no argument {unknown[0]}, whose unit is told in parameters.")
        generates = inspect.isgeneratorfunction(function)
        tunable = "" if lasts or generates else "tunable"
        units = tables["parameters"]
        described = (
            *(Variable(n, units.get(n, ""), x, causality="parameter", variability=tunable) for n, x in starts.items()),
            *(Variable(name, inputs[name], 0.0, causality="input") for name in takes),
            *(
                Variable(name, unit, 0.0, causality="output", variability="discrete" if held else "", depends_on=takes)
                for name, unit in outputs.items()
            ),
        )
        body = {
            "__doc__": function.__doc__,
            "__module__": function.__module__,
            "__qualname__": function.__qualname__,
            "described": described,
            "function": staticmethod(function),
            "takes": takes,
            "gives": tuple(outputs),
            "tells": tuple(starts),
            "lasts": lasts,
            "can_roll_back": not generates,
        }
        return type(function.__name__, (Written,), body)

    return made


def _start(default: Any) -> bool:
    return isinstance(default, (bool, str)) or _number(default)


def _number(value: Any) -> bool:
    return isinstance(value, Real) or getattr(value, "ndim", None) == 0
