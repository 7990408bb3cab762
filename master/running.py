"""A run while it goes on: what every way of stepping works on."""

from __future__ import annotations

import logging
import time as clock
from collections.abc import Callable
from dataclasses import dataclass
from math import isfinite
from pathlib import Path

import numpy as np
import pandas as pd

from . import control, energy
from .about import about
from .circles import Circle
from .coupling import Coupling
from .errors import DescriptionError, PartFailed, RunInterrupted, TimeUp, warn
from .face import Part, Variable
from .faults import Faults
from .files import sink
from .garbage import left_alone
from .initial import initialize, untaken
from .ratios import contrary
from .results import Result, Sink
from .seat import Seat, seats
from .seen import watch
from .state import States, check, identity
from .stops import Stops, rescues
from .system import System
from .wiring import Wiring, wire

log = logging.getLogger(__name__)

Observer = Callable[[float, dict[str, Part]], None]


BALANCED = ["given", "taken", "lost", "relative"]
NO_BONDS = pd.DataFrame([], [], BALANCED, float)  # a copy takes a twentieth of the time of another


class Running:
    """A run while it goes on: its parts wired and seated, what it records, and how far it is."""

    def __init__(
        self,
        system: System,
        settings,
        stop: float,
        out,
        tell,
        observe: Observer | None,
        keep: dict[str, Part] | None = None,
        stops: Stops | None = None,
        resume: bool = False,
    ):
        self.began = clock.perf_counter()
        self.system, self.stop, self.tell, self.observe = system, stop, tell, observe
        self.keep = keep
        self.stops = stops or Stops()
        self.index, self.rejected = 0, 0
        self.resumed = False
        self.time = system.run.start
        self.wiring = wire(system, settings, keep)
        try:
            self.faults = Faults(self.wiring)
            self.pairs = energy.bonds(self.wiring)
            control.check(self.wiring, self.pairs)
            self.states: States | None = None
            if resume:
                if out is None:
                    raise DescriptionError("A run goes on with a file of results: name one.")
                check(self)
                self.states = States(Path(out), identity(self, settings, stop))
            columns = _columns(self.wiring)
            mark = self.states.mark if self.states else None
            self.sink = sink(columns, out, mark, about(columns, self.wiring))
            watch(self.sink.seen, self.wiring)
        except BaseException:
            self.wiring.close()
            raise
        self.loops: list[Circle] = []
        self.coupling: Coupling | None = None
        rescues.add(self)
        self.notes = [*system.notes, *contrary(self.wiring), *self.faults.unseen(stop)]
        self.ends: list[tuple[str, float]] = []  # parts that ended the run, and when
        self.ended: dict[str, float] = {}  # the first of them
        self.interrupted = False  # a person wants it to end
        for part in self.wiring.parts.values():
            part.ends = self.ends
        self.lacks = {name: part.lacks for name, part in self.wiring.parts.items() if part.lacks}
        self.balances: list[energy.Balance] = []
        self.seats: list[Seat] = []

    @left_alone()
    def start(self) -> None:
        """Initialize the parts, and bring all to the first communication point."""
        wiring, start = self.wiring, self.system.run.start
        log.info("%s: %d components, %d connections, from %g s on", self.system.name, len(wiring.parts), len(wiring.links), start)
        for link in wiring.links:
            log.debug("%s · %g + %g", link, link.factor, link.offset)
        self.faults.begin()
        self.loops = initialize(wiring, self.stop if isfinite(self.stop) else None)
        for loop in self.loops:
            log.info("algebraic loop: %s", loop.name)
        self.notes += untaken(wiring)
        for note in self.notes:
            warn(note)
        for part in wiring.parts.values():
            part.at(start)
            if self.states:
                part.freeze()  # from now on it may be gone back to: said to it before its first step, or resumed runs differ
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
        self.coupling = Coupling(wiring, self.seats, self.loops)
        self.coupling.settle(start)
        self.recorder = Recorder(wiring, by_name, self.sink)
        if self.states and self.states.found:
            self.states.restore(self)
            self.resumed = True

    def arrive(self, time: float, keep: bool = True) -> None:
        """At a communication point: write a row, let others look. keep: it is in the results; peaks are of all."""
        self.time = time
        self.recorder.row(time, keep)
        if self.observe is not None:
            self.observe(time, self.wiring.parts)
        if self.tell is not None:
            self.tell(time)
        if self.interrupted:
            self.heed()
        if self.stops.asked or self.states:
            self.look()

    def heed(self) -> None:
        """End a session's steps where a person wants that."""
        if self.interrupted:
            self.interrupted = False
            raise KeyboardInterrupt

    def look(self) -> None:
        """End here where that is asked for; save the state where it is time to."""
        self.stops.obey()
        if self.states and self.states.due():
            self.states.write(self)

    def over(self, time: float) -> bool:
        """Whether, at this communication point, a part has ended the run. The last row then is of the time that it tells.

        Where it tells of one within the step, only a part that was alone has a row there: the others have stepped further,
        and all end at the communication point before.
        """
        slack = 1e-9 * self.system.run.step
        name, at = min(self.ends, key=lambda end: end[1])
        if at > time + slack:  # its own step is longer than that of the others
            return False
        stepped = [seat for seat in self.seats if not seat.timed]
        if at >= time - slack:
            self.arrive(time)
        else:
            self.index -= 1
            if len(stepped) == 1 and stepped[0].even and at > self.time + slack:
                self.arrive(at)
            self.sink.want_last()
        self.ended = {name: at}
        return True

    def stopped(self, error: BaseException) -> BaseException | None:
        """What to raise where it was not the run that failed, but somebody who ended it; with what is kept."""
        if not (self.stops.asked or isinstance(error, KeyboardInterrupt)):
            return None
        self.interrupted = False
        self.sink.want_last()
        self.sink.flush()
        result = self.result()
        result.notes = [*result.notes, f"interrupted at t = {self.time:.9g} s"]
        where = f"in {result.path}" if result.path else "in the `result` of this exception"
        if self.states and self.states.time is not None:
            where += f"; the same command goes on from t = {self.states.time:.9g} s"
        stopped = self.stops.error("The run", f"the results until t = {self.time:.9g} s are {where}")
        if not isinstance(stopped, TimeUp):
            return RunInterrupted(result, str(stopped))
        stopped.result = result
        return stopped

    def rescue(self) -> str:
        """Keep what there is, while a step does not come to an end, and say where; from any thread."""
        if self.sink.path is None:
            return f"A step from t = {self.time:.9g} s on did not come to its end; what was computed before is lost with the process."
        self.sink.close()
        return (
            f"A step from t = {self.time:.9g} s on did not come to its end; the results until then are in {self.sink.path}. "
            "`process = true` for its component, or --isolate, lets it be ended alone."
        )

    def result(self) -> Result:
        """What there is so far."""
        rows = [(b.given, b.taken, b.lost, b.relative) for b in self.balances]
        table = pd.DataFrame(rows, [b.name for b in self.balances], BALANCED, float) if rows else NO_BONDS.copy()
        units = {column.name: column.unit for column in self.sink.columns}
        run = self.system.run
        return Result(
            self.system.name,
            units,
            table,
            [loop.name for loop in self.loops],
            self.time - run.start,
            self.index,
            self.rejected,
            clock.perf_counter() - self.began,
            self.sink.path,
            self.sink,
            self.lacks,
            self.notes,
            self.ended,
            self.coupling.lagging if self.coupling else {},
            self.coupling.tallies if self.coupling else [],
        )


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
        self.timed = [seat for name, seat in seats.items() if seat.timed and wiring.record[name]]
        self.told: list[tuple[Seat, int, int]] = []  # of those: the column that has an output, and its place in y
        self.texts: list[tuple[Part, str]] = []
        self.feeds = {f"{link.target}.{link.input}": f"{link.source}.{link.output}" for link in wiring.links}
        self.untold = [seat for name, seat in seats.items() if not set(seat.outputs) <= set(wiring.record[name])]
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
                if seat.timed:
                    self.told.append((seat, position, k))
                last = pieces[-1] if pieces else None
                if last and last.values is values and last.begin + last.count == k:  # next to the one before: copied together
                    last.count += 1
                else:
                    pieces.append(_Piece(position, values, k, 1))
                position += 1
        self.pieces = [(p.first, p.first + p.count, p.values[p.begin : p.begin + p.count]) for p in pieces]

    def row(self, time: float, keep: bool = True) -> None:
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
        if not keep:
            sink.wanted[sink.fill] = False
        sink.fill += 1
        if not sink.fill & 15:
            self.check(time)

    def check(self, time: float) -> None:
        """See that the rows since the last check are numbers, and make room for more.

        So are outputs that others listen to and nobody records, as they are now: what passes on no number keeps to it, and to
        look at them in every step would cost as much as to record them.
        """
        sink = self.sink
        rows = sink.unchecked()
        if not np.isfinite(rows).all():
            self._look_for_nonsense(rows.reshape(-1, sink.width))
        for seat in self.untold:
            if not isfinite(sum(seat.shown)):  # or beyond a double only together
                for output, value in zip(seat.outputs, seat.shown):
                    if not isfinite(value):
                        raise _nonsense(f"{seat.name}.{output}", time, value)
        sink.checked()

    def _look_for_nonsense(self, rows) -> None:
        numbers = [column.name for column in self.sink.columns if column.type != "String"]
        for row, column in np.argwhere(~np.isfinite(rows)):
            name = numbers[column]
            raise _nonsense(self.feeds.get(name, name), float(rows[row, 0]), rows[row, column])


def _nonsense(name: str, time: float, value: float) -> PartFailed:
    """An output is no number."""
    hint = "a smaller step; see which values grew before this in the results."
    said = ["(it said nothing; its output is no number from here on)"]
    return PartFailed(name, time, 0.0, f"{value}", {}, said, hint)


def _columns(wiring: Wiring) -> list[Variable]:
    columns = [Variable("time", "s")]
    for name, chosen in wiring.record.items():
        for variable in chosen:
            v = wiring.parts[name].variables[variable]
            columns.append(Variable(f"{name}.{variable}", v.unit, type=v.type, causality=v.causality))
    return columns
