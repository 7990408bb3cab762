"""Set-points of a planned run keep to what they are allowed, however they are drawn."""

import numpy as np
import pytest

from selflock.diagnosis.planning.moves import Design, Limits, setpoint

LIMITS = (
    Limits(-1.0, 1.5, speed=2.0, acceleration=20.0, duration=8.0),
    Limits(0.2, 0.25, speed=5.0, acceleration=3.0, duration=4.0),
    Limits(-300.0, 300.0, speed=0.5, acceleration=100.0, duration=12.0),
)


@pytest.mark.parametrize("limits", LIMITS, ids=["arm", "hardly any way", "winch"])
def test_a_run_keeps_to_its_limits(limits, rng):
    design, step = Design.draw(rng), 0.002
    for _ in range(12):
        time, angle, speed = setpoint(design, limits, step)
        assert len(time) == len(angle) == len(speed) == round(limits.duration / step) + 1
        # a row's rounding: the last piece of a move ends within a step
        slack = limits.speed * step
        assert limits.low - slack <= angle.min() and angle.max() <= limits.high + slack
        assert abs(speed).max() <= limits.speed * (1.0 + 1e-9)
        assert abs(np.diff(speed)).max() <= 1.5 * limits.acceleration * step + 1e-12
        assert speed[0] == speed[-1] == 0.0
        assert np.allclose(np.diff(angle), 0.5 * (speed[1:] + speed[:-1]) * step)
        design = design.mutated(rng)


def test_a_run_begins_where_it_is_told_to(rng):
    _, angle, _ = setpoint(Design.draw(rng), LIMITS[0], 0.01, start=0.3)
    assert angle[0] == 0.3


def test_runs_differ(rng):
    first, second = (setpoint(Design.draw(rng), LIMITS[0], 0.01)[1] for _ in range(2))
    assert not np.allclose(first, second)
