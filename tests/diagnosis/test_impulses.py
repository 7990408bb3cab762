"""The other plant: its own physics, and what the diagnosis makes of it. `python -m benchmarks.impulses` asks each cause."""

from __future__ import annotations

import math

import numpy as np
import pytest

from selflock.diagnosis import diagnose

from .plant import impulses


def test_its_friction_holds_what_locks_itself_and_slides_by_the_law_of_the_wedge(rng):
    """A shaft at rest under its load stays there without a volt (12); at even speed the current is that of (2), (3), (13)."""
    s = impulses.sheet(rng)
    s |= {"friction": 1.2 * s["tangent"], "angle_gain": 1e-9, "speed_gain": 1e-9}
    n = 100_000
    still = impulses.simulate(s, (np.full(n, 0.8), np.zeros(n)), 10, 100, 0.0)
    assert np.ptp(still[1:, 3]) < 1e-3 * s["ratio"]
    s |= {"friction": 0.5 * s["tangent"], "angle_gain": 200.0, "speed_gain": 2.0, "supply": 1e3}
    rate, time = 0.2, impulses.STEP * np.arange(3 * n)
    even = impulses.simulate(s, (0.3 + rate * time, np.full(3 * n, rate)), 1, 100, 0.0)[-1]
    torque = s["mass"] * impulses.GRAVITY * s["arm"] * math.sin(even[5])
    needs = torque * math.tan(math.atan(s["tangent"]) + math.atan(s["friction"])) / (s["ratio"] * s["tangent"])
    assert even[2] * s["constant"] == pytest.approx(needs, rel=0.02)


@pytest.mark.slow
@pytest.mark.parametrize("faulty", [False, True])
def test_a_sound_drive_has_no_cause(faulty, rng, tmp_path):
    case = impulses.hide([], impulses.DEVELOPMENT + int(rng.integers(20)), 8.0, faulty)
    print(case.seed, case.faults)
    rig, train, test = case.write(tmp_path)
    result = diagnose(rig, train, test=[test], out=None, seed=case.seed)
    assert result.verdict == "none", result.summary()


@pytest.mark.in_turn
@pytest.mark.slow
def test_a_play_is_found_to_a_tenth_of_what_is_hidden(tmp_path):
    case = impulses.hide(["reducer.backlash"], impulses.DEVELOPMENT + 1, 10.0)
    rig, train, test = case.write(tmp_path)
    result = diagnose(rig, train, test=[test], out=None, seed=1)
    assert result.causes and result.causes[0].label == "reducer backlash", result.summary()
    assert result.causes[0].parameters["reducer.backlash"]["value"] == pytest.approx(case.true["play"], rel=0.1)


@pytest.mark.in_turn
@pytest.mark.slow
@pytest.mark.parametrize("seed", [310, 320])
def test_a_strong_wave_is_found_with_as_many_in_a_turn_as_it_has(seed, tmp_path):
    """It bends the motion so far that a linear look sees fewer, and the gear's ripple where it is the motor's.

    Not so of every drive: what else was seen is in docs/recordings.md, third plant.
    """
    case = impulses.hide(["motor.cogging"], impulses.DEVELOPMENT + seed, 8.0)
    rig, train, test = case.write(tmp_path)
    result = diagnose(rig, train, test=[test], out=None, seed=case.seed)
    assert result.causes and result.causes[0].label == "motor cogging", result.summary()
    assert result.causes[0].parameters["motor.cogging_periods"]["value"] == pytest.approx(case.true["cogging_order"], rel=1e-3)
