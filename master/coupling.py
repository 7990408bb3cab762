"""What a communication step does beyond its algorithm: circles solved, instead of a value that lags in them.

- **Settled**: an algebraic loop of parts whose outputs follow their inputs at one instant (model exchange, event mode of FMI
  3.0, parts in process) is solved at each communication point, after the step.
- **Redone**: a circle of parts that can only step is stepped again and again from the same instant, with inputs on trial, until
  these are what the outputs at the step's end make of them. An input on an algebraic loop is that of the end. Any other is the
  mean of start and end, which is right to second order in the step, as the trapezoidal rule is.

Under `algorithm = "iterated"` every circle of components is redone; under others an algebraic loop that parts declare, where
it cannot be settled and all of them can roll back.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from math import isfinite

import numpy as np

from .algorithms import Advance, Iterated, Stepped
from .circles import Circle, coupled
from .control import Snapshot
from .errors import DescriptionError, PartFailed
from .face import Part, Variable
from .results import Tally
from .seat import Seat
from .secant import Unsettled
from .unknowns import Unknowns
from .wiring import Wiring

LOOP, ITERATED = 1e-9, 1e-5  # relative, how exactly unless told
LOOSE = 1e-3  # what does not come as near as this ends the run


class Solved:
    """A circle that is solved in every step."""

    way: str
    failure: PartFailed | None = None  # of a part on trial, the last
    share: float | np.ndarray = 1.0  # of the end's value in an input; the rest is that of the start

    def __init__(self, circle: Circle, wiring: Wiring, seats: Sequence[Seat], tolerance: float):
        names = set(circle.parts)
        self.seats = [seat for seat in seats if seat.name in names]
        self.unknowns = Unknowns(circle, wiring, tolerance)
        self.tally = Tally(circle.name, self.way, len(self.unknowns.names))

    def solve(
        self, start: np.ndarray, evaluate: Callable[[np.ndarray], np.ndarray | None], exact: bool, time: float, size: float
    ) -> None:
        solver, tally = self.unknowns.solver, self.tally
        try:
            solver.solve(start, evaluate, lambda: self.unknowns.slopes(self.probe, exact) * self.share)
        except Unsettled as error:
            if self.failure is not None and not isfinite(error.residual):
                raise self.failure from None
            if error.residual > LOOSE:
                self._fail(time, size, error.residual)
            tally.loose += 1
        tally.solved += 1
        tally.rounds += solver.rounds
        tally.most = max(tally.most, solver.rounds)
        tally.residual = max(tally.residual, solver.residual)

    def probe(self, part: Part) -> None:
        """y of a part for its u as it is."""
        raise NotImplementedError

    def _fail(self, time: float, size: float, residual: float) -> None:
        unknowns = self.unknowns
        given = {".".join(name): float(place[0].u[place[1]]) for name, place in zip(unknowns.names, unknowns.places)}
        what = f"residual {residual:.2g} after {unknowns.solver.rounds} evaluations, not settled,"
        hint = "a smaller step, or a part in between whose output does not depend on its input at once (an inertia, a delay)."
        raise PartFailed(self.tally.name, time, size, what, given, ["these do not settle on each other"], hint)


class Settled(Solved):
    """An algebraic loop, solved at an instant."""

    way = "algebraic loop, solved at each communication point"

    def probe(self, part: Part) -> None:
        part.probe()

    def settle(self, time: float) -> None:
        """At a communication point to which all have come."""
        unknowns = self.unknowns
        for seat in self.seats:
            seat.gather(time, 0.0, 1.0)

        def evaluate(values: np.ndarray) -> np.ndarray:
            unknowns.put(values)
            for part in unknowns.parts:
                part.probe()
            return unknowns.given()

        for part in unknowns.parts:
            part.on_trial(True)
        self.solve(unknowns.given(), evaluate, True, time, 0.0)
        for part in unknowns.parts:
            part.on_trial(False)
        for seat in self.seats:
            for port in seat.ports:
                port.state[0] = port.y[port.j]


class Redone(Solved):
    """A circle that is solved by stepping it from the same instant again and again."""

    way = "algebraic loop, solved by stepping again"

    def __init__(self, circle: Circle, wiring: Wiring, seats: Sequence[Seat], tolerance: float, loops: Sequence[Circle] = ()):
        """loops: the algebraic ones, whose inputs are those of a step's end."""
        super().__init__(circle, wiring, seats, tolerance)
        at_once = {(link.target, link.input) for loop in loops for link in loop.links}
        self.share = np.array([1.0 if name in at_once else 0.5 for name in self.unknowns.names])
        table = {seat.name: seat for seat in self.seats}
        ends = [(table[name], place[1], k) for k, ((name, _), place) in enumerate(zip(self.unknowns.names, self.unknowns.places))]
        self.lines = [(seat, i, k) for seat, i, k in ends if i in seat.rates_in]
        self.last = np.full(len(self.unknowns.names), np.nan)  # what outputs gave at the step before

    def stroke(self, index: int, time: float, step: float) -> None:
        """A macro step of all on it."""
        for seat in self.seats:
            if seat.keep:
                seat.before[:] = seat.shown
            seat.gather(time, 0.0, 1.0, step)
        self.redo(Snapshot(self.seats), self.unknowns.given(), time, step, there=True)

    def redo(self, snapshot: Snapshot, held: np.ndarray, time: float, size: float, there: bool = False) -> None:
        """Find the step from a snapshot; inputs from elsewhere are as they lie now.

        held: what outputs gave there; there: all are there still.
        """
        unknowns = self.unknowns
        for seat, _, u, _ in snapshot.seats:
            u[:] = seat.part.u
        self._from = {seat.name: (seat, state) for seat, state, *_ in snapshot.seats}
        self._span = time, size

        def evaluate(values: np.ndarray) -> np.ndarray | None:
            nonlocal there
            if not there:
                snapshot.restore()
            there = False
            self._put(values, held, size)
            try:
                for seat in self.seats:
                    seat.go(time, size)
            except PartFailed as failure:
                if failure.status.startswith("Fatal"):
                    raise
                self.failure = failure  # from a saved state it goes on after an error, too
                return None
            return unknowns.given()

        start = 2.0 * held - self.last if np.isfinite(self.last).all() else held
        self.last[:] = held
        ends, mine = self.seats[0].part.ends, {seat.name for seat in self.seats}
        others = [end for end in ends if end[0] not in mine]  # which ended the run, whatever becomes of these
        self.solve(start, evaluate, False, time, size)
        ends[:] = others + [end for end in ends if end[0] in mine]

    def _put(self, values: np.ndarray, held: np.ndarray, size: float) -> None:
        """Inputs that are `held` at the start and `values` at the end: a line to those who take one, else a number between."""
        self.unknowns.put(self.share * values + (1.0 - self.share) * held)
        for seat, i, k in self.lines:
            seat.u[i], seat.rates_in[i] = held[k], (values[k] - held[k]) / size

    def probe(self, part: Part) -> None:
        seat, state = self._from[part.name]
        part.ends.clear()
        part.restore(state)
        seat.go(*self._span)


class Coupling:
    """The macro steps of a run: its algorithm's, with the circles of the system solved."""

    def __init__(self, wiring: Wiring, seats: Sequence[Seat], loops: Sequence[Circle]):
        run = wiring.system.run
        self.algorithm = wiring.algorithm
        self.settled: list[Settled] = []
        self.redone: list[Redone] = []
        self.lagging: dict[str, str] = {}  # loops that are not solved, and why
        self.groups: list[Seat | Redone] = []  # what is stepped one after the other, where all circles are redone
        exactly = run.coupling_tolerance
        if exactly is not None and not 0.0 <= exactly < LOOSE:
            raise DescriptionError(
                f"[run] coupling_tolerance = {exactly:g}: below {LOOSE:g} is wanted here, or 0 for loops that lag."
            )
        table = {seat.name: seat for seat in seats}
        iterated = isinstance(self.algorithm, Iterated)
        for names, circle in coupled(wiring) if iterated else ():
            if circle is None:
                self.groups += [table[name] for name in names]
                continue
            if why := _fixed([table[name] for name in names]):
                raise DescriptionError(
                    f'[run] algorithm = "iterated" steps {circle.name} again and again, but {why}. Use "gauss-seidel".'
                )
            one = Redone(circle, wiring, seats, exactly or ITERATED, loops)
            one.tally.way = "act on each other, stepped again"
            self.redone.append(one)
            self.groups.append(one)
        for loop in loops:
            there = [table[name] for name in loop.parts]
            if exactly == 0.0 and not iterated:
                self.lagging[loop.name] = "coupling_tolerance is 0"
            elif all(seat.part.instant and seat.large == 1 for seat in there) and not _faulty(there):
                self.settled.append(Settled(loop, wiring, seats, exactly or LOOP))
            elif not iterated and not loop.declared:
                silent = [name for name in loop.parts if any(v.depends_on is None for v in _outputs(table[name]))]
                self.lagging[loop.name] = f"{_many(silent, 'does', 'do')} not say which outputs depend on which inputs"
            elif not iterated and (why := _fixed(there)):
                self.lagging[loop.name] = why
            elif not iterated:
                self.redone.append(Redone(loop, wiring, seats, exactly or LOOP, [loop]))
        self.advance: Advance = self.algorithm.step
        if iterated:
            self.advance = self._iterated
        elif self.settled or self.redone:
            self.advance = self._mended

    @property
    def plain(self) -> bool:
        """Whether the algorithm's steps are all."""
        return self.advance == self.algorithm.step

    @property
    def numbers(self) -> list[np.ndarray]:
        """All numbers that decide how the next circles are solved."""
        solved = [*self.settled, *self.redone]
        return [one.unknowns.solver.memory for one in solved] + [one.last for one in self.redone]

    def save(self) -> list[np.ndarray]:
        return [values.copy() for values in self.numbers]

    def restore(self, state: list[np.ndarray]) -> None:
        for values, saved in zip(self.numbers, state):
            values[:] = saved

    @property
    def tallies(self) -> list[Tally]:
        return [one.tally for one in (*self.settled, *self.redone)]

    def settle(self, time: float) -> None:
        """Solve what is solved at an instant; all parts are there."""
        for one in self.settled:
            one.settle(time)

    def _iterated(self, stepped: Sequence[Stepped], index: int, time: float, size: float) -> None:
        for group in self.groups:
            group.stroke(index, time, size)
        self._settle_unless_over(time + size)

    def _mended(self, stepped: Sequence[Stepped], index: int, time: float, size: float) -> None:
        before = [(one, Snapshot(one.seats), one.unknowns.given()) for one in self.redone]
        self.algorithm.step(stepped, index, time, size)
        for one, snapshot, held in before:
            one.redo(snapshot, held, time, size)
        self._settle_unless_over(time + size)

    def _settle_unless_over(self, time: float) -> None:
        if self.settled and not self.settled[0].seats[0].part.ends:
            self.settle(time)


def _outputs(seat: Seat) -> list[Variable]:
    return [seat.part.variables[name] for name in seat.outputs if seat.part.variables[name].causality == "output"]


def _faulty(seats: Sequence[Seat]) -> bool:
    return any(seat.input_faults or seat.output_faults for seat in seats)


def _fixed(seats: Sequence[Seat]) -> str:
    """Why these cannot be stepped again; "" where they can."""
    if fixed := [seat.name for seat in seats if not seat.part.can_roll_back]:
        return f"{_many(fixed, 'does', 'do')} not roll back"
    if own := [seat.name for seat in seats if not seat.even]:
        return f"{_many(own, 'has', 'have')} a step of {'its' if len(own) == 1 else 'their'} own"
    return "[[faults]] on them remember" if _faulty(seats) else ""


def _many(names: Sequence[str], one: str, more: str) -> str:
    return f"{', '.join(names)} {one if len(names) == 1 else more}"
