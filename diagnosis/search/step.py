"""One step of the search: every hypothesis looked at, the best fitted and judged, one of them believed or none."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass, field, replace
from functools import cached_property, partial
from math import tau

import numpy as np
from numba.core import config

from selflock.fmus.effect import DELAY, LAG, LATE, ORDER, PERIOD, PHASE, STEP

from ..residuals.mending import Mending
from ..residuals.whole import HOLD
from ..rules import RULES
from .arrived import arrived
from .candidate import (
    Candidate,
    amount,
    better,
    harmonic,
    may_be_nothing,
    more,
    near_best,
    order_of,
    reaches_an_end,
    same_law,
    simplest,
    stands_beside,
    worse,
)
from .fit import Fit
from .hypotheses import Free, Hypothesis
from .linear import Linear
from .look import Known, Look, Sight, as_read, sights
from .problem import Problem, of_drive
from .screen import Direction
from .waves import looked_for

CHANCE = "chance finds as much"
WITHIN = "what acts late in it does so within a sample of the log"


@dataclass
class Stage:
    """What became of one step."""

    base: Candidate
    candidates: list[Candidate]  # best first
    winner: Candidate | None = None
    by_chance: np.ndarray = field(default_factory=lambda: np.zeros(0))  # largest gain in each draw without an effect
    tied: list[Candidate] = field(default_factory=list)  # cannot be told from the winner
    aside: list[Candidate] = field(default_factory=list)  # no rivals: refused for what they are, the same law, beaten in pairs
    chance_level: float = np.inf  # gain that the best hypothesis finds by chance in one draw of twenty
    unseen: np.ndarray = field(default_factory=lambda: np.zeros(0))  # misfit of the base on blocks that its fit did not see


def so_far(found: Sequence[Hypothesis], best: str = "") -> str:
    """What is known while a search goes on, in brackets, to stand behind what is being done; none of it is judged yet."""
    known = ["found: " + ", ".join(h.label for h in found)] if found else []
    known += ["best as yet: " + best] if best else []
    return f" ({'; '.join(known)})" if known else ""


class Step:
    """The questions of one step, over a base fit and the causes `found` that it holds.

    clean: times its noise up to which a residual's error has nothing missing. chance_level: of the step before. first: the
    base fit without any cause. known: what looks of steps before have found.
    """

    def __init__(
        self,
        problem: Problem,
        base: Fit,
        found: Sequence[Hypothesis],
        clean: float,
        chance_level: float,
        tell: Callable[[str, float], None],
        first: Fit | None = None,
        known: Known | None = None,
    ):
        self.problem, self.base, self.found, self.chance_level = problem, base, found, chance_level
        self._tell, self.known, self.first = tell, known, first
        self.tried: dict[int, tuple[dict, float]] = {}  # of ways of acting: see _tried
        self.lines: dict[str, tuple[float, ...]] = {}  # of each shaft the waves in a turn that the error of a whole drive shows
        self.unseen = unseen = problem.held_out(base)
        self.losses, self.errors = problem.block_loss(unseen), problem.residual_errors(unseen)
        self.fitted = problem.residual_errors(base.misfit)
        if problem.by_channel:  # samples tell: averages of many show what no formula has
            without = first.values if found and first else None
            excess = problem.excess(base.values, without)
            self.off = excess > (RULES.search.natural if found else RULES.search.sound)
            whole = 1.0 - 1.0 / np.maximum(excess, 1.0)  # what brings a channel to its noise
            self.enough = np.where(excess > RULES.search.natural, RULES.search.shows_whole, RULES.search.closes * whole)
        else:
            self.off = problem.experiment.steady | (self.errors > clean * problem.quiet)
        taken = {p.name for p in base.free}
        self.open = [
            replace(h, free=tuple(p for p in h.free if p.name not in taken))
            for h in problem.hypotheses
            if not all(p.name in taken for p in h.free) and not self._one_more_wave(h)
        ]

    def tell(self, what: str, share: float, best: str = "") -> None:
        """Tell what is done, the causes found before, and the hypothesis that does best in this step as yet."""
        self._tell(f"cause {len(self.found) + 1}: {what}{so_far(self.found, best)}", share)

    def _one_more_wave(self, hypothesis: Hypothesis) -> bool:
        """Waves fit anything, one after another: a cause that is found gets more of its numbers, but no more waves."""
        waves = any(p.role == PHASE for p in hypothesis.free)
        return waves and any(hypothesis.same_cause(f) for f in self.found)

    def play(self, rng: np.random.Generator) -> Stage:
        """Look, fit, judge, and compare with chance."""
        problem, base, rules = self.problem, self.base, RULES.search
        problem.experiment.forget()  # what the base says of sensors is asked all the time
        nothing = Candidate(Hypothesis("", "none", ()), base.free, base, self.losses)
        stage = Stage(nothing, [], chance_level=self.chance_level, unseen=self.unseen)
        if not self.off.any():  # no cause would be believed: see _candidate
            return stage
        linear = Linear(
            base.open.reshape(*problem.shape, -1)[problem.train],
            problem.taught(base.weights),
            problem.fold_of_block[problem.train],
            problem.experiment.layout.run_of[problem.train],
        )
        ways = self._look(linear)
        stage.candidates = self._fits(ways)
        fitted = [c for c in stage.candidates if c.fit]
        if not fitted:
            return stage
        left = problem.taught(fitted[0].fitted.misfit * fitted[0].fitted.weights)
        self.tell("chance", 0.0)
        stage.by_chance = linear.chance(ways, left, rules.draws, rng) / max(float((left**2).sum()), 1e-300)
        stage.chance_level = self.chance_level = float(np.quantile(stage.by_chance, rules.chance_quantile))
        believed = lambda real: simplest(real, self.found, self.chance_level, problem.alike)
        real = self._weigh(stage, fitted)
        for _ in range(2):  # each from the other: the one that was better may be the one whose fit ended early
            again = self._waves_beside(believed(real), fitted) if real else []
            if not again:
                break
            others = [c for c in fitted if not any(c.hypothesis.same_cause(a.hypothesis) for a in again)]
            fitted = sorted([*again, *others], key=lambda c: c.errors.mean())
            stage.candidates = [*fitted, *(c for c in stage.candidates if not c.fit)]
            real = self._weigh(stage, fitted)
        # what a shift within a sample explains better is a matter of the recording, and whatever does nearly the same stands in for it
        winner = believed(real) if real else None
        if winner and not any(c.doubt == WITHIN and worse(winner, c, self.chance_level) for c in fitted):
            stage.winner = winner
            others, alike = [c for c in fitted if c is not winner], problem.alike
            stage.tied = [c for c in others if c in real and stands_beside(c, winner, self.chance_level, alike)]
            stage.aside = [c for c in others if self._no_cause(c) or same_law(c, winner, alike)]
        return stage

    def _weigh(self, stage: Stage, fitted: list[Candidate]) -> list[Candidate]:
        """What each gains over the base, in units of what the best leaves, how often chance does, and what speaks against it.

        Those against which nothing does.
        """
        for c in fitted:
            c.gain = float((self.losses - c.losses).sum() / max(fitted[0].errors.sum(), 1e-300))
            c.chance = (1 + int((stage.by_chance >= c.gain).sum())) / (1 + RULES.search.draws)
            c.doubt = self._doubt(c)
        real = [c for c in fitted if not c.doubt]
        for c in near_best(real) if self.problem.by_channel else ():
            left = self.problem.excess(c.fitted.values, (self.first or self.base).values)
            c.complete = bool(left.max() <= RULES.search.natural)
        return real

    def _waves_beside(self, winner: Candidate, fitted: list[Candidate]) -> list[Candidate]:
        """The winner's wave, and others of as many in a turn, fitted again from what the best of them says of all else, where
        that is better.

        Cogging and a ripple of torque at the motor's shaft are one law by two names, and neither is the cause because the
        other's fit ended early.
        """
        alike = [c for c in fitted if order_of(winner, c)] if self.problem.by_channel else []
        found: list[Candidate] = []
        for c in alike if len(alike) > 1 else ():
            best = min([*alike, *found], key=lambda one: one.errors.mean())
            others = {p.name: best.fitted.values[p.name] for p in self.base.free}
            start = {**self.base.values, **c.fitted.values, **others, **order_of(best, c)}
            again = self.problem.fit((*self.base.free, *c.free), self._in_phase(start, c.free))
            # of one law by two names both leave the same to the last digits
            again = self.problem.to_its_end(again)
            better = self._candidate(c.hypothesis, c.free, again, c.linear)
            found += [better] if better.errors.mean() < c.errors.mean() else []
        return found

    def _in_phase(self, start: dict, free: tuple[Free, ...]) -> dict:
        """A start with the phase of its wave where that leaves least of some around a turn."""
        places = np.arange(RULES.search.turned) * tau / RULES.search.turned
        for p in free:
            if p.role == PHASE:
                turned = (start[p.name] + places + np.pi) % tau - np.pi
                start = min(
                    (start | {p.name: float(phase)} for phase in turned),
                    key=lambda at: self.problem.loss(self.problem.misfit(at)),
                )
        return start

    def _doubt(self, candidate: Candidate) -> str:
        """Why a candidate is no cause, as a sentence without its subject; "" where it is one."""
        if candidate.chance > RULES.search.significant:
            return CHANCE
        if candidate.drop < RULES.search.relevant:
            return f"it lowers the error of no comparison by {100 * RULES.search.relevant:.0f} %"
        if not self._resolved(candidate):
            return WITHIN
        if harmonic(candidate, self.found, lambda amounts: self.problem.done(amounts, candidate.fitted)):
            return "it is a harmonic of a wave that is a cause already"
        felt = candidate.fitted.felt(self.problem.rows)
        if not any(felt[p.name] for p in candidate.free if amount(p)):
            return "where its fit ended more or less of it changes nothing: this log does not tell how much there is"
        if self.problem.by_channel:
            if self._does_without(candidate):
                return "what else it frees does as well without it"
            intervals = candidate.fitted.intervals(self.problem.rows, self.problem.blocks)
            if reaches_an_end(candidate, intervals):
                return "a number of it lies at the end of its range"
            if self.found and may_be_nothing(candidate, intervals):
                return "beside the causes found the interval of how much there is of it holds nothing, too"
        return "" if self._shows(candidate) else "it shows in averages of many samples alone"

    def _does_without(self, candidate: Candidate) -> bool:
        """Whether nothing of a cause leaves as little, with all that it frees beside: as Stribeck's fall does that ends at no speed."""
        nothing = {p.name: p.nominal for p in candidate.free if amount(p)}
        if not nothing or len(nothing) == len(candidate.free):
            return False
        without = self.problem.misfit({**candidate.fitted.values, **nothing})
        return self.problem.loss(without) <= (1.0 + RULES.search.matters) * self.problem.loss(candidate.fitted.misfit)

    @staticmethod
    def _no_cause(candidate: Candidate) -> bool:
        """Whether a candidate is refused for what it is, and not for how little it finds: then it may yet fit better."""
        rules = RULES.search
        return bool(candidate.doubt) and candidate.chance <= rules.significant and candidate.drop >= rules.relevant

    def _shows(self, candidate: Candidate) -> bool:
        """Whether a cause lowers the error of samples somewhere, not of their averages alone."""
        experiment, train = self.problem.experiment, self.problem.train
        before, after = (self.problem.absolute(fit.values) for fit in (self.base, candidate.fitted))
        mended = lambda one: Mending(experiment, one, before, after, train).improvement
        if self.problem.by_channel:
            asked = zip(experiment.residuals, self.off, self.enough)
            return any(off and mended(one) >= least for one, off, least in asked)
        if experiment.layout.per_bin == 1:  # then bins are samples
            return True
        return any(mended(one) >= RULES.search.shows for one in experiment.residuals)

    def _resolved(self, candidate: Candidate) -> bool:
        """Whether what acts late is later than a sample: within one, nobody knows what the recorder held."""
        step = max(float(np.median(ch.dt)) for ch in self.problem.experiment.channels.values())
        late = [candidate.fitted.values[p.name] for p in candidate.free if p.role in LATE]
        return not late or max(late) >= step

    def _each(self, what: str, do: Callable, items: Sequence, before: Sequence[Candidate] = ()) -> list:
        """do(item) of all items, in their order; as many at a time as numba is allowed threads, a few at most.

        before: what was fitted already, which may be the best as yet.
        Of single parts one: their loops last a fraction of a millisecond, and two threads spend half as much again on handing each
        other the interpreter; what an hour's motions take would be there twice.
        """
        done: list = []
        self.tell(what, 0.0)
        threads = 1
        if self.problem.by_channel and not self.problem.experiment.long:
            threads = min(RULES.search.threads, config.NUMBA_NUM_THREADS)  # type: ignore[attr-defined]  # made as numba is imported
        with ThreadPoolExecutor(threads) as pool:
            try:
                for result in pool.map(do, items):
                    done.append(result)
                    self.tell(what, len(done) / len(items), self._best([*before, *done]))
            except BaseException:  # Ctrl-C: what waits its turn is not begun
                pool.shutdown(wait=False, cancel_futures=True)
                raise
        return done

    def _best(self, done: list) -> str:
        """The candidate that leaves least as yet, where it leaves less than the base does; "" where none."""
        best = min((c for c in done if isinstance(c, Candidate) and c.fit), key=lambda c: c.errors.mean(), default=None)
        return best.hypothesis.label if best and best.errors.mean() < self.losses.sum(1).mean() else ""

    def _look(self, linear: Linear) -> list[Direction]:
        """The first look at all ways of acting of all hypotheses."""
        problem, look = self.problem, Look(self.problem, self.base, self._views, linear, self.known)
        hypotheses = self.open
        if problem.by_channel:
            hypotheses, self.lines = looked_for(problem.experiment, problem.absolute(dict(self.base.values)), hypotheses)
        return [way for ways in self._each("first look", look.ways, hypotheses) for way in ways]

    def _fits(self, ways: list[Direction]) -> list[Candidate]:
        """The hypotheses that look best, fitted; best first, then those that were only looked at."""
        of: dict[str, list[Direction]] = {}  # best way first, best hypothesis first
        for way in sorted(ways, key=lambda way: -way.gain):
            of.setdefault(way.hypothesis.label, []).append(way)
        # what a log shows of itself, such as the steps of its command, is fitted however little a linear look promises
        shown = lambda ways: (
            self.problem.by_channel
            and (any(p.trials and p.role in (PERIOD, STEP) for p in ways[0].free) or any(map(self._on_a_line, ways)))
        )
        groups = sorted(of.values(), key=lambda ways: not shown(ways))
        waves = lambda ways: any(p.role == ORDER for p in ways[0].free)  # of which one start says nothing of another
        if self.problem.by_channel:
            lead = sum(map(shown, groups))
            chosen, first = self._entered(groups[:lead], groups[lead:], waves)
        else:
            chosen, first = [ways for ways in groups if ways[0].gain > 0.0][: RULES.search.fits], {}
        loss = lambda fitted: self.problem.loss(fitted.misfit)
        behind = RULES.search.behind * min(map(loss, first.values()), default=np.inf)

        def judge(most: float, ways: list[Direction]) -> Candidate:
            if self.problem.by_channel and waves(ways):
                return self._judge(*self._raced(ways), np.inf)
            return self._judge(ways, first.get(ways[0].hypothesis.label), most)

        # those that are fitted to their end anyway, the best of the first fits among them, say how far others are behind
        begun = [ways for ways in chosen if ways[0].hypothesis.label in first]
        ahead = [ways for ways in chosen if ways[0].hypothesis.label not in first] + begun[:1]
        candidates = self._each("fits", partial(judge, behind), ahead)
        if others := begun[1:]:
            # a fit to the end, which reads the recorder anew, may take as much of what they leave as of the best's: one law has two names
            brought = max(1.0, loss(first[begun[0][0].hypothesis.label]) / max(loss(candidates[-1].fitted), 1e-300))
            near = min([behind, *(RULES.search.near_best * brought * loss(c.fitted) for c in candidates[:-1])])
            candidates += self._each("other fits", partial(judge, near), others, candidates)
        if self.problem.by_channel:
            candidates = arrived(self.problem, candidates, lambda c, fit: self._candidate(c.hypothesis, c.free, fit, c.linear))
        fitted = {c.hypothesis.label for c in candidates}
        candidates += [self._unfitted(ways[0]) for ways in groups if ways[0].hypothesis.label not in fitted]
        return sorted(candidates, key=lambda c: (c.fit is None, c.errors.mean() if c.fit else -c.linear))

    def _entered(
        self, shown: list[list[Direction]], groups: list[list[Direction]], waves: Callable[[list[Direction]], bool]
    ) -> tuple[list[list[Direction]], dict[str, Fit]]:
        """Hypotheses of a whole drive that are fitted to their end, and what those of them that are no waves came to in a few steps.

        Such a drive is far from linear: a linear look says in which direction, a simulation where its ways begin which of them are
        worth some steps of a fit, and these which hypotheses are worth more. shown: what the log shows of itself, which is fitted
        anyway. groups: ways of the others, those that look best first; waves are raced by themselves.
        """
        rules = RULES.search
        apart = [ways for ways in groups[: rules.fits_by_channel] if waves(ways) and ways[0].gain > 0.0]
        entered = self._each("starts", self._best_begun, [ways for ways in groups if not waves(ways)])
        entered = sorted((ways for ways in entered if self._tried(ways[0])[1] < 1.0), key=lambda ways: self._tried(ways[0])[1])
        raced = entered[: rules.begun_by_channel]
        begin = lambda ways: self._begin(ways[0].sets(self.base.values)[0], self._start(ways[0]))
        first = dict(zip((ways[0].hypothesis.label for ways in raced), self._each("first fits", begin, raced)))
        raced.sort(key=lambda ways: self.problem.loss(first[ways[0].hypothesis.label].misfit))
        shown = [ways if waves(ways) else self._best_begun(ways) for ways in shown]  # of two periods, that which leaves less
        return [*shown, *apart, *raced[: rules.fits_by_channel - len(apart)]], first

    def _best_begun(self, ways: list[Direction]) -> list[Direction]:
        """Ways of a hypothesis, that first which leaves least where it begins, of those that look best; or as the log was read."""
        most = RULES.search.ways_begun
        best, apart = min(ways[:most], key=lambda way: self._tried(way)[1]), ways[:: -(-len(ways) // most)]
        other = None if self.found else as_read(self._views[ways[0].hypothesis.drifts], self.base, apart)
        if other and other[2] < min(RULES.search.unfiltered, self._tried(best)[1]):
            best, self.tried[id(other[0])] = other[0], other[1:]
        return [best, *(way for way in ways if way is not best)]

    def _raced(self, ways: list[Direction]) -> tuple[list[Direction], Fit | None]:
        """Ways of a wave over an angle, by what a few steps of a fit leave of the best of them; and what the best came to.

        A strong wave bends the motion, and then a linear look sees other numbers of waves in a turn than there are. These are
        held meanwhile: set free too early they run to the next of many near minima.
        """
        first = sorted(ways, key=lambda way: (not self._on_a_line(way), -way.gain))
        entered = [way for way in first if self._on_a_line(way) or way.gain > 0.0][: RULES.search.waves_raced]
        begun, loss = [], {}
        for way in entered:
            usual = way.sets(self.base.values)[0]
            orders = tuple(p for p in usual if p.role == ORDER)
            begun.append(self._begin(tuple(p for p in usual if p not in orders), self._start(way), orders))
            loss[id(way)] = self.problem.loss(begun[-1].misfit)
        best = min(begun, key=lambda fitted: self.problem.loss(fitted.misfit), default=None)
        return sorted(ways, key=lambda way: loss.get(id(way), np.inf)), best

    def _on_a_line(self, way: Direction) -> bool:
        """Whether it is of a wave of which the error shows as many in a turn."""
        return any(p.role == ORDER and way.shape.get(p.name) in self.lines.get(p.shaft, ()) for p in way.free)

    def _unfitted(self, way: Direction) -> Candidate:
        return Candidate(way.hypothesis, way.free, None, self.losses, linear=way.gain)

    def _begin(self, extra: tuple[Free, ...], start: dict, held: tuple[Free, ...] = ()) -> Fit:
        """A few steps of a fit of a whole drive's numbers alone; what is held stays where it starts."""
        drive = of_drive((*self.base.free, *extra))
        plain = {name: 0.0 for name, x in start.items() if name in self.base.values and x == 0.0}  # as the log was read
        begin = plain | {p.name: start[p.name] for p in (*extra, *held)}
        return self.problem.fit(drive, self.base.values | begin, RULES.search.effort_begin)

    def _judge(self, ways: list[Direction], first: Fit | None, most: float) -> Candidate:
        """The full fit of a hypothesis, from its best starts; more of its numbers are freed only where that helps.

        first: what a first fit of its best way of acting came to, where there was one; what then leaves more than `most` is
        fitted no further.
        """
        base, whole, rules = self.base, self.problem.whole, RULES.search
        best: Candidate | None = None
        seen: list[tuple] = []
        joint = [way for way in ways if whole and len(way.amplitudes) > 1][:1]  # however little the look promises
        for way in (*joint, *ways):
            promising = way is ways[0] or way.gain >= rules.promising * ways[0].gain or any(way is j for j in joint)
            if not promising or len(seen) >= (rules.starts_whole if whole or self.problem.by_channel else rules.starts):
                continue
            start = self._start(way) | (first.values if first is not None and way is ways[0] else {})
            usual, every, fewest = way.sets(base.values)
            for extra in (usual, every, fewest):
                names = tuple(p.name for p in extra)
                if names in seen:
                    continue
                seen.append(names)
                # a controller with a period holds its command by itself, and no faster one's hold stands beside it
                by_itself = {HOLD: 0.0} if HOLD in base.values and any(p.role == PERIOD for p in extra) else {}
                begin = {**base.values, **{name: start[name] for name in names}, **by_itself}
                if first is not None:
                    one = self._begin(extra, start) if len(seen) > 1 else first
                    # what leaves more than the base went astray, which says nothing
                    if most < self.problem.loss(one.misfit) < self.problem.loss(base.misfit):
                        if best is None:
                            return self._candidate(way.hypothesis, extra, one, ways[0].gain)
                        continue
                    begin |= one.values
                free, begin = delayed(base, extra, begin)
                fitted = self.problem.fit((*free, *extra), begin)
                found = self._candidate(way.hypothesis, extra, fitted, ways[0].gain)
                if extra is fewest and best is not None:
                    best = found if more(found, best)[0] <= rules.matters else best
                else:
                    best = better(best, found, self.chance_level, whole)
        assert best is not None, "the best way of acting is always tried"
        return best

    def _start(self, way: Direction) -> dict:
        """Where the linear look says; of a whole drive, which is far from linear, a small amount in that direction."""
        if self.problem.by_channel:
            return self._tried(way)[0]
        start = way.start()
        for p in way.amplitudes if self.problem.whole else ():
            most = RULES.search.small * (p.high - p.low if np.isfinite(p.high - p.low) else 1.0)
            start[p.name] = p.nominal + float(np.clip(RULES.search.small_look * (start[p.name] - p.nominal), -most, most))
        return start

    def _tried(self, way: Direction) -> tuple[dict, float]:
        """Of a whole drive compared in all its channels: where a way of acting begins, and what share of the base's loss that leaves.

        As much as the look says where that leaves no more than the base does, else by quarters less, down to what the look saw. A
        small drive ends being linear long before a range does that holds for any, and no fit comes back from there.
        """
        if id(way) in self.tried:
            return self.tried[id(way)]
        view = self._views[way.hypothesis.drifts]
        start, little = way.start(), way.little()
        left = view.left(start)
        more = lambda p: abs(start[p.name] - p.nominal) > abs(little[p.name] - p.nominal)
        while left > 1.0 and not any(p.trials for p in way.amplitudes) and any(map(more, way.amplitudes)):
            start |= {p.name: p.nominal + 0.25 * (start[p.name] - p.nominal) for p in way.amplitudes}
            left = view.left(start)
        self.tried[id(way)] = start, left
        return start, left

    @cached_property
    def _views(self) -> tuple[Sight, Sight]:
        return sights(self.problem, self.base)

    def _candidate(self, hypothesis: Hypothesis, extra: tuple[Free, ...], fitted: Fit, linear: float) -> Candidate:
        problem, unseen = self.problem, self.problem.held_out(fitted)
        errors, losses = problem.residual_errors(unseen), problem.block_loss(unseen)
        for p in extra:
            if p.role == LAG and fitted.values[p.name] > 0.0:
                # a lag also averages the noise of what is simulated from measured channels, and so does its mirror
                # image in time; only what it explains beyond that is its own
                mirrored = problem.misfit({**fitted.values, p.name: -fitted.values[p.name]})
                errors = errors + np.maximum(self.errors - problem.residual_errors(mirrored), 0.0)
                losses = losses + np.maximum(self.losses - problem.block_loss(mirrored), 0.0)
        # what is gained on unseen blocks but not on those of the fit is chance_level of the folds
        on_fit = problem.residual_errors(fitted.misfit) / np.maximum(self.fitted, 1e-300)
        drop = 1.0 - np.maximum(errors / np.maximum(self.errors, 1e-300), on_fit)
        drop = np.where(self.off, drop, 0.0)  # where only noise is left there is nothing to explain
        return Candidate(hypothesis, extra, fitted, losses, float(drop.max()), linear=linear)


def delayed(base: Fit, extra: tuple[Free, ...], begin: dict) -> tuple[tuple[Free, ...], dict]:
    """What else is free beside a cause, and where its fit begins: what a fast controller holds is all of a delay that is free.

    The two are one in a simulation, and each took some of the other: a delay of two samples was one within a sample.
    """
    delays = [p.name for p in extra if p.role == DELAY]
    if not delays or HOLD not in begin:
        return base.free, begin
    whole = begin[delays[0]] + begin[HOLD]
    return tuple(p for p in base.free if p.name != HOLD), {**begin, HOLD: 0.0, delays[0]: whole}
