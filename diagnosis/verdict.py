"""What the outcome of a contest is worth on data that it did not see: believed, or dropped for what else is missing."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from scipy.stats import norm

from . import advice
from .bench import Bench
from .candidate import Candidate
from .cuts import Cut
from .depends import QUIET, Dependence, depends
from .fit import Fit
from .gain import Gain, levels, measure, most_mended, samples, sizes
from .result import Cause
from .select import Contest, Outcome
from .stage import LATE, SHOWS

ENOUGH = 0.55
"""Share of the error above the noise floor that causes must close while something significant remains."""

MANY, MUCH = 3, 0.35
"""So many causes, none of which takes this share of the error, nor the first as much as those after it: guesses."""

AHEAD = 0.05
"""Share of the error by which a free function of one variable, which may bend as it likes, must outdo causes."""

HALF = 0.5
"""... and from which on many causes are guesses, whatever they explain."""

STILL = 0.2
"""Share of what causes leave that goes with a variable as strongly as if they had not touched it."""

NEARLY = 0.9
"""Share of the error that causes must close where it goes most with a place, and what they leave still does."""

HELP = 0.05
"""Share of the held-out error that causes must take away."""

EXCESS = 1.6
"""Error in units of the noise from which on something is missing, whether or not anything is seen to go with it."""

OFF = 1.3
"""... and of a cut, for its error to be the one to tell of."""


@dataclass
class Judgement:
    """An outcome, without its causes where they were dropped, and what it brings."""

    outcome: Outcome
    before: dict  # values of the nominal drive, what is uncertain refitted
    after: dict  # with the causes
    cut: Cut  # in which the gain is told
    gain: Gain
    left: list[Dependence]  # with what the remainder goes


class Judge:
    """The data that judge: `judged` blocks, called `names`, of the whole `bench`; `train` are those of the contest."""

    def __init__(self, bench: Bench, contest: Contest, train: np.ndarray, judged: np.ndarray, names: list[str], rng):
        self.bench, self.contest, self.rng = bench, contest, rng
        self.train, self.judged, self.names = train, judged, names

    def judge(self, outcome: Outcome) -> Judgement:
        """Causes that do not help, that leave too much, or that a free function of one variable outdoes are dropped.

        What comes after the first is dropped one by one, the last first; else all are guesses.
        """
        contest, base = self.contest, outcome.base
        self.bench.forget()
        while len(outcome.causes) > 1 and (fewer := self._refuted(outcome)):
            outcome = fewer
        before = contest.absolute(base.values) | {k: v for k, v in contest.nominal.items() if k not in base.values}
        nothing = replace(outcome, causes=[], kept=[], final=base)
        found = self._gained(outcome, before)
        # held-out data without the error can refute nothing
        silent = found.gain.before < QUIET * found.gain.noise_floor
        if outcome.causes and not silent and found.gain.after > (1.0 - HELP) * found.gain.before:
            found = self._gained(nothing, before)
        found.left = self._dependences(found.after)
        if found.outcome.causes and found.left:
            missing = self._dependences(before)
            little = found.gain.closed < ENOUGH and not silent
            if little or _guesses(outcome) or self._stands_there(found, missing) or self._outdone(found, missing):
                left = missing or found.left
                found = self._gained(nothing, before)
                found.left = left
        return found

    def _refuted(self, outcome: Outcome) -> Outcome | None:
        """The outcome without the cause found last, where that lowers no error of the data that judge."""
        bench, rest = self.bench, outcome.causes[:-1]
        without = self.contest.with_these(rest, outcome.final)
        old, new = self.contest.absolute(without.values), self.contest.absolute(outcome.final.values)
        cut = most_mended(bench, old, new, self.train)
        errors, trusted = samples(bench, cut, old, self.judged)
        was, now, noise = levels(bench, cut, new, errors, samples(bench, cut, new, self.judged)[0], trusted)
        if was < QUIET * noise or now <= (1.0 - SHOWS) * was:  # data without the error can refute nothing
            return None
        return replace(outcome, causes=rest, kept=outcome.kept[:-1], final=without)

    def _gained(self, outcome: Outcome, before: dict) -> Judgement:
        bench, after = self.bench, before
        if outcome.causes:
            after = self.contest.absolute(outcome.final.values)
            cut = most_mended(bench, before, after, self.train)
        else:
            cut = self._most_off(outcome)
        gain = measure(bench, cut, before, after, self.judged, self.names, self.rng)
        return Judgement(outcome, before, after, cut, gain, [])

    def _dependences(self, values: dict) -> list[Dependence]:
        return depends(self.bench, self.bench.residual(values), self.bench.present(values), values, self.rng)

    def _most_off(self, outcome: Outcome) -> Cut:
        """The cut that is off most; the gear's where none is."""
        off = {name: size if size > OFF else 0.0 for name, size in _sizes(self.contest, outcome.base).items()}
        return max(self.bench.cuts, key=lambda c: (off[c.name], c.name.endswith("gear")))

    def _cut(self, dependence: Dependence) -> Cut:
        return next(cut for cut in self.bench.cuts if cut.name == dependence.cut)

    def _stands_there(self, found: Judgement, missing: list[Dependence]) -> bool:
        """Whether the error goes most with a place, and what causes leave of it still does: a stop, or an obstacle.

        The error of an angle says nothing of it: where a loop holds an angle under a load, it goes with itself.
        """
        most = lambda dependences: [(d.variable, d.cut) for d in dependences[:1]]
        return (
            found.gain.closed < NEARLY
            and most(missing) == most(found.left)
            and missing[0].variable in ("position", "output position")
            and "angle" not in self._cut(missing[0]).reading
        )

    def _outdone(self, found: Judgement, missing: list[Dependence]) -> bool:
        """Whether a free function of a variable explains more than all causes, and what these leave still goes with it.

        Of many causes half of the error is enough: they have bent to it with as many numbers as a free function has.
        Not asked of steady-state points, which are too few to tell a law from a free function.
        """
        bench = self.bench
        if bench.steady:
            return False
        r, left = bench.residual(found.before), bench.residual(found.after)
        energies = np.stack([(x**2).sum(0) for x in (r, left, left - r)])
        many = len(found.outcome.causes) >= MANY
        for d in missing:
            cut = self._cut(d)
            if d.variable == cut.reading:  # it goes with itself, as a coarse one does
                continue
            was, now, moved = energies[:, bench.slice(cut)].sum(1)
            still = any((e.variable, e.cut) == (d.variable, d.cut) and e.share >= STILL for e in found.left)
            closed = 1.0 - now / max(was, 1e-300)
            claimed = moved > AHEAD * was  # of a cut that the causes leave alone they say nothing
            if claimed and still and d.share > (min(closed, HALF) if many else closed + AHEAD):
                return True
        return False


def _guesses(outcome: Outcome) -> bool:
    """Whether many causes take a little of the error each, as guesses at something that is none of them do."""
    drops = [c.drop for c in outcome.causes]
    return len(drops) >= MANY and max(drops) < MUCH and drops[0] < sum(drops[1:])


def verdict(causes: list[Cause], left: list[Dependence], contest: Contest, outcome: Outcome) -> str:
    """Nothing is missing only where what is left is noise."""
    if causes:
        return "ambiguous" if any(c.indistinguishable_from for c in causes) else "explained"
    return "unknown" if left or max(_sizes(contest, outcome.final).values()) > EXCESS else "none"


def _sizes(contest: Contest, fit: Fit) -> dict[str, float]:
    return sizes(contest.bench, fit.residual.reshape(contest.shape), contest.present)


def named(contest: Contest, outcome: Outcome) -> list[Cause]:
    """Named causes with the values of the final fit of all of them."""
    if not outcome.causes:
        return []
    intervals = outcome.final.intervals(contest.rows, contest.blocks)
    values = contest.absolute(outcome.final.values)
    step = contest.bench.step
    found = []
    for candidate, stage in zip(outcome.causes, outcome.kept):
        parameters = {}
        for p in candidate.free:
            low, high = intervals[p.name]
            fitted = outcome.final.values[p.name]
            if p.name.endswith(LATE):  # where within a sample something happened no log tells
                low, high = max(p.low, min(low, fitted - step)), min(p.high, max(high, fitted + step))
            shift = values[p.name] - fitted
            parameters[p.name] = {
                "value": values[p.name],
                "low": low + shift,
                "high": high + shift,
                "unit": p.unit,
                "determined": bool(high - low < min(0.9 * (p.high - p.low), 4.0 * max(abs(fitted), 1e-300))),
            }
        h, rivals = candidate.hypothesis, [c.hypothesis for c in stage.tied]
        found.append(
            Cause(
                h.component,
                h.effect,
                parameters,
                _confidence(candidate, stage.candidates, stage.tied),
                [rival.label for rival in rivals],
                advice.separate(h, rivals),
                h.channel,
            )
        )
    return found


def _confidence(winner: Candidate, candidates: list[Candidate], tied: list[Candidate]) -> float:
    """That chance is not it, and that no rival but those named with it is better: over training blocks."""
    confidence = 1.0 - winner.chance
    for rival in candidates:
        if rival.fit is None or rival is winner or any(rival is t for t in tied) or len(rival.free) > len(winner.free):
            continue
        difference = rival.errors - winner.errors
        spread = difference.std(ddof=1) / np.sqrt(len(difference)) if len(difference) > 1 else 1.0
        confidence = min(confidence, float(norm.cdf(difference.mean() / max(spread, 1e-300))))
    return round(confidence / (1 + len(tied)), 4)
