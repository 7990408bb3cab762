"""The reducer in time against an independent integration, in its limits, and in its balance of energy."""

import math

import numpy as np
import pytest
from hypothesis import HealthCheck, assume, event, given, settings
from hypothesis import strategies as st
from scipy.integrate import solve_ivp

from selflock.fmus.reducer import shaft, wedge
from selflock.fmus.reducer.flow import NONE
from selflock.fmus.reducer.law import Friction, Law, plain
from selflock.fmus.reducer.travel import PIECES, glide, travel

P = shaft.Parameters


def run(p, state, inputs, dt, count):
    """inputs(t) -> (motor torque, output angle, output speed); the rows of outputs at the ends of the steps."""
    rows = []
    for i in range(count):
        state, out = shaft.advance(p, state, *inputs(i * dt), dt)
        rows.append(out)
    return state, rows


def relaxed(p, output_angle=0.0, output_speed=0.0, speed=0.0, torque=0.0):
    return shaft.start(p, p.gear_ratio * (output_angle + torque / p.shaft_stiffness), speed, output_angle, output_speed)


class Reference:
    """J w' = M - F integrated by scipy from event to event, with T found from equations 2, 3, 4, 13 case by case."""

    def __init__(self, p, motor_torque, output_angle, output_speed):
        self.p, self.motor, self.angle, self.speed = p, motor_torque, output_angle, output_speed
        self.alpha = math.atan(1.0 / p.gear_ratio)
        self.static = max(p.friction_static, p.friction_kinetic)

    def load(self, t, y):
        p = self.p
        windup = y[0] / p.gear_ratio - self.angle - self.speed * t
        return p.shaft_stiffness * windup + p.shaft_damping * (y[1] / p.gear_ratio - self.speed)

    def force(self, load, s):
        """N from (3) for each case of max(N0, |N|); the case that is true of itself."""
        p, sine, cosine = self.p, math.sin(self.alpha), math.cos(self.alpha)
        found = []
        for sign in (1.0, -1.0):
            normal = load / (cosine - p.friction_kinetic * s * sign * sine)
            if sign * normal >= p.preload:
                found.append((normal, p.friction_kinetic * s * abs(normal)))
        tangent = p.friction_kinetic * s * p.preload
        normal = (load + tangent * sine) / cosine
        if abs(normal) <= p.preload:
            found.append((normal, tangent))
        normal, tangent = found[0]
        return normal * sine + tangent * cosine

    def slips(self, t, y):
        """Positive when (7) exceeds (14)."""
        load = self.load(t, y)
        sine, cosine = math.sin(self.alpha), math.cos(self.alpha)
        tangent = self.motor * cosine - load * sine
        normal = load * cosine + self.motor * sine
        return abs(tangent) - self.static * max(self.p.preload, abs(normal)), math.copysign(1.0, tangent)

    def integrate(self, angle, speed, dt):
        p, t, y = self.p, 0.0, np.array([angle, speed])
        for _ in range(200):
            if y[1] == 0.0:
                excess, s = self.slips(t, y)
                if excess <= 1e-13:
                    stick = lambda t, y: self.slips(t, y)[0]
                    stick.terminal, stick.direction = True, 1.0
                    out = solve_ivp(lambda t, y: [0.0, 0.0], (t, dt), y, events=stick, max_step=dt / 50, rtol=1e-12, atol=1e-14)
                    t, y = out.t[-1], out.y[:, -1]
                    if t >= dt:
                        break
                    s = self.slips(t, y)[1]
            else:
                s = math.copysign(1.0, y[1])
            stop = lambda t, y, s=s: s * y[1] + (1e-30 if y[1] == 0.0 else 0.0)
            stop.terminal, stop.direction = True, -1.0
            kink = lambda t, y: self.load(t, y)
            kink.terminal = True
            slide = lambda t, y, s=s: [y[1], (self.motor - self.force(self.load(t, y), s)) / p.shaft_inertia]
            out = solve_ivp(slide, (t, dt), y, "DOP853", events=[stop, kink], rtol=1e-11, atol=1e-13, max_step=dt / 40)
            t, y = out.t[-1], out.y[:, -1].copy()
            if len(out.t_events[0]):
                y[1] = 0.0
            if t >= dt:
                break
            if len(out.t_events[1]):  # step over the kink, where the torque is continuous
                d = min(1e-9, dt - t)
                y = y + d * np.array(slide(t, y))
                t += d
        return y


CASES = {
    "no friction": (P(friction_kinetic=0.0), 0.02, 0.0, 5.0),
    "driving": (P(friction_kinetic=0.01), 0.05, 0.0, 30.0),
    "limit": (P(friction_kinetic=0.02), -0.03, 2.0, -20.0),
    "self-locking, lowered": (P(friction_kinetic=0.03, shaft_damping=0.0), -0.05, 4.0, -10.0),
    "self-locking, dragged ahead": (P(friction_kinetic=0.06), 0.01, -1.0, 40.0),
    "stops inside": (P(friction_kinetic=0.03), -0.2, 3.0, 20.0),
    "turns back": (P(friction_kinetic=0.005), -0.4, 6.0, 15.0),
    "preload": (P(friction_kinetic=0.02, preload=1.5), 0.06, 0.5, 25.0),
    "static above kinetic": (P(friction_kinetic=0.01, friction_static=0.05), 0.09, 1.0, 0.0),
    "soft": (P(shaft_stiffness=5.0, shaft_damping=0.0), 0.01, 0.2, 3.0),
    "overdamped": (P(shaft_damping=300.0), 0.05, 1.0, 30.0),
    "low ratio": (P(gear_ratio=3.0, friction_kinetic=0.4, shaft_inertia=1e-3), 1.0, 2.0, 2.0),
}


@pytest.mark.alike
@pytest.mark.parametrize("case", CASES)
@pytest.mark.parametrize("output_speed", [0.0, 0.7, -0.4])
def test_against_an_independent_integration(case, output_speed):
    p, motor_torque, torque, speed = CASES[case]
    dt = 0.02
    begin = relaxed(p, 0.3, output_speed, speed, torque)
    state, out = shaft.advance(p, begin, motor_torque, 0.3, output_speed, dt)
    angle, speed = Reference(p, motor_torque, 0.3, output_speed).integrate(begin.angle, begin.speed, dt)
    assert state.angle == pytest.approx(angle, abs=2e-8)
    assert state.speed == pytest.approx(speed, abs=1e-5 * (1.0 + abs(begin.speed)))
    assert (state.speed == 0.0) == (speed == 0.0) == bool(out.stuck)


@pytest.mark.alike
@pytest.mark.parametrize("case", CASES)
def test_one_step_is_as_many(case):
    """The step is exact: how it is divided does not matter, from 1e-5 to 0.1 s."""
    p, motor_torque, torque, speed = CASES[case]
    begin = relaxed(p, 0.0, 0.3, speed, torque)
    one, out = shaft.advance(p, begin, motor_torque, 0.0, 0.3, 0.1)
    for count in (2, 10, 97, 1000, 10000):
        dt = 0.1 / count
        many, rows = run(p, begin, lambda t: (motor_torque, 0.3 * t, 0.3), dt, count)
        assert many.angle == pytest.approx(one.angle, abs=1e-9 * (1.0 + abs(one.angle)))
        assert many.speed == pytest.approx(one.speed, abs=1e-7 * (1.0 + abs(begin.speed)))
        assert rows[-1].output_torque == pytest.approx(out.output_torque, abs=1e-6)


def test_converges_with_the_communication_step():
    """Inputs that vary are held over a step: first order, whatever stops and turns on the way."""
    p = P(friction_kinetic=0.01, shaft_damping=20.0)
    inputs = lambda t: (0.1 * math.sin(30 * t), 0.01 * math.sin(20 * t), 0.2 * math.cos(20 * t))
    ends = [run(p, relaxed(p, 0.0, 0.2), inputs, 0.2 / count, count)[0].angle for count in (400, 800, 1600, 12800)]
    errors = [abs(end - ends[-1]) for end in ends[:-1]]
    assert errors[0] > 1.6 * errors[1] > 2.5 * errors[2] and errors[2] < 1e-3


@pytest.mark.parametrize("damping", [200.0, 50.0])
@pytest.mark.parametrize("speed", [1.234375, 1.1, -3.7])
def test_a_torque_of_rounding_alone_ends_no_step_without_a_number(speed, damping):
    """Of a gear that goes with its load, damped in 20 ns; it goes from the line of driving to that of being driven and back.

    The least that drives it locks the gear.
    """
    p = P(
        gear_ratio=2.0, friction_kinetic=1.0, friction_static=1.0, preload=0.0, shaft_stiffness=1.0, shaft_damping=damping,
        shaft_inertia=1e-6,
    )  # fmt: skip
    state = relaxed(p, 0.0, 0.5, speed, 0.0)
    for i in range(20):
        state, out = shaft.advance(p, state, 0.0, 0.5e-4 * i, 0.5, 1e-4)
        goes = state.speed == pytest.approx(1.0, abs=1e-6) and abs(out.output_torque) < 1e-8
        assert goes or (state.speed == 0.0 and out.output_torque == pytest.approx(-0.5 * damping, rel=1e-3))


@pytest.mark.slow
@settings(max_examples=150, deadline=None)
@given(
    ratio=st.floats(2.0, 200.0),
    share=st.floats(0.0, 3.0),
    static=st.floats(1.0, 2.0),
    preload=st.sampled_from([0.0, 0.0, 0.2, 2.0]),
    stiffness=st.sampled_from([1.0, 300.0, 2e4, 1e6]),
    damping=st.sampled_from([0.0, 0.1, 2.0, 200.0]),
    inertia=st.sampled_from([1e-6, 2e-5, 1e-2]),
    torque=st.floats(-5.0, 5.0),
    speed=st.floats(-100.0, 100.0),
    output_speed=st.sampled_from([0.0, 0.5, -3.0]),
    push=st.floats(-0.5, 0.5),
    dt=st.sampled_from([1e-5, 1e-4, 1e-3, 1e-2, 1e-1]),
)
def test_whatever_happens_the_step_ends_and_no_energy_is_made(
    ratio, share, static, preload, stiffness, damping, inertia, torque, speed, output_speed, push, dt
):
    mu = share / ratio
    assume(mu * static / ratio < 0.99)  # beyond, no torque drives the gear
    p = P(
        gear_ratio=ratio,
        friction_kinetic=mu,
        friction_static=mu * static,
        preload=preload,
        shaft_stiffness=stiffness,
        shaft_damping=damping,
        shaft_inertia=inertia,
    )
    state = relaxed(p, 0.0, output_speed, speed, torque)
    for i in range(4):
        state, out = shaft.advance(p, state, push, output_speed * dt * i, output_speed, dt)
        if math.isnan(state.speed):  # refused: only where the shaft would swing more often than a step's pieces can follow
            assert dt * math.sqrt(stiffness / inertia) / ratio > 0.1 * PIECES
            return
        assert all(map(math.isfinite, out))
        assert out.loss_power >= 0.0
        assert out.friction_torque * out.input_speed >= 0.0
        assert out.input_angle == state.angle and out.input_speed == state.speed
        if out.stuck:
            low, high = wedge.cone(out.output_torque, max(mu, mu * static), preload, 1 / ratio, ratio)
            slack = 1e-9 * (1.0 + abs(push) + abs(out.output_torque))
            assert out.input_speed == 0.0 and low - slack <= out.input_torque <= high + slack
        elif out.input_speed != 0.0:
            s = math.copysign(1.0, out.input_speed)
            assert out.input_torque == pytest.approx(
                wedge.sliding_torque(out.output_torque, s, mu, preload, 1 / ratio, ratio), rel=1e-12, abs=1e-12
            )
        stored = out.input_power - out.output_power - out.loss_power  # into the spring, k windup (rate of windup)
        windup = state.angle / ratio - output_speed * dt * (i + 1)
        rate = state.speed / ratio - output_speed
        terms = abs(out.input_power) + abs(out.output_power) + out.loss_power + stiffness * 1e-3
        assert stored == pytest.approx(stiffness * windup * rate, abs=1e-9 * terms)


@pytest.mark.alike
@pytest.mark.parametrize("mu", [0.0, 0.01, 0.03])
def test_energy_balance(mu):
    """What the motor gives goes out, is stored in inertia and spring, or is lost: integrated over a run with stops."""
    p = P(friction_kinetic=mu, shaft_damping=5.0)
    state, dt, given, gone, lost = relaxed(p), 1e-5, 0.0, 0.0, 0.0
    inputs = lambda t: (0.08 * math.sin(60 * t), 0.02 * math.sin(25 * t), 0.5 * math.cos(25 * t))
    before = None
    for i in range(20000):
        motor_torque, angle, speed = inputs(i * dt)
        turned = state.angle
        state, out = shaft.advance(p, state, motor_torque, angle, speed, dt)
        given += motor_torque * (state.angle - turned)
        if before is not None:
            gone += 0.5 * dt * (before.output_power + out.output_power)
            lost += 0.5 * dt * (before.loss_power + out.loss_power)
        before = out
    windup = state.angle / p.gear_ratio - angle - speed * dt
    stored = 0.5 * p.shaft_inertia * state.speed**2 + 0.5 * p.shaft_stiffness * windup**2
    assert given == pytest.approx(gone + stored + lost, abs=2e-3 * (abs(gone) + lost + stored))
    assert lost > 0.0


def test_stop_is_found_at_its_instant():
    """Constant deceleration (frictionless load, soft spring): the shaft stops after J w / (mu N0 / cos(alpha)), w^2/2a on."""
    p = P(friction_kinetic=0.03, preload=2.0, shaft_stiffness=1e-9, shaft_damping=0.0)
    hold = wedge.preload_torque(0.03, 2.0, 1 / 50)
    for dt in (0.1, 0.0777, 0.013):
        state = relaxed(p, speed=80.0)
        state, _ = run(p, state, lambda t: (0.0, 0.0, 0.0), dt, math.ceil(0.1 / dt))
        assert state.speed == 0.0
        assert state.angle == pytest.approx(80.0**2 / 2 / (hold / p.shaft_inertia), rel=1e-9)


@pytest.mark.parametrize("s", [1.0, -1.0])
@pytest.mark.parametrize("instant", [0.0, 3.77e-3, 9.9e-3])
def test_breakaway_is_found_at_its_instant(s, instant):
    """The output is turned until P leaves the cone; then the shaft starts with M - F(mu_k) inside one step."""
    p = P(friction_kinetic=0.01, friction_static=0.03, shaft_damping=0.0, shaft_stiffness=2.0)
    motor_torque, rate = 0.1 * s, 0.8 * s
    leaves = motor_torque / wedge.driving_slope(0.03, 1 / 50, 50.0)  # P at which this torque breaks away
    begin = shaft.relaxed(p, leaves + p.shaft_stiffness * rate * instant, 0.0, 0.0, rate)
    surplus = motor_torque - wedge.sliding_torque(leaves, s, 0.01, 0.0, 0.02, 50.0)
    after = 1e-4
    state, out = shaft.advance(p, begin, motor_torque, 0.0, rate, instant + after)
    assert state.speed == pytest.approx(surplus / p.shaft_inertia * after, rel=1e-3)
    if instant:
        state, out = shaft.advance(p, begin, motor_torque, 0.0, rate, instant - 1e-9)
        assert state.speed == 0.0 and out.stuck == 1.0


def test_stick_held_for_an_hour_does_not_drift():
    p = P(friction_kinetic=0.03)
    state = begin = relaxed(p, 0.2, 0.0, 0.0, 9.0)
    for i in range(36000):
        state, out = shaft.advance(p, state, 1e-3 * math.sin(i), 0.2, 0.0, 0.1)
    assert state == begin and out.stuck == 1.0 and out.output_torque == pytest.approx(9.0, rel=1e-9)


def test_held_at_the_limit_without_torque():
    p = P(friction_kinetic=0.02)
    state = begin = relaxed(p, 0.0, 0.0, 0.0, 5.0)
    for _ in range(1000):
        state, out = shaft.advance(p, state, 0.0, 0.0, 0.0, 0.01)
    assert state == begin and out.stuck == 1.0


@pytest.mark.parametrize("load, gear", [(3.0, 0.01), (-3.0, 0.01), (2.0, 0.03)])
def test_settles_where_the_motor_torque_is_in_balance(load, gear):
    """Pushed against an output that is held, the shaft winds up until F = M, overshoots not beyond the cone, and stays."""
    p = P(friction_kinetic=gear, shaft_damping=20.0)
    motor_torque = wedge.sliding_torque(load, math.copysign(1.0, load), gear, 0.0, 0.02, 50.0)
    state, rows = run(p, relaxed(p), lambda t: (motor_torque, 0.0, 0.0), 1e-3, 3000)
    low, high = wedge.cone(rows[-1].output_torque, gear, 0.0, 0.02, 50.0)
    assert rows[-1].stuck == 1.0 and low - 1e-12 <= motor_torque <= high + 1e-12


@pytest.mark.parametrize("stiffness", [2e4, 2e6])
def test_jam_is_a_normal_computation(stiffness):
    """A self-locking gear overrun by its load (kappa |eta_2| > 1 with a rigid one): it locks within milliseconds."""
    p = P(friction_kinetic=0.06, shaft_stiffness=stiffness, shaft_damping=0.0)
    state = relaxed(p, 0.0, 0.0, 50.0, -0.5)
    inputs = lambda t: (0.0, 3.0 * t, 3.0)
    coarse, _ = shaft.advance(p, state, *inputs(0.0), 0.1)
    fine, _ = run(p, state, inputs, 1e-5, 300)
    assert coarse.speed == fine.speed == 0.0 and coarse.angle == pytest.approx(fine.angle, rel=1e-9)


@pytest.mark.alike
@pytest.mark.parametrize("mu", [0.0, 0.01, 0.03])
def test_results_do_not_depend_on_a_stiff_spring(mu):
    """The default 2e4 N.m/rad winds up by 0.014 degrees at 5 N.m; stiffer ones give the same torque and speed."""
    wanted = lambda t: 3.0 - 2.0 * math.cos(20.0 * t)
    for stiffness in (2e4, 2e5, 2e6):
        p = P(friction_kinetic=mu, shaft_stiffness=stiffness, shaft_damping=2.0 * math.sqrt(stiffness / 2e4))
        state = relaxed(p, 0.0, 0.5, 25.0, 1.0)
        for i in range(3000):
            motor_torque = wedge.sliding_torque(wanted(i * 1e-4), 1.0, mu, 0.0, 0.02, 50.0)
            state, out = shaft.advance(p, state, motor_torque, 0.5e-4 * i, 0.5, 1e-4)
            assert out.output_torque == pytest.approx(wanted(i * 1e-4), abs=5e-3)
        assert state.speed == pytest.approx(25.0, rel=2e-3)


@pytest.mark.parametrize("case", CASES)
def test_the_usual_step_is_the_general_one(case):
    """advance() takes steps without events directly; travel() must give the same."""
    p, motor_torque, torque, speed = CASES[case]
    state = relaxed(p, 0.0, 0.3, speed, torque)
    law = plain(p, wedge.wedge_tangent(p.gear_ratio, p.wedge_angle))
    for i in range(200):
        arguments = (motor_torque, 0.3e-3 * i, 0.3, 1e-3)
        angle, end, _, _ = travel(law, p.gear_ratio, p.shaft_inertia, state.angle, state.speed, *arguments)
        state, _ = shaft.advance(p, state, *arguments)
        assert state.angle == pytest.approx(angle, abs=1e-12 * (1 + abs(angle)))
        assert state.speed == pytest.approx(end, abs=1e-9 * (1 + abs(end)))


@pytest.mark.slow
@given(
    mu=st.floats(0.0, 0.06),
    level=st.sampled_from([0.0, 0.003]),
    drag=st.sampled_from([0.0, 0.002]),
    viscous=st.sampled_from([0.0, 1e-5, 1e-2]),
    half_play=st.sampled_from([0.0, 0.004]),
    windup=st.floats(-0.01, 0.01),
    speed=st.floats(-40.0, 40.0).filter(lambda w: abs(w) > 1e-6),
    push=st.floats(-0.3, 0.3),
    output_speed=st.floats(-1.0, 1.0),
    dt=st.sampled_from([1e-5, 1e-4, 1e-3]),
)
def test_what_glides_travels_alike(mu, level, drag, viscous, half_play, windup, speed, push, output_speed, dt):
    """glide() says of a step that no event lies in it: travel(), which looks for events, must end at the same place."""
    friction = Friction(wedge.driving_slope(mu, 0.02, 50.0), wedge.backdriving_slope(mu, 0.02, 50.0), level, drag, viscous)
    law = Law(friction, friction, friction, friction, 2e3, 2.0, half_play, 0.0)
    fine, wound, after, _, _ = glide(*friction, 2e3, 2.0, half_play, 50.0, 2e-5, windup, speed, push, output_speed, dt)
    event(f"glides {fine}")
    assume(fine > 0.0)
    angle, end, _, _ = travel(law, 50.0, 2e-5, 50.0 * windup, speed, push, 0.0, output_speed, dt)
    assert after == pytest.approx(end, rel=1e-9, abs=1e-9)
    assert wound == pytest.approx(angle / 50.0 - output_speed * dt - windup, abs=1e-12)


def test_a_shaft_that_runs_under_load_glides():
    friction = Friction(wedge.driving_slope(0.03, 0.02, 50.0), wedge.backdriving_slope(0.03, 0.02, 50.0), 0.0, 0.001, 1e-5)
    windup = 3.0 / 2e3
    push = 3.0 * friction.driving + 0.001 + 1e-5 * 20.0
    for half_play in (0.0, 0.004):
        fine, _, speed, torque, _ = glide(*friction, 2e3, 2.0, half_play, 50.0, 2e-5, windup + half_play, 20.0, push, 0.4, 1e-3)
        assert (fine, speed, torque) == pytest.approx((1.0, 20.0, 3.0), rel=1e-9)
    assert glide(*friction, 2e3, 2.0, 0.0, 50.0, 2e-5, windup, 20.0, -10.0, 0.4, 1e-3)[0] == 0.0  # it stops in this step


@pytest.mark.parametrize(
    "changes", [{}, {"viscous_damping": 1e-4}, {"output_ripple_torque": 0.01}], ids=["plain", "viscous", "ripple"]
)
def test_what_a_step_before_knew_changes_no_bit(changes, rng):
    """Steps of three lengths in turn, through rest and back, so that what is known is right for some and wrong for others."""
    p = P(friction_kinetic=0.02, friction_static=0.03, **changes)
    one = other = relaxed(p, speed=10.0)
    known, used = NONE, 0
    for i, torque in enumerate((0.1 * np.sin(0.02 * np.arange(400)) + rng.normal(0.0, 0.01, 400)).tolist()):
        inputs = torque, 1e-4 * i, 0.1, (1e-4, 1e-4, 2e-4, 1e-3)[i // 10 % 4]
        one, out = shaft.advance(p, one, *inputs)
        before = known
        other, further, known = shaft.advance_on(p, other, wedge.wedge_tangent(p.gear_ratio, p.wedge_angle), *inputs, known)
        used += known is before and one.speed != 0.0
        assert (other, further) == (one, out)
    assert used > 30


def test_a_shaft_that_heats_glides_to_where_it_travels(rng, monkeypatch):
    """While it runs under load no event is looked for; where one is in each step, it ends at the same place, as warm."""
    p = P(friction_kinetic=0.02, heat_coefficient=0.05, cooling_time=0.3, wear_rate=1e-4)
    looked = []
    monkeypatch.setattr(shaft, "travel", lambda *given: looked.append(given) or travel(*given))
    one = other = relaxed(p, speed=20.0, output_speed=0.4, torque=3.0)
    for i, torque in enumerate(rng.uniform(0.1, 0.15, 50).tolist()):
        one, _ = shaft.advance(p, one, torque, 4e-4 * i, 0.4, 1e-3)
        assert not looked
        with monkeypatch.context() as patch:
            patch.setattr(shaft, "glide", lambda *given: (0.0, 0.0, 0.0, 0.0, given[-1]))
            other, _ = shaft.advance(p, other, torque, 4e-4 * i, 0.4, 1e-3)
        assert looked and other == pytest.approx(one, rel=1e-11)
        looked.clear()
    assert one.heat > 0.0 and one.speed > 0.0


def test_a_gear_without_friction_glides_while_its_torque_keeps_its_sign(rng):
    """Its three lines are one, but for rounding: a third of its steps were looked through for an event, at three times the work."""
    for ratio, windup, forward in zip(rng.uniform(5.0, 200.0, 100), rng.uniform(1e-4, 1e-2, 100), rng.choice([-1.0, 1.0], 100)):
        slopes = wedge.driving_slope(0.0, 1.0 / ratio, ratio), wedge.backdriving_slope(0.0, 1.0 / ratio, ratio)
        push = 2e3 * windup / ratio
        assert (
            glide(*slopes, 0.0, 0.0, 0.0, 2e3, 2.0, 0.0, ratio, 2e-5, windup, forward * 20.0, push, forward * 20.0 / ratio, 1e-4)[
                0
            ]
            == 1.0
        )


def test_the_longest_step_is_as_many_inner_steps():
    """A step of as many inner steps as it may have gives what these give one by one."""
    p = P(input_ripple=0.3, input_ripple_order=3.0, shaft_damping=20.0)
    one = many = relaxed(p, 0.0, 0.4, 20.0, 3.0)
    count = PIECES // 2
    one, _ = shaft.advance(p, one, 0.1, 0.0, 0.4, count * shaft.INNER_STEP)
    for i in range(count):
        many, _ = shaft.advance(p, many, 0.1, 0.4 * i * shaft.INNER_STEP, 0.4, shaft.INNER_STEP)
    assert one.speed > 0.0 and one == pytest.approx(many, rel=1e-9)


@settings(suppress_health_check=[HealthCheck.too_slow])
@given(st.floats(-0.3, 0.3), st.floats(-60.0, 60.0), st.floats(-1.0, 1.0))
def test_no_memory_beyond_the_state(push, speed, output_speed):
    p = P()
    state = relaxed(p, 0.0, output_speed, speed, 1.0)
    assert shaft.advance(p, state, push, 0.0, output_speed, 1e-3) == shaft.advance(
        p, shaft.State(*state), push, 0.0, output_speed, 1e-3
    )
