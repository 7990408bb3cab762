"""The load against a fine integration, energy, and closed forms."""

import math

import pytest
from fmpy.fmi1 import FMICallException
from hypothesis import given
from hypothesis import strategies as st
from scipy.integrate import quad, solve_ivp

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


# A damper of any strength.


@given(st.floats(-3.0, 12.0), st.floats(-100.0, 100.0), st.sampled_from([1e-4, 1e-3, 0.1, 10.0]))
def test_without_gravity_the_speed_goes_exponentially_to_torque_over_damping(order, torque, dt):
    damping, inertia, speed = 10.0**order, 0.1, 3.0
    s, out = load.advance(load.Parameters(damping=damping, inertia=inertia), load.State(0.2, speed), torque, dt)
    time, terminal = inertia / damping, torque / damping
    faded = -math.expm1(-dt / time)
    scale = abs(speed) + abs(terminal)
    assert s.speed == pytest.approx(terminal + (speed - terminal) * math.exp(-dt / time), abs=1e-7 * scale)
    assert s.angle == pytest.approx(
        0.2 + terminal * dt + (speed - terminal) * time * faded, abs=1e-7 * scale * min(dt, time) + 1e-14
    )


@pytest.mark.parametrize("damping", [1e4, 1e6, 1e9, 1e12])
def test_an_arm_in_a_strong_damper_creeps_down_as_it_must(damping):
    """Without inertia b angle' = -m g d cos(angle), so that asinh(tan(angle)) falls evenly."""
    p = load.Parameters(mass=2.0, arm=0.5, inertia=0.0, damping=damping)
    dt = 0.05 * damping / 9.81
    s, _ = load.advance(p, load.State(0.6, 0.0), 0.0, dt)
    crept = math.asinh(math.tan(0.6)) - math.asinh(math.tan(s.angle))
    assert crept == pytest.approx(0.05, rel=1e-6 + 20.0 * 0.5 * 9.81 / damping**2)
    assert s.speed == pytest.approx(-9.81 / damping * math.cos(s.angle), rel=1e-5)  # of third order in the longest part


@pytest.mark.parametrize("damping, speed", [(30.0, 10.0), (300.0, -40.0), (3e4, 10.0)])
@pytest.mark.slow
def test_a_damped_arm_against_a_fine_integration(damping, speed):
    p = load.Parameters(mass=2.0, damping=damping, constant_torque=0.4)

    def motion(t, y):
        return [y[1], (3.0 - 0.4 - 2.0 * 9.81 * 0.2 * math.cos(y[0]) - damping * y[1]) / 0.18]

    def jacobian(t, y):
        return [[0.0, 1.0], [2.0 * 9.81 * 0.2 * math.sin(y[0]) / 0.18, -damping / 0.18]]

    exact = solve_ivp(motion, (0.0, 0.1), [0.3, speed], method="Radau", jac=jacobian, rtol=1e-11, atol=1e-13).y[:, -1]
    one, _ = load.advance(p, load.State(0.3, speed), 3.0, 0.1)
    s = load.State(0.3, speed)
    for _ in range(50):
        s, _ = load.advance(p, s, 3.0, 2e-3)
    for end in (one, s):
        assert tuple(end) == pytest.approx(tuple(exact), rel=1e-6, abs=1e-9)


def test_the_exact_damper_joins_the_usual_parts(monkeypatch):
    """The same step by either way, just where one takes over from the other."""
    p = load.Parameters(mass=2.0, damping=0.99 * load.FEW * load.PART * 0.18 / 0.01)
    usual, _ = load.advance(p, load.State(0.3, 5.0), 3.0, 0.01)
    monkeypatch.setattr(load, "FEW", -1)
    exact, _ = load.advance(p, load.State(0.3, 5.0), 3.0, 0.01)
    assert exact != usual and tuple(exact) == pytest.approx(tuple(usual), rel=3e-6, abs=0.0)


def test_energy_of_a_fast_mass_is_kept_by_the_other_method_too():
    """So many parts that the exact damper's method makes them, without a damper."""
    p = load.Parameters(mass=1.0, inertia=0.0, arm=0.5)
    s, _ = load.advance(p, load.State(0.0, 50.0), 0.0, 2.0)
    assert 0.125 * s.speed**2 + 4.905 * math.sin(s.angle) == pytest.approx(0.125 * 2500.0, rel=1e-7)


@pytest.mark.parametrize("z", [0.0, -1e-9, -0.3, -1.0, -1.0001, -7.0, -80.0])
def test_phi_functions_are_their_integrals(z):
    for k, found in enumerate(load._phi(z)[1:], 1):
        told = quad(lambda x: math.exp((1.0 - x) * z) * x ** (k - 1) / math.factorial(k - 1), 0.0, 1.0, epsabs=0.0, epsrel=1e-12)[
            0
        ]
        assert found == pytest.approx(told, rel=1e-11)


EXTREMES = st.sampled_from([0.0, 1e-300, 1e-12, 1e-3, 1.0, 1e3, 1e6, 1e12, 1e100, 1e300])


@given(inertia=EXTREMES, mass=EXTREMES, arm=EXTREMES, damping=EXTREMES, speed=EXTREMES, torque=EXTREMES, dt=EXTREMES)
def test_no_step_makes_more_parts_than_it_may(inertia, mass, arm, damping, speed, torque, dt):
    calls = 0

    def counting(x):
        nonlocal calls
        calls += 1
        return math.cos(x)

    p = load.Parameters(inertia=inertia, mass=mass, arm=arm, damping=damping)
    if not 0.0 < load.moment_of_inertia(p, load.start(p)) < math.inf:
        return
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(load, "cos", counting)
        try:
            load.advance(p, load.State(0.0, -speed), torque, dt)
        except (OverflowError, ValueError, ZeroDivisionError):
            pass  # beyond a float's range: the face tells it
    assert calls <= 4 * load.MOST + 10


@pytest.mark.parametrize(
    "values, torque, dt, named",
    [
        ({"mass": 1.0, "start_speed": 1e9}, 0.0, 1e-3, "speed of 1e+09 rad/s"),
        ({"mass": 1.0}, 1e15, 1e-3, "torque of 1e+15 N.m"),
        ({"mass": 1.0, "gravity": 1e18}, 0.0, 1e-3, "m g d"),
    ],
)
def test_a_step_of_too_many_parts_is_refused_with_a_reason(instance, values, torque, dt, named):
    it = instance("Load").begin(**values)
    with pytest.raises(FMICallException):
        it.step(0.0, dt, torque=torque)
    said = " ".join(it.said)
    assert named in said and "try a shorter step" in said and str(load.MOST) in said
