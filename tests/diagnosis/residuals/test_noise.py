"""The noise floor against noise that is known: white, under a slow error, held, quantised, smoothed; steady-state points."""

import numpy as np
import pandas as pd
import pytest

from selflock.diagnosis.data import rig as rigs
from selflock.diagnosis.data.faults import check
from selflock.diagnosis.data.log import read
from selflock.diagnosis.residuals.channels import smooth
from selflock.diagnosis.residuals.drive_experiment import DriveExperiment
from selflock.diagnosis.residuals.noise import floor, of_bins, of_quiet_bins, of_rows, of_samples, resolution
from selflock.diagnosis.rules import RULES

N = 20_000
SIGMA = 0.03


def found(error, **more):
    return of_samples([error], [np.ones(len(error), bool)], **more)


def test_white_noise_under_a_slow_error(rng):
    slow = 5.0 * np.sin(np.linspace(0.0, 30.0, N))
    assert found(slow + SIGMA * rng.standard_normal(N)) == pytest.approx(SIGMA, rel=0.05)


@pytest.mark.parametrize("length", [2, 8, 20])
def test_a_held_value_is_one_sample_of_noise(rng, length):
    assert found(np.repeat(SIGMA * rng.standard_normal(N), length)) == pytest.approx(SIGMA, rel=0.05)


def test_a_table_that_goes_straight_between_messages_is_as_noisy_as_it_is(rng):
    """Between messages at any phase, of one row and of two; the mean square of a line through two of them is told, and of white noise its own."""
    slow, trusted = 0.3 * np.sin(np.linspace(0.0, 30.0, N)), np.ones(N, bool)
    assert of_rows([slow + SIGMA * rng.standard_normal(N)], [trusted]) == pytest.approx(SIGMA, rel=0.05)
    for period in (1.0, 2.0):
        sent = np.arange(-rng.uniform(0.0, period), N + 2.0, period)
        noise = np.interp(np.arange(N), sent, SIGMA * rng.standard_normal(len(sent)))
        assert of_rows([slow + noise], [trusted]) == pytest.approx(np.sqrt(np.mean(noise**2)), rel=0.1), (period, sent[0])


@pytest.mark.parametrize("sigma", [0.0, 0.5, 3.0])
def test_rounding_is_noise_whether_or_not_other_noise_dithers_it(rng, sigma):
    """q / sqrt(12) beside the other noise (Widrow), of a value that needs 25 samples from one step to the next."""
    quantum = 0.04
    true = np.linspace(0.0, 0.04 * quantum * N, N) + sigma * quantum * rng.standard_normal(N)
    read = quantum * np.round(true / quantum)
    assert resolution(read) == pytest.approx(quantum, rel=1e-6)
    expected = quantum * np.hypot(sigma, 1.0 / np.sqrt(12.0))
    error = read - np.linspace(0.0, 0.04 * quantum * N, N)
    assert np.std(error) == pytest.approx(expected, rel=0.05)
    assert found(error, quantum=quantum) == pytest.approx(expected, rel=0.1)


def test_beyond_the_reach_of_smoothing(rng):
    error = smooth(SIGMA * rng.standard_normal(N), 21)
    assert found(error, reach=21) == pytest.approx(np.std(error), rel=0.1)


def test_samples_that_are_not_trusted_do_not_count(rng):
    error, good = SIGMA * rng.standard_normal(N), rng.random(N) > 0.1
    error[~good] = 1e3
    assert of_samples([error], [good]) == pytest.approx(SIGMA, rel=0.05)


@pytest.mark.parametrize("reach", [1, 11])
def test_a_fast_wave_is_no_noise_where_it_is_slow_in_some_blocks(rng, reach):
    """A wave of the rotor's angle is fast where the rotor is: only slow blocks tell it from noise."""
    speed = np.concatenate([np.full(12, 0.01), np.linspace(0.5, 2.5, 24)])[rng.permutation(36), None]  # rad a bin
    noise = np.array([smooth(row, reach) for row in rng.standard_normal((36, 400))])[:, 100:300]
    lag, present = 1 + reach if reach > 1 else 1, np.ones((36, 200), bool)
    alone = of_bins(noise, present, False, lag)
    waving = noise + 6.0 * noise.std() * np.sin(speed * np.arange(200) + rng.uniform(0.0, 6.0, (36, 1)))
    assert of_bins(waving, present, False, lag) > 2.0 * alone
    assert of_quiet_bins(noise, present, lag) == pytest.approx(alone, rel=0.25)
    assert of_quiet_bins(waving, present, lag) < 1.6 * alone


def test_no_noise_has_no_floor():
    assert found(np.zeros(N)) == 0.0 and found(np.zeros(3)) == 0.0


RIG = """
[rig]
kind = "steady"
{run}
[columns]
"reducer.input_speed" = "speed"
"motor.torque" = "torque"
[parameters]
"reducer.gear_ratio" = 50.0
"load.constant_torque" = 2.0
"""


def steady(folder, table, run=""):
    (folder / "rig.toml").write_text(RIG.format(run=run))
    table.to_csv(folder / "log.csv", index=False)
    rig = rigs.load(folder / "rig.toml")
    runs = read(folder / "log.csv", rig)
    check(runs, rig)
    bench = DriveExperiment(rig, runs)
    return floor(bench, bench.residuals[0], {}, [], [])


@pytest.mark.slow
def test_points_that_are_runs_have_the_standard_error_of_their_mean(tmp_path, rng):
    """Also where the torque drifts within each run and its curve over speed is nobody's."""
    points, samples = 60, 400
    speed = np.repeat(np.concatenate([-np.linspace(1.0, 80.0, 30), np.linspace(1.0, 80.0, 30)]), samples)
    drift = np.tile(np.linspace(-SIGMA, SIGMA, samples), points)
    torque = np.sign(speed) * (0.1 + np.sin(speed)) + drift + SIGMA * rng.standard_normal(points * samples)
    table = pd.DataFrame(
        {
            "time": np.tile(np.arange(samples) * 1e-3, points),
            "speed": speed,
            "torque": torque,
            "run": np.repeat(np.arange(points), samples),
        }
    )
    drifting = 2.0 * SIGMA / 8.0 / 2.0  # between the halves, by the stretches a drift is one stretch earlier in one
    expected = np.hypot(SIGMA / np.sqrt(samples), drifting)
    assert steady(tmp_path, table, 'run = "run"') == pytest.approx(expected, rel=0.25)


@pytest.mark.parametrize("repeats", [1, 3])
def test_points_that_are_rows_have_the_scatter_about_their_neighbours(tmp_path, rng, repeats):
    speed = np.repeat(np.concatenate([-np.linspace(1.0, 80.0, 200), np.linspace(1.0, 80.0, 200)]), repeats)
    rng.shuffle(speed)
    torque = np.sign(speed) * (0.1 + 0.3 * np.exp(-abs(speed) / 20.0)) + SIGMA * rng.standard_normal(len(speed))
    table = pd.DataFrame({"time": np.arange(len(speed)) * 1.0, "speed": speed, "torque": torque})
    assert steady(tmp_path, table) == pytest.approx(SIGMA, rel=0.25)


@pytest.mark.parametrize("count", [300, 3000])
def test_what_is_found_scatters_as_its_rule_says(rng, count):
    of_each = [found(rng.standard_normal(count)) for _ in range(800)]  # whose own deviation is told to 2.5 %
    assert np.std(of_each) == pytest.approx(RULES.residuals.noise_scatter / np.sqrt(count), rel=0.12)


def test_noise_alone_is_hardly_above_what_all_of_it_tells(rng):
    drawn = [rng.standard_normal(500) for _ in range(600)]
    above = lambda **more: np.mean([np.std(one) > RULES.search.clean * found(one, **more) for one in drawn])
    assert above() > 0.025 and above(every=True) < 0.012  # 0.0005 of many more


@pytest.mark.parametrize("share", [0.05, 0.15])
def test_what_some_samples_change_by_for_another_reason_hides_no_more_from_all_than_the_median_may_be_off(rng, share):
    error = SIGMA * (rng.standard_normal(N) + 2.5 * np.sign(rng.standard_normal(N)) * (rng.random(N) < share))
    off = RULES.residuals.noise_off * RULES.residuals.noise_scatter / np.sqrt(N)
    assert found(error) < found(error, every=True) <= (1.001 + off) * found(error) < np.std(error)
