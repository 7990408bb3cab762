"""The plant with an amplifier's cascade: its own physics, and a sound drive. `python -m benchmarks.cascade` asks each cause."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest

from selflock.diagnosis import diagnose

from .plant import cascade


def even(rng, rate, **changes):
    """Sheet and last row of a drive that its amplifier holds at an even speed, rad/s, of the load."""
    s = cascade.sheet(rng) | {"weight": 0.0} | changes
    by = replace(cascade.recorder(rng), seen=1e-9)
    n = 150_000
    return s, cascade.simulate(s, np.stack([rate * cascade.STEP * np.arange(n), np.full(n, rate)]), by)[-100:].mean(axis=0)


def test_at_even_speed_its_current_is_that_of_the_wedge(rng):
    """The preload of (13) where nothing pulls, (2) and (3) where more does; what is viscous goes with the speed."""
    s, row = even(rng, 0.3)
    preload = s["friction"] * s["preload"] * math.sqrt(1.0 + s["tangent"] ** 2)
    assert row[3] == pytest.approx(0.3 * s["ratio"], rel=1e-3) and row[1] * s["constant"] == pytest.approx(preload, rel=1e-3)
    pull = 40.0 * preload * s["ratio"]
    s, row = even(np.random.default_rng(1), 0.3, **(s | {"pull": pull, "supply": 1e4, "viscous": 1e-4}))
    wedge = pull * math.tan(math.atan(s["tangent"]) + math.atan(s["friction"])) / (s["ratio"] * s["tangent"])
    assert row[1] * s["constant"] == pytest.approx(wedge + 1e-4 * row[3], rel=1e-3)


def test_it_yields_by_less_than_a_third_of_a_milliradian_before_it_slides(rng):
    s = cascade.sheet(rng) | {"weight": 0.0, "position_gain": 0.0, "speed_gain": 0.0, "integral_gain": 0.0, "stiffness": 1e-9}
    half = 0.5 * s["friction"] * s["preload"] / s["constant"]  # A, of what would make it slide
    s |= {"cogging": half * s["constant"], "cogging_order": 0.0}  # a torque that stands
    rows = cascade.simulate(s, np.zeros((2, 100_000)), cascade.recorder(rng))
    assert 2e-5 < np.ptp(rows[:, 2]) and abs(rows[-1, 2] - rows[0, 2]) < 3e-4 and abs(rows[-1, 3]) < 1e-3


@pytest.mark.in_turn
@pytest.mark.slow
@pytest.mark.parametrize(
    "number",
    [
        *range(3),
        pytest.param(3, id="spoilt, a voltage of an instant between whose rows the amplifier acts eight times"),
    ],
)
def test_a_sound_drive_has_no_cause(number, tmp_path):
    case = cascade.hide([], cascade.DEVELOPMENT + number, 8.0, faulty=number == 3)
    rig, train, test = case.write(tmp_path)
    result = diagnose(rig, train, test=[test], out=None, seed=case.seed)
    assert result.verdict == "none", result.summary()
