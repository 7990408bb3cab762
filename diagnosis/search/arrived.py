"""Fits of a whole drive that ended on their way, before they are held against one another, gone on with."""

from __future__ import annotations

from collections.abc import Callable

from ..rules import RULES
from .candidate import Candidate, near_best
from .fit import Fit
from .problem import Problem


def arrived(problem: Problem, candidates: list[Candidate], fitted: Callable[[Candidate, Fit], Candidate]) -> list[Candidate]:
    """The best, and what comes near it, fitted again from where they ended, until that brings nothing; then each as the best was read.

    Far from its noise a robust loss bends little, and steps along a valley of it are short: what a fit that ended on its way
    leaves would be sold as one more cause. fitted: a candidate with another fit of its numbers.
    """
    found = list(candidates)
    asked, near = [i for i, c in enumerate(found) if c.fit], {id(c) for c in near_best(candidates)}
    for i in asked:
        if id(found[i]) in near:
            _put(found, i, problem.to_its_end(found[i].fitted), fitted)
    # each from the other: the one that was read better may be the one that leaves more
    for _ in range(2 if len(asked) > 1 else 0):
        best = min(asked, key=lambda i: found[i].errors.mean())
        for i in asked:
            _put(found, i, read_as(problem, found[i].fitted, found[best].fitted), fitted)
    return found


def _put(found: list[Candidate], i: int, fit: Fit, fitted: Callable[[Candidate, Fit], Candidate]) -> None:
    if fit is not found[i].fit:
        found[i] = fitted(found[i], fit)


def read_as(problem: Problem, fit: Fit, other: Fit) -> Fit:
    """A fit made again with what another says of the recorder, where it leaves less with that; else the fit itself.

    A log was recorded in one way, whatever is wrong with its drive. But a filter of the controller's speed, a mean of the voltage and
    when it was read make up for one another, and far from the noise there is more than one valley of them. How much that brings is seen
    at the end of a fit: what a start there leaves less is little, and two candidates may differ by no more than it brings.
    """
    told = {p.name: other.values[p.name] for p in fit.free if p.of_recorder and p.name in other.values}
    left, start = problem.loss(fit.misfit), fit.values | told
    if problem.loss(problem.misfit(start)) >= left:
        return fit
    again = problem.to_its_end(problem.fit(fit.free, start))
    return again if problem.loss(again.misfit) < left / RULES.search.alike else fit
