"""learnt.py: a curve that is found again, and a file that is an effect like any other."""

import numpy as np
import pytest

from selflock.diagnosis.data.log import read
from selflock.diagnosis.data.rig import load
from selflock.diagnosis.judge.depends import Dependence
from selflock.diagnosis.output import learnt
from selflock.diagnosis.pipeline import hold_out
from selflock.diagnosis.residuals.drive_experiment import DriveExperiment
from selflock.fmus import laws
from selflock.master.compiled import compiled

from ..plant import bench
from ..plant.outside import OF_A_USER


def samples(rng, function, noise=0.01):
    x = rng.uniform(-1.0, 2.0, 6000)
    return learnt.Samples(x, function(x) + noise * rng.standard_normal(len(x)), np.arange(len(x)) // 300)


def test_a_curve_between_knots_is_found_with_the_error_that_it_tells(rng):
    tent = lambda x: 0.3 * np.maximum(1.0 - abs(x - 0.5) / 0.75, 0.0)  # bends at knots of 5, 9 and 17
    curve = learnt.learn(samples(rng, tent), "output position")
    assert curve.share > 0.95
    assert np.all(abs(curve.torque - tent(curve.knots)) < 8.0 * np.maximum(curve.errors, 5e-4))
    assert curve(np.array([-50.0, 50.0])) == pytest.approx([curve.torque[0], curve.torque[-1]])  # constant beyond


def test_of_noise_nothing_is_predicted(rng):
    curve = learnt.learn(samples(rng, np.zeros_like), "speed")
    assert curve.share < 0.03


def test_a_place_without_samples_has_no_knot(rng):
    some = samples(rng, np.sin)
    gap = abs(some.x) > 0.4
    curve = learnt.learn(learnt.Samples(some.x[gap], some.torque[gap], some.block[gap]), "speed")
    assert not np.any(abs(curve.knots) < 0.2) and curve.share > 0.9


@pytest.mark.parametrize("variable", learnt.AXES)
@pytest.mark.parametrize("wraps", [False, True])
@pytest.mark.slow
def test_the_file_is_an_effect_and_gives_the_curve(tmp_path, variable, wraps, monkeypatch):
    monkeypatch.setenv("SELFLOCK_CACHE", str(tmp_path / "cache"))
    curve = learnt.Curve(variable, wraps, np.array([-1.0, 0.5, 2.0]), np.array([0.1, -0.2, 0.4]), np.full(3, 0.01), 0.9)
    (tmp_path / "mine").mkdir()
    (tmp_path / "mine" / learnt.NAME).write_text(learnt.source(curve, 0.2, 0.1))
    with laws.joined(tmp_path / "mine"):
        law = compiled("selflock.fmus.reducer.law") if variable == "load" and not wraps else laws.module("reducer.law")
        for at in (-3.0, -1.0, 0.0, 1.7, 2.0, 9.0):
            x = law.Condition(1.0, at, at, at, at, at, 0.0, 0.0)
            given = law._torque(law.Parameters(learnt_torque=2.0), x)
            assert given == pytest.approx(2.0 * curve(np.mod(at, 2.0 * np.pi) if wraps else at), rel=1e-5)


@pytest.mark.slow
def test_a_hidden_tooth_is_learnt_from_a_log(tmp_path, monkeypatch):
    monkeypatch.setattr(bench, "DRAWS", OF_A_USER)
    case = bench.hide(["reducer.tooth"], seed=2, target=5.0)
    rig_file, train, test = case.write(tmp_path)
    rig = load(rig_file)
    runs = [*read(train, rig), *read(test, rig)]
    experiment = DriveExperiment(rig, runs)
    blocks, _ = hold_out.split(experiment, runs, [False, True])
    goes_with = [Dependence(variable, "gear", 0.5, 0.01) for variable in ("current", "speed", "output position")]
    told = learnt.write_learnt(experiment, {}, goes_with, blocks, tmp_path)
    assert told["over"] == "output position" and told["after"] < 0.6 * told["before"]
    with laws.joined(_alone(tmp_path)):
        law = laws.module("reducer.law")
        places = np.linspace(told["low"], told["high"], 400)
        p = law.Parameters(learnt_torque=1.0)
        torque = np.array([law._torque(p, law.Condition(1.0, 0.0, 0.0, x, 0.0, 0.0, 0.0, 0.0)) for x in places])
    truth, sign = case.truth, np.sign(case.truth.tooth)
    assert places[(sign * torque).argmax()] == pytest.approx(truth.tooth_place + 0.5 * truth.tooth_length, abs=0.1)
    assert (sign * torque).max() == pytest.approx(abs(truth.tooth), rel=0.25)
    assert learnt.write_learnt(experiment, {}, [Dependence("current", "gear", 0.5, 0.01)], blocks, tmp_path) is None


def _alone(folder):
    (folder / "mine").mkdir()
    (folder / learnt.NAME).rename(folder / "mine" / learnt.NAME)
    return folder / "mine"
