"""Each effect: its torque by its formula, its motion against an independent integration, and nothing when it is off."""

import math
from importlib import import_module

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.integrate import solve_ivp

from selflock.fmus.reducer import law, shaft, travel, wedge
from selflock.fmus.reducer.effects import EFFECTS
from selflock.fmus.units import parse

P = shaft.Parameters
NAMES = "stribeck viscous asymmetric load_dependent preload ripple backlash compliance warm_up wear".split()


def effect(name):
    return import_module(f"selflock.fmus.reducer.effects.{name}")


def wedge_torque(torque, s, mu, preload=0.0):
    return wedge.sliding_torque(torque, s, mu, preload, 1 / 50, 50.0)


# name -> (parameters, F of (P, s, speed, angle, output angle, time, heat, distance) as the effect's formula says)
ON = {
    "stribeck": (
        dict(friction_kinetic=0.01, friction_static=0.03, stribeck_speed=8.0, stribeck_exponent=1.4),
        lambda P, s, w, a, b, t, h, d: wedge_torque(P, s, 0.01 + 0.02 * math.exp(-(abs(w / 8.0) ** 1.4))),
    ),
    "viscous": (
        dict(friction_kinetic=0.01, viscous_damping=1e-3),
        lambda P, s, w, a, b, t, h, d: wedge_torque(P, s, 0.01) + 1e-3 * w,
    ),
    "asymmetric": (
        dict(friction_kinetic=0.01, friction_asymmetry=0.3, viscous_damping=1e-3, viscous_asymmetry=-0.2),
        lambda P, s, w, a, b, t, h, d: wedge_torque(P, s, 0.01 * (1 + 0.3 * s)) + 1e-3 * (1 - 0.2 * s) * w,
    ),
    "load_dependent": (
        dict(friction_kinetic=0.01, driving_friction=0.004, backdriving_friction=-0.003,
             driving_load_slope=2e-3, backdriving_load_slope=1e-3),
        lambda P, s, w, a, b, t, h, d: wedge_torque(P, s, 0.014 + 2e-3 * abs(P) if P * s > 0 else 0.007 + 1e-3 * abs(P)),
    ),
    "preload": (
        dict(friction_kinetic=0.01, preload=1.0, drag_torque=0.013),
        lambda P, s, w, a, b, t, h, d: wedge_torque(P, s, 0.01, 1.0) + 0.013 * s,
    ),
    "ripple": (
        dict(friction_kinetic=0.01, input_ripple=0.2, input_ripple_order=2.0, input_ripple_phase=0.5, input_ripple_torque=0.01,
             output_ripple=0.1, output_ripple_order=30.0, output_ripple_torque=0.004, output_ripple_phase=-1.0),
        lambda P, s, w, a, b, t, h, d: wedge_torque(P, s, 0.01 * (1 + 0.2 * math.cos(2 * a + 0.5) + 0.1 * math.cos(30 * b - 1)))
        + 0.01 * math.cos(2 * a + 0.5) + 0.004 * math.cos(30 * b - 1),
    ),
    "warm_up": (
        dict(friction_kinetic=0.01, cold_excess=0.8, warm_up_time=0.05, heat_coefficient=0.3, cooling_time=0.2,
             viscous_damping=1e-3),
        lambda P, s, w, a, b, t, h, d: wedge_torque(P, s, 0.01 * (1 + 0.8 * math.exp(-t / 0.05)) * math.exp(-0.3 * h))
        + 1e-3 * w * (1 + 0.8 * math.exp(-t / 0.05)) * math.exp(-0.3 * h),
    ),
    "wear": (
        dict(friction_kinetic=0.01, wear_rate=0.05, wear_reach=4.0),
        lambda P, s, w, a, b, t, h, d: wedge_torque(P, s, 0.01 * (1 + 0.05 * 4.0 * (1 - math.exp(-d / 4.0)))),
    ),
}  # fmt: skip


def test_every_row_of_the_vocabulary_has_its_file():
    assert [e.name for e in EFFECTS] == sorted(NAMES)
    names = [parameter.name for e in EFFECTS for parameter in e.parameters]
    assert len(set(names)) == len(names)


@pytest.mark.parametrize("asymmetry", [-1.5, 0.0, 0.8])
@pytest.mark.parametrize("way", [-1.0, 1.0])
def test_rest_ends_at_the_friction_of_the_slowest_motion(asymmetry, way):
    """A Stribeck fall that differs by direction does so at rest, too."""
    p = P(friction_kinetic=0.01, friction_static=0.03, stribeck_speed=8.0, stribeck_asymmetry=asymmetry)
    x = law.Condition(1.0, 0.0, 5.0, 0.09, 0.0, 0.0, 0.0, 0.0)
    bounds = travel.held(law.extended(p, 1 / 50, x, 0.0), 50.0, 200.0)
    s = shaft.start(p, 5.0, 1e-9 * way, 0.09, 0.0)
    _, slow = shaft.impose(p, s, 5.0, 1e-9 * way, 0.09, 0.0, 0.0)
    assert slow.output_torque == pytest.approx(200.0)
    assert bounds[way > 0.0] == pytest.approx(slow.input_torque, rel=1e-6)


@pytest.mark.parametrize("name", NAMES)
def test_declaration(name):
    declared = effect(name).EFFECT
    assert declared.component == "reducer" and declared.name == name and declared.source and declared.summary
    for parameter in declared.parameters:
        assert parameter.low <= parameter.off <= parameter.high
        assert parameter.unit == "" or parse(parameter.unit)
        assert getattr(P(), parameter.name) == parameter.off
    assert set(declared.frees) <= set(P._fields)


@pytest.mark.parametrize("name", ON)
@pytest.mark.parametrize("torque, speed", [(2.0, 12.0), (2.0, -12.0), (-1.0, 5.0), (-1.0, -0.3)])
def test_torque_of_an_imposed_motion(name, torque, speed):
    changes, formula = ON[name]
    p = P(shaft_damping=0.0, **changes)
    state = shaft.start(p, 1.0, speed, 1 / 50 - torque / p.shaft_stiffness, 0.0)
    for i in range(3):
        at = 1.0 + speed * 1e-3 * i
        output = at / 50 - torque / p.shaft_stiffness
        before = state
        state, out = shaft.impose(p, state, at, speed, output, speed / 50, 1e-3)
        end = at + speed * 1e-3
        expected = formula(
            torque,
            math.copysign(1.0, speed),
            speed,
            end,
            output + speed / 50 * 1e-3,
            (i + 1) * 1e-3,
            before.heat,
            abs(speed) * 1e-3 * (i + 1),
        )
        assert out.output_torque == pytest.approx(torque, rel=1e-9)
        assert out.input_torque == pytest.approx(expected, rel=1e-9)
        assert out.loss_power >= 0.0


@pytest.mark.alike
@pytest.mark.parametrize("name", ON)
def test_motion_against_an_independent_integration(name):
    changes, formula = ON[name]
    p = P(shaft_stiffness=500.0, shaft_damping=1.0, **changes)
    drive = 0.06

    def slide(t, y):
        windup, rate = y[0] / 50 - 0.4 * t, y[1] / 50 - 0.4
        torque = p.shaft_stiffness * windup + p.shaft_damping * rate
        force = formula(torque, 1.0, y[1], y[0], 0.4 * t, t, y[2], y[3])
        loss = (force - torque / 50) * y[1] + p.shaft_damping * rate**2
        return [y[1], (drive - force) / p.shaft_inertia, loss - y[2] / p.cooling_time, abs(y[1])]

    begin = shaft.relaxed(p, 1.0, 25.0, 0.0, 0.4)
    exact = solve_ivp(slide, (0.0, 0.04), [begin.angle, begin.speed, 0.0, 0.0], rtol=1e-10, atol=1e-12, max_step=2e-4).y[:, -1]
    errors = []
    for dt in (2e-3, 2.5e-4, 6.25e-5):
        state = begin
        for i in range(round(0.04 / dt)):
            state, out = shaft.advance(p, state, drive, 0.4 * dt * i, 0.4, dt)
        assert state.speed > 0.0
        errors.append(max(abs(state.angle - exact[0]), 1e-2 * abs(state.speed - exact[1])))
    assert errors[0] < 2e-4  # a long step is as good as its inner steps
    assert errors[2] < max(errors[1] / 6.0, 2e-8)  # second order


def test_rest_is_rest_with_effects_on():
    """Effects on: stick still holds without drift."""
    p = P(viscous_damping=1e-3, input_ripple=0.2, cold_excess=0.5, wear_rate=0.1, friction_asymmetry=0.1)
    state = begin = shaft.relaxed(p, 5.0, 0.0, 0.0, 0.0)
    for _ in range(20):
        state, out = shaft.advance(p, state, 1e-3, 0.0, 0.0, 0.01)
    assert (state.angle, state.speed, state.distance) == (begin.angle, 0.0, 0.0) and out.stuck == 1.0


@pytest.mark.parametrize("name", NAMES)
def test_off_is_exactly_nothing(name):
    """The parameters that only shape an effect change no bit while it is off; neither does its being there."""
    switches = {"stribeck": ["stribeck_speed"],
                "ripple": ["input_ripple", "input_ripple_torque", "output_ripple", "output_ripple_torque"],
                "warm_up": ["cold_excess", "heat_coefficient"], "wear": ["wear_rate"]}  # fmt: skip
    declared = effect(name).EFFECT
    shapes = [q for q in declared.parameters if q.name not in switches.get(name, [x.name for x in declared.parameters])]
    shaped = P(friction_kinetic=0.01, **{q.name: q.off + 0.37 for q in shapes})
    plain = P(friction_kinetic=0.01)
    states = [shaft.relaxed(p, 1.0, 20.0, 0.0, 0.4) for p in (plain, shaped)]
    assert states[0] == states[1]
    for i in range(200):
        results = [shaft.advance(p, s, 0.05 * math.sin(0.2 * i), 4e-4 * i, 0.4, 1e-3) for p, s in zip((plain, shaped), states)]
        assert results[0] == results[1]
        states = [state for state, _ in results]


@pytest.mark.parametrize("name", [*ON, "backlash", "compliance"])
def test_vanishes_with_its_parameters(name):
    """A thousandth of an effect is next to none: the way through inner steps has the plain law as its limit."""
    changes = dict(ON[name][0] if name in ON else {name: 1e-3})
    base = {key: changes.pop(key) for key in list(changes) if key in ("friction_kinetic", "preload", "friction_static")}
    shapes = ("order", "phase", "exponent", "time", "reach")
    small = {key: value if key.endswith(shapes) else 1e-7 * value for key, value in changes.items()}
    ends = []
    for p in (P(**base), P(**base, **small)):
        state = shaft.relaxed(p, 1.0, 20.0, 0.0, 0.4)
        for i in range(60):
            state, _ = shaft.advance(p, state, 0.05, 4e-4 * i, 0.4, 1e-3)
        ends.append(state)
    assert ends[1].angle == pytest.approx(ends[0].angle, abs=1e-4)


# Backlash and compliance act on the output shaft.


def test_play_carries_no_torque():
    p = P(backlash=0.02, friction_kinetic=0.01)
    for windup, torque in ((0.0, 0.0), (0.0099, 0.0), (-0.0099, 0.0), (0.0101, 2.0), (-0.0105, -10.0)):
        state = shaft.start(p, 50.0 * windup, 0.0, 0.0, 0.0)
        assert shaft.impose(p, state, 50.0 * windup, 0.0, 0.0, 0.0, 1e-3)[1].output_torque == pytest.approx(torque, abs=1e-9)


def test_flanks_do_not_pull():
    """Parting fast, the damper alone would pull: it must not."""
    p = P(backlash=0.02, friction_kinetic=0.01, shaft_damping=100.0)
    state = shaft.start(p, 50 * 0.0101, -80.0, 0.0, 0.0)
    out = shaft.impose(p, state, 50 * 0.0101 + 0.08, -80.0, 0.0, 0.0, 1e-3)[1]
    assert out.output_torque == 0.0 and out.loss_power >= 0.0


def test_free_flight_through_the_play_is_exact():
    """In the play nothing but the motor moves the shaft (N0 = 0): touch comes where a parabola meets the flank."""
    p = P(backlash=0.02, friction_kinetic=0.01, shaft_stiffness=1e6, shaft_damping=0.0)
    push = 0.002
    touch = math.sqrt(2 * 50 * 0.01 / (push / p.shaft_inertia))
    state, out = shaft.advance(p, shaft.relaxed(p, 0.0, 0.0, 0.0, 0.0), push, 0.0, 0.0, 0.999 * touch)
    assert out.output_torque == 0.0
    assert state.angle == pytest.approx(push / p.shaft_inertia * (0.999 * touch) ** 2 / 2, rel=1e-12)
    assert shaft.advance(p, shaft.relaxed(p, 0.0, 0.0, 0.0, 0.0), push, 0.0, 0.0, 1.001 * touch)[1].output_torque > 0.0


@pytest.mark.parametrize("damping", [0.0, 2.0])
def test_play_one_step_is_as_many(damping):
    p = P(backlash=5e-3, friction_kinetic=0.01, shaft_damping=damping, preload=0.05)
    one, _ = shaft.advance(p, shaft.relaxed(p, 0.0, 15.0, 0.0, -0.2), -0.03, 0.0, -0.2, 0.1)
    for count in (7, 1000):
        many = shaft.relaxed(p, 0.0, 15.0, 0.0, -0.2)
        for i in range(count):
            many, _ = shaft.advance(p, many, -0.03, -0.2 * 0.1 / count * i, -0.2, 0.1 / count)
        assert many.angle == pytest.approx(one.angle, abs=1e-6)
        assert many.speed == pytest.approx(one.speed, abs=1e-3)


def test_flank_left_slower_than_rounding_can_tell():
    """At the very edge of the play, moving less in an event than a unit of the last place: the step must end all the same."""
    p = P(backlash=0.01, friction_kinetic=0.02)
    state, out = shaft.advance(p, shaft.relaxed(p, 1e-66, -0.002, 0.0, 0.0), 0.0, 0.0, 0.0, 1e-5)
    assert state.speed == -0.002 and out.output_torque == 0.0


def test_a_load_that_leaves_the_flank_of_a_resting_gear_slowly(rng):
    """In all of a step it may go on by less than the wind-up's last bits are from where the torque is none: there was no number."""
    for _ in range(100):
        p = P(backlash=10 ** rng.uniform(-3, -1), friction_kinetic=0.03, preload=0.1, shaft_damping=rng.choice([0.0, 2.0]))
        wound, rate = 10 ** rng.uniform(-12, -6), 10 ** rng.uniform(-9, -3)
        state = shaft.start(p, 0.0, 0.0, -0.5 * p.backlash - wound, 0.0)
        after, out = shaft.advance(p, state, 0.0, -0.5 * p.backlash - wound, rate, 1e-3)
        parted = wound <= rate * (1e-3 + p.shaft_damping / p.shaft_stiffness)
        assert after.angle == after.speed == 0.0 and out.stuck == 1.0
        assert (out.output_torque > 0.0) != parted or math.isclose(wound, rate * 1e-3, rel_tol=1e-6)


def test_output_that_crosses_the_play_meets_the_resting_gear():
    p = P(backlash=0.01, friction_kinetic=0.03)
    state = shaft.relaxed(p, 0.0, 0.0, 0.0, 0.0)
    state, out = shaft.advance(p, state, 0.0, 0.0, 0.2, 0.02)
    assert out.output_torque == 0.0 and out.stuck == 1.0
    state, out = shaft.advance(p, state, 0.0, 0.004, 0.2, 0.02)  # the flank at 0.005 rad is met inside the step
    assert out.output_torque == pytest.approx(-p.shaft_stiffness * 0.003 - p.shaft_damping * 0.2) and out.stuck == 1.0


def test_compliance_adds_to_that_of_the_shaft():
    p = P(compliance=1e-4, shaft_damping=0.0)
    state = shaft.start(p, 0.5, 0.0, 0.0, 0.0)
    out = shaft.impose(p, state, 0.5, 0.0, 0.0, 0.0, 1e-3)[1]
    assert out.output_torque == pytest.approx(0.01 / (1e-4 + 1 / p.shaft_stiffness), rel=1e-12)
    begin = shaft.relaxed(p, 3.0, 0.0, 0.2, 0.0)
    assert begin.angle / 50 - 0.2 == pytest.approx(3.0 * (1e-4 + 1 / p.shaft_stiffness))


def test_limits_of_friction():
    """Factors below zero are no friction; what a load adds cannot take mu tan(alpha) to 1."""
    p = P(friction_kinetic=0.01, friction_asymmetry=1.5, driving_load_slope=10.0, shaft_damping=0.0)
    for speed in (5.0, -5.0):
        state = shaft.start(p, 1.0, speed, 0.0, 0.0)
        out = shaft.impose(p, state, 1.0, speed, 0.0, 0.0, 1e-6)[1]
        assert math.isfinite(out.input_torque) and out.loss_power >= 0.0


share = st.one_of(st.just(0.0), st.floats(0.0, 1.0))
signed = st.one_of(st.just(0.0), st.floats(-1.0, 1.0))


@settings(max_examples=80, deadline=None)
@given(
    stribeck=share, viscous=share, asymmetry=signed, driving=signed, backdriving=signed, load=signed, drag=share, preload=share,
    ripple=signed, play=share, compliance=share, cold=signed, heat=signed, wear=signed,
    torque=st.floats(-5.0, 5.0), speed=st.floats(-60.0, 60.0), output_speed=signed, push=st.floats(-0.3, 0.3), mode=st.booleans(),
)  # fmt: skip
@pytest.mark.slow
def test_any_mixture_ends_and_makes_no_energy(
    stribeck,
    viscous,
    asymmetry,
    driving,
    backdriving,
    load,
    drag,
    preload,
    ripple,
    play,
    compliance,
    cold,
    heat,
    wear,
    torque,
    speed,
    output_speed,
    push,
    mode,
):
    p = P(
        friction_kinetic=0.02,
        friction_static=0.03,
        stribeck_speed=10 * stribeck,
        viscous_damping=1e-3 * viscous,
        friction_asymmetry=asymmetry,
        viscous_asymmetry=-asymmetry,
        driving_friction=0.1 * driving,
        backdriving_friction=0.1 * backdriving,
        driving_load_slope=0.01 * load,
        drag_torque=0.01 * drag,
        preload=preload,
        input_ripple=ripple,
        output_ripple=-ripple,
        backlash=0.01 * play,
        compliance=1e-3 * compliance,
        cold_excess=0.8 * cold,
        heat_coefficient=0.1 * heat,
        wear_rate=0.1 * wear,
    )
    state = shaft.relaxed(p, torque, speed, 0.0, output_speed)
    softened = p.shaft_stiffness / (1.0 + p.shaft_stiffness * p.compliance)
    for i in range(6):
        dt = (1e-5, 1e-3, 0.02)[i % 3]
        if mode:
            state, out = shaft.advance(p, state, push, 0.1 * output_speed * i, output_speed, dt)
        else:
            state, out = shaft.impose(p, state, state.angle, speed, 0.1 * output_speed * i, output_speed, dt)
        assert all(map(math.isfinite, (*state, *out)))
        assert out.loss_power >= 0.0 and out.friction_torque * out.input_speed >= 0.0
        if out.input_speed != 0.0:
            windup = out.input_angle / 50.0 - 0.1 * output_speed * i - output_speed * dt
            deflection = math.copysign(max(abs(windup) - 0.5 * p.backlash, 0.0), windup)
            stored = softened * deflection * (out.input_speed / 50.0 - output_speed)
            balance = out.input_power - out.output_power - out.loss_power - stored
            assert balance == pytest.approx(0.0, abs=1e-9 * (1.0 + abs(out.input_power) + abs(out.output_power) + abs(stored)))
