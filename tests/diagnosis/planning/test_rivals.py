"""Distances: how long errors last, what a distance makes likely, and that a model is no rival of itself."""

import numpy as np
import pytest
from scipy.signal import lfilter
from scipy.stats import norm

from selflock.diagnosis.planning.rivals import Planned, _lasting


@pytest.mark.parametrize("ahead", [0.0, 0.5, 0.9])
def test_how_long_errors_last_is_that_of_a_first_order_process(ahead, rng):
    """(1 + a) / (1 - a) of x' = a x + e, in the mean of 24 draws.

    One of 5000 rows has a standard error of sqrt(2 (2 M + 1) / n) of it (Sokal 1997), a third with M some 150 lags; five times
    the mean's, 0.07, are 0.35.
    """
    draws = lfilter([1.0], [1.0, -ahead], rng.standard_normal((24, 5_000)))
    expected = (1.0 + ahead) / (1.0 - ahead)
    assert np.mean([_lasting(x) for x in draws]) == pytest.approx(expected, rel=0.35)


def test_errors_that_alternate_last_for_one():
    assert _lasting(np.tile([1.0, -1.0], 50)) == 1.0


def test_the_pair_that_is_hardest_to_tell_apart_decides():
    one = np.zeros(3)
    planned = Planned(one, one, one, [], np.array([[0.0, 4.0, 1.0], [4.1, 0.0, 3.0], [1.2, 3.0, 0.0]]))
    assert planned.least == 1.0
    assert planned.decided[0, 2] == pytest.approx(norm.cdf(0.5)) and planned.decided[0, 1] == pytest.approx(norm.cdf(2.0))


def test_the_ratio_of_likelihoods_is_as_likely_right_as_a_distance_says(rng):
    """Two known means a distance d apart, white noise: the nearer one is the right one with probability Phi(d / 2)."""
    apart = rng.standard_normal(40)
    d = 1.5
    apart *= d / np.sqrt(apart @ apart)
    noise = rng.standard_normal((20_000, 40))
    right = np.mean(((noise**2).sum(1)) < ((noise - apart) ** 2).sum(1))
    assert right == pytest.approx(norm.cdf(0.5 * d), abs=5.0 * np.sqrt(0.25 / 20_000))
