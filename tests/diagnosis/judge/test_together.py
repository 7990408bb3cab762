"""The whole drive beside an answer of single parts: a right one makes its channels better, a wrong one some of them worse."""

from dataclasses import replace

import pytest

from selflock.diagnosis.data.faults import check
from selflock.diagnosis.data.log import read
from selflock.diagnosis.data.rig import load
from selflock.diagnosis.judge.together import against, asked, together
from selflock.diagnosis.residuals.drive_experiment import DriveExperiment

from ..plant import bench, score

SEEDS = range(10_002, 10_010)


def brushes(seed, folder):
    """A drive whose brushes cost a voltage that its data sheet does not tell, and that voltage."""
    case = bench.hide(["motor.brush_drop"], seed=seed, duration=6.0, target=6.0)
    rig, train, test = case.write(folder)
    rig = load(rig)
    runs = [*read(train, rig), *read(test, rig)]
    for run in runs:
        check([run], rig)
    experiment = DriveExperiment(rig, runs)
    name = score.PRODUCTS["brush_drop"]
    (amount,) = case.parameters.values()
    return experiment, experiment.layout.owner == 0, {name: float(amount)}


@pytest.fixture(scope="module")
def hidden(tmp_path_factory):
    return brushes(SEEDS[0], tmp_path_factory.mktemp("hidden"))


@pytest.mark.slow
@pytest.mark.in_turn(13)
def test_a_right_cause_makes_the_whole_drive_better(tmp_path):
    """None of them gets worse. Where a drive stops short of its set-point rounding decides, and the voltage that holds it there."""
    halved = 0
    for seed in SEEDS:
        (folder := tmp_path / str(seed)).mkdir()
        experiment, train, truth = brushes(seed, folder)
        rows = together(experiment, train, ~train, {}, truth)
        told = {row["channel"]: row for row in rows}
        assert told.keys() >= {"controller.voltage", "motor.current", "load.angle"} and not against(rows)
        voltage = told.pop("controller.voltage")
        halved += voltage["after"] < 0.5 * voltage["before"] and all(r["after"] < 2.0 * r["noise_floor"] for r in told.values())
    assert halved > len(SEEDS) / 2


@pytest.mark.slow
def test_a_wrong_cause_is_refused_by_the_channel_that_gets_worse(hidden):
    experiment, train, truth = hidden
    rows = together(experiment, train, ~train, truth, truth | {"reducer.friction_kinetic": 0.08, "reducer.friction_static": 0.08})
    assert "controller.voltage (" in against(rows) and "the whole drive gets worse in" in against(rows)


@pytest.mark.slow
def test_it_is_asked_where_parts_were_compared_and_the_loop_is_described(hidden):
    experiment, _, _ = hidden
    rig = experiment.rig
    assert asked(rig, experiment) and asked(replace(rig, simulate="parts"), experiment)
    assert not asked(replace(rig, simulate="whole"), experiment)
    without = {name: value for name, value in rig.parameters.items() if name != "controller.angle_gain"}
    assert not asked(replace(rig, parameters=without), experiment)


def test_nothing_is_said_where_no_channel_is_worse():
    row = {"channel": "motor.current", "unit": "A", "before": 1.0, "after": 1.1, "noise_floor": 1.0, "worse": False}
    assert against([row]) == against([]) == ""
    assert against([row | {"worse": True}]).endswith("gets worse in motor.current (1 -> 1.1 A)")
