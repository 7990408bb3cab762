"""The error as waves over an angle: as large as they are, whatever the speed, and nothing of a shaft that rests."""

import numpy as np
import pytest

from selflock.diagnosis.output.spectrum import Way, by_chance, waves

N = 20_000
TIME = np.linspace(0.0, 10.0, N)
ANGLE = 16.0 * np.sin(1.3 * TIME) + 3.0 * np.sin(4.1 * TIME)  # to and fro, over some turns
GOOD = np.ones(N, bool)


def at(order, spectrum):
    orders, sizes = spectrum
    return sizes[int(np.argmin(abs(orders - order)))]


@pytest.mark.parametrize("order", [1.0, 7.0, 40.0])
def test_a_wave_has_its_size_at_its_order(order):
    found = waves([0.3 * np.sin(order * ANGLE + 1.0)], [Way.of(ANGLE, GOOD)])
    assert at(order, found) == pytest.approx(0.3, rel=0.1)
    away = abs(found[0] - order) > 2.0
    assert found[1][away].max() < 0.15


def test_each_run_has_its_own_phase(rng):
    angles = [ANGLE, ANGLE + 2.0]
    errors = [0.3 * np.sin(7.0 * ANGLE), 0.3 * np.sin(7.0 * ANGLE + 3.0)]
    assert at(7.0, waves(errors, [Way.of(angle, GOOD) for angle in angles])) == pytest.approx(0.3, rel=0.1)


def test_rest_and_samples_that_are_not_trusted_count_for_nothing():
    resting = np.concatenate([ANGLE, np.full(N, ANGLE[-1])])
    error = np.concatenate([0.3 * np.sin(7.0 * ANGLE), np.full(N, 50.0)])
    error[100] = np.nan
    trusted = np.isfinite(error)
    assert at(7.0, waves([error], [Way.of(resting, trusted)])) == pytest.approx(0.3, rel=0.1)


def test_what_changes_its_sign_with_the_direction_is_no_wave():
    found = waves([0.5 * np.sign(np.gradient(ANGLE)) + 0.1], [Way.of(ANGLE, GOOD)])
    assert found[1].max() < 1e-3


def test_noise_has_the_size_that_is_told(rng):
    way = Way.of(ANGLE, GOOD)
    sizes = waves([0.2 * rng.standard_normal(N)], [way])[1][1:]
    assert np.sqrt(np.mean(sizes**2)) == pytest.approx(by_chance(0.2, [way]), rel=0.2)
    assert way.turns == pytest.approx(np.ptp(ANGLE) / (2.0 * np.pi))
