"""The first look at a hypothesis: all its ways of acting, on as little of a log as shows the same as all of it."""

from __future__ import annotations

from collections.abc import Callable, Hashable, Sequence
from copy import copy
from hashlib import blake2b
from typing import Any

import numpy as np

from ..residuals.whole import FILTER
from ..rules import RULES
from .fit import Fit, change
from .hypotheses import Hypothesis
from .linear import Linear
from .problem import Problem
from .screen import Direction, directions

Known = dict[tuple, tuple[Hashable, Any]]
"""What was found of each hypothesis, and what that depends on."""


class Look:
    """Looks over a base fit.

    What drifts is looked at in all of a log, all else in an excerpt (of a whole drive, in its first seconds: see Problem.near). An excerpt
    does not show everything: an angle that is integrated, a mean over the log, heat. So the best way of each hypothesis is
    held against what it does to the whole log, and where that is something else the hypothesis is looked at there.

    views: see `sights`. known: of looks over other bases, taken again where nothing has changed that it depends on; it is
    brought up to date.
    """

    def __init__(self, problem: Problem, base: Fit, views: tuple[Sight, Sight], linear: Linear, known: Known | None = None):
        self.problem, self.linear, self.known = problem, linear, {} if known is None else known
        self.errors = linear.draws(problem.taught(base.misfit * base.weights))
        self.near, self.all = views
        self.asked = not problem.by_channel and self.near.problem.experiment is not problem.experiment

    def ways(self, hypothesis: Hypothesis) -> list[Direction]:
        """Ways in which it acts, with what each gains."""
        if hypothesis.drifts:
            return self._ways(hypothesis, self.all)
        found = self._ways(hypothesis, self.near)
        if self.asked and found and not self._alike(hypothesis, max(found, key=lambda way: way.gain)):
            return self._ways(hypothesis, self.all)
        return found

    def _ways(self, hypothesis: Hypothesis, view: Sight) -> list[Direction]:
        part = Touched(view, hypothesis)
        ways = self._once((hypothesis.label, view.name), part.depends, lambda: self._directions(hypothesis, part))
        found = [copy(way) for way in ways]  # what each gains is another over each base
        self.linear.looks(found, self.errors)
        return [way for way in found if np.isfinite(way.gain)]

    def _directions(self, hypothesis: Hypothesis, part: Touched) -> list[Direction]:
        found = directions(part.misfit, part.view.fixed, part.at, hypothesis, dear=self.problem.by_channel) if part.of else []
        for way in found:
            way.columns = way.columns[self.problem.train]
            part.place(way)
        return found

    def _alike(self, hypothesis: Hypothesis, way: Direction) -> bool:
        """Whether it does to the excerpt what it does to the whole log."""
        near, every = Touched(self.near, hypothesis), Touched(self.all, hypothesis)
        little = way.little()

        def alike() -> bool:
            part, whole = [change(one.misfit({**one.view.fixed, **little}), one.at)[self.problem.train] for one in (near, every)]
            return bool(np.sum((part - whole) ** 2) <= RULES.search.excerpt_alike**2 * np.sum(whole**2))

        depends = tuple(little.items()), near.depends, every.depends
        return self._once((hypothesis.label, "alike"), depends, alike)

    def _once(self, what: tuple, depends: Hashable, make: Callable[[], Any]) -> Any:
        """What `make` gives, or gave when what it depends on was the same. Of a whole drive that never is."""
        if self.problem.by_channel:
            return make()
        if what not in self.known or self.known[what][0] != depends:
            self.known[what] = depends, make()
        return self.known[what][1]


class Sight:
    """A problem as looks have it, of an excerpt or of all of a log, around a base, which leaves `loss` of it."""

    def __init__(self, problem: Problem, base: Fit, name: str):
        self.problem, self.fixed, self.name = problem, dict(base.values), name
        self.at = problem.misfit(self.fixed).reshape(problem.shape)
        self.loss = max(problem.loss(self.at.ravel()), 1e-300)

    def left(self, values: dict) -> float:
        """What share of the base's loss these values leave, with its own beside them."""
        return self.problem.loss(self.problem.misfit({**self.fixed, **values})) / self.loss


def sights(problem: Problem, base: Fit) -> tuple[Sight, Sight]:
    """A problem as looks have it over a base: of what does not drift, and of what does."""
    return Sight(problem.near(base), base, "near"), Sight(problem.glance(True), base, "all")


def as_read(view: Sight, base: Fit, ways: Sequence[Direction]) -> tuple[Direction, dict, float] | None:
    """Of these ways that which leaves least without the controller's filter, where it begins, and what share of the base's loss.

    None where there is no such filter. Of a drive that lacks something it may stand for that in the loop, and beside it the cause
    itself is none: a shaft that winds up left more than the base did, however little of it, and a third of that without. So may
    what else was taken for the recorder's with it: the ways are tried as the log was read, too.
    """
    if not base.values.get(FILTER, 0.0) > 0.0:
        return None
    plain = {FILTER: 0.0}, {p.name: 0.0 for p in base.free if p.of_recorder}
    begun = [(way, start := zeros | way.start(), view.left(start)) for way in ways for zeros in plain]
    return min(begun, key=lambda one: one[2], default=None)


class Touched:
    """What a hypothesis may move of the misfit in a view: of some residuals, which may stand apart among all.

    of: their places. columns: of their bins among all. at: what the base leaves there. depends: what a look at it depends on.
    """

    def __init__(self, view: Sight, hypothesis: Hypothesis):
        self.view, experiment = view, view.problem.experiment
        names, bins = [p.name for p in hypothesis.free], experiment.layout.bins
        self.of = [i for i, residual in enumerate(experiment.residuals) if any(map(residual.uses, names))]
        self.columns = (np.array(self.of, int)[:, None] * bins + np.arange(bins)).ravel()
        self.at = np.ascontiguousarray(view.at[:, self.columns])
        beside = {p.above for p in hypothesis.free}
        uses = lambda name: name in beside or any(experiment.residuals[i].uses(name) for i in self.of)
        used = tuple(item for item in view.fixed.items() if uses(item[0]))
        self.depends: Hashable = (hypothesis.free, tuple(self.of), used, blake2b(self.at.data).digest())

    def misfit(self, values: dict) -> np.ndarray:
        """(blocks, bins) under these values."""
        return self.view.problem.misfit_of(values, self.of, self.columns)

    def place(self, way: Direction) -> None:
        """Put a way that was looked at in this part to its place among all residuals."""
        places = self.columns[way.part]
        first, last = int(places[0]), int(places[-1]) + 1
        if len(places) < last - first:
            spread = np.zeros((len(way.columns), last - first, way.columns.shape[-1]), way.columns.dtype)
            spread[:, places - first] = way.columns
            way.columns = spread
        way.part = slice(first, last)
