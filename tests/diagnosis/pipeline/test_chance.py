"""Chance from simulated logs: a draw holds no effect, is made of the log's own errors, is the same anywhere."""

import json
from functools import partial

import numpy as np
import pandas as pd
import pytest

from selflock.diagnosis import DataError
from selflock.diagnosis.data import rig as rigs
from selflock.diagnosis.data.log import read
from selflock.diagnosis.pipeline.chance import ChanceStudy, chance
from selflock.sweep import SweepError, map_runs

RIG = """
[rig]
kind = "inverse"
known = ["load.*", "reducer.gear_ratio", "reducer.shaft_inertia"]
[columns]
"reducer.input_speed" = "speed"
"motor.torque" = "torque"
[parameters]
"reducer.gear_ratio" = 50.0
"reducer.friction_kinetic" = 0.03
"reducer.shaft_inertia" = 1e-4
"load.inertia" = 0.05
"load.constant_torque" = 2.0
"""
STEP, NOISE = 1e-3, 1e-4  # s, N.m
DRAWS = 3


def write(folder, viscous=0.0):
    """A log by the wedge's closed form (eq 2-13) and noise, with torque proportional to speed if that is hidden."""
    (folder / "rig.toml").write_text(RIG)
    time = np.arange(2500) * STEP
    speed, acceleration = 60.0 * np.sin(1.3 * time), 78.0 * np.cos(1.3 * time)
    load = 2.0 + 0.05 * acceleration / 50.0
    alpha, phi = np.arctan(1 / 50.0), np.arctan(0.03)
    torque = load * np.where(load * speed > 0.0, np.tan(alpha + phi), np.tan(alpha - phi)) + 1e-4 * acceleration
    torque += viscous * speed + NOISE * np.random.default_rng(1).standard_normal(len(time))
    pd.DataFrame({"time": time, "speed": speed, "torque": torque}).to_csv(folder / "log.csv", index=False)
    return folder / "rig.toml", [folder / "log.csv"]


@pytest.mark.slow
def test_a_draw_is_the_base_simulation_and_the_errors_in_another_order(tmp_path):
    rig, logs = write(tmp_path, viscous=1e-5)
    rig = rigs.load(rig)
    study = ChanceStudy(rig, read(logs[0], rig), [False], 0).open()
    study.measured()
    drawn = study.without_effect(np.random.default_rng(3))
    problem, train = study.problem, study.problem.train
    base = problem.fit(problem.base_free, problem.nominal).values
    errors = drawn.misfit(base).reshape(problem.shape)
    match = [[np.allclose(abs(e), abs(block)) for block in study.left[train]] for e in errors[train]]
    assert np.array_equal(np.sum(match, 0), np.ones(train.sum())) and np.array_equal(np.sum(match, 1), np.ones(train.sum()))
    assert not np.allclose(errors[train], study.left[train])
    other = {**base, "reducer.viscous_damping": 2e-5}
    assert not np.allclose(problem.misfit(other), problem.misfit(base))
    np.testing.assert_allclose(drawn.misfit(other) - drawn.misfit(base), problem.misfit(other) - problem.misfit(base), atol=1e-9)


@pytest.mark.in_turn
@pytest.mark.slow
def test_what_is_hidden_beats_chance_and_noise_does_not(tmp_path):
    found = chance(*write(tmp_path, viscous=1e-5), draws=DRAWS)
    assert found.by_chance(found.full) == 1 / (1 + DRAWS) and found.gain > 10.0 * found.full.max()
    nothing = chance(*write(tmp_path), draws=DRAWS)
    assert nothing.gain < 3.0 * nothing.full.max()  # one draw more


@pytest.mark.in_turn
@pytest.mark.slow
def test_the_same_draws_wherever_they_are_made_and_more_of_them_later(tmp_path):
    rig, logs = write(tmp_path, viscous=1e-5)
    out = tmp_path / "out"
    spread = partial(map_runs, sources=("selflock.diagnosis", "selflock.fmus"), growing=True, workers=0)
    few = chance(rig, logs, draws=1, out=out, spread=spread)
    more = chance(rig, logs, draws=2, out=out, spread=spread)
    assert more.draws == chance(rig, logs, draws=2).draws and more.draws[:1] == few.draws
    said = json.loads((out / "chance.json").read_text())
    assert said["full"]["draws"] == 2 and said["hypothesis"] == more.hypothesis and (out / "chance.png").exists()
    with pytest.raises(SweepError, match="it differs in log"):
        chance(*write(tmp_path), draws=1, out=out, spread=spread)


def test_a_system_of_fmus_has_no_contest(tmp_path):
    (tmp_path / "rig.toml").write_text('[rig]\nsystem = "chain.toml"\nnamed = true\n')
    (tmp_path / "chain.toml").write_text('[components.motor]\nfmu = "selflock:Motor"\n')
    with pytest.raises(DataError, match="no search of hypotheses"):
        chance(tmp_path / "rig.toml", [tmp_path / "log.csv"])
