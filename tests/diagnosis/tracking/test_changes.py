"""Changes beyond chance: rare where nothing changes, found where something does, with the right amount and time."""

import numpy as np
import pytest
from scipy.stats import linregress

from selflock.diagnosis.tracking.changes import GROWTH, STEP, _fitted, changes
from selflock.diagnosis.tracking.series import Series


@pytest.mark.alike
@pytest.mark.parametrize("kind", [{}, {"units": 1}, {"units": 3, "months": 5}, {"season": 0.1}, {"tail": 4}, {"scatter": 0.0}])
def test_drives_that_do_not_change_are_not_named(fleet, kind):
    named = sum(bool(changes(fleet(**kind)).changes) for _ in range(8))
    assert named <= 3  # each with a chance of 1 % at most: 4 of 8 once in a million times


def test_what_wears_is_named_and_nothing_else(fleet):
    worn = {2: lambda t: 0.5 * np.clip((t - 4.0) / 7.0, 0.0, None), 5: lambda t: -0.4 * (t > 6.5)}
    series = fleet(worn=worn, season=0.1)
    found = {one.unit: one for one in changes(series).changes}
    assert set(found) == {"2", "5"}
    grown, stepped = found["2"], found["5"]
    assert (grown.shape, stepped.shape) == (GROWTH, STEP)
    assert grown.amount / grown.before == pytest.approx(0.5, abs=0.12)
    assert stepped.amount / stepped.before == pytest.approx(-0.4, abs=0.1)
    assert grown.low < grown.amount < grown.high
    assert abs(grown.since - 20_120.0) < 65.0 and abs(stepped.since - 20_210.0) < 4.0


def test_what_all_units_do_at_once_is_no_change_of_one(fleet):
    (watched,) = changes(fleet(units=30, season=0.2)).numbers
    days, shared = watched.shared
    expected = 0.2 * np.sin((days - 20_000.0) / 60.0)
    assert shared - shared.mean() == pytest.approx(expected - expected.mean(), abs=0.03)
    assert watched.relative and watched.scatter == pytest.approx(0.02, rel=0.35)


def test_the_scatter_is_that_beyond_the_intervals(fleet):
    worn = {k: lambda t: 0.1 * t for k in range(5)} | {7: lambda t: 1.0 * (t > 6)}  # neither drift nor a step is scatter
    (watched,) = changes(fleet(units=60, worn=worn, scatter=0.03)).numbers
    assert watched.scatter == pytest.approx(0.03, rel=0.25)
    (watched,) = changes(fleet(units=60, scatter=0.0)).numbers
    assert watched.scatter < 0.006


def test_one_log_that_went_wrong_is_set_aside_wherever_it_is(fleet):
    series = fleet()
    for unit, place in ((1, 0), (4, 6), (6, -1)):
        series[unit].value[place] *= 1.6
    found = changes(series)
    assert not found.changes
    aside = {unit: np.flatnonzero(x).tolist() for unit, x in found.numbers[0].aside.items() if x.any()}
    assert aside == {"1": [0], "4": [6], "6": [11]}


def test_a_drive_alone_is_named_by_its_own_scatter(rng):
    value = np.where(np.arange(12) < 6, 1.0, 1.3) + 0.02 * rng.standard_normal(12)
    one = Series("a", "p", "Ohm", 30.0 * np.arange(12), value, np.full(12, 0.005))
    (found,) = changes([one]).changes
    assert found.shape == STEP and found.since == 180.0
    few = Series("a", "p", "Ohm", one.time[4:7], value[4:7], one.error[4:7])
    assert changes([few]).tried == 0


def test_amounts_are_those_of_least_squares(rng):
    x, y = rng.uniform(size=9), rng.uniform(size=9)
    expected = linregress(x, y)
    amount, before, sigma = _fitted(x[None], y, np.full(9, 1e6))  # weights so great that the scatter is the fit's own
    assert (amount[0], before[0]) == pytest.approx((expected.slope, expected.intercept))
    assert sigma[0] == pytest.approx(expected.stderr)


def test_values_near_zero_change_by_amounts_and_not_by_shares(fleet):
    series = [
        Series(s.unit, s.parameter, "N.m", s.time, s.value - (s.unit == "0") * np.median(s.value), s.error)
        for s in fleet(scatter=0.01)
    ]
    (watched,) = changes(series).numbers
    assert not watched.relative and set(watched.size.values()) == {1.0}
