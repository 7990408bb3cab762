"""A part's place in a run: where its inputs come from, and its own steps.

- A part with a smaller step h = H/m makes m steps; under Gauss-Seidel what it takes from parts stepped before is
  interpolated between their outputs at t_n and t_n+1, at the end of each of its steps. What it takes from others is
  carried on from t_n to the start of each of its steps, where the source also puts out its derivative; else held.
- A part with a larger step h = M·H steps once in M macro steps; its outputs are then shown on the straight line
  from its old values to its new ones, or held ([run] hold_outputs). Booleans, integers and discrete values wait for its step's end.
  Of a part that samples all is there as its step begins.
- A source that is a function of time is evaluated at the start of each step of each part that listens to it.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import TYPE_CHECKING

from .energy import Port
from .errors import DescriptionError
from .face import Part, view
from .wiring import Link, Wiring

if TYPE_CHECKING:  # at run time memoryview has no parameter
    Buffer = memoryview[float]
    Wrong = Callable[[float, Buffer], None]  # a fault: at a time, makes a number of a buffer wrong


class Seat:
    """A part's place in a run: its buffers, and where its inputs come from, all found before the first step."""

    def __init__(self, name: str, wiring: Wiring):
        self.name = name
        self.part = wiring.parts[name]
        self.cycle = self.part.stepper()
        self.timed, self.parallel, self.passes = self.part.timed, self.part.parallel, self.part.passes
        inputs, outputs = wiring.bound[name]
        self.inputs, self.outputs = list(inputs), list(outputs)
        self.u, self.out = view(self.part.u), view(self.part.y)
        run = wiring.system.run
        own = wiring.system.components[name].step
        self.small, self.large = _ratios(name, own, run.step)
        self.start, self.macro = run.start, run.step
        self.shown = view(self.part.y.copy()) if self.large > 1 else self.out  # outputs as others see them
        self.before = view(self.part.y.copy())  # `shown` at the start of the macro step
        self.even = self.small == self.large == 1  # steps with the master
        self.holds, self.samples = run.hold_outputs, wiring.system.components[name].samples
        self.tilts = run.input_derivatives and self.part.interpolates
        self.keep = False  # whether anyone interpolates from `before`
        self.origin = view(self.part.y.copy())  # outputs at the start of a long step
        variables = [self.part.variables[output] for output in self.outputs]
        self.smooth = [v.type == "Real" and v.variability == "continuous" for v in variables]
        self.evaluated = math.nan  # time of the last `at`
        # Where inputs come from: place in `u`; buffer or seat, and the place there; factor and offset.
        self.plain: list[tuple[int, Buffer, int]] = []
        self.scaled: list[tuple[int, Buffer, int, float, float]] = []
        self.between: list[tuple[int, Seat, int, float, float]] = []  # interpolated over the macro step
        self.carried: list[tuple[int, Buffer, int, int, float, float]] = []  # carried on by a rate, whose place comes fourth
        self.clocked: list[tuple[Seat, int, int, float, float]] = []  # from a function of time
        self.tilted: list[tuple[Seat, int, int, float, float, bool]] = []  # to a part that is told how its inputs change
        self.rates_in: dict[int, float] = {}  # what it is told, by places in `u`, per s
        self.texts: list[tuple[str, Part, str]] = []
        self.mapped: list[tuple[int, Seat, int, dict[float, float]]] = []  # numbers that become others
        self.rates = {v.derivative_of: j for j, v in enumerate(variables) if v.derivative_of}
        self.ports: list[Port] = []
        self.held: dict[
            int, float
        ] = {}  # inputs that nothing feeds and a fault makes wrong: their place, and what they truly are
        self.input_faults: list[Wrong] = []
        self.output_faults: list[Wrong] = []

    def listen(self, link: Link, source: Seat, ahead: bool) -> None:
        """Take an input from `source`; `ahead`: it has made the macro step before this part does."""
        if link.text:
            self.texts.append((link.input, source.part, link.output))
            return
        i, j = self.inputs.index(link.input), source.outputs.index(link.output)
        if link.mapping:
            self.mapped.append((i, source, j, dict(link.mapping)))
        elif self.tilts and self.even and source.smooth[j] and (source.timed or source.even):
            self.tilted.append((source, i, j, link.factor, link.offset, ahead))
            self.rates_in[i] = 0.0
            source.keep |= ahead
        elif source.timed:
            self.clocked.append((source, i, j, link.factor, link.offset))
        elif ahead and self.small > 1 and source.smooth[j]:
            source.keep = True
            self.between.append((i, source, j, link.factor, link.offset))
        elif self.small > 1 and link.output in source.rates:
            self.carried.append((i, source.shown, j, source.rates[link.output], link.factor, link.offset))
        elif link.factor == 1.0 and link.offset == 0.0:
            self.plain.append((i, source.shown, j))
        else:
            self.scaled.append((i, source.shown, j, link.factor, link.offset))

    def gather(self, time: float, since: float, part_done: float, step: float = 0.0) -> None:
        """Inputs for a step from `time`, `since` after the communication point; at its end `part_done` of the macro step is over.

        step: its size, s, for those who are told how inputs change in it; 0 at an instant.
        """
        u = self.u
        for i, y, j in self.plain:
            u[i] = y[j]
        if self.scaled:
            for i, y, j, factor, offset in self.scaled:
                u[i] = factor * y[j] + offset
        if self.between:
            for i, source, j, factor, offset in self.between:
                old = source.before[j]
                u[i] = factor * (old + (source.shown[j] - old) * part_done) + offset
        if self.texts:
            for name, giver, output in self.texts:
                self.part.set(name, giver.get(output))
        for i, source, j, table in self.mapped:
            if source.timed and source.evaluated != time:
                source.evaluate(time)
            value = (source.out if source.timed else source.shown)[j]
            u[i] = table.get(value, value)
        if self.clocked or self.carried:
            self.look(time, since)
        if self.tilted:
            self.tilt(time, step)

    def look(self, time: float, since: float) -> None:
        """Inputs that are known at `time`: functions of time, and what is carried on by its derivative."""
        for i, y, j, rate, factor, offset in self.carried:
            self.u[i] = factor * (y[j] + y[rate] * since) + offset
        for source, i, j, factor, offset in self.clocked:
            if source.evaluated != time:
                source.evaluate(time)
            self.u[i] = factor * source.out[j] + offset

    def tilt(self, time: float, step: float) -> None:
        """Inputs as they are at `time`, and how they change until `step` s later: as far as sources have been there, or tell."""
        for source, i, j, factor, offset, ahead in self.tilted:
            if source.timed:
                source.evaluate(time + step)
                end = source.out[j]
                source.evaluate(time)
                now, rate = source.out[j], (end - source.out[j]) / step if step else 0.0
            elif ahead and step:
                now, rate = source.before[j], (source.shown[j] - source.before[j]) / step
            else:
                now, rate = source.shown[j], source.part.rate(j)
            self.u[i], self.rates_in[i] = factor * now + offset, factor * rate

    def evaluate(self, time: float) -> None:
        self.part.at(time)
        self.evaluated = time
        for fault in self.output_faults:
            fault(time, self.out)

    def go(self, time: float, size: float) -> None:
        """One step with the inputs gathered."""
        if self.input_faults:
            for place, value in self.held.items():
                self.u[place] = value
            for fault in self.input_faults:
                fault(time, self.u)
        if self.rates_in:
            self.part.write()
            self.part.tilt(self.rates_in)
            self.part.step(time, size)
            self.part.read()
        else:
            self.cycle(time, size)
        if self.output_faults:
            for fault in self.output_faults:
                fault(time + size, self.out)
        if self.ports:
            for port in self.ports:
                port.add(size)

    def settle(self) -> None:
        """Choose, once all is known, the shortest way through a macro step.

        stroke(index, time, step): take inputs and step, for Gauss-Seidel; collect and move: the same in two, for Jacobi.
        """
        self.stroke, self.collect, self.move = self._stroke, self._collect, self._move
        more = (
            self.scaled,
            self.between,
            self.carried,
            self.clocked,
            self.tilted,
            self.texts,
            self.mapped,
            self.input_faults,
            self.output_faults,
        )
        if not self.even or self.keep or self.parallel or any(more):
            return
        u, plain, cycle, ports = self.u, self.plain, self.cycle, self.ports

        def collect(index: int, time: float, step: float) -> None:
            for i, y, j in plain:
                u[i] = y[j]

        def move(index: int, time: float, step: float) -> None:
            cycle(time, step)
            for port in ports:
                port.add(step)

        def stroke(index: int, time: float, step: float) -> None:
            for i, y, j in plain:
                u[i] = y[j]
            cycle(time, step)
            for port in ports:
                port.add(step)

        self.stroke, self.collect, self.move = stroke, collect, move

    def _stroke(self, index: int, time: float, step: float) -> None:
        self.turn(index, time, step, True)

    def _collect(self, index: int, time: float, step: float) -> None:
        if self.large == 1 or index % self.large == 0:
            self.gather(time, 0.0, 0.0, step)
            if self.parallel and self.even and not self.input_faults and not self.rates_in:
                self.part.begin(time, step)

    def _move(self, index: int, time: float, step: float) -> None:
        self.turn(index, time, step, False)

    def turn(self, index: int, time: float, step: float, gather: bool) -> None:
        """This part's share of macro step `index`, from `time`. `gather`: renew inputs before every own step."""
        if self.keep:
            self.before[:] = self.shown
        if self.even:
            if gather:
                self.gather(time, 0.0, 1.0, step)
            self.go(time, step)
        elif self.small > 1:
            for k in range(self.small):
                if self.part.ends and self.name in dict(self.part.ends):
                    break
                since = step * k / self.small
                if gather:
                    self.gather(time + since, since, (k + 1) / self.small)
                else:
                    self.look(time + since, since)
                self.go(time + since, time + step * (k + 1) / self.small - (time + since))
        else:
            phase = index % self.large
            if phase == 0:
                self.origin[:] = self.out
                if gather:
                    self.gather(time, 0.0, 1.0)
                self.go(time, self.size(index, time, step))
            self.show((phase + 1) / self.large)

    def size(self, index: int, time: float, step: float) -> float:
        """Of a step of its own that begins with macro step `index`, which is of `step` s, where it is not shorter than that, s."""
        return step if self.large == 1 else self.start + (index + self.large) * self.macro - time

    def show(self, done: float) -> None:
        """Outputs of a long step as they are when `done` of it is over."""
        for j, smooth in enumerate(self.smooth):
            old, new = self.origin[j], self.out[j]
            until = old + (new - old) * done if smooth and not self.holds else old
            self.shown[j] = until if done < 1.0 and not self.samples else new


def _ratios(name: str, own: float, step: float) -> tuple[int, int]:
    """How many own steps make one macro step, or how many macro steps one own step."""
    if not own:
        return 1, 1
    for value, result in ((step / own, lambda n: (n, 1)), (own / step, lambda n: (1, n))):
        n = round(value) if 0.0 < value < 1e9 else 0
        if n >= 1 and abs(value - n) < 1e-9 * n:
            return result(n)
    raise DescriptionError(
        f"[components.{name}] step = {own:g} s neither divides the communication step {step:g} s nor is a multiple of it."
    )


def seats(wiring: Wiring) -> list[Seat]:
    """Every part's seat, in the order of stepping, listening to the others."""
    table = {name: Seat(name, wiring) for name in wiring.system.order}
    for link in wiring.links:
        table[link.target].listen(link, table[link.source], wiring.algorithm.ahead(link.source, link.target))
    return list(table.values())
