"""A command that acts late: what a controller faster than its log holds, and a delay, are one number."""

import numpy as np
import pytest

from selflock.diagnosis.residuals.whole import HOLD
from selflock.diagnosis.search.fit import fit
from selflock.diagnosis.search.hypotheses import Free
from selflock.diagnosis.search.step import delayed
from selflock.fmus.effect import DELAY, LAG

ROW = 3e-3  # s
TIME = np.arange(0.0, 3.0, ROW)
HELD, FILTER = Free(HOLD, 0.25 * ROW, 0.0, ROW, "s"), Free("recorder.controller.filter", 0.0, 0.0, 1e-2, "s")
LATE = Free("controller.command_delay", 0.0, 0.0, 0.1, "s", role=DELAY)


@pytest.fixture
def late(rng):
    """A command logged as it was asked, and what acted of it: s by which it was late, and what is left of it for a lateness."""
    total = rng.uniform(1.3, 3.0) * ROW
    acted = lambda t: np.sin(2.0 * np.pi * t) + 0.4 * np.sin(7.0 * np.pi * t)
    seen = acted(TIME - total) + 1e-3 * rng.standard_normal(len(TIME))
    return total, lambda values: seen - acted(TIME - values.get(HOLD, 0.0) - values.get(LATE.name, 0.0))


def test_a_delay_is_told_whole_and_not_beside_what_a_fast_controller_holds(late):
    total, misfit = late
    rows = np.ones(len(TIME), bool)
    base = fit(misfit, {}, (HELD,), {HOLD: HELD.nominal}, rows, np.inf)
    assert base.values[HOLD] == pytest.approx(ROW, rel=1e-3)  # as much as it may
    free, begin = delayed(base, (LATE,), {**base.values, LATE.name: 1e-4})
    found = fit(misfit, begin, (*free, LATE), begin, rows, np.inf)
    assert found.values == {LATE.name: pytest.approx(total, abs=1e-4)}


def test_other_causes_leave_what_a_controller_holds_free(late):
    base = fit(late[1], {}, (HELD, FILTER), {HOLD: HELD.nominal, FILTER.name: 0.0}, np.ones(len(TIME), bool), np.inf)
    lag, begin = (
        Free("sensor.load.angle.lag_time", 0.0, 0.0, 1.0, "s", role=LAG),
        {**base.values, "sensor.load.angle.lag_time": 1e-3},
    )
    assert delayed(base, (lag,), begin) == (base.free, begin)
