"""The wedge: equations 1 to 14 against themselves, against LossyGear, against brute force."""

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from selflock.fmus.reducer import wedge

ratios = st.floats(1.5, 300.0)
shares = st.floats(0.0, 0.98)  # of the largest mu, 1 / t
torques = st.floats(-50.0, 50.0)
preloads = st.sampled_from([0.0, 0.0, 0.3, 4.0])
directions = st.sampled_from([-1.0, 1.0])
angles = st.sampled_from([0.0, 0.0, 0.05, 0.4])


def geometry(ratio, angle, share):
    t = wedge.wedge_tangent(ratio, angle)
    return t, min(share / t, 5.0)


@given(ratios, angles, shares, torques, preloads, directions)
def test_sliding_torque_satisfies_the_equations(ratio, angle, share, torque, preload, s):
    t, mu = geometry(ratio, angle, share)
    force = wedge.sliding_torque(torque, s, mu, preload, t, ratio)
    load = torque / (ratio * t)  # P at the wedge
    normal = wedge.normal_force(force, load, t)  # (4)
    friction = s * wedge.friction_limit(mu, normal, preload)  # (13)
    scale = 1.0 + abs(force) + abs(load) + abs(normal)
    assert wedge.input_force(normal, friction, t) == pytest.approx(force, abs=1e-12 * scale)  # (2)
    assert wedge.output_force(normal, friction, t) == pytest.approx(load, abs=1e-12 * scale)  # (3)
    assert wedge.tangent_force(force, load, t) == pytest.approx(friction, abs=1e-12 * scale)  # (7)


@given(st.floats(1.5, 300.0), shares, torques, directions)
def test_sliding_without_preload_is_the_tangent_of_the_angle_of_friction(ratio, share, torque, s):
    alpha = math.atan(1.0 / ratio)
    mu = min(share * ratio, 5.0)
    phi = math.atan(mu)
    angle = alpha + phi if torque * s > 0.0 else alpha - phi
    force = wedge.sliding_torque(torque, s, mu, 0.0, 1.0 / ratio, ratio)
    assert force == pytest.approx(torque * math.tan(angle), rel=1e-12 / (1.0 - mu / ratio), abs=1e-12 * abs(torque))


@given(ratios, st.floats(0.0, 0.98))
def test_efficiencies_are_those_of_lossy_gear(ratio, share):
    t = 1.0 / ratio
    mu = share * t  # below self-locking, where LossyGear can represent the gear
    eta1, eta2 = (1.0 - mu * t) / (1.0 + mu / t), (1.0 - mu / t) / (1.0 + mu * t)
    assert wedge.driving_efficiency(mu, t) == pytest.approx(eta1, rel=1e-12)
    assert wedge.backdriving_efficiency(mu, t) == pytest.approx(eta2, rel=1e-12)
    # LossyGear's torque balance: driving tau_b = -i eta1 tau_a, back-driving tau_b = -i / eta2 tau_a (its i is r)
    assert wedge.sliding_torque(1.0, 1.0, mu, 0.0, t, ratio) == pytest.approx(1.0 / (ratio * eta1), rel=1e-12)
    assert wedge.sliding_torque(1.0, -1.0, mu, 0.0, t, ratio) == pytest.approx(eta2 / ratio, rel=1e-12)


@pytest.mark.slow
@given(ratios, angles, shares, torques, preloads)
def test_cone_is_where_static_friction_suffices(ratio, angle, share, torque, preload):
    """Equations 4, 7, 8, 14 at every torque of a fine grid, against the interval."""
    t, mu = geometry(ratio, angle, share)
    low, high = wedge.cone(torque, mu, preload, t, ratio)
    load = torque / (ratio * t)
    reach = 1.5 * (abs(low) + abs(high)) + 1e-3
    for force in np.linspace(-reach, reach, 401):
        tangent = wedge.tangent_force(force, load, t)
        limit = wedge.friction_limit(mu, wedge.normal_force(force, load, t), preload)
        if abs(abs(tangent) - limit) > 1e-12 * (abs(load) + reach) * (1.0 + mu):
            assert (abs(tangent) < limit) == (low < force < high)
            assert (wedge.static_friction(force, load, mu, preload, t) == tangent) == (abs(tangent) < limit)


@given(st.floats(2.0, 200.0), st.floats(0.0, 3.0), st.floats(-20.0, 20.0), st.sampled_from([0.0, 0.5]))
@pytest.mark.slow
def test_least_torque_against_brute_force_over_the_cone(ratio, share, torque, preload):
    t, mu = 1.0 / ratio, share / ratio
    least = wedge.least_torque(*wedge.cone(torque, mu, preload, t, ratio))
    grid = np.linspace(-abs(torque) * 6.0 / ratio - 0.1, abs(torque) * 6.0 / ratio + 0.1, 4001)
    load = torque / (ratio * t)
    admissible = [
        f
        for f in grid
        if abs(wedge.tangent_force(f, load, t)) <= wedge.friction_limit(mu, wedge.normal_force(f, load, t), preload)
    ]
    if admissible:
        best = min(admissible, key=abs)
        assert abs(abs(best) - abs(least)) <= grid[1] - grid[0]
        assert abs(least) <= abs(best) + 1e-12
    if share > 1.0:
        assert least == 0.0  # self-locking (12): nothing is needed to hold


@pytest.mark.parametrize("share", [0.5, 1.0, 1.7])
def test_self_locking_is_where_no_torque_holds_the_load(share):
    t = 0.02
    mu = share * t
    low, high = wedge.cone(3.0, mu, 0.0, t, 50.0)
    assert wedge.self_locking(mu, t) == (1.0 if share > 1.0 else 0.0)
    assert (low > 0.0) == (share < 1.0)  # holding the load against running back needs a torque only below the limit
    assert low == 0.0 if share == 1.0 else low != 0.0  # exactly at the limit: exactly zero
    assert wedge.backdriving_efficiency(mu, t) == pytest.approx((1 - share) / (1 + mu * t), abs=1e-15)


@given(ratios, shares, st.sampled_from([0.1, 2.0]), directions)
def test_continuous_where_the_preload_ends(ratio, share, preload, s):
    t = 1.0 / ratio
    mu = min(share * ratio, 5.0)
    for sign in (1.0, -1.0):
        # |N| = N0: P = N0 (sign cos(alpha) - mu s sin(alpha))
        edge = preload * (sign - mu * s * t) / math.sqrt(1.0 + t * t)
        below, at, above = (wedge.sliding_torque(edge + d, s, mu, preload, t, ratio) for d in (-1e-9, 0.0, 1e-9))
        steepest = wedge.driving_slope(mu, t, ratio)
        assert max(abs(at - below), abs(above - at)) <= 1.1e-9 * max(1.0, steepest)
        normal = wedge.normal_force(at, edge, t)
        assert abs(normal) == pytest.approx(preload, rel=1e-9 / (1.0 - mu * t))


@given(torques, directions)
def test_continuous_at_the_self_locking_limit(torque, s):
    below, at, above = (wedge.sliding_torque(torque, s, mu, 0.0, 0.02, 50.0) for mu in (0.02 - 1e-12, 0.02, 0.02 + 1e-12))
    assert max(abs(above - at), abs(below - at)) <= 1.1e-12 * abs(torque)


@given(ratios, shares, torques, preloads)
def test_directions_mirror(ratio, share, torque, preload):
    t = 1.0 / ratio
    mu = min(share * ratio, 5.0)
    ahead = wedge.sliding_torque(torque, 1.0, mu, preload, t, ratio)
    assert wedge.sliding_torque(-torque, -1.0, mu, preload, t, ratio) == -ahead


@given(ratios, angles, torques, directions)
def test_no_friction_loses_nothing(ratio, angle, torque, s):
    t = wedge.wedge_tangent(ratio, angle)
    assert wedge.sliding_torque(torque, s, 0.0, 0.0, t, ratio) == pytest.approx(torque / ratio, rel=1e-14)
