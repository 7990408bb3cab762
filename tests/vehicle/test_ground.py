"""The contact law of the study (eq 23, 24), friction and the ground's shape, against independent formulas."""

import math

import numpy as np
import pytest

from selflock.master.errors import DescriptionError
from selflock.vehicle import ground, kernel


def smooth(c_max, h, x):
    """Eq 24 as printed."""
    if x <= 0:
        return 0.0
    return c_max * (3 / h**2 * x**2 - 2 / h**3 * x**3) if x <= h else c_max


def test_normal_force_is_the_printed_law_with_the_rate_of_the_distance(rng):
    for _ in range(300):
        k, e, c, h = 10 ** rng.uniform(2, 6), rng.uniform(1, 2.5), 10 ** rng.uniform(0, 3), 10 ** rng.uniform(-4, -2)
        x, rate = rng.uniform(-1, 3) * h, rng.normal() * 0.1
        distance_rate = -rate
        expected = max(0.0, k * x**e - smooth(c, h, x) * distance_rate) if x > 0 else 0.0
        assert kernel.normal_force(k, e, c, h, x, rate) == pytest.approx(expected, rel=1e-12, abs=1e-15)


def test_damping_is_smooth_at_both_ends():
    for h in (1e-4, 1e-3):
        assert kernel.damping(30.0, h, 0.0) == 0.0 and kernel.damping(30.0, h, h) == 30.0
        for x in (0.0, h):
            slope = (kernel.damping(30.0, h, x + 1e-6 * h) - kernel.damping(30.0, h, x - 1e-6 * h)) / (2e-6 * h)
            assert abs(slope) * h < 1e-3 * 30.0


def constants(**values):
    p = np.zeros(1, kernel.CONSTANTS)
    for name, value in dict(dt=1e-4, ground_friction=0.5, bristle_stiffness=1e4, bristle_damping=5.0, **values).items():
        p[name] = value
    return p[0]


def test_friction_sticks_like_a_spring_and_slips_at_the_limit():
    p, normal = constants(), 10.0
    force, bristle = kernel.friction(p, normal, 0.0, 2e-4)
    assert force == pytest.approx(-2.0) and bristle == 2e-4
    for slip in (0.3, -0.3):
        bristle = 0.0
        for _ in range(1000):
            force, bristle = kernel.friction(p, normal, slip, bristle)
            assert abs(force) <= 5.0 and force * slip < 0.0
        assert force == pytest.approx(-math.copysign(5.0, slip))
        assert abs(bristle) == pytest.approx(5.0 / 1e4)  # no memory beyond the limit
    assert kernel.friction(p, 0.0, 0.3, 1e-3)[0] == 0.0


@pytest.mark.slow
def test_clearance_against_dense_points(rng):
    """The distance from a polyline is that to the nearest of many points on it; its sign says which side."""
    for text in (
        "flat",
        "slope:25",
        "slope:-10,0.3",
        "step:0.1,0.2",
        "step:-0.15,0.2",
        "stairs:0.1,0.25,3,0.1",
        "polyline:-1,0;0,0.2;0.4,0.1;1,0.3",
    ):
        gx, gy = ground.profile(text)
        t = np.linspace(0.0, 1.0, 20001)
        pieces = []
        for (a, b), (c, d) in zip(np.clip(np.stack([gx[:-1], gx[1:]], 1), -3, 3), np.stack([gy[:-1], gy[1:]], 1)):
            x = a + t * (b - a)
            pieces.append(np.column_stack([x, np.interp(x, gx, gy) if a < b else c + t * (d - c)]))
        dense = np.vstack(pieces)
        for _ in range(60):
            x = rng.uniform(-0.5, 1.0)
            y = ground.height(gx, gy, x) + rng.uniform(-0.04, 0.08)
            distance, nx, ny = kernel.clearance(gx, gy, x, y, 0.3)
            nearest = np.min(np.hypot(dense[:, 0] - x, dense[:, 1] - y))
            assert abs(distance) == pytest.approx(nearest, abs=3e-4)
            assert math.hypot(nx, ny) == pytest.approx(1.0)
            if abs(distance) > 1e-3:
                assert (distance < 0) == (y < ground.height(gx, gy, x))
                farther = kernel.clearance(gx, gy, x + 1e-7 * nx, y + 1e-7 * ny, 0.3)[0]
                assert farther - distance == pytest.approx(1e-7, rel=0.02)  # the normal is the distance's gradient


def test_every_kind_of_ground_has_the_height_it_says():
    assert ground.height(*ground.profile("flat"), 3.3) == 0.0
    assert ground.height(*ground.profile("slope:30"), 2.0) == pytest.approx(2.0 * math.tan(math.radians(30)))
    assert ground.height(*ground.profile("slope:30,1.5"), 2.0) == pytest.approx(0.5 * math.tan(math.radians(30)))
    assert [ground.height(*ground.profile("step:0.1"), x) for x in (0.99, 1.01)] == [0.0, 0.1]
    stairs = ground.profile("stairs:0.17,0.29,3,1.0")
    assert [ground.height(*stairs, 1.0 + 0.29 * i + 0.1) for i in range(-1, 4)] == pytest.approx([0.0, 0.17, 0.34, 0.51, 0.51])
    assert ground.height(*ground.profile("polyline:0,0;1,0.5;2,0"), 1.5) == pytest.approx(0.25)


@pytest.mark.parametrize(
    "text",
    ["", "hill:3", "slope:", "slope:85", "step:0", "stairs:0.1,0.2", "polyline:0,0", "polyline:1,0;0,0", "slope:abc", "step:nan"],
)
def test_a_ground_that_is_not_known_is_refused_with_the_known_ones(text):
    with pytest.raises(DescriptionError, match="ground = "):
        ground.profile(text)
