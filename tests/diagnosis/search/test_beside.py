"""What was passed over alone is asked beside the other causes: of mass, arm and inertia of a load any two are as good."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from selflock.diagnosis.search.beside import beside_one_another
from selflock.diagnosis.search.candidate import Candidate
from selflock.diagnosis.search.fit import Fit
from selflock.diagnosis.search.hypotheses import Free, Hypothesis
from selflock.diagnosis.search.selection import Selection, together
from selflock.diagnosis.search.step import Stage

from .sets import BLOCKS, Sets

ALONE = {"": 20.0, "mass": 5.0, "arm": 6.0, "inertia": 12.0, "scale": 7.0}
PAIRS = {"arm mass": 1.0, "inertia mass": 1.0, "arm inertia": 1.0, "arm scale": 4.0, "mass scale": 4.0}


def hypothesis(name):
    return Hypothesis("load", name, (Free(name, 0.0, 0.0, 1.0),))


class Problem(Sets):
    """What an outcome asks of one, of a load of which each set of names leaves what it is given here."""

    rows, blocks = np.ones(BLOCKS, bool), np.arange(BLOCKS)

    def __init__(self, rng, left, ends):
        self.noise, self.left, self.ends = rng.uniform(0.9, 1.1, BLOCKS), left, ends
        self.slopes = rng.normal(size=(BLOCKS, 4))

    def fit(self, free, start, *_):
        left = self.left[" ".join(sorted(start))] * self.noise
        values = {name: self.ends.get(name, 0.5) for name in start}
        return Fit(tuple(free), values, left, 1e3 * self.slopes[:, : len(free)], np.ones(BLOCKS))

    def alike(self, a, b):
        return np.allclose(a.misfit, b.misfit)


def outcome(rng, left, ends=None):
    """A search that found a mass, and an arm beside it."""
    problem, stages, found = Problem(rng, left, ends or {}), [], []
    for winner in ("mass", "arm"):
        base = problem.fit(tuple(p for c in found for p in c.free), dict.fromkeys((c.hypothesis.effect for c in found), 0.5))
        candidates = []
        for name in ("mass", "arm", "inertia", "scale"):
            if name not in base.values:
                free = hypothesis(name).free
                fitted = problem.fit((*base.free, *free), {**base.values, name: 0.5})
                gain = float((base.misfit - fitted.misfit).sum())
                candidates.append(Candidate(hypothesis(name), free, fitted, fitted.misfit[:, None], gain=gain, chance=0.005))
        best = next(c for c in candidates if c.hypothesis.effect == winner)
        nothing = Candidate(Hypothesis("", "none", ()), base.free, base, base.misfit[:, None])
        stages.append(Stage(nothing, candidates, best, chance_level=0.01))
        found.append(best)
    last = Stage(replace(nothing), [])
    whole = together(problem, found[-1].fitted)
    return Selection(problem, [*stages, last], found, stages, whole.fitted, problem.fit((), {}), problem, whole)


@pytest.mark.parametrize("count", [1, 2])
def test_two_of_three_that_are_as_good_are_not_told_apart(rng, count):
    before = outcome(rng, ALONE | PAIRS)
    before = replace(before, causes=before.causes[:count], kept=before.kept[:count])
    after = beside_one_another(before)
    assert [c.hypothesis.effect for c in after.causes] == ["mass", "arm"][:count]
    tied = [[c.hypothesis.effect for c in stage.tied] for stage in after.kept]
    assert tied == ([["inertia"], ["inertia"]] if count == 2 else [[]])
    for cause, stage in zip(after.causes, after.kept):
        assert stage.winner is cause
        if count == 2:  # compared as they are beside the other, and told as a step of the search
            assert stage.tied[0].errors.mean() == pytest.approx(cause.errors.mean())
            assert any(stage is one for one in after.stages[:-1])
            assert stage.base.errors.mean() > 4.0 * cause.errors.mean()
    assert after.stages[-1] is before.stages[-1]


@pytest.mark.parametrize(
    ("change", "ends", "tied"),
    [
        ({"arm inertia": 1.5}, {}, [[], ["inertia"]]),
        ({"inertia mass": 1.5}, {}, [["inertia"], []]),
        ({}, {"inertia": 1.0}, [[], []]),
        ({}, {"inertia": 0.0}, [[], []]),
    ],
    ids=["worse beside the arm", "worse beside the mass", "at the end of its range", "nothing of it"],
)
def test_what_is_worse_there_or_none_at_all_is_no_rival(rng, change, ends, tied):
    after = beside_one_another(outcome(rng, ALONE | PAIRS | change, ends))
    assert [[c.hypothesis.effect for c in stage.tied] for stage in after.kept] == tied


def test_what_a_rule_refused_alone_is_not_asked(rng):
    before = outcome(rng, ALONE | PAIRS)
    for stage in before.stages:
        for c in stage.candidates:
            c.doubt = "it is none" if c.hypothesis.effect == "inertia" else ""
    assert [stage.tied for stage in beside_one_another(before).kept] == [[], []]
