"""The motor against closed forms, a fine integration and the limits L = 0 and R = 0."""

import math

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.integrate import quad, solve_ivp

from selflock.fmus.motor import dc
from selflock.fmus.motor.effects.supply_sag import supplied

positive = st.floats(1e-3, 1e3)
volts = st.floats(-50.0, 50.0).map(lambda x: x if abs(x) > 1e-200 else 0.0)  # below, products of doubles lose their digits


def stepped(p, voltage, speed, size, steps):
    s = dc.start(p)
    for _ in range(steps):
        s, out = dc.advance(p, s, voltage, speed, size)
    return s, out


@given(positive, st.floats(1e-6, 1.0), volts, st.floats(-500.0, 500.0), st.floats(1e-5, 0.1))
def test_held_step_is_the_closed_form(r, l, u, w, h):
    p = dc.Parameters(resistance=r, inductance=l)
    _, out = dc.advance(p, dc.start(p), u, w, h)
    assert out.current == pytest.approx((u - 0.03 * w) / r * -math.expm1(-r * h / l), rel=1e-9, abs=1e-12)
    assert out.torque == 0.03 * out.current
    assert out.electric_power == u * out.current
    assert out.mechanical_power == out.torque * w


@given(positive, st.floats(1e-5, 1.0), volts, st.integers(2, 20))
def test_many_small_steps_are_one_large_one(r, l, u, n):
    p = dc.Parameters(resistance=r, inductance=l)
    whole, _ = stepped(p, u, 10.0, 0.05, 1)
    parts, _ = stepped(p, u, 10.0, 0.05 / n, n)
    assert parts.current == pytest.approx(whole.current, rel=1e-9, abs=1e-9)


def test_against_a_fine_integration():
    p = dc.Parameters(resistance=0.5, inductance=3e-3)
    exact = solve_ivp(lambda t, i: (9.0 - 0.03 * 40.0 - 0.5 * i) / 3e-3, (0.0, 0.01), [0.0], rtol=1e-12, atol=1e-12).y[0, -1]
    assert stepped(p, 9.0, 40.0, 0.01, 1)[0].current == pytest.approx(exact, rel=1e-9)


@given(positive, st.floats(1e-9, 1.0), volts, volts, st.floats(1e-6, 1e-2))
def test_the_mean_torque_is_what_the_charge_says(r, l, u, i, h):
    """Of L I' = U - R I over a step: the mean current is (U - L (I_1 - I_0) / h) / R; where R does little, that of both ends."""
    p = dc.Parameters(resistance=r, inductance=l, voltage_constant=0.0, torque_constant=2.0)
    before = dc.State(i, 0.0, 0.0, 0.0)
    after, _ = dc.advance(p, before, u, 0.0, h)
    found, size = dc.mean_torque(p, before, after, u, 0.0, dc.pace(p, h)), 2.0 * max(abs(i), abs(after.current))
    if r * h / l > 1e-5:
        assert found == pytest.approx(2.0 * (u - l * (after.current - i) / h) / r, rel=1e-8, abs=1e-8 * size)
    else:
        assert found == pytest.approx(i + after.current, rel=1e-8, abs=1e-5 * size)


@pytest.mark.parametrize(
    "changes", [{}, {"resistance": 0.0}, {"inductance": 0.0}, {"brush_voltage": 0.5}, {"winding_thermal_resistance": 20.0}]
)
def test_steps_of_a_pace_are_steps_to_the_bit(changes, rng):
    p = dc.Parameters(**changes)
    for h in (1e-5, 1e-3, 0.2):
        one = other = dc.start(p)
        pace = dc.pace(p, h)
        for voltage, speed in zip(rng.uniform(-24.0, 24.0, 50).tolist(), rng.uniform(-300.0, 300.0, 50).tolist()):
            one, out = dc.advance(p, one, voltage, speed, h)
            other, paced = dc.paced(p, other, voltage, speed, pace)
            assert (other, paced) == (one, out)


def test_the_mean_torque_of_a_wave_is_of_second_order():
    """A current without delay, and a cogging beside it, under an even speed: half the step leaves a quarter of the error."""
    p = dc.Parameters(inductance=0.0, cogging_torque=0.01, cogging_periods=5.0, voltage_constant=0.0)
    s, off = dc.State(5.0, 0.0, 0.0, 1.0), []
    waves = quad(lambda angle: dc.torque_law(p, dc.Condition(3.0, 20.0, 5.0, angle, 0.0))[1], 0.3, 0.34)[0] / 0.04
    for steps in (1, 2, 4):
        m, total = s._replace(angle=0.3), 0.0
        for _ in range(steps):
            before = m
            m, _ = dc.advance(p, m, 3.0, 20.0, 2e-3 / steps)
            total += dc.mean_torque(p, before, m, 3.0, 20.0, dc.pace(p, 2e-3 / steps)) / steps
        off.append(total - p.torque_constant * 5.0 - waves)
    assert off[1] / off[0] == pytest.approx(0.25, rel=0.1) and off[2] / off[1] == pytest.approx(0.25, rel=0.1)


def test_small_inductance_tends_to_none():
    none = stepped(dc.Parameters(inductance=0.0), 12.0, 5.0, 1e-3, 1)[1]
    assert none.current == (12.0 - 0.15) / 0.6
    for l in (1e-6, 1e-9, 1e-300):
        assert stepped(dc.Parameters(inductance=l), 12.0, 5.0, 1e-3, 1)[1].current == pytest.approx(none.current, rel=1e-12)


def test_small_resistance_tends_to_none():
    none = stepped(dc.Parameters(resistance=0.0, inductance=0.01), 12.0, 0.0, 1e-3, 1)[1]
    assert none.current == pytest.approx(1.2)
    for r in (1e-6, 1e-9, 1e-15):
        little = stepped(dc.Parameters(resistance=r, inductance=0.01), 12.0, 0.0, 1e-3, 1)[1]
        assert little.current == pytest.approx(none.current, rel=1e-6 + 1e-2 * r)


def test_stalled_power_is_eq_19():
    _, out = stepped(dc.Parameters(), 3.0, 0.0, 1.0, 3)
    assert out.electric_power == pytest.approx(0.6 / 0.03**2 * out.torque**2, rel=1e-12)


def test_energy_balance():
    """What the terminals give is turned to heat, stored in the coil, or mechanical (K_e = K_m)."""
    p = dc.Parameters(resistance=0.5, inductance=2e-3)
    h, s, given_, heat, work = 1e-6, dc.start(p), 0.0, 0.0, 0.0
    for n in range(5000):
        u, w = 10.0 * math.sin(2e3 * n * h), 30.0
        mean = s.current
        s, out = dc.advance(p, s, u, w, h)
        mean = 0.5 * (mean + s.current)
        given_, heat, work = given_ + u * mean * h, heat + 0.5 * mean**2 * h, work + 0.03 * mean * w * h
    assert given_ == pytest.approx(heat + work + 0.5 * 2e-3 * s.current**2, rel=1e-5)


@settings(max_examples=25)
@given(st.floats(-5.0, 5.0), volts, st.floats(0.0, 3.0), st.floats(1e-5, 0.1))
def test_brush_drop_against_a_fine_integration(i0, u, drop, h):
    got = dc.next_current(i0, u, drop, 0.7, 0.004, h)
    n, i = 5000, i0
    dt = h / n
    for _ in range(n):  # backward Euler of an inclusion: the drop takes any value up to its own at i = 0
        free = i + dt * u / 0.004
        limit = drop * dt / 0.004
        i = math.copysign(max(abs(free) - limit, 0.0), free) / (1.0 + dt * 0.7 / 0.004)
    assert got == pytest.approx(i, rel=2e-2, abs=2e-2)


def test_brush_drop_holds_the_current_at_zero():
    assert dc.next_current(1.0, 0.5, 1.0, 0.6, 1e-3, 10.0) == 0.0
    assert dc.next_current(0.0, -0.9, 1.0, 0.6, 0.0, 1.0) == 0.0
    assert dc.next_current(0.0, -1.6, 1.0, 0.6, 0.0, 1.0) == pytest.approx(-1.0)


@settings(max_examples=25)
@given(st.floats(-5.0, 5.0), volts, st.floats(0.01, 3.0), st.floats(0.1, 5.0), st.floats(1e-5, 0.01), st.sampled_from((0.0, 0.7)))
def test_soft_brushes_against_a_fine_integration(i0, u, drop, knee, h, r):
    """Runge's midpoint rule, second order, of L I' = U - R I - U_b I / I_b between -I_b and I_b, else less U_b."""
    got = dc.bent_current(i0, u, drop, knee, r, 0.004, h)
    slope = lambda i: (u - r * i - drop * min(max(i / knee, -1.0), 1.0)) / 0.004
    n, i = 500, i0
    dt = h / n
    for _ in range(n):
        i += dt * slope(i + 0.5 * dt * slope(i))
    assert got == pytest.approx(i, rel=1e-3, abs=1e-3)


@given(st.floats(-5.0, 5.0), volts, st.floats(0.01, 3.0), st.floats(1e-5, 0.1), st.sampled_from((0.0, 0.004)))
def test_brushes_without_softness_are_the_limit(i0, u, drop, h, l):
    sharp = dc.next_current(i0, u, drop, 0.7, l, h)
    assert dc.bent_current(i0, u, drop, 1e-7, 0.7, l, h) == pytest.approx(sharp, abs=1e-6)


def test_soft_brushes_are_a_resistance_first_and_a_voltage_then():
    soft = dc.Parameters(resistance=0.6, brush_voltage=1.2, brush_softness=0.5)  # all of it from 1 A on
    assert stepped(soft, 0.9, 0.0, 1.0, 1)[1].current == pytest.approx(0.9 / (0.6 + 0.6 / 0.5))
    assert stepped(soft, -0.9, 0.0, 1.0, 1)[1].current == pytest.approx(-0.5)
    assert stepped(soft, 6.0, 0.0, 1.0, 1)[1].current == pytest.approx((6.0 - 1.2) / 0.6)
    instant = soft._replace(inductance=0.0)
    assert stepped(instant, 0.9, 0.0, 1e-6, 1)[1].current == pytest.approx(0.5)
    assert stepped(instant, -6.0, 0.0, 1e-6, 1)[1].current == pytest.approx(-8.0)


def test_winding_warms_to_its_steady_state():
    p = dc.Parameters(winding_thermal_resistance=2.0, thermal_time=1.0)
    s, _ = stepped(p, 6.0, 0.0, 0.01, 3000)
    resistance = 0.6 * (1.0 + 0.00393 * 2.0 * s.heat)
    assert s.current == pytest.approx(6.0 / resistance, rel=1e-6)
    assert s.heat == pytest.approx(6.0**2 / resistance, rel=1e-6)


def test_torque_constant_falls_with_current_and_heat():
    cold = stepped(dc.Parameters(weakening_per_current=0.01), 6.0, 0.0, 1.0, 1)[1]
    assert cold.torque == pytest.approx(0.03 * 10.0 / 1.1)
    sudden = stepped(dc.Parameters(weakening_per_current=0.001, weakening_exponent=2.0), 6.0, 0.0, 1.0, 1)[1]
    assert sudden.torque == pytest.approx(0.03 * 10.0 / (1.0 + 0.001 * 10.0**2))
    warm = stepped(dc.Parameters(weakening_per_loss=0.001, thermal_time=0.1), 6.0, 0.0, 1.0, 20)[1]
    assert warm.torque == pytest.approx(0.3 / 1.06, rel=1e-6)


def test_a_weakening_takes_of_the_voltage_constant_what_share_it_is_said_to(rng):
    """At an even speed U = R I + K_e omega: K_e = K_e0 / (1 + c w), and K_m = K_0 / (1 + w) whatever c is."""
    share, speed, a = rng.uniform(0.0, 1.0), rng.uniform(20.0, 100.0), rng.uniform(0.005, 0.05)
    p = dc.Parameters(inductance=0.0, weakening_per_current=a, weakening_of_voltage=share)
    _, out = stepped(p, 6.0, speed, 1.0, 100)
    w = a * abs(out.current)
    assert out.torque == pytest.approx(p.torque_constant * out.current / (1.0 + w))
    assert 6.0 == pytest.approx(p.resistance * out.current + p.voltage_constant * speed / (1.0 + share * w))


def test_supply_sag_shows_at_high_duty_only():
    p = dc.Parameters(supply_resistance=0.4, supply_voltage=24.0)
    assert stepped(p, 24.0, 0.0, 1.0, 1)[1].current == pytest.approx(24.0 / 1.0)
    assert stepped(p, 2.4, 0.0, 1.0, 1)[1].current == pytest.approx(2.4 / 0.604)


def test_without_a_capacitor_the_supply_gives_the_motors_current_while_the_switch_is_on():
    """Beside a switch in 200 instants of a period: of the motor's voltage their mean, of what the supply gives while it is on."""
    p = dc.Parameters(supply_resistance=0.4, supply_voltage=24.0, supply_driver=0.0)
    for volts in (-21.0, -6.0, 2.4, 24.0):
        current = stepped(p, volts, 0.0, 1.0, 1)[1].current
        on = round(200 * abs(volts) / 24.0)
        seen = sum(math.copysign(24.0, volts) - 0.4 * current if k < on else 0.0 for k in range(200)) / 200
        assert current == pytest.approx(seen / p.resistance, rel=1e-9)


@pytest.mark.parametrize("volts, speed", [(12.0, 0.0), (-12.0, -200.0), (6.0, 500.0), (-0.3, 200.0), (0.0, 300.0), (1.0, -100.0)])
def test_a_linear_stage_takes_the_motors_whole_current_of_its_supply_in_either_direction(volts, speed):
    """Beside a fine integration, from a current that was flowing: driving, braking, and where the stage has nothing left to give."""
    p = dc.Parameters(resistance=1.5, inductance=2e-3, supply_resistance=0.4, supply_voltage=24.0, supply_driver=-1.0)

    def slope(t, y):
        given = math.copysign(max(abs(volts) - 0.4 * abs(y[0]), 0.0), volts)
        return [(given - 0.03 * speed - 1.5 * y[0]) / 2e-3]

    s = dc.State(3.0, 0.0, 0.0, 1.0)
    for _ in range(2000):
        s, _ = dc.advance(p, s, volts, speed, 2e-6)
    exact = solve_ivp(slope, (0.0, 4e-3), [3.0], rtol=1e-9, atol=1e-12, max_step=1e-5).y[0, -1]
    assert s.current == pytest.approx(exact, rel=2e-3, abs=2e-3)


def test_a_linear_stage_has_an_end_where_its_motor_drives_more_current_than_its_supply_gives():
    p = dc.Parameters(resistance=0.5, inductance=0.0, supply_resistance=5.0, supply_voltage=24.0, supply_driver=-1.0)
    _, out = stepped(p, 6.0, 400.0, 1e-3, 50)
    assert out.current == pytest.approx(-0.03 * 400.0 / 0.5)  # as short-circuited


def test_what_a_supply_is_left_with_goes_with_what_its_driver_takes():
    p = dc.Parameters(supply_resistance=0.4, supply_voltage=24.0)
    linear = p._replace(supply_driver=-1.0)
    assert [supplied(p, u, i) for u, i in ((12.0, 5.0), (12.0, -5.0))] == [23.0, 25.0]
    assert [supplied(linear, u, i) for u, i in ((12.0, 5.0), (12.0, -5.0), (-12.0, -5.0))] == [22.0, 22.0, 22.0]


def test_cogging_needs_no_current():
    p = dc.Parameters(cogging_torque=0.05, cogging_periods=10.0, cogging_phase=0.2)
    _, out = stepped(p, 0.0, 0.0, 1e-3, 1)
    assert out.torque == pytest.approx(0.05 * math.sin(0.2))


@given(positive, st.floats(1e-6, 1.0), volts, st.floats(-100.0, 100.0))
def test_effects_that_are_off_change_no_bit(r, l, u, w):
    from selflock.fmus.effect import parameters_type

    p = dc.Parameters(resistance=r, inductance=l)
    s, out = dc.advance(p, dc.start(p)._replace(current=0.3), u, w, 1e-3)
    assert out.current == dc.free_current(0.3, u - 0.03 * w, r, l, 1e-3)
    assert out.torque == 0.03 * out.current
    assert set(parameters_type(dc.BASE)._fields) <= set(dc.Parameters._fields)
