"""The reducer in kinematic mode: the torque that a motion imposed on its input shaft needs."""

import math

import pytest
from hypothesis import given
from hypothesis import strategies as st

from selflock.fmus.reducer import shaft, wedge

P = shaft.Parameters


@given(st.floats(0.0, 0.06), st.floats(-9.0, 9.0), st.sampled_from([0.0, 0.4, -2.0]), st.sampled_from([0.0, 0.5]))
def test_imposed_motion_needs_the_sliding_or_the_least_torque(mu, torque, speed, preload):
    p = P(friction_kinetic=mu, preload=preload, shaft_damping=0.0)
    angle = 50.0 * torque / p.shaft_stiffness
    state = shaft.start(p, angle, speed, 0.0, 0.0)
    state, out = shaft.impose(p, state, angle - speed * 1e-3, speed, 0.0, 0.0, 1e-3)
    load = out.output_torque
    assert load == pytest.approx(torque, abs=1e-9)
    if speed == 0.0:
        expected = wedge.least_torque(*wedge.cone(load, mu, preload, 0.02, 50.0))
        assert out.stuck == 1.0
    else:
        expected = wedge.sliding_torque(load, math.copysign(1.0, speed), mu, preload, 0.02, 50.0)
        assert out.stuck == 0.0
    assert out.input_torque == pytest.approx(expected, rel=1e-12, abs=1e-15)
    assert out.loss_power >= 0.0


def test_imposed_acceleration_asks_for_its_torque():
    p = P(friction_kinetic=0.01)
    state = shaft.start(p, 0.0, 1.0, 0.0, 0.02)
    state, out = shaft.impose(p, state, 0.0, 1.0, 0.0, 0.02, 1e-3)
    assert out.motor_torque_required == out.input_torque
    state, out = shaft.impose(p, state, 0.001, 1.5, 2e-5, 0.03, 1e-3)
    assert out.motor_torque_required - out.input_torque == pytest.approx(p.shaft_inertia * 0.5 / 1e-3)


def test_imposed_rest_of_a_self_locking_gear_needs_exactly_nothing():
    p = P(friction_kinetic=0.03)
    state = shaft.start(p, 0.1, 0.0, 0.0, 0.0)
    _, out = shaft.impose(p, state, 0.1, 0.0, 0.0, 0.0, 1e-3)
    assert out.output_torque > 30.0 and out.input_torque == 0.0


def test_imposed_motion_through_standstill_is_bounded_by_the_cone():
    """F jumps across w = 0 (Coulomb), yet never beyond the cone that holds at rest."""
    p = P(friction_kinetic=0.01)
    forces = []
    for speed in (-1e-9, 0.0, 1e-9):
        state = shaft.start(p, 0.01, speed, 0.0, 0.0)
        forces.append(shaft.impose(p, state, 0.01, speed, 0.0, 0.0, 1e-6)[1].input_torque)
    assert forces[0] <= forces[1] <= forces[2]


def test_dynamic_resembles_kinematic():
    """Driven by a motor torque, the sliding reducer needs what the same motion imposed on it needs."""
    p = P(friction_kinetic=0.01)
    inputs = lambda t: (0.02 + 0.01 * math.sin(9 * t), 0.4 * t, 0.4)
    state = shaft.start(p, p.gear_ratio / p.shaft_stiffness, 20.0, 0.0, 0.4)  # under 1 N.m
    imposed = shaft.start(p, state.angle, 20.0, 0.0, 0.4)
    for i in range(500):
        state, dynamic = shaft.advance(p, state, *inputs(i * 1e-4), 1e-4)
        angle = state.angle - state.speed * 1e-4
        imposed, kinematic = shaft.impose(p, imposed, angle, state.speed, *inputs(i * 1e-4)[1:], 1e-4)
        assert kinematic.input_torque == pytest.approx(dynamic.input_torque, abs=1e-12)
        assert kinematic.output_torque == pytest.approx(dynamic.output_torque, abs=1e-9)
