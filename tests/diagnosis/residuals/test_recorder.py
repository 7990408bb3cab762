"""Over how many rows a speed is a difference of counts is read from what its spectrum lacks, whatever the log has lost."""

import numpy as np
import pytest

from selflock.diagnosis.residuals.recorder import _difference

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
    assert _difference(x, np.ones(LENGTH, bool), time, own)[1] == rows
    time, x, good = faulty(rng, time, x)
    assert _difference(x, good, time, own)[1] == rows


def test_what_is_no_difference_is_told_as_none(rng):
    time, x = speed(rng, 0)
    assert _difference(x + 0.1 * rng.standard_normal(LENGTH), np.ones(LENGTH, bool), time, 0.0) == (0.0, 0)
