"""A hypothesis after its fit, and how two of them compare on blocks that their fits did not see."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np

from selflock.fmus.effect import METAL, ORDER, SHAPES

from ..rules import RULES
from .fit import Fit
from .hypotheses import Free, Hypothesis


@dataclass(eq=False)
class Candidate:
    """A hypothesis in one stage: how it did on training blocks that its fit did not see."""

    hypothesis: Hypothesis
    free: tuple[Free, ...]
    fit: Fit | None
    losses: np.ndarray  # (blocks, residuals): what each residual adds to the mean loss of each training block
    drop: float = 0.0  # of the error, largest over the residuals, 0 to 1
    gain: float = 0.0  # drop of the loss in units of the noise's
    chance: float = 1.0  # share of draws in which chance does as well
    linear: float = 0.0  # the gain of the first, linear look
    doubt: str = ""  # why it is no cause, where it is none
    complete: bool = False  # whether it leaves of no channel of a whole drive more than noise, and what formulas may miss

    @property
    def fitted(self) -> Fit:
        """The fit, of a candidate that was fitted."""
        assert self.fit is not None, f"{self.hypothesis.label} was not fitted"
        return self.fit

    @property
    def errors(self) -> np.ndarray:
        """Mean loss of each training block."""
        return self.losses.sum(1)


def near_best(candidates: Sequence[Candidate]) -> list[Candidate]:
    """Of those that were fitted, what leaves no more than a few times what the best of them leaves, whatever speaks against them."""
    fitted = [c for c in candidates if c.fit]
    least = min((c.errors.mean() for c in fitted), default=0.0)
    return [c for c in fitted if c.errors.mean() <= RULES.search.near_best * least]


def more(a: Candidate, b: Candidate) -> tuple[float, np.ndarray]:
    """How much more a leaves than b on unseen blocks, as a share, and for each block.

    Only the residuals in which they differ count: residuals that neither touches would hide what one explains and not the other.
    """
    apart = abs((a.losses - b.losses).mean(0)) > RULES.search.apart * b.losses.mean(0)
    difference = (a.losses - b.losses)[:, apart].sum(1)
    return difference.mean() / max(b.losses[:, apart].sum(1).mean(), 1e-300), difference


def worse(a: Candidate, b: Candidate, chance_level: float) -> bool:
    """Whether a leaves more than b, enough to matter: beyond what varies between blocks, or beyond chance_level.

    chance_level: gain that the best hypothesis finds by chance in one draw of twenty.
    """
    rules = RULES.search
    share, difference = more(a, b)
    ratio = np.log(np.maximum(a.errors, 1e-300) / np.maximum(b.errors, 1e-300))  # a few blocks may have most of a difference
    spread = lambda x: x.std(ddof=1) / np.sqrt(len(x)) if len(x) > 1 else 0.0
    beyond = lambda x: x.mean() > rules.spreads * spread(x)
    whole = b.fit is not None and b.fit.by_channel
    if a.complete and b.complete:  # what one leaves less of than the other may be what its formula misses
        return share > rules.matters and beyond(difference)
    return share > rules.matters and (
        beyond(difference)
        or (whole and beyond(ratio))
        or difference.mean() > rules.chance_levels * chance_level * b.errors.mean()
    )


def equal(a: Candidate, b: Candidate, chance_level: float) -> bool:
    """Whether neither is worse than the other."""
    return not worse(a, b, chance_level) and not worse(b, a, chance_level)


def better(a: Candidate | None, b: Candidate, chance_level: float, whole: bool) -> Candidate:
    """Of two fits of a hypothesis the one with fewer free numbers, unless it is worse. whole: of a whole drive."""
    if a is None:
        return b
    first, second = (a, b) if len(a.free) <= len(b.free) else (b, a)
    if whole and ends(first) and not ends(second) and not worse(second, first, chance_level):
        return second  # fewer numbers, but pressed against the end of their range, are no simpler law
    return first if not worse(first, second, chance_level) else second


def ends(candidate: Candidate) -> list[Free]:
    """Numbers that the hypothesis sets free and that are at the end of their range; one that shapes an effect may be."""
    return [p for p in candidate.free if pressed(p, candidate.fitted.values[p.name])]


def pressed(p: Free, value: float) -> bool:
    """Whether a number that shapes nothing is at the end of its range, away from what it is without the hypothesis."""
    near = RULES.search.at_end * (p.high - p.low)
    return p.role not in SHAPES and value != p.nominal and min(value - p.low, p.high - value) < near


def holds_nothing(p: Free, low: float, high: float) -> bool:
    """Whether an interval of a number holds what it is without its cause."""
    return low <= p.nominal <= high


def amount(p: Free) -> bool:
    """Whether a number says how much there is of a cause."""
    return p.role not in SHAPES and not p.companion


def reaches_an_end(candidate: Candidate, intervals: dict[str, tuple[float, float]]) -> bool:
    """Whether an interval goes to the end of its number's range: what is small beside a wide range may yet be sure.

    Where that end is what the number is without the cause, others of its numbers may say how much there is of it.
    """
    amounts = [p for p in candidate.free if p.role not in SHAPES]
    nothing = [p for p in amounts if holds_nothing(p, *intervals[p.name])]
    for p in ends(candidate):
        low, high = intervals[p.name]
        if (low <= p.low or high >= p.high) and (p not in nothing or len(nothing) == len(amounts)):
            return True
    return False


def may_be_nothing(candidate: Candidate, intervals: dict[str, tuple[float, float]]) -> bool:
    """Whether the intervals of all that says how much there is of a cause hold what it is without the cause.

    Asked where something else is found already: beside nothing a large error widens all intervals, the right cause's, too.
    """
    amounts = [p for p in candidate.free if amount(p) and not p.trials]
    return bool(amounts) and all(holds_nothing(p, *intervals[p.name]) for p in amounts)


def simplest(
    real: Sequence[Candidate], found: Sequence[Hypothesis], chance_level: float, alike: Callable[[Fit, Fit], bool]
) -> Candidate:
    """The one with the fewest free numbers among those that are not worse than the best, which is the first.

    More numbers of a cause that is found already are less than one more cause. Of the same law twice the more special
    one is the cause, an effect before a nominal value; but what would drift and was not seen to is a value that is off.
    Where nothing is left to tell an effect from a nominal value that no rig gives, that is as good as the same law.
    alike: see Problem.alike.
    """
    as_good = [c for c in real if not worse(c, real[0], chance_level) or one_wave(c, real[0], alike)]
    fewest = min(len(c.free) for c in as_good)
    as_simple = [c for c in as_good if len(c.free) == fewest]
    as_simple = [c for c in as_simple if any(c.hypothesis.same_cause(f) for f in found)] or as_simple
    best = min(as_simple, key=lambda c: c.errors.mean())
    twice = [
        c for c in as_simple if c.errors.mean() <= RULES.search.alike * best.errors.mean() or _of_one_turn(c, best) or (
            "parameter" not in (c.hypothesis.effect, best.hypothesis.effect) and alike(c.fitted, best.fitted)
        ) or (c.complete and best.complete and _untold(best))
    ]  # fmt: skip

    def doubt(c: Candidate) -> tuple:
        nominal = c.hypothesis.effect == "parameter"
        return (
            c.hypothesis.drifts,
            nominal and c.hypothesis.free[0].role == METAL,
            nominal,
            len(c.hypothesis.free),
            c.errors.mean(),
        )

    return min(twice, key=doubt)


def _untold(candidate: Candidate) -> bool:
    """Whether it is a nominal value of which no rig says anything, as that of a law that nobody described."""
    return candidate.hypothesis.effect == "parameter" and not any(p.told for p in candidate.free)


def same_law(a: Candidate, b: Candidate, alike: Callable[[Fit, Fit], bool]) -> bool:
    """A nominal value that does exactly what the component's effect does is no other cause. alike: see Problem.alike."""
    effects = [a.hypothesis.effect, b.hypothesis.effect]
    if a.hypothesis.component != b.hypothesis.component or effects.count("parameter") != 1:
        return False
    return alike(a.fitted, b.fitted)


def stands_beside(rival: Candidate, winner: Candidate, chance_level: float, alike: Callable[[Fit, Fit], bool]) -> bool:
    """Whether a rival does as well with no more numbers, and is another law. alike: see Problem.alike."""
    as_good = equal(rival, winner, chance_level) or one_wave(rival, winner, alike)
    return as_good and len(rival.free) <= len(winner.free) and not same_law(rival, winner, alike)


def order_of(a: Candidate, b: Candidate) -> dict[str, float]:
    """What b's numbers of waves in a turn are where a has as many, whichever shaft they are counted over; empty if it has not.

    As many are those that are not a radian apart where the shaft has gone its way.
    """
    found = {}
    for p in (p for p in a.free if p.role == ORDER):
        for q in (q for q in b.free if q.role == ORDER):
            order = a.fitted.values[p.name] / p.gears * q.gears
            if abs(order - b.fitted.values[q.name]) <= max(p.length / p.gears * q.gears, q.length):
                found[q.name] = order
    return found


def harmonic(candidate: Candidate, found: Sequence[Hypothesis], does: Callable[[Sequence[Free]], float]) -> bool:
    """Whether it is a harmonic of a wave that is a cause already: k times as many in a turn of that shaft, at most 1 / k as much.

    Of what comes back once in a turn a jump has the strongest harmonics, 1 / k of its first wave. Several harmonics of one effect
    are one cause. does: how much amounts do to the misfit, with all that the candidate's fit ended with.
    """
    values, mine = candidate.fitted.values, [p for p in candidate.free if amount(p)]
    for p in (p for p in candidate.free if p.role == ORDER):
        for hypothesis in found:
            for q in (q for q in hypothesis.free if q.role == ORDER and q.shaft == p.shaft):
                first = values.get(q.name, q.nominal)
                k = round(values[p.name] / first)
                theirs = [a for a in hypothesis.free if a.shaft == q.shaft and amount(a) and a.name in values]
                if theirs and k > 1 and abs(values[p.name] - k * first) <= p.length and does(mine) <= does(theirs) / k:
                    return True
    return False


def one_wave(a: Candidate, b: Candidate, alike: Callable[[Fit, Fit], bool]) -> bool:
    """Whether two are one wave by two names, of which no log says which it is. alike: see Problem.alike.

    Cogging and a ripple of torque at the motor's shaft are, and one at the load's of as many times the gear's ratio.
    """
    return _of_one_turn(a, b) and alike(a.fitted, b.fitted)


def _of_one_turn(a: Candidate, b: Candidate) -> bool:
    """Whether two are waves of one quantity, as many in a turn. Which of their fits ended the nearer says nothing of the drive."""
    unit = lambda c: {p.unit for p in c.free if amount(p)}
    return bool(order_of(a, b)) and unit(a) == unit(b)
