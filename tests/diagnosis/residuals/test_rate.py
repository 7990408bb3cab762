"""Rates behind a recorder: of rows whose stamps scatter, and of a speed that is a difference over some rows."""

import numpy as np
import pandas as pd
import pytest
from scipy.ndimage import gaussian_filter1d

from selflock.diagnosis.data import rig as rigs
from selflock.diagnosis.data.faults import check
from selflock.diagnosis.data.log import read
from selflock.diagnosis.residuals import drive
from selflock.diagnosis.residuals.channels import derivative, motion, rate, smooth
from selflock.diagnosis.residuals.drive_experiment import DriveExperiment

STEP, COUNT, ROWS = 2e-3, 2.0 * np.pi / 8000.0, 8
RIG = """
[rig]
kind = "inverse"
[columns]
"reducer.input_angle" = "angle"
"reducer.input_speed" = "speed"
"motor.torque" = "torque"
[parameters]
"reducer.gear_ratio" = 50.0
"load.constant_torque" = 2.0
"""


def test_a_shaft_that_turns_evenly_does_so_whatever_its_stamps_scatter_by(rng):
    even = STEP * np.arange(5000)
    stamps = even + STEP * rng.uniform(-0.3, 0.3, len(even))  # two that cross would make a difference of -100 times
    by_steps = derivative(smooth(3.0 * even, 11), stamps)
    assert by_steps[20:-20].mean() > 1.08 * 3.0  # what it was: 1.126, deviation 0.003 over draws
    assert rate(3.0 * even, stamps, 11)[20:-20].mean() == pytest.approx(3.0, rel=2e-3)
    moved = motion(3.0 * even, None, np.diff(stamps, prepend=stamps[0]), 11)
    assert moved.speed[20:-20].mean() == pytest.approx(3.0, rel=2e-3)


@pytest.mark.parametrize("rows, samples", [(3000, 31), (2048, 9), (40, 39), (40, 40)])
def test_what_is_smoothed_is_scipy_s_gaussian_average_to_the_bit(rng, rows, samples):
    x = rng.standard_normal(rows)
    assert np.array_equal(smooth(x[::-1], samples), gaussian_filter1d(x[::-1], samples / 6.0, mode="nearest", truncate=3.0))


def test_a_difference_over_some_rows_is_the_speed_of_their_middle(tmp_path):
    time = STEP * np.arange(10_000)
    angle = 30.0 * np.sin(2.0 * time) + 4.0 * np.sin(7.3 * time + 1.0)
    true = 60.0 * np.cos(2.0 * time) + 29.2 * np.cos(7.3 * time + 1.0)
    counted = COUNT * np.floor(angle / COUNT)
    speed = np.concatenate([np.zeros(ROWS), counted[ROWS:] - counted[:-ROWS]]) / (ROWS * STEP)
    (tmp_path / "rig.toml").write_text(RIG)
    pd.DataFrame({"time": time, "angle": counted, "speed": speed, "torque": 0.1 + 0.0 * time}).to_csv(
        tmp_path / "log.csv", index=False
    )
    rig = rigs.load(tmp_path / "rig.toml")
    check(runs := read(tmp_path / "log.csv", rig), rig)
    experiment = DriveExperiment(rig, runs)
    late = 0.5 * ROWS * STEP * np.std(np.gradient(true, STEP))  # what half the window leaves
    redundant = next(one for one in experiment.residuals if one.reads == ("reducer.input_angle",))
    ((simulated, measured, good),) = experiment.compare(redundant, {})
    assert np.std((measured - simulated)[good][50:]) < 0.05 * late
    assert np.std((drive.shaft("reducer.input_", {}, experiment.channels[0, ""]).speed - true)[50:-50]) < 0.05 * late
