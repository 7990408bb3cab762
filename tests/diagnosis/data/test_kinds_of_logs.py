"""Logs that are no motion with a torque: a clamped output, a loop of which only the motion was kept, points judged by a motion."""

import re

import numpy as np
import pandas as pd
import pytest

from selflock import diagnosis
from selflock.diagnosis import DataError
from selflock.diagnosis.data import rig as rigs
from selflock.diagnosis.data.gathered import gathered
from selflock.diagnosis.residuals.drive_experiment import DriveExperiment

RATIO, STIFFNESS, PLAY = 50.0, 4000.0, 2e-3  # N.m/rad and rad at the output
CLAMPED = """
[rig]
kind = "inverse"
[columns]
"reducer.input_angle" = "motor"
"load.angle" = "output"
"motor.torque" = "torque"
[parameters]
"reducer.gear_ratio" = 50.0
"""


def clamped(folder, noise: float):
    """A slow torque to and fro on a gear whose output is held: its twist is the spring's, and half of the play to each side."""
    t = np.arange(4000) * 0.005
    torque = 0.4 * np.sin(1.1 * t)  # at the motor
    twist = torque * RATIO / STIFFNESS + 0.5 * PLAY * np.sign(torque)
    rng = np.random.default_rng(2)
    table = pd.DataFrame(
        {"time": t, "motor": 0.3 + RATIO * twist, "output": 0.01 + noise * rng.standard_normal(len(t)), "torque": torque}
    )
    table.to_csv(folder / "clamped.csv", index=False)
    (folder / "rig.toml").write_text(CLAMPED)
    return folder / "rig.toml", folder / "clamped.csv"


@pytest.mark.parametrize("noise", [0.0, 2e-5])
@pytest.mark.parametrize("call", ["replay", "diagnose"])
def test_a_clamped_output_is_told_with_its_stiffness_and_its_play(call, noise, tmp_path):
    rig, log = clamped(tmp_path, noise)
    with pytest.raises(DataError, match="'output' .load.angle. stands still .* the output is clamped") as caught:
        diagnosis.replay(rig, log, out=None) if call == "replay" else diagnosis.diagnose(rig, [log], out=None)
    stiffness, play = map(
        float, re.search(r"about (\S+) N.m/rad of stiffness at the output and (\S+) rad of play", str(caught.value)).groups()
    )
    assert stiffness == pytest.approx(STIFFNESS, rel=0.02) and play == pytest.approx(PLAY, rel=0.1)


def test_a_gear_that_drives_its_load_is_not_clamped(tmp_path):
    rig, log = clamped(tmp_path, 0.0)
    table = pd.read_csv(log)
    table.assign(output=table.motor / RATIO).to_csv(log, index=False)
    assert len(gathered(log, rigs.load(rig))[0]) == 1


@pytest.mark.slow
def test_a_closed_loop_is_simulated_without_a_column_of_what_drives_it(tmp_path):
    """Set-points and motion alone: the controller's voltage is the simulated one."""
    t = np.arange(1500) * 0.002
    wanted = 0.3 * np.sin(2.0 * t)
    pd.DataFrame({"time": t, "goal": wanted, "angle": 0.3 * np.sin(2.0 * (t - 0.01))}).to_csv(tmp_path / "log.csv", index=False)
    (tmp_path / "rig.toml").write_text(
        '[rig]\nkind = "forward"\nsimulate = "closed"\n[columns]\n"controller.angle_setpoint" = "goal"\n"load.angle" = "angle"\n'
        '[parameters]\n"reducer.gear_ratio" = 50.0\n"load.inertia" = 0.05\n'
    )
    rig = rigs.load(tmp_path / "rig.toml")
    runs, _ = gathered(tmp_path / "log.csv", rig)
    (residual,) = DriveExperiment(rig, runs).residuals
    assert residual.kind == "drive" and residual.output == "load.angle" and residual.components[0] == "controller"
    (comparison,) = diagnosis.replay(rig, tmp_path / "log.csv", out=None).comparisons
    assert 0.0 < comparison.relative < 0.5  # it goes where it is sent


def test_points_at_constant_speed_are_not_judged_by_a_motion(tmp_path):
    rows = [(k, 0.01 * j, s, 0.01 * np.sign(s)) for k, s in enumerate((-5.0, -2.0, 2.0, 5.0)) for j in range(50)]
    pd.DataFrame(rows, columns=["run", "time", "n", "m"]).to_csv(tmp_path / "points.csv", index=False)
    t = np.arange(500) * 0.01
    pd.DataFrame({"time": t, "n": np.sin(t), "m": np.cos(t)}).to_csv(tmp_path / "motion.csv", index=False)
    (tmp_path / "rig.toml").write_text(
        '[rig]\nkind = "steady"\nrun = "run"\n[columns]\n"reducer.input_speed" = "n"\n"motor.torque" = "m"\n[parameters]\n"reducer.gear_ratio" = 50.0\n'
    )
    with pytest.raises(DataError, match='motion.csv: there is no column .run.*kind = "inverse".*selflock replay'):
        diagnosis.diagnose(tmp_path / "rig.toml", [tmp_path / "points.csv"], test=[tmp_path / "motion.csv"], out=None)
