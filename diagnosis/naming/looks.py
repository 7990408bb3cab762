"""The look at everything, linear: what each guess would change, little by little, and what that gains on blocks it did not see.

Each place is moved for each variable once for each point of a free curve; laws without a state are sums of these.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property

import numpy as np

from selflock.fmus.correction import law

from ..calibration.fit import End
from ..calibration.numbers import Number
from ..rules import RULES
from ..search.fit import weight
from ..search.hypotheses import Free
from ..search.linear import Draws, Linear
from ..search.screen import Direction
from . import guesses as g
from .arranged import Arranged
from .extended import Extending
from .guesses import CURVE, Guess, Trial
from .places import IN, Insert, Place, ahead
from .response import Responses
from .scene import Scene
from .shape import adds

Tell = Callable[[str, float], None]


@dataclass
class Looks:
    """What was looked at over a base: `ways`, each with its gain."""

    problem: Extending
    base: End
    values: dict[str, float]  # of the base
    arranged: Arranged
    linear: Linear
    scene: Scene
    inserts: tuple[Insert, ...]  # what was found before
    taken: set[str]  # numbers that are fitted anyway
    kinds: Sequence[str]
    tell: Tell
    enough: Callable[[], bool] = lambda: False  # whether time is up
    most: float = np.inf  # numbers that what has a name may have: what has more would not be believed
    ways: list[tuple[Direction, Guess]] = field(default_factory=list)
    paths: dict[Place, set[str]] = field(default_factory=dict)  # laws of those among them, by where they are

    def __post_init__(self) -> None:
        assert self.base.misfit is not None
        if self.scene.only is not None:  # beside what does a part of what a curve does, the rest is a law of its variable there
            self.kinds = [g.LAW]
        self.drawn: Draws = self.linear.draws(
            self.arranged.put(self.base.misfit * weight(self.base.misfit, RULES.search.loss_scale))
        )
        self.tables: list[tuple[Insert, np.ndarray, np.ndarray]] = []  # free curves, their points, what these change
        overs = {place: self._overs(place) for place in self.scene.places}
        spreads = {place: self.scene.spread(place) for place in self.scene.places}
        self.responses = Responses(self.problem, self.values, self.inserts, overs, spreads)

    def _overs(self, place: Place) -> list[str]:
        """What a law at a place may go with: also what goes nearly along with it, of others that hand on a surplus to it."""
        members, known = self.scene.played.group.members, self.scene.parts.variables
        given = [
            n for n, v in known.items() if v.causality == "output" and v.type == "Real" and self.scene.parts.owner(n) in members
        ]
        others = given if place.where == IN and g.LAW in self.kinds else []
        names = dict.fromkeys([*(over for over, _ in self.scene.variables(place)), *others])
        return [name for name in names if name != place.variable]

    def trial(self, guess: Guess) -> Extending:
        """The problem of a guess: what was found before, and its corrections and numbers."""
        wanted = (*self.inserts, *guess.inserts)
        if self.scene.played.inserts != wanted:
            self.scene.played.extend(wanted)
        return self._problem(guess)

    def _problem(self, guess: Guess) -> Extending:
        problem = self.problem
        found = replace(problem, numbers=(*problem.numbers, *guess.numbers), acts=problem.acts | guess.acts, units=problem.units)
        vars(found)["played"] = self.scene.played
        vars(found)["trusted"] = problem.trusted
        return found

    def _misfit(self, guess: Guess, at: dict[str, float], whole: bool = False) -> np.ndarray | None:
        """The misfit with a guess at these values of its numbers: of one correction by how outputs answer it, else simulated.

        whole: all that a path does at once, as a delay of a command in stairs, is large and turns back soon. Where answers
        change as a run goes on what is between two of them errs by a share of each step, and not of what is left of both.
        """
        values = self.values | {n.name: n.start for n in guess.numbers} | at
        problem = self._problem(guess)
        if whole and guess.place is not None and (self._rounds(guess) or not self.responses.steady(guess.place)):
            self.scene.played.extend((*self.inserts, *guess.inserts))
        elif len(guess.inserts) == 1:
            change = self.responses.change(guess.inserts[0], problem.settings(values))
            return None if change is None or self.base.misfit is None else self.base.misfit + change
        errors = problem.errors(values)
        if errors is None:
            return None
        return np.concatenate(
            [e[t] / problem.units[name] for name in errors for e, t in zip(errors[name], problem.trusted[name])]
        )

    def _rounds(self, guess: Guess) -> bool:
        """Whether it is a rounding that the log shows, which tells in which step a value was."""
        assert guess.place is not None
        return guess.law == "quantisation" and guess.place.variable in self.scene.played.rounded and guess.place.where != IN

    def _keep(
        self, guess: Guess, shape: dict[str, float], amplitudes: Sequence[Free], columns: np.ndarray, jump: float = 0.0
    ) -> None:
        if not self._wanted(guess) or not np.isfinite(columns).all() or not columns.any():
            return
        way = Direction(guess.hypothesis, shape, tuple(amplitudes), self.arranged.put(columns), jump=jump)
        self.linear.look(way, self.drawn)
        if np.isfinite(way.gain):
            self.ways.append((way, guess))
            if guess.kind == g.PATH and guess.place is not None:
                self.paths.setdefault(guess.place, set()).add(guess.law)

    def _wanted(self, guess: Guess) -> bool:
        return guess.kind == CURVE or guess.count <= self.most

    def _paths(self, place: Place) -> None:
        """What a path at a place may do. Of its roundings, of which there may be a thousand, those that look best are simulated."""
        roundings = []
        for trial in g.paths(self.scene, place):
            if trial.guess.law == "quantisation" and not self._rounds(trial.guess):
                roundings.append(trial)
            else:
                self._column(trial)
        few = len(roundings) <= RULES.naming.simulated or self.responses.steady(place)
        begin = len(self.ways)
        for trial in roundings:
            self._column(trial, few)
        if few:
            return
        looked = sorted(self.ways[begin:], key=lambda pair: -pair[0].gain)
        self.ways[begin:] = looked[RULES.naming.simulated :]
        for way, guess in looked[: RULES.naming.simulated]:
            self._column(Trial(guess, way.shape))

    def _column(self, trial: Trial, whole: bool = True) -> None:
        guess = trial.guess
        if not self._wanted(guess):
            return
        off = {n.name: n.start for n in guess.numbers} | trial.at
        if trial.acting:
            at = self._misfit(guess, off)
            columns = []
            for name in trial.acting:
                n = next(n for n in guess.numbers if n.name == name)
                step = RULES.naming.unit * (n.high - n.low)
                step = -step if n.start + step > n.high else step
                moved = self._misfit(guess, off | {name: n.start + step})
                if at is None or moved is None:
                    return
                columns.append((moved - at) / step)
            frees = [f for f in guess.free if f.name in trial.acting]
            self._keep(guess, trial.at, frees, np.stack(columns, -1))
        else:
            moved = self._misfit(guess, off, whole)
            if moved is not None and self.base.misfit is not None:
                self._keep(guess, trial.at, [Free("amount", 0.0, 0.0, 1.0)], (moved - self.base.misfit)[:, None], jump=1.0)

    def gains(self) -> dict[str, float]:
        """What each guess gains where it looks best, by label."""
        return {guess.label: way.gain for way, guess in sorted(self.ways, key=lambda pair: pair[0].gain)}

    def shaped(self, guess: Guess, shape: dict[str, float], acting: tuple[str, ...]) -> tuple[Direction, Guess] | None:
        """A look at a guess with this shape; None where none was to be had."""
        count = len(self.ways)
        self._column(Trial(guess, shape, acting))
        return self.ways[-1] if len(self.ways) > count else None

    def chance(self, left: np.ndarray, rng: np.random.Generator) -> dict[int, np.ndarray]:
        """What each draw of chance gains at most, by the stages of guesses: what is asked first pays for no more than what was asked by then."""
        draws: dict[int, np.ndarray] = {}
        for stage in (g.PLAIN, g.DERIVED, g.PAIRS):
            ways = [way for way, guess in self.ways if guess.stage == stage]
            draws[stage] = self.linear.chance(ways, left, RULES.search.draws, rng)
            if stage:
                draws[stage] = np.maximum(draws[stage], draws[stage - 1])
        return draws

    def slopes(self, way: Direction, problem: Extending) -> dict[str, np.ndarray]:
        """Slopes of the base's numbers, and of a way's amplitudes, d misfit / d place, as seen here."""
        assert self.base.jacobian is not None
        found = {n.name: self.base.jacobian[:, j] for j, n in enumerate(self.problem.free)}
        if not way.jump:
            columns = self.arranged.taken(way.columns, way.part)
            of = {n.name: n for n in problem.free}
            for j, amplitude in enumerate(way.amplitudes):
                found[amplitude.name] = columns[:, j] * of[amplitude.name].slope(of[amplitude.name].place(amplitude.nominal))
        return found

    def alone(self, way: Direction) -> np.ndarray:
        """What a way changes by its amounts that the base cannot make up for, (blocks times samples), of length 1; else 0."""
        weights, changed = self.linear.weights[:, way.part], np.zeros(self.linear.weights.shape)
        changed[:, way.part] = way.columns @ way.amounts * weights
        before, rest = float(np.linalg.norm(changed)), changed.ravel()
        rest = rest - self._made_up @ (self._made_up.T @ rest)
        size = float(np.linalg.norm(rest))
        return rest / size if size > RULES.naming.degenerate * before else np.zeros(len(rest))

    def simulated(self, way: Direction, guess: Guess) -> Direction | None:
        """A way of one amplitude as it is; None where the look has it so, as where answers do not change as a run goes on.

        Where they do the look errs by a share of all that a law changes, of which little is left where the base makes up for most.
        """
        if way.jump or way.shape or guess.place is None or len(guess.inserts) > 1 or self.responses.steady(guess.place):
            return None
        n = guess.numbers[0]
        step = RULES.naming.unit * (n.high - n.low)
        moved = self._misfit(guess, {n.name: n.start + step}, True)
        if moved is None or self.base.misfit is None:
            return None
        found = Direction(way.hypothesis, {}, way.amplitudes, self.arranged.put(((moved - self.base.misfit) / step)[:, None]))
        self.linear.look(found, self.drawn)
        return found

    @cached_property
    def _made_up(self) -> np.ndarray:
        """An orthonormal base of what the base's numbers move, where runs begin among them."""
        assert self.base.jacobian is not None
        columns = self.arranged.put(self.base.jacobian) * self.linear.weights[..., None]
        flat = columns.reshape(np.prod(columns.shape[:-1], dtype=int), columns.shape[-1]).astype(float)
        lengths = np.sqrt((flat**2).sum(0))
        flat = flat[:, lengths > 0.0] / lengths[lengths > 0.0]
        found, sizes, _ = np.linalg.svd(flat, full_matrices=False)
        return found[:, sizes > RULES.naming.degenerate * sizes.max(initial=0.0)]

    def _felt(self, name: str) -> float:
        """How much of a number that is 0 moves the outputs by as much as is left, as a little of it does; 0 where none is felt.

        Of a drag that nobody gave there is no size to begin with: the least of these decades that moves anything is enough.
        """
        assert self.base.misfit is not None
        left = float(np.linalg.norm(self.base.misfit))
        for size in 10.0 ** np.arange(*RULES.naming.decades_of_nothing):
            guess = Guess(g.PARAMETER, "parameter", name, (), (Number(name, name, 0.0, -size, size),))
            if (moved := self._misfit(guess, {name: float(size)})) is None:
                return 0.0
            if (change := float(np.linalg.norm(moved - self.base.misfit))) > RULES.naming.unit * left:
                return float(size) * left / change
        return 0.0

    def first(self) -> None:
        """All that goes with variables as they are and is added, and what is no law."""
        scene, places = self.scene, self.scene.places
        if g.PARAMETER in self.kinds:
            for trial in list(g.parameters(scene, self.taken, scene.parts.values, self._felt)):
                self._column(trial)
        for k, place in enumerate(places):
            if self.ways and self.enough():
                return
            self.tell(f"first look at {place}", 0.05 + 0.35 * k / len(places))
            if g.PATH in self.kinds:
                self._paths(place)
            scene.played.extend(self.inserts)
            if g.EVENT in self.kinds:
                self._events(place, next(g.shifts(scene, place)))
            if g.LAW in self.kinds:
                for over, what in scene.variables(place):
                    if what == law.VALUE:
                        self._laws(place, over, what, False)
        for one, knots, columns in self.tables:
            if not any(self._wanted(guess) for guess, *_ in g.overflow(scene, one, knots, one)):
                continue  # what the surplus changes is not simulated, either
            for other, more in self._elsewhere(one):
                for guess, shape, amplitudes, heights in g.overflow(scene, one, knots, other):
                    frees = [f for f in guess.free if f.name in amplitudes]
                    self._keep(guess, shape, frees, np.stack([columns @ heights, more @ heights], -1))

    def _elsewhere(self, one: Insert) -> Iterator[tuple[Insert, np.ndarray]]:
        """Where what a table takes away may go on, and what the same table changes there.

        Also where its variable is asked for by another name: what comes out of a tank may go nearly along with its level.
        """
        known = {(table.place, table.over, table.taken): columns for table, _, columns in self.tables}
        for place in self.scene.places:
            other = replace(
                one, place=place, fixed=(("ahead", ahead(self.scene.parts, place, one.over, self.scene.smooth)), *one.fixed[1:])
            )
            if g.overflows(self.scene, one, other):
                found = known.get((place, one.over, one.taken))
                columns = self._hats(other) if found is None else found
                if columns is not None:
                    yield other, columns

    def further(self) -> None:
        """What multiplies, goes with rates, integrals and times since a turn, and events in proportion to something."""
        scene, places = self.scene, self.scene.places
        for k, place in enumerate(places):
            if self.enough():
                return
            self.tell(f"further look at {place}", 0.6 + 0.15 * k / len(places))
            for shift in list(g.shifts(scene, place))[1:] if g.EVENT in self.kinds else ():
                self._events(place, shift)
            for over, what in scene.variables(place) if g.LAW in self.kinds else ():
                if what != law.VALUE:
                    self._laws(place, over, what, False)
                self._laws(place, over, what, True)

    def _laws(self, place: Place, over: str, what: int, multiplies: bool) -> None:
        """All laws of a variable at a place."""
        self._curve(place, over, what, multiplies)
        for trial in g.sines(self.scene, place, over, what, multiplies):
            self._column(trial)
        for trial in g.with_state(self.scene, place, over, what) if not multiplies and self.scene.only is None else ():
            self._column(trial)

    def pairs(self) -> None:
        """Laws of two variables, where all that was fitted of one leaves something."""
        for k, place in enumerate(self.scene.places):
            if self.enough():
                return
            self.tell(f"two variables at {place}", 0.8 + 0.05 * k / len(self.scene.places))
            for over, what, beside in self.scene.pairs(place):
                self._curve(place, over, what, False, beside)

    def _curve(self, place: Place, over: str, what: int, multiplies: bool, beside: str = "") -> None:
        """A free curve of a variable at a place, and the laws that its table can stand for, from one set of simulations."""
        scene = self.scene
        table, knots = g.curve(scene, place, over, what, multiplies, beside)
        columns = self._hats(table) if len(knots) > 1 else None
        if columns is None:
            return
        if not multiplies and not beside:
            self.tables.append((table, knots, columns))
        paths = self.paths.get(place, ())
        for guess, shape, amplitudes, heights in g.laws(scene, table, knots):
            if guess.law == "constant" and ("scale" if multiplies else "offset") in paths:
                continue  # whatever variable it is said of
            if guess.law == "proportional" and guess.inserts[0].own and not multiplies and "scale" in paths:
                continue
            self._keep(guess, shape, [f for f in guess.free if f.name in amplitudes], columns @ heights)
        for coarser, heights in g.coarser(table, knots) if scene.only is None else ():  # there it is known what a curve leaves
            self._keep_curve(coarser, columns @ heights, "curve")

    def _hats(self, table: Insert) -> np.ndarray | None:
        """What each height of a free curve changes."""
        step = RULES.naming.unit * (1.0 if table.multiplies else self.scene.spread(table.place))
        names = g.heights(table)
        probe = Guess(CURVE, "table", "", (table,), tuple(g.number(name, 0.0, -step, step) for name in names))
        at = self.base.misfit
        assert at is not None
        found = []
        for name in names:
            moved = self._misfit(probe, {name: step})
            if moved is None:
                return None
            found.append((moved - at) / step)
        columns = np.stack(found, -1)
        return columns if np.isfinite(columns).all() and columns.any() else None

    def finer(self, guess: Guess, values: dict[str, float], end: End) -> tuple[Guess, dict[str, float]] | None:
        """A free curve of all points that there may be, where its variable is beside one that was fitted, and where its fit starts.

        What is missing moves its variable as well: the base goes where the system does not, and the curve lay where that goes.
        """
        (coarse,) = guess.inserts
        table = g.placed(coarse, self._goes(coarse, self.trial(guess), values))
        at = np.interp(g.points_of(table), g.points_of(coarse), g.heights_at(guess, values))
        return self._begun(guess, values, end, table, at, "fine curve")

    def told_over(self, guess: Guess, values: dict[str, float], end: End, other: Insert) -> tuple[Guess, dict[str, float]] | None:
        """A free curve over what tells its variable, its points where that is at its own; and where its fit starts.

        other: a table of that at the same place.
        """
        (one,), problem = guess.inserts, self.trial(guess)
        both = lambda table: [self.scene.joined(table.over, table.taken, table.beside), self._goes(table, problem, values)]
        x, y = (np.concatenate(both(table)[: 1 if one.own or other.own else 2]) for table in (one, other))
        rises = np.argsort(x)
        points, at = np.interp(g.points_of(one), x[rises], y[rises]), g.heights_at(guess, values)
        way = slice(None, None, 1 if points[0] < points[-1] else -1)
        if not (np.diff(points[way]) > 0.0).all():
            return None
        return self._begun(guess, values, end, g.with_points(other, points[way]), at[way], guess.label.partition(" of ")[0])

    def as_curve(self, guess: Guess, values: dict[str, float], end: End) -> tuple[Guess, dict[str, float]] | None:
        """A law without a state as a free curve of all points that there may be, and where its fit starts: at what the law adds there."""
        (one,) = guess.inserts
        table = g.placed(replace(one, law="table"), self._goes(one, self.trial(guess), values))
        at = adds(one, values, g.points_of(table))
        return self._begun(guess, values, end, table, at, "fine curve")

    def _begun(
        self, guess: Guess, values: dict[str, float], end: End, table: Insert, at: np.ndarray, word: str
    ) -> tuple[Guess, dict[str, float]] | None:
        """A free curve in place of what was fitted, with these heights where its fit starts; None where none is to be had there."""
        heights = dict(zip(g.heights(table), map(float, at)))
        known = [n.name for n in self.trial(guess).free]
        own = {n.name for n in guess.numbers}
        rest = {name: value for name, value in values.items() if name not in own}
        columns = self._moved(table, rest, heights)
        if columns is None or end.jacobian is None:
            return None
        mine = [known.index(n.name) for n in self.problem.free]
        made = self._keep_curve(table, columns, word, end.jacobian[:, mine])
        return made, rest | {n.name: float(sum(made.acts[n.name][y] * h for y, h in heights.items())) for n in made.numbers}

    def _goes(self, table: Insert, problem: Extending, values: dict[str, float]) -> np.ndarray:
        """What a table's variable goes through beside it; a signal itself is known before it is corrected alone."""
        if table.own:
            return self.scene.joined(table.over, table.taken, table.beside)
        series = self.scene.played.series(problem.settings(values), problem.which)
        return replace(self.scene, series=series).joined(table.over, table.taken, table.beside)

    def _moved(self, table: Insert, values: dict[str, float], heights: dict[str, float]) -> np.ndarray | None:
        """What each height of a table changes around these, simulated."""
        step = RULES.naming.unit * (1.0 if table.multiplies else self.scene.spread(table.place))
        probe = Guess(CURVE, "table", "", (table,), tuple(g.number(name, 0.0, -step, step) for name in heights))
        problem = self.trial(probe)
        inside = lambda errors: np.concatenate(
            [e[t] / problem.units[n] for n in errors for e, t in zip(errors[n], problem.trusted[n])]
        )
        errors = [problem.errors(values | heights | moved) for moved in ({}, *({n: at + step} for n, at in heights.items()))]
        told = [inside(one) for one in errors if one is not None]
        if len(told) < len(errors):
            return None
        columns = np.stack([(one - told[0]) / step for one in told[1:]], -1)
        return columns if np.isfinite(columns).all() and columns.any() else None

    def _keep_curve(self, table: Insert, columns: np.ndarray, word: str, base: np.ndarray | None = None) -> Guess:
        """A free curve as a guess, its numbers the ways to change its heights; columns: of the heights, base: of the base's numbers."""
        reach = RULES.naming.reach * (1.0 if table.multiplies else self.scene.spread(table.place))
        moved = self.base.jacobian if base is None else base
        assert moved is not None
        ways, most = self._own_directions(columns, moved), reach * np.sqrt(table.points)
        numbers = tuple(g.number(f"{table.name}.c{j + 1}", 0.0, -most, most) for j in range(ways.shape[1]))
        acts = {n.name: dict(zip(g.heights(table), map(float, ways[:, j]))) for j, n in enumerate(numbers)}
        guess = Guess(CURVE, "table", g.words(word, table), (table,), numbers, acts)
        self._keep(guess, {}, guess.free, columns @ ways)
        return guess

    def _own_directions(self, columns: np.ndarray, base: np.ndarray) -> np.ndarray:
        """Ways to change a curve's heights that the base's own numbers cannot make up for, (knots, directions)."""
        assert self.base.misfit is not None
        weights = weight(self.base.misfit, RULES.search.loss_scale)[:, None]
        mine, base = columns * weights, base * weights
        lengths = np.sqrt((base**2).sum(0))
        base = base[:, lengths > 0.0] / lengths[lengths > 0.0]
        if base.shape[1]:
            q, r = np.linalg.qr(base)
            q = q[:, abs(np.diag(r)) > RULES.calibrate.lost]
            mine = mine - q @ (q.T @ mine)
        _, sizes, ways = np.linalg.svd(mine, full_matrices=False)
        largest = float(np.linalg.norm(columns * weights, 2))
        return ways[sizes > RULES.naming.degenerate * largest].T

    def _events(self, place: Place, shift: tuple[Insert, float, str]) -> None:
        """Shifts between two times: each edge is simulated once, and a shift is the difference of two."""
        scene, count = self.scene, RULES.naming.edges
        longest = sorted(self.problem.which, key=lambda i: -len(self.problem.runs[i]))[: RULES.naming.edge_runs]
        edges = []
        for i in longest:
            time = self.problem.runs[i].time
            edges.append(np.linspace(0.0, float(time[-1] - time[0]), count + 1))
        a, since = f"{scene.prefix}.a", f"{scene.prefix}.since"
        added, most, in_words = shift
        step = RULES.naming.unit * most
        steps: dict[tuple[int, int], np.ndarray | None] = {}
        wanted = [one for one in g.events(scene, added, most, in_words, edges, longest) if self._wanted(one[1])]
        for i, times in zip(longest if wanted else [], edges):
            numbers = (Number(a, a, 0.0, -step, step, run=i), g.number(since, 0.0, 0.0, float(times[-1])))
            probe = Guess(g.EVENT, "event", "", (replace(added, fixed=(*added.fixed, ("until", g.FAR))),), numbers)
            at = self.base.misfit
            for k, time in enumerate(times[:-1]):
                moved = self._misfit(probe, {a: step, since: float(time)})
                steps[i, k] = None if moved is None or at is None else (moved - at) / step
            steps[i, len(times) - 1] = np.zeros(self.arranged.block.shape)
        for i, guess, first, last in wanted:
            begin, end = steps[i, first], steps[i, last]
            if begin is None or end is None or (first == 0 and last == count):
                continue
            shape = {n.name: n.start for n in guess.numbers[1:]}
            self._keep(guess, shape, guess.free[:1], (begin - end)[:, None])
