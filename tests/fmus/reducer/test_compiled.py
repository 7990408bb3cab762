"""The law compiled by numba gives what the plain one gives: the same source, to rounding."""

import math

import pytest

from selflock.fmus.load import load
from selflock.fmus.reducer import flow, shaft, wedge
from selflock.master.compiled import compiled

EFFECTS = dict(
    friction_static=0.03,
    stribeck_speed=5.0,
    viscous_damping=1e-4,
    friction_asymmetry=0.1,
    driving_load_slope=1e-3,
    drag_torque=1e-3,
    input_ripple=0.1,
    output_ripple_torque=1e-3,
    backlash=1e-4,
    compliance=1e-5,
    cold_excess=0.5,
    heat_coefficient=0.01,
    wear_rate=1e-4,
)


@pytest.fixture(scope="module")
def fast():
    return compiled("selflock.fmus.reducer.shaft")


def close(one, other):
    scale = max(1.0, *(abs(value) for value in one))
    assert tuple(other) == pytest.approx(tuple(one), rel=1e-9, abs=1e-9 * scale)


@pytest.mark.parametrize(
    "changes", [{}, {"friction_kinetic": 0.01, "preload": 0.5}, EFFECTS], ids=["plain", "preload", "effects"]
)
@pytest.mark.slow
def test_both_modes_step_by_step(fast, changes):
    plain, second = shaft.Parameters(**changes), fast.Parameters(**changes)
    assert plain == tuple(second)
    for mode in ("advance", "impose"):
        state = shaft.relaxed(plain, 1.0, 10.0, 0.0, 0.3)
        close(state, fast.relaxed(second, 1.0, 10.0, 0.0, 0.3))
        for i in range(60):
            speed = 10.0 * math.cos(0.1 * i) if i % 20 else 0.0
            inputs = (0.08 * math.sin(0.3 * i),) if mode == "advance" else (0.01 * i, speed)
            twin = fast.State(*state)
            state, out = getattr(shaft, mode)(plain, state, *inputs, 3e-4 * i, 0.3, 1e-3)
            twin, same = getattr(fast, mode)(second, twin, *inputs, 3e-4 * i, 0.3, 1e-3)
            close(state, twin)
            close(out, same)


def test_wedge_and_flow():
    fast_wedge, fast_flow = compiled("selflock.fmus.reducer.wedge"), compiled("selflock.fmus.reducer.flow")
    for torque in (-3.0, 0.0, 0.2, 7.0):
        for mu in (0.0, 0.02, 0.4):
            arguments = (torque, mu, 0.3, 0.02, 50.0)
            assert fast_wedge.cone(*arguments) == pytest.approx(wedge.cone(*arguments), rel=1e-14)
            forward = (torque, 1.0, mu, 0.3, 0.02, 50.0)
            assert fast_wedge.sliding_torque(*forward) == pytest.approx(wedge.sliding_torque(*forward), rel=1e-14)
    for delta, w, tau in ((10.0, 1e6, 1e-3), (1e4, 1e6, 1e-3), (-3.0, -1e5, 1e-2), (0.0, 0.0, 0.1), (1e3, 1e6, 1e-3)):
        assert fast_flow.response(delta, w, tau) == pytest.approx(flow.response(delta, w, tau), rel=1e-12)


def test_the_plain_law_stays_plain():
    compiled("selflock.fmus.reducer.shaft")
    assert type(shaft.advance).__name__ == "function" and type(wedge.cone).__name__ == "function"


@pytest.mark.slow
@pytest.mark.alike
@pytest.mark.parametrize("changes", [{"shaft_stiffness": 1e12, "shaft_damping": 0.0}, {"output_ripple_torque": 1e-3}])
def test_a_step_of_too_many_pieces_ends_without_a_number(fast, changes):
    plain, second = shaft.Parameters(friction_kinetic=0.01, **changes), fast.Parameters(friction_kinetic=0.01, **changes)
    state = shaft.start(plain, 0.0, 100.0, 0.0, 0.3)
    for one, out in (
        shaft.advance(plain, state, 0.1, 0.0, 0.3, 1.0),
        fast.advance(second, fast.State(*state), 0.1, 0.0, 0.3, 1.0),
    ):
        assert math.isnan(one.speed) and math.isnan(sum(out))


@pytest.mark.slow
def test_the_load_with_any_damper():
    fast_load = compiled("selflock.fmus.load.load")
    for damping in (1.0, 1e3, 1e6, 1e12, 1e300):
        values = dict(mass=2.0, damping=damping)
        state = load.State(0.3, 10.0)
        state, out = load.advance(load.Parameters(**values), state, 3.0, 0.01)
        twin, same = fast_load.advance(fast_load.Parameters(**values), fast_load.State(0.3, 10.0), 3.0, 0.01)
        close(state, twin)
        close(out, same)
    for speed in (1e9, 1e300, math.inf, math.nan):
        end, out = fast_load.advance(fast_load.Parameters(mass=2.0), fast_load.State(0.3, speed), 3.0, 0.01)
        assert math.isnan(end.speed) and math.isnan(sum(out))
