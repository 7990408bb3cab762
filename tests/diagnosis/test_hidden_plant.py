"""The hidden plant is a drive: closed forms of the wedge, convergence, rest, and independence of the product."""

import math
import re
from pathlib import Path

import numpy as np
import pytest

from .plant import bench, causes
from .plant.drive import CHANNELS, Drive, simulate

PLANT = Path(__file__).parent / "plant"


def _column(rows, name):
    return rows[:, CHANNELS.index(name)]


def _steady(drive, speed, seconds=1.6):
    n = int(seconds / bench.STEP)
    angle = speed * np.arange(n) * bench.STEP
    return simulate(drive, angle, np.full(n, speed), np.full(n, 22.0), bench.STEP, bench.FINE, 0.0)


@pytest.mark.parametrize("friction", [0.008, 0.015, 0.026])
@pytest.mark.parametrize("speed", [0.5, -0.5])
def test_lifting_and_lowering_take_the_wedges_torque(friction, speed):
    """A constant load: F = P tan(alpha + phi) driving, P tan(alpha - phi) back-driving (model.md)."""
    drive = Drive(friction=friction, mass=0.0, load_inertia=0.1, constant_torque=4.0)
    rows = _steady(drive, speed)[-200:]
    phi = math.copysign(math.atan(friction), speed)
    assert _column(rows, "motor_torque").mean() == pytest.approx(4.0 * math.tan(drive.wedge_angle + phi), rel=0.005, abs=2e-4)


def test_the_motor_obeys_ohm_and_its_back_emf():
    drive = Drive(mass=0.0, load_inertia=0.1, constant_torque=4.0)
    rows = _steady(drive, 1.0)[-200:]
    expected = drive.resistance * _column(rows, "current") + drive.voltage_constant * _column(rows, "motor_speed")
    assert _column(rows, "voltage").mean() == pytest.approx(expected.mean(), rel=1e-3)


def test_half_the_step_changes_nothing_that_a_log_shows():
    plan = bench.motion(np.random.default_rng(3), 6.0)
    coarse, fine = (
        simulate(Drive(), plan.angle, plan.speed, plan.ambient, bench.STEP, n * bench.FINE, plan.start) for n in (1, 2)
    )
    for channel in ("current", "motor_speed", "angle"):
        assert np.std(_column(coarse, channel) - _column(fine, channel)) < 0.1 * bench.NOISE[channel]


def test_a_locked_gear_rests_without_current():
    drive = Drive(friction=0.026, angle_gain=0.0, speed_gain=0.0)
    n = 2000
    rows = simulate(drive, np.zeros(n), np.zeros(n), np.full(n, 22.0), bench.STEP, bench.FINE, 1.2)
    assert abs(_column(rows, "angle")[-1] - _column(rows, "angle")[100]) < 1e-4


@pytest.mark.alike
@pytest.mark.parametrize("name", causes.DRAWS)
def test_a_cause_is_nothing_at_strength_zero_and_something_at_its_strength(name):
    rng = np.random.default_rng([5, len(name)])
    sheet = bench.nominal(rng)
    cause = causes.DRAWS[name](rng, sheet)
    plan = bench.motion(rng, 4.0)
    changed = bench.run(sheet._replace(**cause.change(min(1.0, cause.extent[1]))), plan)
    assert np.all(np.isfinite(changed))
    if name not in ("controller.saturation", "controller.sampling"):  # these begin at a least strength
        assert np.allclose(bench.run(sheet._replace(**cause.change(0.0)), plan), bench.run(sheet, plan), rtol=1e-6, atol=1e-6)
    if cause.effect not in ("quantisation", "saturation") and cause.what != "end_stop":
        assert not np.array_equal(changed, bench.run(sheet, plan))


@pytest.mark.slow
def test_the_same_seed_makes_the_same_log(tmp_path):
    logs = [bench.hide(["motor.brush_drop"], 4, duration=2.0).write(tmp_path / name)[1].read_bytes() for name in ("a", "b")]
    assert logs[0] == logs[1]


def test_the_plant_knows_nothing_of_the_product():
    for path in PLANT.glob("*.py"):
        assert not re.search(r"^\s*(from|import)\s+(fmus|master|diagnosis|selflock)\b", path.read_text(), re.M), path
