"""What the laws say backwards, for measured drives, is what they say forwards."""

import math
import random

import pytest

from selflock.fmus.load import load
from selflock.fmus.motor import dc
from selflock.fmus.reducer import law, shaft
from selflock.fmus.sensor import sensor


@pytest.fixture
def draw():
    seed = random.randrange(2**32)
    print(f"seed {seed}")
    return random.Random(seed)


def test_the_torque_of_a_load_s_motion(draw):
    for _ in range(100):
        p = load.Parameters(
            mass=draw.uniform(0.0, 3.0),
            arm_angle=draw.uniform(-3.0, 3.0),
            damping=draw.uniform(0.0, 1.0),
            constant_torque=draw.uniform(-2.0, 2.0),
            mass_error=0.3,
            arm_error=0.05,
            inertia_error=-0.02,
            tilt_error=0.1,
        )
        s = load.State(draw.uniform(-4.0, 4.0), draw.uniform(-5.0, 5.0))
        torque = draw.uniform(-20.0, 20.0)
        end, out = load.advance(p, s, torque, draw.choice([0.0, 1e-3]))
        assert load.driving_torque(p, end, out.acceleration) == pytest.approx(torque, rel=1e-12, abs=1e-12)


HOT = dict(
    thermal_time=0.2, winding_thermal_resistance=20.0, weakening_per_current=0.02, weakening_per_loss=0.003,
    brush_voltage=0.5, cogging_torque=0.004, cogging_periods=7.0, supply_resistance=0.0,
)  # fmt: skip


@pytest.mark.parametrize("effects", [{}, HOT], ids=["plain", "effects"])
def test_the_torque_of_a_measured_current(effects, draw):
    """The motor's own current, angle and speed give back its torque and its heat."""
    p = dc.Parameters(**effects)
    s = dc.start(p)
    followed = dc.State(*s)
    angle = 0.0
    for _ in range(300):
        speed = draw.uniform(-50.0, 50.0)
        s, out = dc.advance(p, s, draw.uniform(-12.0, 12.0), speed, 1e-3)
        angle += speed * 1e-3
        followed, torque = dc.follow(p, followed, out.current, speed, angle, 1e-3)
        assert torque == pytest.approx(out.torque, rel=1e-12, abs=1e-15)
        constant, beside = dc.torque_law(p, dc.Condition(0.0, speed, out.current, angle, followed.heat))
        assert constant * out.current + beside == pytest.approx(torque, rel=1e-12, abs=1e-15)
        assert followed.heat == pytest.approx(s.heat if effects else followed.heat, rel=1e-12)


@pytest.mark.parametrize("effects", [{}, {"compliance": 1e-4}, {"compliance": 1e-4, "backlash": 0.02}], ids=str)
def test_the_wind_up_of_an_output_torque(effects, draw):
    """Wound up by it, the gear at rest delivers this torque."""
    p = law.Parameters(**effects)
    for _ in range(100):
        torque, angle = draw.uniform(-30.0, 30.0), draw.uniform(-9.0, 9.0)
        x = law.Condition(1.0, 0.0, angle, 0.0, torque, 0.0, 0.0, 0.0)
        output_angle = angle / p.gear_ratio - law.wound_up(p, x, law.flank(torque, 0.0))
        s = shaft.start(p, angle, 0.0, output_angle, 0.0)
        _, out = shaft.impose(p, s, angle, 0.0, output_angle, 0.0, 0.0)
        assert out.output_torque == pytest.approx(torque, rel=1e-9, abs=1e-9)


def test_without_a_torque_the_flank_touched_last_stays():
    assert [law.flank(0.0, side) for side in (-1.0, 0.0, 1.0)] == [-1.0, 0.0, 1.0]
    assert law.flank(3.0, -1.0) == 1.0 and law.flank(-1e-9, 1.0) == -1.0


def test_a_sensor_undone(draw):
    for _ in range(100):
        p = sensor.Parameters(bias=draw.uniform(-3.0, 3.0), scale_factor=draw.uniform(0.5, 2.0))
        value = draw.uniform(-10.0, 10.0)
        assert sensor.undone(p, sensor.exact(p, value)) == pytest.approx(value, rel=1e-14, abs=1e-14)
    assert sensor.undone(sensor.Parameters(), value) == value


def test_a_sensor_undone_whose_bias_goes_with_the_value(monkeypatch):
    monkeypatch.setattr(sensor, "bias", lambda p, x: 0.3 * math.sin(x))
    for value in (-2.0, 0.1, 1.4):
        assert sensor.undone(sensor.Parameters(), sensor.exact(sensor.Parameters(), value)) == pytest.approx(value, rel=1e-14)


def test_a_lag_undone():
    """Of a ramp's reading, whose rate is known."""
    p = sensor.Parameters(lag_time=0.02)
    s = sensor.start(p, 0.0)
    last = 0.0
    for i in range(1, 2000):
        s, out = sensor.advance(p, s, 3.0 * 1e-4 * i, 1e-4)
        rate, last = (out.reading - last) / 1e-4, out.reading
    assert sensor.before_lag(p, out.reading, rate) == pytest.approx(3.0 * 1e-4 * 1999, rel=1e-3)
