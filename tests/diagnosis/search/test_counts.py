"""What a diagnosis costs, in simulations, which do not depend on the machine: a bound is between what is and its double."""

from collections import Counter
from types import SimpleNamespace

import numpy as np
import pytest
from numba.core import config

from selflock.diagnosis import diagnose
from selflock.diagnosis.residuals import kernels
from selflock.diagnosis.residuals.experiment import Experiment
from selflock.diagnosis.rules import RULES
from selflock.diagnosis.search import problem as ground
from selflock.diagnosis.search import step
from selflock.diagnosis.search.problem import Problem

from ..residuals.test_experiment import inverse


@pytest.mark.slow
def test_simulations_of_a_small_diagnosis(tmp_path, monkeypatch):
    """A gear's log of a third of a second, every hypothesis about it looked at, the best fitted."""
    made: Counter = Counter()

    def counted(name, function):
        def count(*given, **more):
            made[name] += 1
            return function(*given, **more)

        return count

    laws = kernels.kernels()
    for name in ("gear", "windup"):
        monkeypatch.setattr(laws, name, counted(name, getattr(laws, name)))
    monkeypatch.setattr(ground, "fit", counted("fits", ground.fit))
    monkeypatch.setattr(Experiment, "misfit", counted("asked", Experiment.misfit))
    problems, of = [], Problem.of
    monkeypatch.setattr(Problem, "of", lambda *given: (problems.append(of(*given)), problems[-1])[1])
    inverse(tmp_path, np.random.default_rng(1), friction=0.04, noise=2e-3, n=300)
    diagnose(tmp_path / "rig.toml", [tmp_path / "log.csv"], out=None, seed=3)
    hypotheses = len(problems[0].hypotheses)
    assert hypotheses > 20 and made["fits"] < 25  # 15 of them
    assert hypotheses < made["asked"] < 52 * hypotheses  # 35 for each
    assert made["gear"] < 52 * hypotheses  # 35 of these
    assert made["windup"] < 0.35 * made["gear"]  # it changes with few hypotheses, and is kept while it does not


@pytest.mark.slow
def test_a_log_too_long_to_be_remembered_is_answered_alike(tmp_path, rng, monkeypatch):
    """An hour's motions do not stay in the memory longer than they are asked for."""
    inverse(tmp_path, rng, friction=0.04, noise=2e-3, n=300)
    answers = []
    for most in (10**6, 200):
        monkeypatch.setitem(vars(RULES.residuals), "motions_remembered", most)
        found = diagnose(tmp_path / "rig.toml", [tmp_path / "log.csv"], out=None, seed=3).data()
        answers.append({what: told for what, told in found.items() if what != "rules"})
    assert answers[0] == answers[1]


@pytest.mark.parametrize(("by_channel", "long"), [(False, False), (False, True), (True, False), (True, True)])
def test_only_loops_that_are_worth_it_are_run_by_more_than_one_thread(by_channel, long, monkeypatch):
    """Those of a whole drive; of one that is too long to be remembered its motions would be there twice."""
    threads: list[int] = []
    pool = step.ThreadPoolExecutor
    monkeypatch.setattr(config, "NUMBA_NUM_THREADS", 3)  # tests are allowed one, with which all would be alike
    monkeypatch.setattr(step, "ThreadPoolExecutor", lambda most: threads.append(most) or pool(most))
    problem = SimpleNamespace(by_channel=by_channel, experiment=SimpleNamespace(long=long))
    stepping = SimpleNamespace(problem=problem, tell=lambda *told: None, _best=lambda done: "")
    assert step.Step._each(stepping, "halves", lambda x: x / 2, [1, 2, 3]) == [0.5, 1.0, 1.5]
    assert threads == [RULES.search.threads if by_channel and not long else 1]
