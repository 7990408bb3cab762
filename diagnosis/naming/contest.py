"""One contest: rivals looked at linearly, the best fitted as simulations of the whole, and judged on blocks they did not see.

As in the search over our own drives (search.step): the look and its chance are search.linear, a fit's unseen blocks
search.fit.held_out, who is worse than whom search.candidate. What is compared are samples, in blocks.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property, partial
from typing import Any

import numpy as np

from ..calibration.fit import Calibrating, End, fit_from, in_units
from ..calibration.slopes import Forward
from ..residuals.blocks import Blocks
from ..rules import RULES
from ..search.candidate import Candidate
from ..search.fit import Fit, held_out, rho, weight
from ..search.hypotheses import Free, Hypothesis
from ..search.linear import Linear
from ..search.screen import Direction
from . import guesses as g
from .afresh import LATE_OR_BENT, afresh, elsewhere
from .arranged import Arranged, determined, lasting, over_noise
from .bent import begins_low, bent, from_brims, takes_most
from .chosen import again, chosen, fewest_first
from .extended import Extended, Extending
from .guesses import CURVE, Guess
from .limit import Limit
from .looks import Looks, Tell
from .near import as_curve, beside_best, carried, finer, starts, told_over
from .order import believe, curve_of, distinct, far, fits_best, leading, only_beside, ordered
from .places import Place
from .relatives import relatives
from .round import Rivalled, Round
from .rounding import between, stepped
from .scene import Scene

Told = Callable[..., Extending | None]
"""The problem beside a log that is told better for a rival, from the noise of each output (steps.around); None where there is none."""


@dataclass
class Contest:
    """A round over a base: the system with what was found before, its numbers at `places`."""

    problem: Extending  # on the data of the look
    places: np.ndarray
    prefix: str
    tell: Tell
    smooth: bool = False
    taken: set[str] = field(default_factory=set)  # numbers that are fitted anyway
    kinds: Sequence[str] = g.KINDS  # of guesses that are held against the base
    enough: Limit = field(default_factory=Limit)  # whether time is up: what was fitted by then is judged
    sampled: frozenset[str] = frozenset()  # components that act once a step
    told: Told | None = None  # where rivals take steps that miss something
    steps: Callable[[Rivalled], Any] | None = None  # the search in the steps that a rival asks for; None where in these
    only: tuple[Place, str] | None = None  # where something is missing that goes with which variable, if that is known
    before: tuple[Guess, Sequence[dict[str, float]]] | None = None  # what asked for these steps, its values in them and before
    other: Any = None  # such a search, with which to begin anew
    asker: Rivalled | None = None  # beside what it was asked for
    fitted: list[Rivalled] = field(default_factory=list)  # all, as they come
    retold: dict[int, Rivalled] = field(default_factory=dict)  # by id, what was fitted on a log that is told better for it
    made: dict[tuple, tuple[Any, Rivalled | None]] = field(default_factory=dict)  # fits, by what decides them, with their problem
    telling: bool = False  # whether fits are on such a log
    asked: set[str] = field(default_factory=set)  # labels of rivals beside which steps were asked for
    most: float = 0.0  # that any rival with a name takes off the loss, on the log that is told for the base
    named: bool = False  # whether something that has a name leaves no more than noise
    numbers: float = np.inf  # of the fewest beside which no other can be better: what has more would not be believed

    @property
    def played(self) -> Extended:
        assert isinstance(self.problem.played, Extended)
        return self.problem.played

    @cached_property
    def layout(self) -> Blocks:
        return Blocks(self.problem.runs, False)

    @cached_property
    def arranged(self) -> Arranged:
        errors = self.problem.errors(self.values)
        assert errors is not None
        return Arranged(self.problem, self.layout, lasting(errors, self.layout))

    def play(self, rng: np.random.Generator) -> Round:
        """Look, fit, judge, and compare with chance."""
        problem = self.problem
        self.inserts = self.played.inserts
        self.tell("the base", 0.0)
        base = in_units(problem, self.places, RULES.naming.effort, RULES.naming.ended)
        assert base.misfit is not None and base.jacobian is not None
        self.base, self.values = base, problem.values(base.places)
        self.begins = self.arranged.begins(problem, base)
        unseen = self._held_out(problem, base)
        nothing = self._candidate(Hypothesis("", "nothing more", ()), (), problem, base, unseen)
        self.losses, self.errors_unseen, self.errors_fit = (
            nothing.losses,
            self.arranged.errors(unseen),
            self.arranged.errors(base.misfit),
        )
        outcome = Round(nothing, [], only=self.only)
        self.noise, outcome.ratios = over_noise(self.problem, self.values)
        outcome.noise = self.noise
        limit = RULES.search.left if self.inserts else RULES.search.clean
        outcome.off = self.off = np.array([ratio > limit for ratio in outcome.ratios.values()])
        if not self.off.any() or len(self.arranged.names) < RULES.pipeline.fewest_blocks:
            return outcome
        series = self.played.series(problem.settings(self.values), problem.which)
        self.scene = Scene(self.problem.played.parts, self.played, series, self.prefix, self.smooth, self.only)
        outcome.still = self.scene.still
        weights = self.arranged.put(weight(base.misfit, RULES.search.loss_scale))
        columns = self.arranged.put(
            determined(self._as_fit(problem, base).jacobian, weight(base.misfit, RULES.search.loss_scale))
        )
        begin = self.arranged.put(self.arranged.of_begins(problem, base, self.begins))
        self.linear = Linear(columns, weights, self.arranged.folds, self.arranged.runs, makes_up=True, own=begin)
        known = problem, base, self.values, self.arranged, self.linear, self.scene
        self.looks = Looks(*known, self.inserts, self.taken, self.kinds, self.tell, self.enough)
        try:
            self._stages(outcome)
            if self.other is not None:
                return outcome
            self._near_best(outcome)
        except KeyboardInterrupt:
            if not self.enough.ends():
                raise
            outcome.fitted = distinct(self.fitted)
        outcome.looked = len({guess.label for _, guess in self.looks.ways})
        with self.enough.answering():
            if outcome.fitted:
                self._judge(outcome, rng)
                if (curve := outcome.curve) and curve.guess.place and self.told_by_curve([curve]):
                    outcome.only = curve.guess.place, curve.guess.over[0]
                    only_beside(outcome)
            self.played.extend(self.inserts)
        return outcome

    def _stages(self, outcome: Round) -> None:
        """Look and fit: what is simple first, and what is not where something is left."""
        turned: list[Rivalled] = []
        for values in self.before[1] if self.before else ():
            if self.before and (known := self.fit(self.before[0], at := self.values | values)) is not None:
                turned.append(known)
                self._retold(known, at)  # what steps miss is known there
                if not self.more(known):
                    break
        self.looks.most = self.numbers
        self.looks.first()
        signs = self._afresh(("sign",))
        turned += signs
        best = min(signs, key=lambda r: r.end.loss, default=None)
        outcome.fitted = distinct(turned)
        if best is not None and self._takes(best, 0.0) and not self.more(best):
            return  # what has no number would be believed before all else
        if self._elsewhere(best, RULES.naming.as_much) or self._elsewhere(self._looks_best(), RULES.naming.as_much):
            return
        outcome.fitted = distinct(turned + self._fits(g.PLAIN))
        if self.only or self.other or (self._wanting(outcome) and self._elsewhere(fits_best(outcome.fitted), 0.0)):
            return
        if self._wanting(outcome):
            outcome.fitted = distinct(outcome.fitted + self._afresh(LATE_OR_BENT))
        if self._wanting(outcome) and not self.enough():
            self.looks.further()
            outcome.fitted = distinct(outcome.fitted + self._fits(g.DERIVED))
        if g.LAW in self.kinds and self._wanting(outcome) and not self.enough():
            self.looks.pairs()
            outcome.fitted = distinct(outcome.fitted + self._fits(g.PAIRS))

    def _afresh(self, laws: Sequence[str]) -> list[Rivalled]:
        """Paths beside a base without a cause, fitted from the numbers that the rig has."""
        asked = g.PATH in self.kinds and not self.inserts and not self.enough()
        fits = [self.fit(guess, start) for guess, start in (afresh(self.looks, laws) if asked else ())]
        return [rival for rival in fits if rival is not None]

    def _looks_best(self) -> Rivalled | None:
        """What looks best of what has a name, fitted, or, where it leaves much, of curves; None where it is not asked for."""
        found = None
        for curve in (False, True):
            mine = [(way, guess) for way, guess in self.looks.ways if (guess.kind == CURVE) == curve and guess.plain]
            if self.steps is None or not mine or self.enough() or (found and self._takes(found, RULES.naming.as_much)):
                break
            way, guess = max(mine, key=lambda pair: pair[0].gain)
            found = self.fit(guess, self.values | self._start(way, guess), way)
        return found

    def _takes(self, rival: Rivalled, least: float) -> bool:
        """Whether a rival takes off at least this share of the base's loss."""
        return rival.end.loss <= (1.0 - least) * self.problem.loss(self.base.misfit)

    def _clears(self, rival: Rivalled, least: float) -> bool:
        """The same of what is left in units of the noise: in those of the loss an output that is ten times its noise weighs as any."""
        return self._energy(rival.end.misfit) <= (1.0 - least) * self._energy(self.base.misfit)

    def _energy(self, misfit: np.ndarray | None) -> float:
        return float(np.mean(self._leaves(misfit) ** 2))

    def _elsewhere(self, best: Rivalled | None, least: float) -> bool:
        """Whether a rival that takes off at least this share of the loss, and leaves something, asks for other steps: then all begins there."""
        if self.steps is None or best is None or best.guess.label in self.asked or self.named or self.enough():
            return False
        if not (self._takes(best, least) or self._clears(best, least)) or not self.more(best):
            return False
        self.asked.add(best.guess.label)
        self.tell(f"steps beside {best.guess.label}", 0.5)
        self.asker = self._retold(best)
        self.other = self.steps(self.asker)
        self.scene.played = self.played
        return self.other is not None

    def _near_best(self, outcome: Round) -> None:
        """What comes near the best held against it on logs that are told better for each."""
        base = outcome.base.errors.mean()
        least = RULES.naming.as_much * (base - min((r.candidate.errors.mean() for r in outcome.fitted), default=base))
        for k, rival in enumerate(outcome.fitted):
            if base - rival.candidate.errors.mean() >= least and not self.enough():
                outcome.fitted[k] = self._retold(rival)
        outcome.fitted = distinct(outcome.fitted)

    def _retold(self, rival: Rivalled, at: dict[str, float] | None = None) -> Rivalled:
        """A rival fitted anew where what steps miss beside it, or beside it at such values, is taken off; itself where they miss nothing."""
        if self.told is None or id(rival) in self.retold:
            return self.retold.get(id(rival), rival)
        found, own, last = rival.moved(at) if at else rival, self.problem, list[Extending]()
        for _ in range(RULES.naming.retold):  # what it is there changes what steps miss of it
            self.played.extend(self.inserts)
            if (anew := self.told(found, self.arranged.noise(self.noise, found.end.misfit), *last)) is None:
                break
            self.tell(f"fits: {rival.guess.label}", 0.88)
            self.problem, self.looks.problem, self.telling, last = anew, anew, True, [anew]
            try:
                self.scene.played = self.played
                fits = [self.fit(rival.guess, found.values, begun=found)]
                if fits[0] is None or fits[0].end.loss > found.end.loss:  # slopes of its own may lead on where those do not
                    fits.append(self.fit(rival.guess, found.values))
                found = min((r for r in fits if r is not None), key=lambda r: r.end.loss, default=found)
            finally:
                self.problem, self.looks.problem, self.telling = own, own, False
                self.scene.played = self.played
        self.retold[id(rival)] = self.retold[id(found)] = found = found if last else rival
        return found

    def _wanting(self, outcome: Round) -> bool:
        """Whether something is left by the named rival that fits best, also where what the steps miss beside it is taken off.

        Not where another that has a name leaves nothing once that is taken off beside it, or a curve does.
        """
        best = fits_best(outcome.fitted)
        return not self.named and (best is None or self.more(best)) and self.told_by_curve(outcome.fitted) is None

    def told_by_curve(self, found: list[Rivalled]) -> Rivalled | None:
        """A free curve of one variable as it is that leaves no more than noise: what is missing acts there, and nowhere else."""
        curves = [r for r in found if r.guess.kind == CURVE and r.guess.plain]
        best = min(curves, key=lambda r: r.end.loss, default=None)
        return None if best is None or self.more(best, RULES.search.left) else best  # as a round beside it would ask

    def more(self, rival: Rivalled, times: float = RULES.search.clean) -> bool:
        """Whether a rival leaves more than so many times the noise, also where what the steps miss beside it is taken off."""
        left = self._leaves(rival.end.misfit)
        if (left > times).any():
            left = self._leaves(self._retold(rival).end.misfit)
        more = bool((left > times).any())
        if not more and rival.guess.kind != CURVE and times == RULES.search.clean:
            self.named = True
            if float(np.mean(left**2)) <= 1.0 + RULES.search.matters:  # of its energy another would have to leave less
                self.numbers = min(self.numbers, rival.guess.count)
        return more

    def _leaves(self, misfit: np.ndarray | None) -> np.ndarray:
        """What is left of each output in units of its noise, as it was asked of the base: a robust loss makes little of what it left."""
        assert misfit is not None
        return self.arranged.deviations(misfit) / self.arranged.quieter(self.noise, misfit)

    def stands(self, outcome: Round, told: Told, own: Extending) -> bool:
        """Whether what is believed first still is where what comes near the best is held against it on logs that are told anew.

        own: the problem beside the log as it is told for the base.
        """
        self.problem = self.looks.problem = own
        self.told, self.retold = lambda rival, noise, *last: told(rival, noise, *last) or (None if last else own), {}
        self.numbers = np.inf
        self.scene.played = self.played
        anew, winner = replace(outcome, fitted=[r for r in outcome.fitted if not r.candidate.doubt], order=[]), outcome.winner
        if winner is not None:
            self.more(self._retold(winner))  # where it leaves no more than noise what has more numbers is not fitted anew
        self._near_best(anew)
        believe(anew, self._far)
        only_beside(anew)
        self.played.extend(self.inserts)
        return bool(anew.order) and winner is not None and anew.order[0].guess.label == winner.guess.label

    def _fits(self, stage: int) -> list[Rivalled]:
        """The guesses of a stage that look best, fitted; best first."""
        found: list[Rivalled] = []
        todo: list[tuple[Guess, dict[str, float], Direction]] = []
        for ways in chosen(self.looks.ways, stage):
            todo += [(guess, self._start(way, guess), way) for way, guess in ways[: starts(ways[0][1])]]
        for k, (guess, start, way) in enumerate(todo):
            if (found or stage != g.PLAIN) and self.enough():
                break
            self.tell(f"fits: {guess.label}{self.so_far(found)}", 0.45 + 0.3 * k / len(todo))
            if (rival := self.fit(guess, self.values | start, way)) is not None:
                found.append(rival)
        if stage == g.PLAIN:
            self._as_curve(found)
        found = distinct(found)
        lead = lambda: leading(found, self.gained, lambda r: self._energy(r.end.misfit), self._far)
        asks = lambda: self.told_by_curve(found) is None and any(self._elsewhere(r, RULES.naming.in_reach) for r in lead())
        if stage == g.PLAIN and asks():
            return found
        limits, curve = bent(self, found), self.told_by_curve(found)
        if stage == g.PLAIN and asks():  # with slopes of its own another may be the best
            return found
        found = self._polished(
            distinct(found + fewest_first(limits, lambda one: from_brims(self, one, curve), self.more)), 0.72, curve
        )
        reached = [one for one in found if not one.rough]
        more: list[tuple[Guess, dict[str, float], Direction | None]] = []
        for one in reached:
            more += [(guess, start, None) for guess, start in relatives(one.guess, one.values)]
        for one in [one for one in reached if one.guess.kind == g.EVENT][: RULES.naming.shifted]:
            more += [(one.guess, start, None) for start in g.shifted(one.guess, one.values)]
        for _ in range(RULES.naming.beside):  # what comes first then may be another, and is asked as well
            asked = beside_best(found, self._first(found), self.looks, self._far)
            more += [(guess, self.values | self._start(way, guess), way) for way, guess in asked]
            for k, (guess, start, beside_it) in enumerate(more if not self.enough() else []):
                self.tell(f"fits: {guess.label}{self.so_far(found)}", 0.75 + 0.1 * k / len(more))
                if (rival := self.fit(guess, start, beside_it)) is not None:
                    found.append(rival)
            found, more = distinct(found), []
        first = self._first(found)
        for one in [one for one in found if first and first.kind == g.EVENT and first.plain and one.guess.label == first.label]:
            again = elsewhere(self.looks, one, {r.guess.label for r in found if not r.rough})
            found += [r for guess, start in again if (r := self.fit(guess, start)) is not None]
        for way, guess in carried(found, self.looks) if not self.enough() else ():
            self.tell(f"fits: {guess.label}", 0.84)
            found += [rival] if (rival := self.fit(guess, self.values | self._start(way, guess), way)) is not None else []
        found = distinct(found)
        for asks_for in (partial(as_curve, more=self.more), partial(finer, far=self._far), partial(told_over, far=self._far)):
            for guess, start in asks_for(distinct(found), self.looks) if not self.enough() else ():
                self.tell(f"fits: {guess.label}", 0.85)
                found += [rival] if (rival := self.fit(guess, start)) is not None else []
        return self._polished(distinct(found), 0.87, curve)

    def _first(self, found: list[Rivalled]) -> Guess | None:
        """What would be believed of what was fitted by now, whatever chance says of it."""
        named = [rival for rival in found if rival.guess.kind != CURVE]
        return ordered(named, np.inf, float(self.losses.sum(1).mean()), self._far)[0].guess if named else None

    def _polished(self, found: list[Rivalled], done: float, curve: Rivalled | None = None) -> list[Rivalled]:
        """The rivals that predict or fit most, beside what a curve may tell, fitted again with slopes of their own, where without."""
        unseen = lambda rival: self.losses.sum(1).mean() - rival.candidate.errors.mean()
        chosen = again(found, self.gained, unseen, takes_most(self, curve), self._far, self.looks.gains())
        for k, rival in enumerate(found):
            if rival.rough and rival.guess.label in chosen:
                if not found[0].rough and self.enough():
                    break
                self.tell(f"fits: {rival.guess.label}{self.so_far(found)}", done)
                if (better := self.fit(rival.guess, rival.values)) is not None:
                    found[k] = better
        return distinct(found)

    def gained(self, rival: Rivalled) -> float:
        """What a rival takes off the base's loss."""
        return self.problem.loss(self.base.misfit) - rival.end.loss

    def _as_curve(self, found: list[Rivalled]) -> None:
        """Where a curve fits best it has slopes of its own, and all its points where its variable goes: what it leaves is asked first."""
        best = min(found, key=lambda r: r.end.loss, default=None)
        if best is None or best.guess.kind != CURVE or self.enough():
            return
        self.tell(f"fits: {best.guess.label}{self.so_far(found)}", 0.7)
        found.append(best := self.fit(best.guess, best.values) or best)
        finer = self.looks.finer(best.guess, best.values, best.end) if self.more(best) else None
        found += [rival] if finer and (rival := self.fit(*finer)) else []

    def so_far(self, found: list[Rivalled]) -> str:
        """What fits best by now, for those who wait."""
        if not found:
            return ""
        best = min(found, key=lambda r: r.end.loss)
        left = best.end.loss / max(self.problem.loss(self.base.misfit), 1e-300)
        return f" (best so far: {best.guess.label}, leaves {100.0 * left:.0f} % of the loss)"

    def _start(self, way: Direction, guess: Guess) -> dict[str, float]:
        if way.jump:
            return way.shape
        return {**way.shape, **{f.name: f.nominal + float(x) for f, x in zip(way.amplitudes, way.amounts)}}

    def fit(
        self, guess: Guess, start: dict[str, float], way: Direction | None = None, begun: Rivalled | None = None
    ) -> Rivalled | None:
        """A guess fitted from these values of its numbers, and of the base's where they are given.

        way: how the look saw it; then slopes are those of the base and of the look, and what the fit's own steps say of them. begun:
        the same beside another log, with its slopes, but of what is bent. Else they are simulated. None also of too many numbers.
        """
        if guess.kind != CURVE and guess.count > self.numbers:
            return None
        key = id(self.problem), guess.label, id(way), id(begun), tuple(sorted(start.items()))
        if key not in self.made:
            self.made[key] = self.problem, self._fit_anew(guess, start, way, begun)
        return self.made[key][1]

    def _fit_anew(self, guess: Guess, start: dict[str, float], way: Direction | None, begun: Rivalled | None) -> Rivalled | None:
        problem = self.looks.trial(guess)
        values = self.values | {n.name: n.start for n in guess.numbers} | start
        size = abs(self.scene.signal(guess.place)).max() if guess.law == "quantisation" and guess.place is not None else 0.0
        values = between(problem, guess, values, size) if size else values
        best: End | None = None
        for share in (1.0, 0.3):  # far from linear the whole of what the look says may be too much
            scaled = values | {n.name: n.start + share * (values[n.name] - n.start) for n in guess.numbers if n.name in start}
            inside = lambda n, of=scaled: float(np.clip(of[n.name], n.low, n.high))  # a look knows no ends of ranges
            places = np.array([n.place(inside(n)) for n in problem.free])
            loss = problem.loss(problem.misfit(places))
            if np.isfinite(loss) and (best is None or loss < best.loss):
                best = End(places, places, loss)
            if best is not None and best.loss < problem.loss(self.base.misfit):
                break
        if best is None:
            return None
        slopes = None if way is None else self.looks.slopes(way, problem)
        slopes = (begun and begun.slopes) or slopes
        fitted = lambda at, known=None: fit_from(problem, at, RULES.naming.effort, RULES.naming.ended, Forward, known)
        end = fitted(best.places, slopes)
        end = stepped(problem, guess, end, size, fitted) if size else end
        if end.misfit is None or not np.isfinite(end.loss):
            return None
        unseen = self._held_out(problem, end)
        frees = tuple(Free(n.name, n.place(n.start), 0.0, 1.0) for n in guess.numbers if not g.begins(n))
        candidate = self._candidate(guess.hypothesis, frees, problem, end, unseen)
        on_fit = self.arranged.errors(end.misfit) / np.maximum(self.errors_fit, 1e-300)
        drop = 1.0 - np.maximum(self.arranged.errors(unseen) / np.maximum(self.errors_unseen, 1e-300), on_fit)
        candidate.drop = float(np.where(self.off, drop, 0.0).max())
        self.fitted.append(rival := Rivalled(guess, problem, end, candidate, self.arranged.block, way is not None))
        if guess.kind != CURVE and not self.telling:
            self.most = max(self.most, self.gained(rival))
        return rival

    def _as_fit(self, problem: Calibrating, end: End) -> Fit:
        assert end.misfit is not None and end.jacobian is not None
        free = tuple(Free(n.name, float(place), 0.0, 1.0) for n, place in zip(problem.free, end.places))
        values = {n.name: float(place) for n, place in zip(problem.free, end.places)}
        jacobian = end.jacobian * ~self._of_run(problem)
        return Fit(free, values, end.misfit, jacobian, weight(end.misfit, RULES.search.loss_scale))

    def _of_run(self, problem: Calibrating) -> np.ndarray:
        """Which free numbers say where a run begins, of the base or of a law's own state: no other block could say them."""
        return np.array([n.name in self.begins or g.begins(n) for n in problem.free], bool)

    def _held_out(self, problem: Calibrating, end: End) -> np.ndarray:
        """The misfit of each fold of blocks under the fit to the others: linear where that can be believed, else simulated."""
        fitted, folds = self._as_fit(problem, end), self.arranged.folds[self.arranged.block]
        rows, c = np.ones(len(fitted.misfit), bool), RULES.search.loss_scale
        linear = held_out(fitted, rows, folds)
        if rho(linear, c).sum() < RULES.search.wild * rho(fitted.misfit, c).sum():
            return linear

        def misfit(values: dict[str, float]) -> np.ndarray:
            places = np.array([values[n.name] for n in problem.free])
            found = problem.misfit(np.where(self._of_run(problem), end.places, places))
            return np.full(len(rows), 1e6) if found is None else found

        return held_out(fitted, rows, folds, misfit, c)

    def _candidate(
        self, hypothesis: Hypothesis, free: tuple[Free, ...], problem: Calibrating, end: End, unseen: np.ndarray
    ) -> Candidate:
        return Candidate(hypothesis, free, self._as_fit(problem, end), self.arranged.losses(unseen))

    # --- what is believed ----------------------------------------------------------------------------------------------

    def _judge(self, outcome: Round, rng: np.random.Generator) -> None:
        """Which are real, and which of these is the cause: the fewest numbers of those that predict as well as the best."""
        rules, fitted = RULES.search, outcome.fitted
        best = fitted[0].candidate.fitted
        self.tell("chance", 0.92)
        left = self.arranged.put(best.misfit * best.weights)
        energy = max(float((left**2).sum()), 1e-300)
        draws = {stage: gains / energy for stage, gains in self.looks.chance(left, rng).items()}
        outcome.chance_level = float(np.quantile(draws[g.PLAIN], rules.chance_quantile))
        for rival in fitted:
            c, by_chance = rival.candidate, draws[rival.guess.stage]
            c.gain = float((self.losses - c.losses).sum() / max(fitted[0].candidate.errors.sum(), 1e-300))
            c.chance = (1 + int((by_chance >= c.gain).sum())) / (1 + rules.draws)
            if c.chance > rules.significant:
                c.doubt = "chance finds as much"
            elif c.drop < rules.relevant:
                c.doubt = f"it lowers the error of no output by {100 * rules.relevant:.0f} %"
            elif begins_low(rival):
                c.doubt = "it overflows from the lowest value on: that is no limit"
        outcome.curve = curve_of(fitted, outcome.chance_level, self._far, self.scene.parts)
        believe(outcome, self._far)

    def _far(self, guess: Guess) -> tuple[bool, bool]:
        return far(guess, self.scene.parts, self.sampled)
