"""The controller: eq 21 and 22, letting go at rest, and its effects."""

import math

import pytest
from hypothesis import given
from hypothesis import strategies as st

from selflock.fmus.controller import pd
from selflock.fmus.reducer.wedge import static_friction, tangent_force

small = st.floats(-0.2, 0.2)


def run(p, inputs, steps, h=1e-3):
    """Voltages at 0, h, 2 h … for inputs(t)."""
    s = pd.start(p, *inputs(0.0))
    _, out = pd.advance(p, s, *inputs(0.0), 0.0)
    voltages = [out.voltage]
    for n in range(steps):
        s, out = pd.advance(p, s, *inputs(n * h), h)
        voltages.append(out.voltage)
    return voltages


@given(small, st.floats(-2.0, 2.0).filter(lambda w: w != 0.0), small, st.floats(-2.0, 2.0))
def test_eq_21_and_22(wanted, wanted_speed, angle, speed):
    p = pd.Parameters()
    u = 400.0 * (wanted - angle) + 20.0 * (wanted_speed - speed)
    assert run(p, lambda t: (wanted, wanted_speed, angle, speed, 50.0 * speed, 0.0), 1)[1] == min(max(u, -24.0), 24.0)


def test_voltage_rises_towards_the_set_point():
    """Positive gains stabilise: the sign is that of what is missing."""
    assert run(pd.Parameters(), lambda t: (0.01, 1.0, 0.0, 0.0, 1.0, 0.0), 1)[1] > 0.0


@pytest.mark.parametrize("h", [1e-3, 1e-2, 0.05])
def test_irreversible_lets_go_linearly(h):
    p = pd.Parameters(release_time=0.3)
    voltages = run(p, lambda t: (0.01, 0.0, 0.0, 0.0, 0.0, 7.0), round(0.5 / h), h)
    for n, voltage in enumerate(voltages):
        assert voltage == pytest.approx(4.0 * max(0.0, 1.0 - n * h / 0.3), abs=1e-12)


def test_letting_go_waits_for_the_stop_and_goes_on_from_there():
    p = pd.Parameters(release_time=0.3)

    def inputs(t):
        moving = 1.0 if t < 0.1 or 0.2 < t < 0.25 else 0.0
        return (0.01, 0.0, 0.0, 0.0, moving, 0.0)

    voltages = run(p, inputs, 502)
    assert voltages[50] == 4.0
    assert voltages[250] == pytest.approx(4.0 * 0.5, abs=0.03)
    assert voltages[500] == 0.0


def test_eq_22_returns_with_the_set_point():
    p = pd.Parameters()
    voltages = run(p, lambda t: (0.01, 1e-9 if t >= 0.5 else 0.0, 0.0, 0.0, 0.0, 0.0), 502)
    assert voltages[500] == 0.0 and voltages[501] == pytest.approx(4.0)


@pytest.mark.slow
@given(st.floats(-50.0, 50.0), st.floats(1e-4, 0.019), st.floats(0.0, 0.05))
def test_reversible_holds_with_the_least_voltage(load, mu, preload):
    p = pd.Parameters(irreversible=0.0, friction_static=mu, preload=preload, hold_margin=0.0)
    voltage = run(p, lambda t: (0.0, 0.0, 0.0, 0.0, 0.0, load), 400)[-1]
    torque = voltage * p.torque_constant / p.resistance
    t = 1.0 / p.gear_ratio

    def holds(force):
        wanted = tangent_force(force, load, t)
        return abs(static_friction(force, load, mu, preload, t) - wanted) <= 1e-9 * (1.0 + abs(wanted))

    if abs(voltage) < 24.0:
        assert holds(torque)
        assert torque == 0.0 or not holds(torque * 0.999 - math.copysign(1e-6, torque))  # a little less would not do
        if preload == 0.0 and abs(load) > 1e-3:
            assert abs(voltage) > 0.0 and torque * load > 0.0
            assert torque == pytest.approx(load * math.tan(math.atan(t) - math.atan(mu)), rel=1e-9)


def test_without_friction_nothing_is_let_go():
    p = pd.Parameters(irreversible=0.0, friction_static=0.0)
    assert run(p, lambda t: (0.01, 0.0, 0.0, 0.0, 0.0, 10.0), 500)[-1] == 4.0


def test_without_load_it_is_let_go_as_with_a_little():
    p = pd.Parameters(irreversible=0.0, friction_static=0.01)
    last = [run(p, lambda t: (0.01, 0.0, 0.0, 0.0, 0.0, load), 500)[-1] for load in (-1e-9, 0.0, 1e-9)]
    assert last == pytest.approx([0.0, 0.0, 0.0], abs=1e-6)


def test_hold_margin_stays_inside_the_cone():
    p = pd.Parameters(irreversible=0.0, friction_static=0.01, hold_margin=0.1)
    for load in (-20.0, 20.0):
        torque, width = pd.hold_torque(p, load)
        edge, _ = pd.hold_torque(p._replace(hold_margin=0.0), load)
        assert abs(torque) == pytest.approx(abs(edge) + 0.1 * width)


def test_dead_zone():
    flat = pd.Parameters(dead_zone=2.0)
    jump = pd.Parameters(dead_zone=2.0, dead_zone_share=0.0)
    for error, straight, jumping in ((0.004, 0.0, 0.0), (0.01, 2.0, 4.0), (-0.01, -2.0, -4.0), (9.0, 22.0, 24.0)):
        assert pd.feedback(flat, 1.0, error, 0.0, 0.0, 0.0) == pytest.approx(straight)
        assert pd.feedback(jump, 1.0, error, 0.0, 0.0, 0.0) == pytest.approx(jumping)


def test_saturation():
    assert pd.feedback(pd.Parameters(saturation_factor=0.5), 1.0, 9.0, 0.0, 0.0, 0.0) == 12.0


@pytest.mark.parametrize("h", [1e-3, 2.5e-3, 1e-2])
def test_sampling_holds_between_samples(h):
    p = pd.Parameters(sample_period=0.01)
    voltages = run(p, lambda t: (0.01 * t, 1.0, 0.0, 0.99, 50.0, 0.0), round(0.1 / h), h)
    per_sample = round(0.01 / h)
    assert len(set(voltages)) >= 10
    assert all(len(set(voltages[n : n + per_sample])) == 1 for n in range(0, len(voltages) - 1, per_sample))


def test_sampling_does_not_drift():
    p, h = pd.Parameters(sample_period=0.01), 1e-3
    s = pd.start(p, 0.0, 1.0, 0.0, 1.0, 50.0, 0.0)
    changes = []
    for n in range(50000):
        before = s.command
        s, _ = pd.advance(p, s, 1e-6 * n, 1.0, 0.0, 1.0, 50.0, 0.0, h)
        if s.command != before:
            changes.append(n)
    assert {later - earlier for earlier, later in zip(changes, changes[1:])} == {10}


@pytest.mark.parametrize(("delay", "h"), [(0.02, 1e-3), (0.02, 7e-3), (0.005, 0.02), (0.1, 1e-4)])
def test_delay_of_a_ramp_is_exact(delay, h):
    """A command that is a ramp comes out as the same ramp, late."""
    p = pd.Parameters(command_delay=delay, voltage_max=1e9)

    def inputs(t):  # given at t, the command is that of the end of the step
        return (t, 1.0, 0.0, 1.0, 50.0, 0.0)

    steps = round(0.5 / h)
    voltages = run(p, inputs, steps, h)
    for n in range(steps // 2, steps):
        if n * h > 2 * delay + 2 * h:
            assert voltages[n] == pytest.approx(400.0 * ((n - 1) * h - delay), rel=1e-9)


def test_delay_converges_with_the_step():
    """A sine late by the delay, better with smaller steps."""
    p, errors = pd.Parameters(command_delay=0.02), []
    for h in (4e-3, 2e-3, 1e-3):
        steps = round(1.0 / h)
        voltages = run(p, lambda t: (0.05 * math.sin(5.0 * (t + h)), 1.0, 0.0, 1.0, 50.0, 0.0), steps, h)
        errors.append(max(abs(voltages[n] - 20.0 * math.sin(5.0 * (n * h - 0.02))) for n in range(steps // 2, steps)))
    assert errors[-1] < 20.0 * (5.0 * 0.02 / 8) ** 2


@pytest.mark.parametrize("delay", [1e-9, 1e-15, 1e-22])
def test_a_delay_of_next_to_nothing_is_none_and_ends(delay):
    """Its delay line moves on by more slots in a step than a float counts."""
    p, inputs = pd.Parameters(command_delay=delay, voltage_max=1e9), lambda t: (t, 1.0, 0.0, 1.0, 50.0, 0.0)
    assert run(p, inputs, 20, 1e-3) == pytest.approx(run(pd.Parameters(voltage_max=1e9), inputs, 20, 1e-3), rel=1e-2)
