"""Set-points between rows: straight, but where they jump."""

import numpy as np
import pytest

from selflock.diagnosis.residuals.set_points import about, between, jumps, leaps, upright

TIME = np.arange(1000) * 1e-3


def test_a_step_is_a_jump_and_a_motion_is_none(rng):
    at, height = int(rng.integers(5, 990)), rng.uniform(1e-3, 1.0)
    assert jumps(np.where(np.arange(1000) >= at, height, 0.0), TIME).tolist() == [at]
    assert jumps(0.3 * np.sin(7.0 * TIME) + np.where(np.arange(1000) >= at, 0.2, 0.0), TIME).tolist() == [at]
    for motion in (np.sin(7.0 * TIME), np.clip(TIME - 0.3, 0.0, 0.2), np.abs(TIME - 0.4), np.zeros(1000)):
        assert not len(jumps(motion, TIME))


def test_what_goes_in_counts_all_the_time_does_not_jump():
    assert not len(jumps(np.floor(TIME / 0.017) * 1e-3, TIME))


def test_what_moved_through_a_gap_did_not_jump():
    kept = (TIME < 0.4) | (TIME > 0.6)
    assert not len(jumps(TIME[kept], TIME[kept]))


def test_between_rows_a_set_point_is_straight_and_held_before_its_jump(rng):
    fine = np.sort(rng.uniform(0.0, 0.999, 5000))
    motion = 0.3 * np.sin(7.0 * TIME)
    assert np.array_equal(between(fine, TIME, motion), np.interp(fine, TIME, motion))
    stepped = np.where(np.arange(1000) >= 400, 1.0, 0.0)
    assert np.array_equal(between(fine, TIME, stepped), np.where(fine >= TIME[400], 1.0, 0.0))
    at = TIME[400] - 0.3e-3
    assert np.array_equal(between(fine, TIME, stepped, {400: 0.3}), np.where(fine >= at, 1.0, 0.0))


@pytest.mark.parametrize("table", ["held", "straight"])
def test_a_measured_voltage_jumps_within_its_messages(table, rng):
    """Sent every two rows, with noise, held in between or straight: the jump lies between the two rows that are told."""
    at, noise = rng.uniform(0.3, 0.7), 0.01
    sent = np.arange(rng.uniform(0.0, 2e-3), 1.1, 2e-3)
    told = np.where(sent >= at, 9.0, -3.0) + noise * rng.standard_normal(len(sent))
    x = np.interp(TIME, sent, told) if table == "straight" else told[np.maximum(np.searchsorted(sent, TIME, side="right") - 1, 0)]
    ((first, last),) = leaps(x, TIME)
    assert (
        TIME[first] < at <= TIME[last] + 0.1 * 2e-3 and last - first <= 5
    )  # a tenth of it, and so of a message, may lie beside it
    assert x[first] == pytest.approx(-3.0, abs=1.2 + 6.0 * noise) and x[last] == pytest.approx(9.0, abs=1.2 + 6.0 * noise)
    assert not len(leaps(3.0 * np.sin(40.0 * TIME) + noise * rng.standard_normal(1000), TIME))


def test_straight_lines_draw_jumps_where_rows_are_put_before_them(rng):
    fine = np.sort(rng.uniform(0.0, 0.999, 5000))
    asked = np.where(np.arange(1000) >= 400, 1.0, 0.2 * TIME), np.sin(7.0 * TIME)
    for sooner, rows in ({}, 1001), ({400: 0.3}, 1002), ({400: 0.99}, 1002):
        lines = lambda when, sooner=sooner: np.stack([between(when, TIME, x, sooner) for x in asked])
        jumped = np.array([TIME[400] - 1e-3 * sooner.get(400, 0.0)])
        drawn, columns = upright(TIME, jumped, lines)
        assert np.all(np.diff(drawn) > 0.0) and len(drawn) == rows
        away = abs(fine - jumped[0]) > 2e-6
        for x, column in zip(asked, columns):
            apart = abs(np.interp(fine, drawn, column) - between(fine, TIME, x, sooner))[away]
            assert apart.max() < 1e-4, sooner


@pytest.mark.parametrize("late, last", [(0.0, 400), (4.5e-3, 404)])
def test_rows_that_a_jump_may_have_reached(late, last):
    assert np.flatnonzero(about(np.array([[399, 400]]), TIME, late)).tolist() == list(range(399, last + 1))
