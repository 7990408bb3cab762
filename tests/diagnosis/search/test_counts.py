"""What a diagnosis costs, in simulations, which do not depend on the machine: a bound is between what is and its double."""

from collections import Counter

import numpy as np
import pytest

from selflock.diagnosis import diagnose
from selflock.diagnosis.residuals import kernels
from selflock.diagnosis.residuals.experiment import Experiment
from selflock.diagnosis.search import problem as ground
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
