"""Distances: how long errors last, what a distance makes likely, and that a model is no rival of itself."""

import numpy as np
import pytest
from scipy.signal import lfilter
from scipy.stats import norm

from selflock.diagnosis.planning.rivals import Planned, _lasting
from selflock.diagnosis.rules import RULES


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
    distances = np.array([[0.0, 4.0, 1.0], [4.1, 0.0, 3.0], [1.2, 3.0, 0.0]])
    planned = Planned(one, one, one, [], distances, np.zeros((3, 3)))
    assert planned.least == 0.5
    assert planned.decided[0, 2] == pytest.approx(norm.cdf(0.5)) and planned.decided[0, 1] == pytest.approx(norm.cdf(2.0))


@pytest.mark.parametrize("share", [0.0, 0.02, 0.2])
def test_a_rival_is_beaten_as_often_as_a_distance_and_the_share_that_is_asked_for_say(share, rng):
    """Two known means a distance d apart, white noise: how often the wrong one leaves more by this share of the noise's energy."""
    rows, d = 40, 1.5
    apart = rng.standard_normal(rows)
    apart *= d / np.sqrt(apart @ apart)
    noise = rng.standard_normal((20_000, rows))
    right = np.mean(((noise - apart) ** 2).sum(1) - (noise**2).sum(1) > share * rows)
    one, pair = np.zeros(3), np.array([[0.0, d], [d, 0.0]])
    planned = Planned(one, one, one, [], pair, share * rows * (pair > 0.0))
    assert right == pytest.approx(planned.decided[0, 1], abs=5.0 * np.sqrt(0.25 / 20_000))


def test_a_pair_that_nothing_tells_apart_does_not_cost_the_others():
    """Of two runs that leave a pair tied the one that decides the other two is the better, though it tells that pair less."""
    one = np.zeros(3)
    pairs = lambda tied, other: np.array([[0.0, tied, other], [tied, 0.0, other], [other, other, 0.0]])
    asked = np.full((3, 3), 20.0)
    useless, useful = (Planned(one, one, one, [], pairs(*far), asked) for far in ((1.0, 2.0), (0.9, 9.0)))
    assert useful.least < useless.least and useful.worth > useless.worth


def test_what_differs_by_less_than_is_asked_for_stays_tied_however_long_the_run_is():
    """A tenth of the noise apart in every row is a share of 0.01 of its energy: below the 0.02 that is asked for."""
    one = np.zeros(3)
    decided = []
    for rows in (1e2, 1e4):
        d = np.sqrt(0.01 * rows)
        pair = np.array([[0.0, d], [d, 0.0]])
        decided.append(Planned(one, one, one, [], pair, np.full((2, 2), RULES.search.matters * rows)).decided[0, 1])
    assert decided[1] < decided[0] < 0.5 and decided[1] < 1e-3
