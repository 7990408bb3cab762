"""The contest: which hypotheses explain what the base simulation leaves, one after another until chance does as well.

Each stage starts from a base (the nominal drive, what is uncertain refitted, the causes found so far). All hypotheses
are looked at linearly; those that may matter are fitted; the best on blocks that their fit did not see is compared
with what the same search finds by chance. Among those that do equally well there, the one with the fewest free
numbers wins, and rivals that cannot be told from it are named with it.
"""

from __future__ import annotations

from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass, field, replace
from typing import Callable

import numba
import numpy as np

from .bench import Bench
from .fit import Fit, fit, held_out, rho
from .hypotheses import ON_REQUEST, Free, Hypothesis, uncertain, vocabulary
from .noise import of_bins, of_quiet_bins
from .screen import Direction, Linear, directions

FOLDS = 5
DRAWS = 199
SIGNIFICANT = 0.02
"""A cause must do better than the best by chance in all but this share of draws."""

RELEVANT = 0.04
"""... and lower the error of some cut by this share at least: smaller gains may be a matter of formulas."""

MATTERS = 0.02
"""Share of the error's energy by which a rival must be worse to be beaten."""

DRIFTS = ("warm_up", "wear", "winding_heating")

CUT_IN_METAL = ("wedge_angle", "gear_ratio")

LATE = ("_delay", "lag_time", "_period")

CLEAN = 1.08
"""A cut whose error is no more than this many times its noise has nothing missing."""

LEFT = 1.15
"""... once a cause is found: nature's formula is never exactly ours."""

SMALL = 0.01
"""Share of its range from which a number of a whole drive is fitted."""

WILD = 1.03
"""Where a linear step leaves so many times more on unseen blocks than the fit itself, it is worth simulating."""

RIVALS = 0.3
"""Share of the winner's gain from which a rival is tried again beside the causes found later."""

FULL_FITS = 8
MOST_ROUNDS = 4


@dataclass
class Candidate:
    """A hypothesis in one stage: how it did on training blocks that its fit did not see."""

    hypothesis: Hypothesis
    free: tuple[Free, ...]
    fit: Fit | None
    losses: np.ndarray  # (blocks, cuts): what each cut adds to the mean loss of each training block
    drop: float  # of the error, largest over the cuts, 0 to 1
    gain: float  # drop of the loss in units of the noise's
    chance: float = 1.0  # share of draws in which chance does as well
    linear: float = 0.0  # the gain of the first, linear look

    @property
    def errors(self) -> np.ndarray:
        """Mean loss of each training block."""
        return self.losses.sum(1)


@dataclass
class Stage:
    """One round of the contest."""

    base: Candidate
    candidates: list[Candidate]  # best first
    winner: Candidate | None = None
    by_chance: np.ndarray = field(default_factory=lambda: np.zeros(0))  # largest gain in each draw without an effect
    tied: list[Candidate] = field(default_factory=list)  # cannot be told from the winner


@dataclass
class Outcome:
    stages: list[Stage]
    causes: list[Candidate]  # in the order found
    kept: list[Stage]  # the stages in which they were found
    final: Fit
    base: Fit
    normal: float  # where the robust loss turns, in units of noise


class Contest:
    """All stages over one bench."""

    clean = CLEAN

    def __init__(self, bench: Bench, train: np.ndarray, rng: np.random.Generator, tell: Callable[[str, float], None] = lambda *_: None):
        self.bench, self.train, self.rng, self.tell = bench, train, rng, tell
        self.base_free = tuple(p for p in uncertain(bench.rig) if p.name.rpartition(".")[0] in bench.components or p.name.startswith("sensor."))
        self.base_free = tuple(p for p in self.base_free if p.name.rpartition(".")[2] not in ON_REQUEST)
        self.luck = np.inf  # gain that the best hypothesis finds by chance in one draw of twenty
        self.hypotheses = vocabulary(bench.rig, bench.components, bench.measured, bench)
        self.nominal = {p.name: p.nominal for p in self.base_free}
        self.shape = bench.residual(self.nominal).shape
        self.enough = np.zeros(len(bench.cuts))  # errors, in units of noise, below which nothing is missing in a cut
        self.fitted = np.zeros(len(bench.cuts))  # what the base of this stage leaves on the blocks it was fitted to
        self.quiet = np.ones(len(bench.cuts))  # noise where there is least of it, over the usual noise of a cut
        self.present = bench.present(self.nominal)
        self.rows = (self.present & train[:, None]).ravel()
        self.whole = any(cut.name.endswith("drive") for cut in bench.cuts)  # far from linear in its parameters
        self.blocks = np.repeat(np.arange(bench.blocks), self.shape[1])
        self.fold_of_block = np.zeros(bench.blocks, int)
        self.fold_of_block[train] = np.arange(train.sum()) % FOLDS
        self.folds = np.repeat(self.fold_of_block, self.shape[1])

    def residual(self, values: dict) -> np.ndarray:
        """Flat; values counted above another are put back on it."""
        return self.bench.residual(self.absolute(values)).ravel()

    def absolute(self, values: dict) -> dict:
        out = dict(values)
        for hypothesis in self.hypotheses:
            for p in hypothesis.free:
                if p.above and p.name in out:
                    out[p.name] = self.bench.value(p.above, out) + out[p.name]
        return out

    def run(self) -> Outcome:
        self.tell("fit of the nominal drive", 0.0)
        self._noise()
        base_fit = self._fit(self.base_free, self.nominal)
        first, causes, stages, kept = base_fit, [], [], []
        while len(stages) < MOST_ROUNDS:
            stage = self._stage(base_fit, [c.hypothesis for c in causes], len(causes))
            stages.append(stage)
            if stage.winner is None:
                break
            base_fit = stage.winner.fit
            again = next((i for i, c in enumerate(causes) if c.hypothesis.same_cause(stage.winner.hypothesis)), None)
            if again is None:
                causes.append(stage.winner)
                kept.append(stage)
            else:  # what hid some of its numbers is found by now
                causes[again] = replace(causes[again], free=causes[again].free + stage.winner.free)
                kept[again] = replace(kept[again], winner=causes[again])
        if len(causes) > 1:
            causes, kept, standing = self._exchange(*self._prune(causes, kept, self._standing(base_fit)))
            base_fit = standing.fit
        if self.bench.take_all():  # the last word on the numbers has the whole log
            self.tell("last fit", 0.0)
            self.present = self.bench.present(self.nominal)
            self.rows = (self.present & self.train[:, None]).ravel()
            self._noise()
            first = self._fit(first.free, dict(first.values), effort=8)
            base_fit = self._fit(base_fit.free, dict(base_fit.values), effort=8)
        return Outcome(stages, causes, kept, base_fit, first, self.turn)

    def _prune(self, causes: list[Candidate], stages: list[Stage], whole: Candidate):
        """Drop causes that those found after them have made needless: an early guess may stand for a later, better one."""
        for gone in list(causes[:-1]):
            rest = [c for c in causes if c is not gone]
            names = {p.name for c in rest for p in c.free} | {p.name for p in self.base_free}
            free, values = tuple(p for p in whole.free if p.name in names), whole.fit.values
            without = self._standing(self._fit(free, {p.name: values[p.name] for p in free}))
            if not self._worse(without, whole):
                stages = [s for s in stages if s.winner is not gone]
                causes, whole = rest, without
        return causes, stages, whole

    def _exchange(self, causes: list[Candidate], stages: list[Stage], whole: Candidate):
        """Two causes may do with fewer numbers what a first guess and its helpers did: alone, neither may have looked best."""
        opening, values, best = stages[0], whole.fit.values, None
        named = [c.hypothesis for c in causes]
        for rival in opening.candidates:
            if rival.fit is None or rival.gain < RIVALS * opening.winner.gain or any(rival.hypothesis.same_cause(h) for h in named):
                continue
            for cause, stage in zip(causes[1:], stages[1:]):
                free = tuple({p.name: p for p in (*self.base_free, *rival.free, *cause.free)}.values())
                if len(free) >= len(whole.free):
                    continue
                start = {**values, **rival.fit.values, **{p.name: values[p.name] for p in cause.free}}
                pair = self._standing(self._fit(free, {p.name: start[p.name] for p in free}))
                merit = len(free), pair.errors.mean()
                if not self._worse(pair, whole) and (best is None or merit < best[0]):
                    best = merit, [rival, cause], [replace(opening, winner=rival, tied=[]), stage], pair
        return best[1:] if best else (causes, stages, whole)

    def _standing(self, fitted: Fit) -> Candidate:
        """How a set of causes does on unseen blocks."""
        return Candidate(Hypothesis("", "set", ()), fitted.free, fitted, self._block_loss(self._held_out(fitted)), 0.0, 0.0)

    # --- one stage -----------------------------------------------------------------------------------------

    def _noise(self) -> None:
        """Noise of each cut's bins from neighbouring differences, and where the robust loss turns."""
        fitted = fit(self.residual, {}, self.base_free, self.nominal, self.rows, 1e30, effort=15) if self.base_free else None
        values = fitted.values if fitted else {}
        for number, cut in enumerate(self.bench.cuts):
            r, count = self.bench.binned(cut, self.absolute(values))
            lag = 1 + self.bench.reach(cut) // self.bench.per_bin
            cut.noise = of_bins(r, count > 0, self.bench.steady, lag)
            if not self.bench.steady:
                self.quiet[number] = min(1.0, of_quiet_bins(r, count > 0, lag) / cut.noise)
        r = self.residual({**self.nominal, **values})[self.rows]
        self.turn = max(3.0, 2.0 * float(np.median(abs(r))))
        self.nominal.update(values)

    def _fit(self, free: tuple[Free, ...], start: dict, effort: int = 25) -> Fit:
        return fit(self.residual, {}, free, start, self.rows, self.turn, effort, *((1e-4, 1e-4) if self.whole else ()))

    def _held_out(self, fitted: Fit) -> np.ndarray:
        """Residual of each fold under the fit to the others: linear where that can be believed, else simulated."""
        linear = held_out(fitted, self.rows, self.folds)
        if not self.whole and self._block_loss(linear).sum() < WILD * self._block_loss(fitted.residual).sum():
            return linear
        return held_out(fitted, self.rows, self.folds, self.residual, self.turn)

    def _block_loss(self, residual: np.ndarray) -> np.ndarray:
        """What each cut adds to the mean loss of each training block, (blocks, cuts)."""
        loss = (rho(residual, self.turn) * self.rows).reshape(self.shape)
        sums = np.stack([loss[:, self.bench.slice(cut)].sum(1) for cut in self.bench.cuts], 1)
        return sums[self.train] / np.maximum(self.rows.reshape(self.shape).sum(1)[self.train, None], 1)

    def _cut_errors(self, residual: np.ndarray) -> np.ndarray:
        """Root of the mean loss over training blocks, for each cut."""
        loss = (rho(residual, self.turn) * self.rows).reshape(self.shape)
        rows = self.rows.reshape(self.shape)
        return np.array([np.sqrt(loss[:, s].sum() / max(1, rows[:, s].sum())) for s in map(self.bench.slice, self.bench.cuts)])

    def _stage(self, base: Fit, found: list[Hypothesis], number: int) -> Stage:
        say = f"cause {number + 1}: "
        base_free = base.free
        taken = {p.name for p in base_free}
        open_ = [h for h in self.hypotheses if not all(p.name in taken for p in h.free) and not (
            any(h.same_cause(f) for f in found) and any(p.name.endswith("_phase") for p in h.free))]  # waves fit anything, one after another
        open_ = [_without(h, taken) for h in open_]
        unseen = self._held_out(base)
        base_loss, base_errors = self._block_loss(unseen), self._cut_errors(unseen)
        nothing = Stage(Candidate(Hypothesis("", "none", ()), base_free, base, base_loss, 0.0, 0.0), [])
        self.enough = (LEFT if found else self.clean) * self.quiet
        self.fitted = self._cut_errors(base.residual)
        if not self.bench.steady and (base_errors <= self.enough).all():  # no cause would be believed: see _candidate
            return nothing
        fixed = dict(base.values)
        ways: list[Direction] = []
        shaped = lambda values: self.residual(values).reshape(self.shape)
        at = shaped(fixed)
        linear = Linear(base.jacobian.reshape(*self.shape, -1)[self.train], (base.weights * self.rows).reshape(self.shape)[self.train],
                        self.fold_of_block[self.train])
        errors = linear.draws((base.residual * base.weights * self.rows).reshape(self.shape)[self.train])

        def look(hypothesis: Hypothesis) -> list[Direction]:
            found_ways = directions(shaped, fixed, at, hypothesis)
            for way in found_ways:
                way.columns = way.columns[self.train]
                linear.look(way, errors)
            return [way for way in found_ways if np.isfinite(way.gain)]

        with ThreadPoolExecutor(min(2, numba.config.NUMBA_NUM_THREADS)) as pool:
            for done, result in enumerate(pool.map(look, open_)):
                ways += result
                self.tell(say + "first look", (done + 1) / len(open_))
        best_way: dict[str, list[Direction]] = {}
        for way in sorted(ways, key=lambda w: -w.gain):
            best_way.setdefault(way.hypothesis.label, []).append(way)
        order = sorted(best_way, key=lambda label: -best_way[label][0].gain)

        def judge(label: str) -> Candidate:
            way = best_way[label][0]
            if way.gain <= 0.0:
                return Candidate(way.hypothesis, way.free, None, base_loss, 0.0, 0.0, linear=way.gain)
            return self._judge(base, best_way[label], base_loss, base_errors)

        tried = order[:FULL_FITS]
        with ThreadPoolExecutor(min(2, numba.config.NUMBA_NUM_THREADS)) as pool:
            candidates = []
            for done, candidate in enumerate(pool.map(judge, tried)):
                candidates.append(candidate)
                self.tell(say + "fits", (done + 1) / len(tried))
        for label in order[FULL_FITS:]:
            way = best_way[label][0]
            candidates.append(Candidate(way.hypothesis, way.free, None, base_loss, 0.0, 0.0, linear=way.gain))
        candidates.sort(key=lambda c: (c.fit is None, c.errors.mean() if c.fit else -c.linear))
        stage = replace(nothing, candidates=candidates)
        fitted = [c for c in candidates if c.fit]
        if not fitted:
            return stage
        best = fitted[0]
        noise_level = (best.fit.residual * best.fit.weights * self.rows).reshape(self.shape)[self.train]
        energy = float((noise_level**2).sum())
        self.tell(say + "chance", 0.0)
        chance = linear.chance(ways, noise_level, DRAWS, self.rng) / max(energy, 1e-300)
        stage.by_chance, self.luck = chance, float(np.quantile(chance, 0.95))
        for c in fitted:
            c.gain = float((base_loss - c.losses).sum() / max(best.errors.sum(), 1e-300))
            c.chance = (1 + int((chance >= c.gain).sum())) / (1 + DRAWS)
        real = [c for c in fitted if c.chance <= SIGNIFICANT and c.drop >= RELEVANT and self._resolved(c)]
        if not real:
            return stage
        winner = self._simplest(real, real[0], found)
        stage.winner = winner
        stage.tied = [c for c in real if c is not winner and self._equal(c, winner) and len(c.free) <= len(winner.free)
                      and not self._same_law(c, winner)]
        return stage

    def _resolved(self, candidate: Candidate) -> bool:
        """Whether what acts late is later than a sample: within one, nobody knows what the recorder held."""
        step = max(float(np.median(ch.dt)) for ch in self.bench.channels.values())
        late = [candidate.fit.values[p.name] for p in candidate.free if p.name.endswith(LATE)]
        return not late or max(late) >= step

    def _judge(self, base: Fit, ways: list[Direction], base_loss: np.ndarray, base_errors: np.ndarray) -> Candidate:
        """The full fit of a hypothesis, from its best starts; more of its numbers are freed only where that helps."""
        best: Candidate | None = None
        seen: list[tuple] = []
        joint = [way for way in ways if self.whole and len(way.amplitudes) > 1][:1]  # however little the look promises
        for way in (*joint, *ways):
            if (way.gain < 0.5 * ways[0].gain and not any(way is j for j in joint)) or len(seen) >= (2 if self.whole else 4):
                continue
            start = self._start(way)
            every = tuple(p for p in way.free if p.name not in base.values)
            shapes = [p for p in every if p.name in way.shape]
            usual = tuple(p for p in every if not (p in shapes and 0.0 < p.low < p.nominal < p.high))  # shapes with a usual value
            simpler = tuple(p for p in usual if not (p in shapes and p.nominal in (p.low, p.high)))  # and what the law can do without
            for extra in (usual, every, simpler):
                kind = tuple(p.name for p in extra)
                if kind in seen:
                    continue
                seen.append(kind)
                fitted = self._fit((*base.free, *extra), {**base.values, **{p.name: start[p.name] for p in extra}})
                found = self._candidate(way.hypothesis, extra, fitted, base_loss, base_errors, ways[0].gain)
                if extra is simpler and best is not None:
                    best = found if self._more(found, best)[0] <= MATTERS else best
                else:
                    best = self._better(best, found)
        return best

    def _start(self, way: Direction) -> dict:
        """Where the linear look says; of a whole drive, which is far from linear, a small amount in that direction."""
        start = way.start()
        for p in way.amplitudes if self.whole else ():
            most = SMALL * (p.high - p.low if np.isfinite(p.high - p.low) else 1.0)
            start[p.name] = p.nominal + float(np.clip(0.1 * (start[p.name] - p.nominal), -most, most))
        return start

    def _candidate(self, hypothesis, extra, fitted: Fit, base_loss, base_errors, linear) -> Candidate:
        unseen = self._held_out(fitted)
        errors, losses = self._cut_errors(unseen), self._block_loss(unseen)
        for p in extra:
            if hypothesis.effect == "lag" and fitted.values[p.name] > 0.0:
                # a lag also averages the noise of what is simulated from measured channels, and so does its mirror
                # image in time; only what it explains beyond that is its own
                mirrored = self.residual({**fitted.values, p.name: -fitted.values[p.name]})
                errors = errors + np.maximum(base_errors - self._cut_errors(mirrored), 0.0)
                losses = losses + np.maximum(base_loss - self._block_loss(mirrored), 0.0)
        # what is gained on unseen blocks but not on those of the fit is luck of the folds
        share = np.maximum(errors / np.maximum(base_errors, 1e-300), self._cut_errors(fitted.residual) / np.maximum(self.fitted, 1e-300))
        drop = 1.0 - share
        if not self.bench.steady:  # where only noise is left there is nothing to explain
            drop = np.where(base_errors > self.enough, drop, 0.0)
        return Candidate(hypothesis, extra, fitted, losses, float(drop.max()), 0.0, linear=linear)

    def _better(self, a: Candidate | None, b: Candidate) -> Candidate:
        if a is None:
            return b
        first, second = (a, b) if len(a.free) <= len(b.free) else (b, a)
        if self.whole and self._ends(first) and not self._ends(second) and not self._worse(second, first):
            return second  # fewer numbers, but pressed against the end of their range, are no simpler law
        return first if not self._worse(first, second) else second

    @staticmethod
    def _ends(candidate: Candidate) -> bool:
        """Whether a number that the hypothesis sets free is at the end of its range."""
        at = candidate.fit.values
        return any(at[p.name] != p.nominal and min(at[p.name] - p.low, p.high - at[p.name]) < 1e-3 * (p.high - p.low)
                   for p in candidate.free)

    def _more(self, a: Candidate, b: Candidate) -> tuple[float, np.ndarray]:
        """How much more a leaves than b on unseen blocks, as a share, and for each block.

        Only the cuts in which they differ count, else cuts that neither touches would hide what one explains and not the other.
        """
        apart = abs((a.losses - b.losses).mean(0)) > 1e-3 * b.losses.mean(0)
        difference = (a.losses - b.losses)[:, apart].sum(1)
        return difference.mean() / max(b.losses[:, apart].sum(1).mean(), 1e-300), difference

    def _worse(self, a: Candidate, b: Candidate) -> bool:
        """Whether a leaves more than b, enough to matter: beyond what varies between blocks, or beyond luck."""
        more, difference = self._more(a, b)
        spread = difference.std(ddof=1) / np.sqrt(len(difference)) if len(difference) > 1 else 0.0
        return more > MATTERS and (difference.mean() > 2.0 * spread or difference.mean() > 2.0 * self.luck * b.errors.mean())

    def _equal(self, a: Candidate, b: Candidate) -> bool:
        return not self._worse(a, b) and not self._worse(b, a)

    def _simplest(self, real: list[Candidate], best: Candidate, found: list[Hypothesis]) -> Candidate:
        """The one with the fewest free numbers among those that are not worse than the best; more of a cause is less than one more."""
        as_good = [c for c in real if not self._worse(c, best)]
        fewest = min(len(c.free) for c in as_good)
        as_simple = [c for c in as_good if len(c.free) == fewest]
        as_simple = [c for c in as_simple if any(c.hypothesis.same_cause(f) for f in found)] or as_simple
        least = min(c.errors.mean() for c in as_simple)
        # equal to the last digits: the same law twice. The more special one is the cause: an effect before a nominal value.
        # What would drift, but was not seen to, is a value that is off; what is cut in metal is doubted last.
        same = [c for c in as_simple if c.errors.mean() <= 1.002 * least]
        return min(same, key=lambda c: (c.hypothesis.effect in DRIFTS, c.hypothesis.label.endswith(CUT_IN_METAL),
                                        c.hypothesis.effect == "parameter", len(c.hypothesis.free), c.errors.mean()))

    def _same_law(self, a: Candidate, b: Candidate) -> bool:
        """A nominal value that does exactly what the component's effect does is no other cause."""
        if a.hypothesis.component != b.hypothesis.component or [a.hypothesis.effect, b.hypothesis.effect].count("parameter") != 1:
            return False
        difference, size = (a.fit.residual - b.fit.residual)[self.rows], self.turn / 3.0
        return bool(np.sqrt(np.mean(difference**2)) < 0.05 * size)


def _without(hypothesis: Hypothesis, taken: set[str]) -> Hypothesis:
    """The hypothesis without numbers that are free already."""
    return replace(hypothesis, free=tuple(p for p in hypothesis.free if p.name not in taken))
