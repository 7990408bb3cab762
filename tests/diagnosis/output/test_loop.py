"""A whole drive extended: the FMUs, coupled from the set-points of the log, are what the fit promised, to what their step allows."""

from dataclasses import replace

import numpy as np
import pytest

from selflock.diagnosis.data.faults import check
from selflock.diagnosis.data.log import read
from selflock.diagnosis.data.rig import load
from selflock.diagnosis.output import loop
from selflock.diagnosis.output.extend import extend
from selflock.diagnosis.residuals import whole
from selflock.diagnosis.residuals.drive_experiment import DriveExperiment
from selflock.diagnosis.residuals.mending import Mending

from ..plant import bench

SEED = 10_001
COGGING = {"motor.cogging_torque": 0.02, "motor.cogging_periods": 6.0, "motor.cogging_phase": 1.0}


def extended(folder, values, without=()):
    """What is told of an extended drive with these values; its log lacks some channels."""
    rig, train, _ = bench.hide([], seed=SEED, duration=4.0).write(folder)
    rig = replace(load(rig), simulate=whole.WHOLE)
    (run,) = read(train, rig)
    check([run], rig)
    run = replace(run, signals={name: x for name, x in run.signals.items() if name not in without})
    experiment = DriveExperiment(rig, [run])
    (folder / "out").mkdir()
    residual = next(one for one in experiment.residuals if one.output == "motor.current")
    mending = Mending(experiment, residual, {}, values, np.ones(experiment.layout.count, bool))
    return experiment, extend(mending, folder / "out", [])


@pytest.mark.slow
@pytest.mark.parametrize(
    "values, without",
    [
        ({"motor.brush_voltage": 0.5, whole.HOLD: 1e-3}, ()),
        (COGGING, ()),  # over the rotor's angle, which the motor's FMU counts from the start
        ({"sensor.load.angle.bias": 0.02, "controller.command_delay": 0.004}, ()),  # a sensor in the loop
        ({"controller.sample_period": 0.005}, ()),
        ({}, ("load.angle", "load.speed")),  # the loop closes over the motor's encoder
    ],
    ids=["brushes", "cogging", "sensor", "period", "encoder"],
)
def test_the_coupled_fmus_are_what_the_fit_promised(values, without, tmp_path):
    experiment, told = extended(tmp_path, values, without)
    assert told["agrees"] and told["system"] == "extended.toml" and told["seconds"] == pytest.approx(3.0)
    assert [row["channel"] for row in told["channels"]] == [one.output for one in experiment.residuals]
    for row in told["channels"]:
        spread = np.std(experiment.runs[0].signals[row["channel"]])
        assert row["difference"] < 0.03 * spread, row  # 0.013 at most, of a current, over these five
    assert told["fmu"] == pytest.approx(told["promised"], rel=0.1)


@pytest.mark.slow
def test_fmus_that_do_something_else_are_told(tmp_path, monkeypatch):
    monkeypatch.setattr(loop, "_phases", lambda *given: {})
    _, told = extended(tmp_path, COGGING)
    assert not told["agrees"]


@pytest.mark.slow
def test_a_log_with_rows_without_power_is_not_run_again(tmp_path):
    rig, train, _ = bench.hide([], seed=SEED, duration=2.0).write(tmp_path)
    rig = replace(load(rig), simulate=whole.WHOLE)
    (run,) = read(train, rig)
    powered = np.append(0.0, np.ones(len(run) - 1))
    experiment = DriveExperiment(rig, [replace(run, signals=run.signals | {loop.VALID: powered})])
    assert loop.run_again(experiment, {}, tmp_path / "none.toml", experiment.residuals[0]) == {}
