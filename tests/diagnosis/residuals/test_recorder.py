"""Over how many rows a speed is a difference of counts is read from what its spectrum lacks, whatever the log has lost."""

from pathlib import Path

import numpy as np
import pytest

from selflock.diagnosis.data.differenced import SpeedRows, difference, over_losses
from selflock.diagnosis.data.log import MeasuredRun
from selflock.diagnosis.data.rig import LogColumn, Rig
from selflock.diagnosis.data.values import resolution
from selflock.diagnosis.residuals.drive_experiment import DriveExperiment
from selflock.diagnosis.residuals.recorder import counts, step_of

from .test_row_by_row import DRIVE

STEP, COUNT, LENGTH = 1e-3, 2.0 * np.pi / 4000.0, 8000


def speed(rng, rows):
    """A shaft's speed in rad/s as a difference of counts over `rows` (none: as it is), read by a recorder with its own clock."""
    time = STEP * np.arange(LENGTH)
    waves = [(rng.uniform(1.0, 8.0), rng.uniform(0.3, 3.0), rng.uniform(0.0, 6.0)) for _ in range(5)]
    angle = sum(size * np.sin(2.0 * np.pi * often * time + phase) for size, often, phase in waves)
    if not rows:
        return time, np.gradient(angle, STEP)
    counted = COUNT * np.floor(angle / COUNT)
    return time, np.concatenate([np.zeros(rows), counted[rows:] - counted[:-rows]]) / (rows * STEP)


def faulty(rng, time, x):
    """Clipped, with corrupted rows, some that are no number, and two that lack."""
    good = np.ones(LENGTH, bool)
    clipped = abs(x) > np.quantile(abs(x), 0.93)
    good[clipped] = False
    good[wrong := rng.integers(2000, 6000, 3)] = False
    good[wrong[0] : wrong[0] + 7] = False
    x = np.interp(time, time[good], x[good])  # as a channel is bridged
    there = np.ones(LENGTH, bool)
    there[3000:3002] = False
    return time[there], x[there], good[there]


@pytest.mark.parametrize("rows", [2, 3, 5, 9])
@pytest.mark.parametrize("own", [0.0, COUNT], ids=["alone", "beside its angle"])
def test_the_rows_of_a_difference_are_read_from_a_faulty_log(rng, rows, own):
    time, x = speed(rng, rows)
    assert difference([SpeedRows(x, np.ones(LENGTH, bool), time)], own)[1] == rows
    time, x, good = faulty(rng, time, x)
    assert difference([SpeedRows(x, good, time)], own)[1] == rows


@pytest.mark.parametrize("rows", [0, 1, 4])
def test_a_difference_is_told_by_its_angle_whatever_the_clock_says(rng, rows):
    """A small controller's: rows of some 20 ms in whole ms, a speed of its own clock; of a speed that is none (0) nothing is told."""
    step, count = 0.02, 2.0 * np.pi / 4096.0
    true = 0.05 + step * np.arange(1500) + rng.uniform(0.0, 1e-3, 1500)
    where = np.arange(true[0] - 0.1, true[-1] + 0.1, 1e-4)
    waves = [(rng.uniform(0.02, 0.2), rng.uniform(0.1, 0.5), rng.uniform(0.0, 6.0)) for _ in range(3)]
    angle = sum(size * np.sin(2.0 * np.pi * often * where + phase) for size, often, phase in waves)
    told = count * np.floor(np.interp(true, where, angle) / count)
    if rows:
        x = np.append(np.zeros(rows), (told[rows:] - told[:-rows]) / (true[rows:] - true[:-rows]))
    else:
        x = np.interp(true, where, np.gradient(angle, where)) + 0.02 * rng.standard_normal(1500)
    run = SpeedRows(np.round(x, 3), np.ones(1500, bool), np.floor(1e3 * true) * 1e-3, told)
    assert difference([run], count)[1] == rows


def test_a_simulated_angle_that_creeps_is_no_number_of_counts(rng):
    """It creeps by nearly the same in most rows, which is then the least step between its values; its speed is no difference."""
    time = STEP * np.arange(LENGTH)
    x = 1e-6 * (1.0 + 1e-3 * np.sin(time)) + np.where(
        abs(time - 4.0) < 0.5, np.cos(np.pi * (time - 4.0)) ** 2 * rng.uniform(1.0, 9.0), 0.0
    )
    angle = np.cumsum(x) * STEP
    own = resolution(angle)
    assert own < 1.1e-9
    assert difference([SpeedRows(x, np.ones(LENGTH, bool), time, angle)], own) == (0.0, 0)


def test_what_is_no_difference_is_told_as_none(rng):
    time, x = speed(rng, 0)
    assert difference([SpeedRows(x + 0.1 * rng.standard_normal(LENGTH), np.ones(LENGTH, bool), time)]) == (0.0, 0)


def test_runs_tell_together_what_each_is_too_short_to_tell(rng):
    """Pieces of a log: one alone has too few rows for a spectrum in which the zeros could be seen."""
    time, x = speed(rng, 5)
    pieces = [slice(a, a + 200) for a in rng.choice(np.arange(50, LENGTH - 200), 30, replace=False)]
    runs = [SpeedRows(x[part], np.ones(200, bool), time[part]) for part in pieces]
    assert np.mean([difference([run])[1] == 5 for run in runs]) < 0.9
    assert difference(runs)[1] == 5


def test_a_run_that_passes_over_every_other_count_has_the_encoder_of_the_others(rng):
    """It turns two counts a row; the other, slower, tells what they are, and both that its speed is a difference over 10 rows."""
    time, rows, count = STEP * np.arange(LENGTH), 10, 2.0 * np.pi / 12738.0
    slow = rng.uniform(0.5, 2.0) * np.sin(2.0 * np.pi * rng.uniform(0.05, 0.2) * time)
    runs = []
    for angle in (count * np.floor(slow / count), 2.0 * count * np.arange(LENGTH)):
        x = np.append(np.zeros(rows), angle[rows:] - angle[:-rows]) / (rows * STEP)
        signals = {"reducer.input_angle": angle, "reducer.input_speed": x, "motor.voltage": np.sin(time)}
        runs.append(MeasuredRun("log.csv", "", np.arange(LENGTH), time, signals))
    columns = tuple(LogColumn(name, name) for name in runs[0].signals)
    rig = Rig(Path("rig.toml"), "bot", "forward", columns, DRIVE, time=LogColumn("time", "time"))
    bench = DriveExperiment(rig, runs)
    for run in (0, 1):
        assert counts("reducer.input_angle", bench.channels[run, ""])[0] == pytest.approx(count, rel=1e-6)
        assert counts("reducer.input_speed", bench.channels[run, ""]) == (pytest.approx(count, rel=1e-6), rows)


@pytest.mark.parametrize("coarse", [True, False], ids=["in steps", "in none"])
def test_the_steps_of_a_current_that_mostly_rests_are_told_by_where_it_moves(rng, coarse):
    """At rest it has one value in row after row, which lies in steps of any size: the coarsest was asked of those that move, and no other."""
    time, step = np.linspace(0.0, 20.0, 12000), rng.uniform(1.0, 1.3)
    waves = 5.0 * np.sin(2.0 * np.pi * rng.uniform(0.3, 0.6) * time + rng.uniform(0.0, 6.0)) + 0.6 * np.sin(17.0 * time)
    x = np.where((time // 2.0) % 2.0 < 1.0, 0.0, waves)
    read = lambda x: np.round((x + 0.1 * rng.standard_normal(len(x))) / 0.01) * 0.01
    found = step_of(read(step * np.round(x / step) if coarse else x), 0.01)
    assert found == (pytest.approx(step, rel=0.01) if coarse else 0.0)


def test_rows_whose_difference_goes_over_lost_rows(rng):
    time = STEP * np.append(np.arange(100), np.arange(103, 200))
    assert np.flatnonzero(over_losses(time, 4)).tolist() == [0, 1, 2, 3, 100, 101, 102, 103]
