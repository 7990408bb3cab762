"""Neighbouring FMUs stepped as one: their C calls, and what passes between them, in one compiled loop.

Python spends more time around the three C calls of an FMU's step than a native FMU spends in them. A convoy writes
down once what a macro step of its FMUs consists of, as a list of operations on addresses, and a loop compiled by
numba carries the list out. What happens, in which order, and every bit of every number are those of
master.algorithms. Whatever is not plain is left to it: steps of their own but for those of what samples, interpolated
inputs, strings, faults. A status beyond Warning is handed back to Python at the operation that had it.

Where the whole system is one convoy that nobody observes, many macro steps with their rows of results are one call.
"""

from __future__ import annotations

import ctypes
import time as clock
from collections.abc import Callable
from itertools import groupby
from typing import TYPE_CHECKING, Any

import numpy as np
from llvmlite import ir
from numba import njit, types

from ..fmus.variable import INTEGERS
from .addresses import intrinsic
from .addresses import load as _load
from .addresses import load_int as _load_int
from .addresses import store as _store
from .addresses import store_int as _store_int
from .algorithms import Algorithm
from .energy import Port
from .garbage import left_alone
from .native import BEYOND, MORE, Exchange, Native
from .seat import Seat

if TYPE_CHECKING:
    from .running import Recorder, Running

STRETCH = 1000  # macro steps between two looks at the results, at most
AT_ONCE = 0.2  # s of wall time that they take, so that rows are written and Ctrl-C is heard
LEAST, MOST = INTEGERS[0] - 1.0, INTEGERS[1] + 1.0
MOVE, TO_INT, FROM_INT, EXCHANGE, STEP, WORK, LOOK, STEP3 = range(8)
LOCK = tuple(
    ctypes.cast(call, ctypes.c_void_p).value or 0
    for call in (ctypes.pythonapi.PyGILState_Ensure, ctypes.pythonapi.PyGILState_Release)
)
FLAGS = 0xFFFFFF  # the three bytes of what a step of FMI 3.0 tells


def _call(builder, address, kinds, args):
    return builder.call(builder.inttoptr(address, ir.FunctionType(ir.IntType(32), kinds).as_pointer()), args)


@intrinsic
def _exchange(context, function, instance, references, count, values):
    """fmi2SetXxx or fmi2GetXxx by the address of the function; of FMI 3.0, too, which wants the count of values behind them.

    C lets a function that does not want it pass over it.
    """

    def code(context, builder, signature, args):
        return _call(builder, args[0], [ir.IntType(64)] * 5, [*args[1:], args[3]])

    return types.int32(types.int64, types.int64, types.int64, types.int64, types.int64), code


@intrinsic
def _do_step(context, function, instance, time, size, free):
    """fmi2DoStep by the address of the function."""

    def code(context, builder, signature, args):
        return _call(builder, args[0], [ir.IntType(64), ir.DoubleType(), ir.DoubleType(), ir.IntType(32)], args[1:])

    return types.int32(types.int64, types.int64, types.float64, types.float64, types.int32), code


@intrinsic
def _do_step3(context, function, instance, time, size, free, told):
    """fmi3DoStep by the address of the function."""

    def code(context, builder, signature, args):
        places = [builder.add(args[5], ir.Constant(ir.IntType(64), k)) for k in (0, 1, 2, 8)]
        kinds = [ir.IntType(64), ir.DoubleType(), ir.DoubleType(), ir.IntType(32), *[ir.IntType(64)] * 4]
        return _call(builder, args[0], kinds, [*args[1:5], *places])

    return types.int32(types.int64, types.int64, types.float64, types.float64, types.int32, types.int64), code


@intrinsic
def _hold(context, function):
    """PyGILState_Ensure by its address."""

    def code(context, builder, signature, args):
        return _call(builder, args[0], [], [])

    return types.int32(types.int64), code


@intrinsic
def _let_go(context, function, held):
    """PyGILState_Release by its address."""

    def code(context, builder, signature, args):
        kind = ir.FunctionType(ir.VoidType(), [ir.IntType(32)]).as_pointer()
        builder.call(builder.inttoptr(args[0], kind), args[1:])
        return context.get_dummy_value()

    return types.void(types.int64, types.int32), code


@njit(cache=True, nogil=True)  # rows are written, and Ctrl-C is heard, while an FMU takes its time
def _carry_out(kinds, where, numbers, first, row, index, start, step, time, size):
    """Carry out the operations from `first` on: (the operation that failed, its status), or (-1, 0).

    row: of the tables of functions of time, that of this macro step, the `index`th of `step` s since `start`. What samples does so
    once in several of them.
    """
    for k in range(first, len(kinds)):
        kind, long = kinds[k], where[k, 5]
        if long > 1 and index % long != 0:
            continue
        until = size if long <= 1 else start + (index + long) * step - time
        a, b = where[k, 0], where[k, 1]
        status = 0
        if kind == MOVE:
            value = _load(a)
            if numbers[k, 0] != 1.0 or numbers[k, 1] != 0.0:
                value = numbers[k, 0] * value + numbers[k, 1]
            _store(b, value)
        elif kind == EXCHANGE:
            status = _exchange(a, b, where[k, 2], where[k, 3], where[k, 4])
        elif kind == STEP:
            status = _do_step(a, b, time, until, np.int32(where[k, 2]))
        elif kind == STEP3:
            _store_int(where[k, 3], np.int32(0))
            status = _do_step3(a, b, time, until, np.int32(where[k, 2]), where[k, 3])
            if status <= 1 and _load_int(where[k, 3]) & FLAGS:
                status = MORE
        elif kind == WORK:  # as master.energy.Port.add
            state, now = where[k, 2], _load(a)
            work = 0.5 * (_load(state) + now) * _load(b) * size * numbers[k, 0]
            _store(state, now)
            _store(state + 8, _load(state + 8) + work)
            _store(state + 16, _load(state + 16) + abs(work))
        elif kind == LOOK:
            value = _load(a + row * where[k, 2])
            if numbers[k, 0] != 1.0 or numbers[k, 1] != 0.0:
                value = numbers[k, 0] * value + numbers[k, 1]
            _store(b, value)
        elif kind == TO_INT:
            value = _load(a)
            if LEAST < value < MOST:  # as int() takes it
                _store_int(b, np.int32(value))
            else:
                status = BEYOND
        else:
            _store(b, float(_load_int(a)))
        if status > 1:
            return k, status
    return -1, 0


@njit(cache=True, nogil=True)  # rows are written, and Ctrl-C is heard, while an FMU takes its time
def _sail(kinds, where, numbers, start, first, count, size, sources, rows, fill, hold, let_go):
    """Macro steps `first` to `first + count`, a row after each: (steps made, rows, failed operation, status).

    hold, let_go: of Python's lock, which FMUs in Python else take at each call; 0: it is left to them.
    """
    held = _hold(hold) if hold != 0 else np.int32(0)
    done, failed, status = count, -1, 0
    for index in range(first, first + count):
        time = start + index * size
        exact = start + (index + 1) * size - time
        failed, status = _carry_out(kinds, where, numbers, 0, index - first, index, start, size, time, exact)
        if failed >= 0:
            done = index - first
            break
        rows[fill, 0] = start + (index + 1) * size
        for column in range(len(sources)):
            rows[fill, column + 1] = _load(sources[column])
        fill += 1
    if hold != 0:
        _let_go(let_go, held)
    return done, fill, failed, status


def address(values: memoryview[float], place: int = 0) -> int:
    """Where a number of a part's buffer lies."""
    return ctypes.addressof(ctypes.c_char.from_buffer(values)) + place * values.itemsize


class Program:
    """A list of operations, and which seat each belongs to."""

    def __init__(self, natives: dict[str, Native], tables: dict[str, np.ndarray] | None = None):
        self.natives = natives  # by the name of the seat
        self.tables = tables or {}  # of functions of time: a row each macro step, as they come out; none: others look
        self.rows: list[tuple[int, tuple[int, ...], tuple[float, float]]] = []
        self.seats: list[Seat] = []
        self.names: list[str] = []

    def add(self, seat: Seat, kind: int, *where: int, factor: float = 1.0, offset: float = 0.0, name: str = "") -> None:
        self.rows.append((kind, where + (0,) * (5 - len(where)) + (seat.large,), (factor, offset)))
        self.seats.append(seat)
        self.names.append(name)

    def gather(self, seat: Seat) -> None:
        for i, y, j in seat.plain:
            self.add(seat, MOVE, address(y, j), address(seat.u, i))
        for i, y, j, factor, offset in seat.scaled:
            self.add(seat, MOVE, address(y, j), address(seat.u, i), factor=factor, offset=offset)
        for source, i, j, factor, offset in seat.clocked if self.tables else ():
            table = self.tables[source.name]
            first, width = table.ctypes.data, table.strides[0]
            self.add(seat, LOOK, first + j * table.itemsize, address(seat.u, i), width, factor=factor, offset=offset)

    def cycle(self, seat: Seat) -> None:
        native = self.natives[seat.name]
        for exchange in native.writes:
            for place, own in exchange.copies:
                self.add(seat, TO_INT, address(seat.u, place), own, name=exchange.name)
            self.exchange(seat, native, exchange)
        self.add(seat, STEP3 if native.told else STEP, native.do_step, native.instance, native.free, native.told)
        for exchange in native.reads:
            self.exchange(seat, native, exchange)
            for place, own in exchange.copies:
                self.add(seat, FROM_INT, own, address(seat.out, place))
        for j in range(len(seat.outputs) if seat.large > 1 else 0):
            self.add(seat, MOVE, address(seat.out, j), address(seat.shown, j))
        for port in seat.ports:
            self.work(seat, port)

    def exchange(self, seat: Seat, native: Native, one: Exchange) -> None:
        where = one.function, native.instance, one.references, one.count, one.values
        self.add(seat, EXCHANGE, *where, name=one.name)

    def work(self, seat: Seat, port: Port) -> None:
        self.add(seat, WORK, address(port.y, port.j), address(port.u, port.i), address(port.state), factor=port.scale)

    def close(self) -> Program:
        self.kinds = np.array([row[0] for row in self.rows], dtype=np.int64)
        self.where = np.array([row[1] for row in self.rows], dtype=np.int64).reshape(-1, 6)
        self.numbers = np.array([row[2] for row in self.rows], dtype=float).reshape(-1, 2)
        return self

    def run(self, index: int, time: float, size: float, first: int = 0, row: int = 0) -> None:
        """Carry the operations of a macro step out; what a part does not finish is finished, or raised, by the part."""
        start, step = (self.seats[0].start, self.seats[0].macro) if self.seats else (0.0, size)
        while True:
            failed, status = _carry_out(self.kinds, self.where, self.numbers, first, row, index, start, step, time, size)
            if failed < 0:
                return
            self.mend(failed, status, index, time, size)
            first = failed + 1

    def mend(self, failed: int, status: int, index: int, time: float, size: float) -> None:
        """Let the part finish what ended with `status`; raises PartFailed where it cannot."""
        seat = self.seats[failed]
        native = self.natives[seat.name]
        size = seat.size(index, time, size)
        if self.kinds[failed] in (STEP, STEP3):
            native.finish(status, time, size)
        else:
            native.fail(status, self.names[failed], time, size)


class Convoy:
    """Seats next to each other as one, with the face that the algorithms know of a seat."""

    passes = False

    def __init__(self, seats: list[Seat], natives: dict[str, Native]):
        self.seats, self.natives = seats, natives
        self.looking = [seat for seat in seats if seat.clocked]
        self.together, self.gathering, self.moving = (Program(natives) for _ in range(3))
        for seat in seats:
            self.together.gather(seat)
            self.together.cycle(seat)
            self.gathering.gather(seat)
            self.moving.cycle(seat)
        for program in (self.together, self.gathering, self.moving):
            program.close()

    def _look(self, index: int, time: float) -> None:
        for seat in self.looking:
            if index % seat.large == 0:
                seat.look(time, 0.0)

    def stroke(self, index: int, time: float, step: float) -> None:
        self._look(index, time)
        self.together.run(index, time, step)

    def collect(self, index: int, time: float, step: float) -> None:
        self._look(index, time)
        self.gathering.run(index, time, step)

    def move(self, index: int, time: float, step: float) -> None:
        self.moving.run(index, time, step)

    def whole(self, algorithm: Algorithm, tables: dict[str, np.ndarray]) -> Program:
        """A macro step of a system that is this convoy alone, and functions of time."""
        program = Program(self.natives, tables)
        algorithm.lay_out(program, self.seats)
        return program.close()


def fits(seat: Seat) -> Native | None:
    """What a convoy needs of a seat that does nothing but what a convoy knows."""
    more = seat.between, seat.carried, seat.tilted, seat.texts, seat.mapped, seat.input_faults, seat.output_faults
    samples = seat.large > 1 and seat.samples and not seat.ports  # between its steps nothing of it changes
    return seat.part.native() if (seat.even or samples) and not seat.keep and not any(more) else None


@left_alone()
def form(stepped: list[Seat]) -> list[Seat | Convoy]:
    """The seats in their order, neighbours that fit as one."""
    natives = {seat.name: native for seat in stepped if (native := fits(seat)) is not None}
    formed: list[Seat | Convoy] = []
    for together, group in groupby(stepped, lambda seat: seat.name in natives):
        run = list(group)
        formed += [Convoy(run, natives)] if together and (len(run) > 1 or len(stepped) == 1) else run
    return formed


def clocks(convoy: Convoy, recorder: Recorder) -> dict[str, Seat] | None:
    """The functions of time that seats listen to, or that are recorded; None where one of them does not tell a stretch at once."""
    heard = [source for seat in convoy.looking for source, *_ in seat.clocked]
    sources = {source.name: source for source in (*heard, *recorder.timed)}
    plain = all(source.part.tells_ahead and not source.output_faults for source in sources.values())
    return sources if plain else None


def sail(running: Running, convoy: Convoy, count: int, kept: Callable[[Any], Any]) -> None:
    """All macro steps of a run whose parts are one convoy, in stretches that end where rows are looked at.

    kept: whether the row after so many of them is in the results.
    """
    recorder, sink = running.recorder, running.sink
    timed = clocks(convoy, recorder) or {}
    tables = {name: np.zeros((STRETCH + 1, len(seat.outputs))) for name, seat in timed.items()}
    program = convoy.whole(running.wiring.algorithm, tables)
    start, size = running.system.run.start, running.system.run.step
    sources = np.array(
        [address(values, k) for first, last, values in recorder.pieces for k in range(last - first)], dtype=np.int64
    )
    lock = LOCK if all(native.python for native in convoy.natives.values()) else (0, 0)
    pace = STRETCH
    while running.index < count:
        stretch = min(count - running.index, len(sink.block) - sink.fill, pace)
        first, filled, began = running.index, sink.fill, clock.perf_counter()
        for name, seat in timed.items():
            tables[name][: stretch + 1] = seat.part.ahead(start + np.arange(first, first + stretch + 1) * size)
        done, fill, failed, status = _sail(
            program.kinds,
            program.where,
            program.numbers,
            start,
            running.index,
            stretch,
            size,
            sources,
            sink.block,
            sink.fill,
            *lock,
        )
        for seat, column, place in recorder.told:
            sink.block[filled:fill, column] = tables[seat.name][1 : done + 1, place]
        sink.wanted[filled:fill] = kept(np.arange(first + 1, first + done + 1))
        sink.fill = fill  # no sooner: another thread may keep all rows up to it at any time
        pace = min(max(int(stretch * AT_ONCE / max(clock.perf_counter() - began, 1e-9)), 1), STRETCH)
        running.index += done
        running.time = start + running.index * size
        recorder.check(running.time)
        if failed >= 0:
            now = start + (running.index + 1) * size
            program.mend(failed, status, running.index, running.time, now - running.time)
            program.run(running.index, running.time, now - running.time, failed + 1, running.index - first)
            running.index += 1
            if running.ends and running.over(now):
                return
            running.time = now
            recorder.row(now, bool(kept(running.index)))
        if running.tell is not None:
            running.tell(running.time)
        running.heed()
        running.look()
