"""The sensor's four effects, each alone."""

import math

import pytest
from hypothesis import given
from hypothesis import strategies as st

from selflock.fmus.sensor import sensor

values = st.floats(-1e6, 1e6)


def read(p, value, h=1e-3):
    return sensor.advance(p, sensor.start(p, value), value, h)[1].reading


@given(values)
def test_an_ideal_sensor_says_the_value(value):
    assert read(sensor.Parameters(), value) == value


@given(values, st.floats(-10.0, 10.0), st.floats(0.5, 2.0))
def test_bias_and_scale(value, bias, scale):
    assert read(sensor.Parameters(bias=bias, scale_factor=scale), value) == scale * value + bias


@given(values, st.floats(1e-3, 10.0))
def test_quantisation_is_the_nearest_step(value, step):
    reading = read(sensor.Parameters(resolution=step), value)
    assert abs(reading - value) <= 0.5 * step * (1.0 + 1e-9)
    assert reading / step == pytest.approx(round(reading / step), abs=1e-6)


@pytest.mark.parametrize("h", [1e-3, 0.1])
def test_lag_is_exact_for_a_held_value(h):
    p = sensor.Parameters(lag_time=0.05)
    s = sensor.start(p, 0.0)
    for _ in range(round(0.2 / h)):
        s, out = sensor.advance(p, s, 1.0, h)
    assert out.reading == pytest.approx(1.0 - math.exp(-4.0), rel=1e-12)
