"""A hypothesis is looked at and fitted in an excerpt of the log only where that shows what the whole log does."""

from dataclasses import replace

import numpy as np
import pytest

from selflock.diagnosis.search import look as looks
from selflock.diagnosis.search.linear import Linear
from selflock.diagnosis.search.look import Look, sights
from selflock.diagnosis.search.problem import Problem

from ..residuals.test_experiment import inverse


@pytest.fixture
def sampled(tmp_path, rng):
    """The problem of a long log of a gear, and its base fit."""
    whole = inverse(tmp_path, rng, friction=0.04, n=20_000, noise=1e-3)
    bench = type(whole)(whole.rig, whole.runs, sampled=True)
    problem = Problem.of(bench, np.ones(bench.layout.count, bool)).with_noise()
    return problem, problem.fit(problem.base_free, problem.nominal)


def looked(problem, base, hypothesis, known=None):
    linear = Linear(base.open.reshape(*problem.shape, -1), problem.taught(base.weights), problem.fold_of_block)
    return Look(problem, base, sights(problem, base), linear, known).ways(hypothesis)


def of(problem, name):
    return next(h for h in problem.hypotheses if name in [p.name for p in h.free])


@pytest.mark.slow
def test_what_has_no_memory_gains_the_same(sampled, monkeypatch):
    problem, base = sampled
    friction = of(problem, "reducer.friction_kinetic")
    near = looked(problem, base, friction)
    monkeypatch.setattr(type(problem.experiment), "excerpt", lambda experiment: experiment)
    everywhere = looked(replace(problem), base, friction)
    assert near and len(near) == len(everywhere)
    for one, other in zip(near, everywhere):
        assert one.shape == other.shape and one.gain == pytest.approx(other.gain, rel=1e-3)


@pytest.mark.slow
def test_what_an_excerpt_shows_otherwise_is_looked_at_in_the_whole_log(sampled, monkeypatch):
    """Here it is of a gear that feels half as much load again."""
    problem, base = sampled
    excerpt, friction = type(problem.experiment).excerpt, of(problem, "reducer.friction_kinetic")
    everywhere = [way.gain for way in looked(problem, base, friction)]

    def other(experiment):
        part = excerpt(experiment)
        feels = replace(part.rig, parameters={**part.rig.parameters, "load.constant_torque": 3.0})
        return part.but(channels=part._channels(replace(part.setting, rig=feels)))

    monkeypatch.setattr(type(problem.experiment), "excerpt", other)
    problem = replace(problem)  # which has made none yet
    assert [way.gain for way in looked(problem, base, friction)] == pytest.approx(everywhere, rel=1e-9)
    monkeypatch.setattr(Look, "_alike", lambda look, hypothesis, way: True)
    assert [way.gain for way in looked(problem, base, friction)] != pytest.approx(everywhere, rel=1e-6)


@pytest.mark.slow
def test_what_a_new_base_does_not_touch_is_not_looked_at_again(sampled, monkeypatch):
    problem, base = sampled
    made, plain, known, friction = [], looks.directions, {}, of(problem, "reducer.friction_kinetic")
    monkeypatch.setattr(looks, "directions", lambda *given, **more: made.append(1) or plain(*given, **more))
    first = looked(problem, base, friction, known)
    assert made and known
    made.clear()
    again = looked(problem, base, friction, known)
    assert not made and [way.gain for way in again] == [way.gain for way in first]
    other = replace(base, values={**base.values, "reducer.shaft_inertia": 2e-4})
    anew = looked(problem, other, friction, known)
    assert made and [way.gain for way in anew] == [way.gain for way in looked(problem, other, friction)]
    assert [way.gain for way in anew] != [way.gain for way in first]


def friction_fitted(problem, base):
    """A fit of the friction of all that teaches."""
    (friction,) = (p for p in of(problem, "reducer.friction_kinetic").free if p.name == "reducer.friction_kinetic")
    return problem.fit((*base.free, friction), {**base.values, friction.name: friction.nominal})


def fitted_whole(problem, base, monkeypatch):
    """The same where no excerpt is asked."""
    monkeypatch.setattr(Problem, "_told_nearby", frozenset())
    return friction_fitted(replace(problem), base)


def test_a_fit_of_an_excerpt_is_that_of_the_whole_log(sampled, monkeypatch):
    problem, base = sampled
    asked, plain = [], Problem.misfit
    monkeypatch.setattr(Problem, "misfit", lambda self, values: asked.append(values) or plain(self, values))
    near, few = friction_fitted(problem, base), len(asked)
    whole = fitted_whole(problem, base, monkeypatch)
    name = "reducer.friction_kinetic"
    assert near.values[name] == pytest.approx(whole.values[name], rel=1e-9) and near.values[name] == pytest.approx(0.04, rel=0.01)
    assert few == 1 + len(near.free) < len(asked) - few  # where it ends, and the slopes there
    np.testing.assert_array_equal(near.misfit, problem.misfit(near.values))
    np.testing.assert_allclose(near.jacobian, whole.jacobian, rtol=1e-6, atol=1e-6)


@pytest.mark.alike
@pytest.mark.parametrize("share", [0.0, 0.5])
def test_where_an_excerpt_says_otherwise_of_where_a_fit_ends_the_whole_log_is_fitted(sampled, share, monkeypatch):
    """Here it feels a share of the change alone; of none of it nothing but the slope tells."""
    problem, base = sampled
    name, plain = "reducer.friction_kinetic", Problem._nearby
    usual, asked = problem.experiment.rig.parameters[name], []

    def less(self, values):
        asked.append(values)
        return plain(self, {**values, name: usual + share * (values[name] - usual)})

    monkeypatch.setattr(Problem, "_nearby", less)
    near = friction_fitted(problem, base)
    assert asked and near.values == fitted_whole(problem, base, monkeypatch).values
