"""The manoeuvre: where it goes, where it rests, how smoothly."""

import math

import numpy as np
import pytest
from scipy.integrate import quad

from selflock.master.face import Part
from selflock.study.manoeuvre import Setpoints
from selflock.study.turns import FRONT, PRESS_ANGLE, REAR, Turn, motion

BOTH = pytest.mark.parametrize("turns", [FRONT, REAR], ids=["front", "rear"])


@BOTH
@pytest.mark.parametrize("rest", [(0, 2), (4, 6), (8, 10)])
def test_speed_is_exactly_zero_at_rest(turns, rest):
    for time in np.linspace(*rest, 101):
        assert motion(turns, time).speed == 0.0
        assert motion(turns, time).acceleration == 0.0


def test_configurations():
    at = {time: (motion(FRONT, time).angle, motion(REAR, time).angle) for time in (0, 1, 3, 5, 9)}
    assert at[0] == at[1] == (0, 0)
    assert at[3] == pytest.approx((0, math.pi / 2))
    assert at[5] == pytest.approx((0, math.pi))
    assert at[9] == pytest.approx((-PRESS_ANGLE, math.pi + PRESS_ANGLE))


@BOTH
def test_speed_and_acceleration_are_the_derivatives(turns, rng):
    h = 1e-5
    for time in rng.uniform(0.1, 9.9, 300):
        before, here, after = (motion(turns, t) for t in (time - h, time, time + h))
        assert (after.angle - before.angle) / (2 * h) == pytest.approx(here.speed, abs=1e-6)
        assert (after.speed - before.speed) / (2 * h) == pytest.approx(here.acceleration, abs=2e-3)


@pytest.mark.slow
@BOTH
def test_acceleration_is_continuous(turns):
    time = np.linspace(0, 10, 100001)
    acceleration = np.array([motion(turns, t).acceleration for t in time])
    steepest = max(6 * abs(turn.angle) / (turn.stop - turn.start - turn.ramp) / turn.ramp**2 for turn in turns)
    assert np.max(np.abs(np.diff(acceleration))) <= 1.001 * steepest * (time[1] - time[0])


def test_a_turn_covers_its_angle():
    turn = Turn(1.0, 2.5, 0.3, -0.8)
    assert quad(lambda t: turn.at(t).speed, 1.0, 2.5, points=[1.3, 2.2])[0] == pytest.approx(-0.8, abs=1e-9)
    assert turn.at(2.5).angle == -0.8


def test_setpoints_are_a_part_that_can_be_asked_at_any_time():
    part = Setpoints("setpoints")
    assert isinstance(part, Part)
    part.bind([], ["rear_angle", "rear_input_speed", "sprocket_speed"])
    part.set("gear_ratio", 40.0)
    part.enter_initialization(0.0, 10.0)
    part.exit_initialization()
    part.step(0.0, 3.0)
    part.read()
    stepped = part.y.copy()
    part.at(3.0)
    assert part.y.tolist() == stepped.tolist()
    assert part.y[0] == pytest.approx(math.pi / 2)
    assert part.y[1] == pytest.approx(40 * motion(REAR, 3.0).speed)
    assert part.get("sprocket_speed") == part.y[2]


@pytest.mark.parametrize("ramp", [0.0, 0.7])
def test_a_stretch_of_setpoints_is_what_each_of_its_times_tells_to_the_bit(rng, ramp):
    part = Setpoints("setpoints")
    part.bind([], [v.name for v in part.described if v.causality == "output"])
    part.set("sprocket_ramp", ramp)
    edges = [time for turn in (*FRONT, *REAR) for time in (turn.start, turn.start + turn.ramp, turn.stop - turn.ramp, turn.stop)]
    times = np.sort(np.concatenate([edges, rng.uniform(0.0, 11.0, 400), np.arange(1000) * 0.01]))
    np.testing.assert_array_equal(part.ahead(times), Part.ahead(part, times))
