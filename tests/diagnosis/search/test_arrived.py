"""A log was recorded in one way, whatever is wrong with its drive: what one fit found of that, others begin with."""

from __future__ import annotations

from dataclasses import replace
from math import inf

import numpy as np
import pytest

from selflock.diagnosis.rules import RULES
from selflock.diagnosis.search.arrived import arrived, read_as
from selflock.diagnosis.search.candidate import Candidate
from selflock.diagnosis.search.fit import fit
from selflock.diagnosis.search.hypotheses import Free, Hypothesis

SHIFT = Free("recorder.load.angle.shift", 0.0, -2.0, 2.0)
AMOUNTS = {name: Free(name, 0.0, 0.0, 5.0) for name in ("reducer.viscous_damping", "load.damping")}
TIME, BLOCKS = np.linspace(0.0, 6.0, 240), 12


class Read:
    """A wave that comes and goes, read late: of that there is a valley in each of its periods. What the amounts do is nearly the same."""

    rows = np.ones(len(TIME), bool)

    def __init__(self, rng):
        self.amount, self.shift = rng.uniform(1.0, 2.0), rng.uniform(0.2, 0.3)
        self.measured = self.read({"reducer.viscous_damping": self.amount, SHIFT.name: self.shift})
        self.measured = self.measured + 1e-3 * rng.standard_normal(len(TIME))

    def read(self, values):
        t = TIME - values.get(SHIFT.name, 0.0)
        damped = values.get("load.damping", 0.0) * (1.0 + 0.02 * np.cos(3.0 * t))
        return (values.get("reducer.viscous_damping", 0.0) + damped) * np.exp(-(((t - 3.0) / 1.2) ** 2)) * np.sin(2.0 * np.pi * t)

    def misfit(self, values):
        return self.measured - self.read(values)

    def loss(self, misfit):
        return float((misfit**2).sum())

    def fit(self, free, start):
        rules = RULES.search
        return fit(self.misfit, start, free, start, self.rows, inf, rules.effort, rules.tolerances_whole, True)

    def to_its_end(self, fitted):
        return fitted

    def of(self, name, shift):
        """A fit of this amount from such a reading on."""
        return self.fit((SHIFT, AMOUNTS[name]), {SHIFT.name: shift, name: self.amount})

    def candidate(self, name, fitted):
        losses = (fitted.misfit.reshape(BLOCKS, -1) ** 2).mean(1)[:, None]
        component, _, effect = name.partition(".")
        return Candidate(Hypothesis(component, effect, (AMOUNTS[name],)), (AMOUNTS[name],), fitted, losses)


@pytest.fixture
def problem(rng):
    return Read(rng)


def test_a_fit_in_a_far_valley_of_the_recorder_is_made_again_from_a_nearer_one(problem):
    """And one that is in the nearest is left as it is."""
    wrong, right = problem.of("reducer.viscous_damping", problem.shift + 0.95), problem.of("load.damping", problem.shift)
    assert wrong.values[SHIFT.name] > problem.shift + 0.5
    again = read_as(problem, wrong, right)
    assert again.values[SHIFT.name] == pytest.approx(problem.shift, abs=1e-3)
    assert again.values["reducer.viscous_damping"] == pytest.approx(problem.amount, rel=1e-2)
    assert read_as(problem, right, wrong) is right


def test_a_nearer_valley_is_seen_from_a_start_that_leaves_hardly_less(problem):
    """It is at the rim of that valley; what a start leaves says little of where a fit ends."""
    wrong = problem.of("reducer.viscous_damping", problem.shift + 0.95)
    left = problem.loss(wrong.misfit)
    of = lambda shift: problem.loss(problem.misfit(wrong.values | {SHIFT.name: shift}))
    rim = max(s for s in problem.shift + np.linspace(0.0, 0.5, 5000) if of(s) < left)
    assert (1.0 - RULES.search.matters) * left < of(rim)
    other = replace(problem.of("load.damping", problem.shift), values={SHIFT.name: float(rim)})
    assert problem.loss(read_as(problem, wrong, other).misfit) < 0.1 * left


def test_which_cause_is_best_hangs_on_no_valley_that_its_fit_ended_in(problem):
    """The right one ended in a far one, and is best once it is read as the other; both ways round."""
    fits = problem.of("reducer.viscous_damping", problem.shift + 0.95), problem.of("load.damping", problem.shift)
    both = [problem.candidate(name, fitted) for name, fitted in zip(AMOUNTS, fits)]
    assert both[0].errors.mean() > both[1].errors.mean()
    made = lambda c, fitted: problem.candidate(f"{c.hypothesis.component}.{c.hypothesis.effect}", fitted)
    for candidates in (both, both[::-1]):
        found = arrived(problem, candidates, made)
        assert min(found, key=lambda c: c.errors.mean()).hypothesis.effect == "viscous_damping"
        assert all(c.fitted.values[SHIFT.name] == pytest.approx(problem.shift, abs=1e-2) for c in found)
