"""A run from start to stop."""

from __future__ import annotations

import math
import time as clock
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from importlib.util import find_spec
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd

from . import control, energy
from .algorithms import ALGORITHMS, Stepped
from .errors import DescriptionError, PartFailed
from .face import Part, Variable
from .faults import Faults
from .initial import initialize
from .results import Result, Sink, sink
from .seat import Seat, seats
from .system import System, check_choice, load
from .wiring import Wiring, wire

WORTH = 3000  # FMU steps from which on it pays to load the compiled loop of master.convoy
Observer = Callable[[float, dict[str, Part]], None]


def run(
    system: System | Path | str,
    settings: dict[str, Any] | None = None,
    stop: float | None = None,
    out: Path | str | None = None,
    progress: bool | Callable[[float], None] = False,
    observe: Observer | None = None,
    keep: dict[str, Part] | None = None,
    step: float | None = None,
    algorithm: str | None = None,
    allow_code: bool = False,
    unlimited: bool = False,
) -> Result:
    """Couple the components of `system` from its start to `stop` [s].

    settings: "component.variable" = value, over those of the system; text is taken as the variable's type wants it.
    out: a .csv or .parquet file to write to; without one the table stays in memory.
    progress: True draws a bar; a function is called with the fraction done.
    observe: called as observe(time, parts) at the start and after every communication step.
    keep: an empty dictionary at first; holds the parts from run to run of the same system, which are then reset
        instead of made again. Whoever gives it closes them. A run that fails closes its parts and leaves none in it.
    allow_code: parts of other packages may be loaded (docs/security.md).
    unlimited: FMUs and SSPs may be of any size.
    step, algorithm: the communication step [s] and "gauss-seidel" or "jacobi", in place of the system's.

    A part that fails raises PartFailed, whose `result` holds what was computed until then.
    """
    if not isinstance(system, System):
        system = load(system, allow_code, unlimited)
    elif allow_code or unlimited:
        system = replace(system, allow_code=system.allow_code or allow_code, unlimited=system.unlimited or unlimited)
    if step is not None or algorithm is not None:
        check_choice("algorithm", algorithm or system.run.algorithm, ALGORITHMS)
        chosen = replace(system.run, step=system.run.step if step is None else step, algorithm=algorithm or system.run.algorithm)
        system = replace(system, run=chosen)
    end = system.run.stop if stop is None else float(stop)
    _check_times(system, end)
    with _Progress(progress, system.run.start, end) as tell:
        return _Simulation(system, settings, end, out, tell, observe, keep).result()


class _Simulation:
    def __init__(
        self, system: System, settings, stop: float, out, tell, observe: Observer | None, keep: dict[str, Part] | None = None
    ):
        self.began = clock.perf_counter()
        self.system, self.stop, self.tell, self.observe = system, stop, tell, observe
        self.keep = keep
        self.index, self.rejected = 0, 0
        self.time = system.run.start
        self.wiring = wire(system, settings, keep)
        try:
            self.faults = Faults(self.wiring)
            self.pairs = energy.bonds(self.wiring)
            control.check(self.wiring, self.pairs)
            self.sink = sink(_columns(self.wiring), out)
        except BaseException:
            self.wiring.close()
            raise
        self.loops: list[str] = []
        self.balances: list[energy.Balance] = []
        self.seats: list[Seat] = []

    def result(self) -> Result:
        """Run, close everything whatever happens, and give the result, or raise the failure with the result in it."""
        try:
            self._start()
            with _failing(self):
                self._go()
                self.recorder.check()
                self.sink.flush()
                for part in self.wiring.parts.values():
                    part.terminate()
            result = self._result()
            if self.keep is not None:
                self.keep |= self.wiring.parts
                self.wiring.parts = {}
            return result
        finally:
            self.sink.close()
            self.wiring.close()

    def _start(self) -> None:
        wiring, start = self.wiring, self.system.run.start
        self.loops = initialize(wiring, self.stop)
        for part in wiring.parts.values():
            part.at(start)
        self.seats = seats(wiring)
        by_name = {seat.name: seat for seat in self.seats}
        for pair in self.pairs:
            balance, giver, taker = energy.balance(wiring, pair)
            by_name[giver].ports.append(balance.giver)
            by_name[taker].ports.append(balance.taker)
            self.balances.append(balance)
        self.faults.install(by_name)
        for seat in self.seats:
            seat.settle()
        self.recorder = Recorder(wiring, by_name, self.sink)

    def _go(self) -> None:
        run = self.system.run
        self.arrive(run.start)
        if run.step_control:
            control.run(self)
            return
        seats = [seat for seat in self.seats if not seat.timed]
        stepped: Sequence[Stepped] = seats
        advance, windows, arrive = self.wiring.algorithm.step, self.faults, self.arrive
        start, step = run.start, run.step
        count = round((self.stop - start) / step)
        every = max(1, round(run.interval / step)) if run.interval else 1
        if count * len(stepped) >= WORTH and find_spec("numba"):  # which the master alone does without
            from . import convoy

            stepped = formed = convoy.form(seats)
            one, observed = formed[0], self.observe is not None or self.recorder.texts or self.recorder.timed
            if (
                len(formed) == 1
                and isinstance(one, convoy.Convoy)
                and not one.looking
                and not observed
                and not windows.parameters
            ):
                return convoy.sail(self, one, count, every)
        time = start
        for index in range(count):
            if windows.parameters:
                windows.switch(time)
            advance(stepped, index, time, step)
            time = start + (index + 1) * step
            self.index = index + 1
            arrive(time, (index + 1) % every == 0)

    def arrive(self, time: float, record: bool = True) -> None:
        """At a communication point: write a row, let others look."""
        self.time = time
        if record:
            self.recorder.row(time)
        if self.observe is not None:
            self.observe(time, self.wiring.parts)
        if self.tell is not None:
            self.tell(time)

    def _result(self) -> Result:
        table = pd.DataFrame(
            {b.name: {"given": b.given, "taken": b.taken, "lost": b.lost, "relative": b.relative} for b in self.balances},
            index=["given", "taken", "lost", "relative"], dtype=float,
        ).T  # fmt: skip
        units = {column.name: column.unit for column in self.sink.columns}
        run = self.system.run
        return Result(
            self.system.name, units, table, self.loops, self.time - run.start, self.index, self.rejected,
            clock.perf_counter() - self.began, self.sink.path, self.sink,
        )  # fmt: skip


class _failing:
    """Hands the results so far to whatever failure ends a run, and says where they are."""

    def __init__(self, simulation: _Simulation):
        self.simulation = simulation

    def __enter__(self):
        return self

    def __exit__(self, kind, error, trace):
        if isinstance(error, PartFailed):
            simulation = self.simulation
            try:
                simulation.recorder.check()
            except PartFailed as earlier:  # what ended the run began with nonsense
                if earlier.status != error.status:
                    earlier.args = (f"{earlier}\n  after that, {error}",)
                    error.args = earlier.args
            simulation.sink.flush()
            error.result = result = simulation._result()
            where = f"in {result.path}" if result.path else "in the `result` of this exception"
            error.args = (f"{error}\n  the results until t = {simulation.time:.9g} s are {where}",)
        return False


@dataclass
class _Piece:
    """Numbers side by side in a part's buffer that stand side by side in a row, from place `first` on."""

    first: int
    values: memoryview[float]
    begin: int
    count: int


class Recorder:
    """Writes rows: first the time, then each component's recorded variables."""

    def __init__(self, wiring: Wiring, seats: dict[str, Seat], sink: Sink):
        self.sink = sink
        self.timed = [seat for seat in seats.values() if seat.timed]
        self.texts: list[tuple[Part, str]] = []
        pieces: list[_Piece] = []
        position = 1
        for name, chosen in wiring.record.items():
            seat, part = seats[name], wiring.parts[name]
            of_y = {output: k for k, output in enumerate(seat.outputs)}
            of_u = {input_: k for k, input_ in enumerate(seat.inputs)}
            for variable in chosen:
                if part.variables[variable].type == "String":
                    self.texts.append((part, variable))
                    continue
                values, k = (seat.shown, of_y[variable]) if variable in of_y else (seat.u, of_u[variable])
                last = pieces[-1] if pieces else None
                if last and last.values is values and last.begin + last.count == k:  # next to the one before: copied together
                    last.count += 1
                else:
                    pieces.append(_Piece(position, values, k, 1))
                position += 1
        self.pieces = [(p.first, p.first + p.count, p.values[p.begin : p.begin + p.count]) for p in pieces]

    def row(self, time: float) -> None:
        sink = self.sink
        for seat in self.timed:
            if seat.evaluated != time:
                seat.evaluate(time)
        flat, base = sink.flat, sink.fill * sink.width
        flat[base] = time
        for first, last, values in self.pieces:
            flat[base + first : base + last] = values
        if self.texts:
            sink.words.append([part.get(name) for part, name in self.texts])
        sink.fill += 1
        if not sink.fill & 15:
            self.check()

    def check(self) -> None:
        """See that the rows since the last check are numbers, and make room for more."""
        sink = self.sink
        rows = sink.unchecked()
        if not np.isfinite(rows).all():
            self._look_for_nonsense(rows.reshape(-1, sink.width))
        sink.checked()

    def _look_for_nonsense(self, rows) -> None:
        numbers = [column.name for column in self.sink.columns if column.type != "String"]
        for row, column in np.argwhere(~np.isfinite(rows)):
            hint = "a smaller step; see which values grew before this in the results."
            said = ["(it said nothing; its output is no number from here on)"]
            raise PartFailed(numbers[column], float(rows[row, 0]), 0.0, f"{rows[row, column]}", {}, said, hint)


def _columns(wiring: Wiring) -> list[Variable]:
    columns = [Variable("time", "s")]
    for name, chosen in wiring.record.items():
        for variable in chosen:
            v = wiring.parts[name].variables[variable]
            columns.append(Variable(f"{name}.{variable}", v.unit, type=v.type))
    return columns


def _check_times(system: System, stop: float) -> None:
    run = system.run
    if not run.step > 0.0 or not math.isfinite(run.step):
        raise DescriptionError(f"[run] step = {run.step:g}: a step above zero is wanted here.")
    if not stop > run.start or not math.isfinite(stop):
        raise DescriptionError(f"The stop time {stop:g} s must be after the start {run.start:g} s.")
    for what, length in (("The time from start to stop", stop - run.start), ("[run] interval", run.interval)):
        steps = length / run.step
        if abs(steps - round(steps)) > 1e-6 * max(1.0, steps):
            raise DescriptionError(f"{what}, {length:g} s, is not a whole number of steps of {run.step:g} s.")


class _Progress:
    """A bar, a function, or nothing; told the time now and then."""

    def __init__(self, progress, start: float, stop: float):
        self.start, self.length, self.bar = start, stop - start, None
        self.next, self.function = 0.0, progress if callable(progress) else None
        if progress is True:
            from rich.progress import BarColumn, Progress, TextColumn, TimeRemainingColumn

            self.bar = Progress(
                TextColumn("{task.completed:.2f} of {task.total:g} s"), BarColumn(), TimeRemainingColumn(), transient=True
            )

    def __enter__(self):
        if self.bar:
            self.bar.start()
            task = self.bar.add_task("run", total=self.length)
            self.function = lambda fraction: self.bar.update(task, completed=fraction * self.length)
        return self.tell if self.function else None

    def __exit__(self, *_):
        if self.bar:
            self.bar.stop()

    def tell(self, time: float) -> None:
        fraction = (time - self.start) / self.length
        if self.function and (fraction >= self.next or fraction >= 1.0):
            self.next = fraction + 0.005
            self.function(fraction)
