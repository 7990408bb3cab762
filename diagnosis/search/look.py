"""The first look at a hypothesis: all its ways of acting, on as little of a log as shows the same as all of it."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from ..rules import RULES
from .fit import Fit, change
from .hypotheses import Hypothesis
from .linear import Linear
from .problem import Problem
from .screen import Direction, directions


class Look:
    """Looks over a base fit.

    What drifts is looked at in all of a log, all else in an excerpt (of a whole drive, in its first seconds). An excerpt
    does not show everything: an angle that is integrated, a mean over the log, heat. So the best way of each hypothesis is
    held against what it does to the whole log, and where that is something else the hypothesis is looked at there.
    """

    def __init__(self, problem: Problem, base: Fit, linear: Linear):
        self.problem, self.linear, self.fixed = problem, linear, dict(base.values)
        self.errors = linear.draws(problem.taught(base.misfit * base.weights))
        near = problem.glance(False)
        self.near, self.all = self._at(near), self._at(problem.glance(True))
        self.asked = not problem.by_channel and near.experiment is not problem.experiment

    def _at(self, problem: Problem) -> tuple[Callable[[dict], np.ndarray], np.ndarray]:
        """The misfit in blocks, and that of the base."""
        shaped = lambda values: problem.misfit(values).reshape(problem.shape)
        return shaped, shaped(self.fixed)

    def ways(self, hypothesis: Hypothesis) -> list[Direction]:
        """Ways in which it acts, with what each gains."""
        if hypothesis.drifts:
            return self._ways(hypothesis, *self.all)
        found = self._ways(hypothesis, *self.near)
        if self.asked and found and not self._alike(max(found, key=lambda way: way.gain)):
            return self._ways(hypothesis, *self.all)
        return found

    def _ways(self, hypothesis: Hypothesis, shaped: Callable[[dict], np.ndarray], at: np.ndarray) -> list[Direction]:
        found = directions(shaped, self.fixed, at, hypothesis, dear=self.problem.by_channel)
        for way in found:
            way.columns = way.columns[self.problem.train]
            self.linear.look(way, self.errors)
        return [way for way in found if np.isfinite(way.gain)]

    def _alike(self, way: Direction) -> bool:
        """Whether it does to the excerpt what it does to the whole log."""
        acting = {**self.fixed, **way.little()}
        part, whole = [change(shaped(acting), at)[self.problem.train] for shaped, at in (self.near, self.all)]
        return bool(np.sum((part - whole) ** 2) <= RULES.search.excerpt_alike**2 * np.sum(whole**2))
