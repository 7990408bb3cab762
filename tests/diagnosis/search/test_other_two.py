"""What stood alone for two causes is asked again beside the second of them, and so is a fit that ended in a valley of its own."""

from __future__ import annotations

from dataclasses import replace
from types import SimpleNamespace
from typing import ClassVar

import numpy as np
import pytest

from selflock.diagnosis.search.candidate import Candidate
from selflock.diagnosis.search.fit import Fit
from selflock.diagnosis.search.hypotheses import Free, Hypothesis
from selflock.diagnosis.search.selection import ForwardSelection, together
from selflock.diagnosis.search.step import Stage

from .sets import BLOCKS, Sets

LEFT = {"constant": 5.0, "mass": 6.0, "inertia": 8.0, "constant inertia": 1.3, "inertia mass": 1.0, "constant mass": 4.0}
"""What each alone leaves, and two: a constant stands for a mass and an inertia better than either, and not as well as both."""


def hypothesis(name):
    return Hypothesis("drive", name, (Free(name, 0.0, 0.0, 1.0),))


class Problem(Sets):
    """What a selection asks of one."""

    def __init__(self, rng, left):
        self.blocks, self.left = rng.uniform(0.9, 1.1, BLOCKS), left

    def fit(self, free, start, *_):
        return Fit(
            tuple(free), dict(start), self.left[" ".join(sorted(start))] * self.blocks, np.ones((BLOCKS, 1)), np.ones(BLOCKS)
        )


class Search(ForwardSelection):
    """Whose steps are those of the three names."""

    names = "constant", "mass", "inertia"

    def step(self, base, found, first=None):
        names = [name for name in self.names if name not in [h.effect for h in found]]
        candidates = []
        for name in names:
            free = hypothesis(name).free
            fitted = self.problem.fit((*base.free, *free), {**base.values, name: 0.5})
            losses = fitted.misfit[:, None]
            candidates.append(Candidate(hypothesis(name), free, fitted, losses, gain=float(base.misfit.sum() - losses.sum())))
        candidates.sort(key=lambda c: c.errors.mean())
        nothing = Candidate(Hypothesis("", "none", ()), base.free, base, base.misfit[:, None])
        return Stage(nothing, candidates, candidates[0])


@pytest.mark.parametrize("beside", [1.0, 1.29], ids=["better", "as good"])
def test_a_first_guess_goes_where_another_leaves_less_beside_the_second(rng, beside):
    problem = Problem(rng, LEFT | {"inertia mass": beside, "": 20.0})
    search = Search(problem, rng)
    base = problem.fit((), {})
    first = search.step(base, [])
    second = search.step(first.winner.fitted, [first.winner.hypothesis])
    causes = [first.winner, second.winner]
    assert [c.hypothesis.effect for c in causes] == ["constant", "inertia"]
    whole = together(search.problem, second.winner.fitted)
    found, stages, standing = search._other_two(causes, [first, second], whole, base)
    named = ["inertia", "mass"] if beside == 1.0 else ["constant", "inertia"]
    assert [c.hypothesis.effect for c in found] == named
    assert [stage.winner for stage in stages] == found
    assert standing.errors.mean() == pytest.approx((1.0 if beside == 1.0 else 1.3) * problem.blocks.mean())


class Stuck(Problem):
    """Of which a play, alone, ends in a valley that any number beside it leads out of; where it ends hangs on where it begins."""

    nominal: ClassVar = {}

    def __init__(self, rng, deep):
        super().__init__(rng, {})
        self.deep, self.experiment = deep, SimpleNamespace(whole=lambda: self.experiment)

    def fit(self, free, start, *_):
        values = {**start, "play": 0.9} if len(start) > 1 else dict(start)
        left = 20.0 if not values else 15.0 if "play" not in values else 1.0 if values["play"] > 0.7 else self.deep
        return Fit(tuple(free), values, left * self.blocks, np.ones((BLOCKS, 1)), np.ones(BLOCKS))

    def with_noise(self):
        return self

    def longer(self, base):
        return None

    def loss(self, misfit):
        return float(misfit.sum())


class Steps(Search):
    """Whose steps are those of two names, of which one wins where it leaves less, and another is as good as the first."""

    names = "play", "damping"

    def step(self, base, found, first=None):
        stage = super().step(base, found, first)
        better = stage.winner.errors.mean() < 0.9 * base.misfit.mean()
        rival = Candidate(hypothesis("compliance"), stage.winner.free, stage.winner.fit, 1.01 * stage.winner.losses)
        return replace(stage, winner=stage.winner if better else None, tied=[] if found else [rival])


@pytest.mark.parametrize("deep", [10.0, 1.0], ids=["in a valley", "at its end"])
def test_a_fit_that_another_number_leads_out_of_its_valley_goes_on_from_there_alone(rng, deep):
    """A play left four times what it leaves, five numbers took 95 % of that, and one of them was told as a number of the play."""
    found = Steps(Stuck(rng, deep), rng).run()
    assert [c.hypothesis.effect for c in found.causes] == ["play"]
    assert found.final.values == {"play": 0.9 if deep > 1.0 else 0.5}
    assert found.standing.errors.mean() == pytest.approx(found.causes[0].errors.mean())
    assert [c.hypothesis.effect for c in found.kept[0].tied] == ([] if deep > 1.0 else ["compliance"])
