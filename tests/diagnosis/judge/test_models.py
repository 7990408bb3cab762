"""What the next run is to tell apart where a search has no answer."""

from __future__ import annotations

from types import SimpleNamespace

import numpy as np
import pytest

from selflock.diagnosis.judge.models import PLAIN, models, nearest
from selflock.diagnosis.rules import RULES
from selflock.diagnosis.search.candidate import Candidate
from selflock.diagnosis.search.hypotheses import Free, Hypothesis

PROBLEM = SimpleNamespace(base_free=(), absolute=dict)


def candidate(component, effect, numbers, error, more=()):
    """A hypothesis with numbers "name": value, fitted beside `more` ones, that leaves this error."""
    free = tuple(Free(f"{component}.{name}", 0.0, 0.0, 10.0) for name in numbers)
    values = {p.name: value for p, value in zip(free, numbers.values())}
    fit = SimpleNamespace(values=dict(more) | values)
    return Candidate(Hypothesis(component, effect, free), free, fit, np.full((3, 1), error))


def outcome(*rounds, causes=(), final=()):
    """What became of a search with these rounds of candidates."""
    stages = [SimpleNamespace(candidates=candidates) for candidates in rounds]
    return SimpleNamespace(problem=PROBLEM, stages=stages, causes=list(causes), final=SimpleNamespace(values=dict(final)))


@pytest.fixture
def viscous(rng):
    """A cause that a search found, and dropped."""
    return candidate("reducer", "viscous", {"viscous_damping": rng.uniform(1.0, 2.0)}, 0.5)


def test_what_stood_beside_a_cause_is_a_model_with_it(viscous, rng):
    """Without it, with numbers that were fitted beside it, it is a drive that nobody holds for this one."""
    found = viscous.fit.values
    late = candidate("motor", "winding", {"coefficient": rng.uniform(1.0, 2.0)}, 0.4, found)
    search = outcome([viscous], [late])
    best = outcome(causes=[viscous], final=found)
    told = {model.label: model for model in nearest(search, [viscous], best)}
    assert list(told) == ["reducer viscous", "reducer viscous and motor winding", PLAIN]
    assert told["reducer viscous"].values == found
    assert told["reducer viscous and motor winding"].values == found | late.fit.values
    assert not told[PLAIN].values


def test_more_numbers_of_a_cause_that_was_found_are_one_model_with_it(viscous, rng):
    again = candidate("reducer", "viscous", {"other_damping": rng.uniform(1.0, 2.0)}, 0.4, viscous.fit.values)
    told = nearest(outcome([viscous], [again]), [viscous], None)
    assert [model.label for model in told] == ["reducer viscous", PLAIN]
    assert told[0].values == again.fit.values and len(told[0].free) == 2


def test_a_cause_that_was_exchanged_later_is_in_no_model_of_before(viscous):
    later = candidate("load", "sag", {"arm": 1.0}, 0.3)
    told = nearest(outcome([viscous], [later]), [viscous], None)
    assert [model.label for model in told] == ["load sag", PLAIN]


def test_the_best_of_many_are_told_once_each_and_none_of_nothing(rng):
    errors = rng.permutation(6) + 1.0
    many = [candidate("load", f"law{int(e)}", {"x": 1.0}, e) for e in errors]
    best = outcome(causes=[many[int(np.argmin(errors))]])
    labels = [model.label for model in nearest(outcome(many), [], best)]
    assert labels == [*(f"load law{n + 1}" for n in range(RULES.judge.open_models)), PLAIN]
    assert nearest(outcome([]), [], None) == [] == nearest(outcome(), [], None)


@pytest.mark.parametrize("beside", [True, False])
def test_a_rival_of_one_of_two_causes_has_the_other_as_it_was_fitted_beside_it(rng, beside):
    """An inertia beside an arm of 0.025 m, which a mass had there, was another drive than beside its own of -0.031 m."""
    mass = candidate("load", "mass", {"mass_error": rng.uniform(1.0, 2.0)}, 0.2)
    arm = candidate("load", "arm", {"arm_error": 2.5}, 0.1, mass.fit.values)
    inertia = candidate("load", "inertia", {"inertia_error": 4.0}, 0.1, {"load.arm_error": 3.1} if beside else ())
    found = outcome([mass, inertia], causes=[mass, arm], final=arm.fit.values)
    found.kept = [SimpleNamespace(tied=[inertia]), SimpleNamespace(tied=[])]
    told = {model.label: model.values for model in models(found, [False, False])}
    assert told == {
        "load mass and load arm": dict(arm.fit.values),
        "load inertia and load arm": {"load.inertia_error": 4.0, "load.arm_error": 3.1 if beside else 2.5},
    }
