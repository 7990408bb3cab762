"""A hypothesis is looked at in an excerpt of the log only where that shows what the whole log does."""

from dataclasses import replace

import numpy as np
import pytest

from selflock.diagnosis.search import look as looks
from selflock.diagnosis.search.linear import Linear
from selflock.diagnosis.search.look import Look
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
    return Look(problem, base, linear, known).ways(hypothesis)


def of(problem, name):
    return next(h for h in problem.hypotheses if name in [p.name for p in h.free])


def test_what_has_no_memory_gains_the_same(sampled, monkeypatch):
    problem, base = sampled
    friction = of(problem, "reducer.friction_kinetic")
    near = looked(problem, base, friction)
    monkeypatch.setattr(type(problem.experiment), "excerpt", lambda experiment: experiment)
    everywhere = looked(problem, base, friction)
    assert near and len(near) == len(everywhere)
    for one, other in zip(near, everywhere):
        assert one.shape == other.shape and one.gain == pytest.approx(other.gain, rel=1e-3)


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
    assert [way.gain for way in looked(problem, base, friction)] == pytest.approx(everywhere, rel=1e-9)
    monkeypatch.setattr(Look, "_alike", lambda look, hypothesis, way: True)
    assert [way.gain for way in looked(problem, base, friction)] != pytest.approx(everywhere, rel=1e-6)


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
