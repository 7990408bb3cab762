"""The load against a fine integration, energy, and closed forms."""

import math

import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.integrate import solve_ivp

from selflock.fmus.load import load


def run(p, torque, stop, h):
    s = load.start(p)
    for _ in range(round(stop / h)):
        s, out = load.advance(p, s, torque, h)
    return s, out


@given(st.floats(-5.0, 5.0), st.floats(0.05, 2.0))
def test_without_gravity_a_held_torque_gives_a_parabola(torque, inertia):
    p = load.Parameters(inertia=inertia, start_speed=1.0)
    s, _ = run(p, torque, 0.5, 0.1)
    assert s.speed == pytest.approx(1.0 + torque / inertia * 0.5, rel=1e-12)
    assert s.angle == pytest.approx(0.5 + 0.5 * torque / inertia * 0.25, rel=1e-12, abs=1e-12)


@pytest.mark.parametrize("h", [1e-3, 1e-2, 0.1])
def test_pendulum_against_a_fine_integration(h):
    p = load.Parameters(
        mass=2.0, damping=0.3, constant_torque=0.4, tilt_error=0.1, arm_error=0.02, mass_error=0.1, inertia_error=0.05
    )
    inertia = 0.15 + 2.1 * 0.22**2

    def motion(t, y):
        return [y[1], (1.5 - 2.1 * 9.81 * 0.22 * math.cos(y[0] + 0.1) - 0.3 * y[1] - 0.4) / inertia]

    exact = solve_ivp(motion, (0.0, 1.0), [0.0, 0.0], rtol=1e-12, atol=1e-12).y[:, -1]
    s, out = run(p, 1.5, 1.0, h)
    assert (s.angle, s.speed) == pytest.approx(tuple(exact), rel=1e-5, abs=1e-6)
    assert out.acceleration == pytest.approx(motion(1.0, exact)[1], rel=1e-4)


def test_energy_of_a_swinging_mass_is_kept():
    p = load.Parameters(mass=1.0, inertia=0.0, arm=0.5)
    s, _ = run(p, 0.0, 20.0, 0.1)
    energy = 0.5 * 0.25 * s.speed**2 + 9.81 * 0.5 * math.sin(s.angle)
    assert energy == pytest.approx(0.0, abs=1e-4 * 9.81)


def test_balanced_arm_stays():
    p = load.Parameters(mass=1.0, arm=0.3)
    s, out = run(p, 9.81 * 0.3, 10.0, 0.01)
    assert (s.angle, s.speed) == (0.0, 0.0) and out.load_torque == pytest.approx(9.81 * 0.3)
