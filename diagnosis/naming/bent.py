"""Limits and overflows, which a fit hardly crosses: which are fitted with slopes of their own, and from where."""

from __future__ import annotations

from statistics import NormalDist
from typing import TYPE_CHECKING

import numpy as np

from ..rules import RULES
from . import guesses as g
from .guesses import CURVE

if TYPE_CHECKING:
    from .contest import Contest
    from .round import Rivalled


def begins_low(rival: Rivalled) -> bool:
    """Whether an overflow's limit is not told from the lowest that its variable goes to: all goes on there, and nothing overflows.

    Two laws in proportion, one at each place, are then what was fitted: of a product of both they make up most.
    """
    level = next((n.name for n in rival.guess.numbers if n.name.endswith(".l")), "")
    free = [n.name for n in rival.problem.free]
    if rival.guess.law != "overflow" or level not in free:
        return False
    j, every = free.index(level), np.ones(len(rival.block), bool)
    error = float(np.sqrt(max(rival.candidate.fitted.covariance(every, rival.block)[j, j], 0.0)))
    return bool(rival.end.places[j] < NormalDist().inv_cdf(RULES.judge.interval[1]) * error)


def takes_most(contest: Contest, curve: Rivalled | None) -> float:
    """What any that has a name takes off the base's loss, or a curve that leaves no more than noise."""
    return contest.most if curve is None else max(contest.most, contest.gained(curve))


def from_brims(contest: Contest, rival: Rivalled, curve: Rivalled | None) -> list[Rivalled]:
    """A limit fitted with slopes of its own, from where it ended; and from other heights where it is in reach of the best so.

    curve: one that leaves no more than noise, which is the best but for limits of its variable at its place.
    """
    contest.tell(f"fits: {rival.guess.label}{contest.so_far([rival])}", 0.7)
    first, here = contest.fit(rival.guess, rival.values), curve is not None and curve.guess.goes == rival.guess.goes
    if first is None or contest.gained(first) < RULES.naming.in_reach * takes_most(contest, None if here else curve):
        return [first] if first is not None else []
    begun = [contest.values | start for start in g.brims(contest.scene, rival.guess)]
    return [first, *(one for start in begun if (one := contest.fit(rival.guess, start)) is not None)]


def bent(contest: Contest, found: list[Rivalled]) -> list[Rivalled]:
    """Limits that do something: where a law is bent, slopes that were learnt say little.

    Not where fewer numbers, with slopes of their own, leave no more than noise: in their place no limit would be believed.
    Where a curve at one place leaves no more nothing goes on to another, as an overflow's surplus.
    """
    most, fewest = (1.0 - RULES.naming.bent) * contest.problem.loss(contest.base.misfit), np.inf
    laws = ("limit",) if contest.told_by_curve(found) is not None else ("limit", "overflow")
    bent = [r for r in found if r.rough and r.guess.law in laws and r.end.loss <= most]
    for count in sorted({r.guess.count for r in found if r.guess.count < max((b.guess.count for b in bent), default=0)}):
        named = [k for k, r in enumerate(found) if r.guess.count == count and r.guess.kind != CURVE and r not in bent]
        if not named or fewest < np.inf or contest.enough():
            continue
        k = min(named, key=lambda k: found[k].end.loss)
        if found[k].rough:
            found[k] = contest.fit(found[k].guess, found[k].values) or found[k]
        if not contest.more(found[k]):
            fewest = count
    return [r for r in bent if r.guess.count <= fewest and not contest.enough()]
