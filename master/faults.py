"""Faults on purpose: a variable made wrong in a window of time.

A fault on an output is seen by everyone and recorded; one on an input by that part alone. A tunable parameter can
be stuck at a value or offset, and is put back at the end of the window.
"""

from __future__ import annotations

import random
from bisect import bisect_right
from collections import deque
from collections.abc import Callable
from math import isfinite
from typing import NoReturn

from .errors import DescriptionError
from .face import Variable
from .seat import Seat
from .system import Fault
from .wiring import Wiring, Wrong, typed

Change = Callable[[float, float], float]  # (time, true value) -> what is seen instead
NEAR = 1e-6  # of a step: a communication point is at the end of a window that it misses by less, for a sum of steps is rounded

NEEDS = {"stuck": ("value",), "offset": ("value",), "drop-out": ("value",), "delay": ("delay",), "noise": ("deviation", "seed")}
"""What each kind knows, beside its variable and its window."""


class Faults:
    """The faults of a system, ready to be put into a run."""

    def __init__(self, wiring: Wiring):
        self._wiring = wiring
        self._slack = NEAR * wiring.system.run.step
        self._held: dict[tuple[str, str], float] = {}  # true values of inputs that nothing feeds
        self._signals: list[tuple[str, str, bool, Fault]] = []  # component, variable, is it an input
        self.parameters: list[_Parameter] = []
        for fault in wiring.system.faults:
            component, variable = wiring.variable(fault.variable, "[[faults]]")
            _check(fault, variable)
            if variable.causality in ("input", "output"):
                self._signals.append((component, variable.name, variable.causality == "input", fault))
            else:
                self.parameters.append(_Parameter(wiring, component, variable, fault, self._slack))

    def begin(self) -> None:
        """Before the initial values are made: what is wrong from the start on is so in them, for all who listen.

        Each fault is made anew here, so that what it remembers, or draws, is the same once the run begins.
        """
        wiring, start = self._wiring, self._wiring.system.run.start
        self.switch(start)
        for parameter in self.parameters:
            if parameter.active:  # it is no parameter that was not taken
                wiring.values.setdefault(parameter.part.name, {})[parameter.variable.name] = parameter.wrong
        fed = {(link.target, link.input) for link in wiring.links}
        for component, name, is_input, _ in self._signals:
            mine = [fault for *place, _, fault in self._signals if place == [component, name]]
            there = [fault for fault in mine if _during(fault, self._slack)(start)]
            keeps = not any(fault.kind == "drop-out" or (fault.kind == "stuck" and fault.value is not None) for fault in there)
            seen = 0.0
            for fault in there:
                seen = change_of(fault, self._slack)(start, seen)
            wrong = Wrong(keeps, seen, wiring.parts[component].variables[name].type != "Real")
            if there:
                wiring.wrong[component, name] = wrong
            if is_input and (component, name) not in fed and (component, name) not in self._held:
                u, position = wiring.parts[component].u, wiring.bound[component][0].index(name)
                self._held[component, name] = float(u[position])
                u[position] = wrong(u[position])

    def unseen(self, stop: float) -> list[str]:
        """A sentence for each fault whose window is not within the run."""
        start, slack = self._wiring.system.run.start, self._slack
        found = []
        for fault in self._wiring.system.faults:
            where = f"[[faults]] {fault.variable}, {fault.kind}"
            if fault.start > stop + slack:
                found.append(f"{where}: it begins at {fault.start:g} s, after the end of the run at {stop:g} s, and is not seen")
            elif fault.stop <= start + slack:
                found.append(f"{where}: it ends at {fault.stop:g} s, before the run begins at {start:g} s, and is not seen")
        return found

    def install(self, seats: dict[str, Seat]) -> None:
        for component, name, is_input, fault in self._signals:
            seat = seats[component]
            position = (seat.inputs if is_input else seat.outputs).index(name)
            change, integer = change_of(fault, self._slack), seat.part.variables[name].type != "Real"
            (seat.input_faults if is_input else seat.output_faults).append(_at(position, change, integer))
            if (component, name) in self._held:
                seat.held[position] = self._held[component, name]
        start = self._wiring.system.run.start
        for seat in seats.values():
            for wrong in seat.output_faults:
                wrong(start, seat.out)
                seat.evaluated = start  # a function of time is not asked, and its noise not drawn, once more

    def switch(self, time: float) -> None:
        for parameter in self.parameters:
            parameter.switch(time)


def _at(position: int, change: Change, integer: bool) -> Callable[[float, memoryview[float]], None]:
    def fault(time: float, values: memoryview[float]) -> None:
        value = change(time, values[position])
        values[position] = round(value) if integer else value

    return fault


def _check(fault: Fault, variable: Variable) -> None:
    where = f"[[faults]] {fault.variable}"

    def refuse(why: str) -> NoReturn:
        raise DescriptionError(f"{where}: {why}")

    if variable.type == "String":
        refuse("strings cannot be made wrong, numbers can.")
    for key, left_out in (("value", None), ("delay", 0.0), ("deviation", 0.0), ("seed", None)):
        given = getattr(fault, key)
        if given == left_out:
            continue
        if key not in NEEDS[fault.kind]:
            refuse(f"{key} is nothing of the kind {fault.kind}, which knows {' and '.join(NEEDS[fault.kind])}.")
        if not isfinite(given):
            refuse(f"its {key} = {given:g} is no number that a variable can take.")
    if not fault.stop > fault.start:
        refuse(f"its stop {fault.stop:g} s must be after its start {fault.start:g} s.")
    if fault.kind == "offset" and fault.value is None:
        refuse("an offset needs the value to add.")
    if fault.kind == "delay" and not fault.delay > 0.0:
        refuse("a delay needs a delay above zero, in s.")
    if fault.kind == "noise" and not fault.deviation > 0.0:
        refuse("noise needs a deviation above zero, in the variable's unit.")
    if fault.kind == "noise" and fault.seed is None:
        refuse("noise needs a seed, so that the run can be repeated.")
    if variable.causality not in ("input", "output"):
        if variable.causality != "parameter" or variable.variability != "tunable":
            refuse(
                f"it is a {variable.variability} {variable.causality}; inputs, outputs and tunable parameters can be made wrong."
            )
        if fault.kind not in ("stuck", "offset") or fault.value is None:
            refuse("a parameter can be stuck at a value, or offset by one.")


def _during(fault: Fault, slack: float) -> Callable[[float], bool]:
    """Whether a time is in the fault's window, whose end is not."""
    begin, end = fault.start - slack, fault.stop - slack
    return lambda time: begin <= time < end


def change_of(fault: Fault, slack: float = 0.0) -> Change:
    """What a fault does to a value at a time; slack: s by which a time may miss its window's ends."""
    during = _during(fault, slack)
    amount = fault.value or 0.0

    if fault.kind == "offset":
        return lambda time, value: value + amount if during(time) else value

    if fault.kind == "drop-out":
        return lambda time, value: amount if during(time) else value

    if fault.kind == "noise":
        gauss = random.Random(fault.seed).gauss
        return lambda time, value: value + gauss(0.0, fault.deviation) if during(time) else value

    if fault.kind == "stuck":
        held = fault.value

        def stuck(time: float, value: float) -> float:
            nonlocal held
            if not during(time):
                return value
            if held is None:
                held = value
            return held

        return stuck

    times: deque[float] = deque()
    values: deque[float] = deque()

    def delay(time: float, value: float) -> float:
        times.append(time)
        values.append(value)
        wanted = time - fault.delay
        while len(times) > 2 and times[1] <= wanted:
            times.popleft()
            values.popleft()
        if not during(time):
            return value
        k = bisect_right(times, wanted)
        if k == 0:
            return values[0]
        if k == len(times):
            return values[-1]
        share = (wanted - times[k - 1]) / (times[k] - times[k - 1])
        return values[k - 1] + share * (values[k] - values[k - 1])

    return delay


class _Parameter:
    """A parameter that is wrong for a while."""

    def __init__(self, wiring: Wiring, component: str, variable: Variable, fault: Fault, slack: float):
        self.during = _during(fault, slack)
        self.part, self.variable, self.fault = wiring.parts[component], variable, fault
        self.right = wiring.values.get(component, {}).get(variable.name, variable.start)
        wrong = fault.value if fault.kind == "stuck" else (self.right or 0.0) + (fault.value or 0.0)
        self.wrong = typed(variable, wrong, f"[[faults]] {fault.variable}")
        self.active = False

    def switch(self, time: float) -> None:
        active = self.during(time)
        if active != self.active:
            self.active = active
            self.part.set(self.variable.name, self.wrong if active else self.right)
