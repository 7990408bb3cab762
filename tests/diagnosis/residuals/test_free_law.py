"""A free law in a whole drive does what the law of that shape does, and is named by where its numbers stand."""

from dataclasses import replace

import numpy as np
import pytest

from selflock.diagnosis.residuals import free_law, loops, whole

from ..plant import recordings
from .test_whole import experiment


def test_its_numbers_say_where_they_stand():
    values = {free_law.name("voltage", "current", x): y for x, y in ((-1.5, 0.2), (0.0, 0.0), (1e-3, 0.7))}
    law = free_law.of({"reducer.viscous_damping": 1e-3, **values})
    assert (law.place, law.over) == (3, 6)
    assert law.knots.tolist() == [-1.5, 0.0, 1e-3] and law.heights.tolist() == [0.2, 0.0, 0.7]
    assert free_law.of({"reducer.viscous_damping": 1e-3}).place == 0
    reading = free_law.of({free_law.name("reading motor.current", "current", x): x for x in (-1.0, 2.0)})
    assert (reading.place, reading.over, reading.channel) == (0, 6, "motor.current")


def test_it_is_straight_between_knots_and_constant_beyond(rng):
    knots, heights = np.sort(rng.uniform(-3.0, 3.0, 7)), rng.normal(size=7)
    for x in (*rng.uniform(-5.0, 5.0, 200), *knots):
        assert loops._straight(knots, heights, x) == pytest.approx(np.interp(x, knots, heights), abs=1e-12)


@pytest.mark.slow
def test_a_free_law_of_a_shape_that_has_a_name_moves_a_drive_as_that_does(tmp_path):
    """Viscous friction is inside the gear's closed form, a free torque is held over a step: both go to the same with the step."""
    bench = experiment(recordings.hide([], recordings.DEVELOPMENT + 7, longest=6.0, duration=6.0), tmp_path)
    far, damping = 400.0, 2e-4  # rad/s, N.m.s/rad
    line = {free_law.name("torque", "speed", x): damping * x for x in (-far, 0.0, far)}
    apart = []
    for step in (4e-4, 1e-4):
        (ch,) = bench.but_with(replace(bench.setting, whole_step=step)).channels.values()
        plain, named, free = (whole.simulate(v, ch)["current"] for v in ({}, {"reducer.viscous_damping": damping}, line))
        size = np.sqrt(np.mean((named - plain) ** 2))
        apart.append(np.sqrt(np.mean((named - free) ** 2)) / size)
    assert apart[1] < 0.05 and apart[1] < 0.5 * apart[0]


@pytest.mark.slow
def test_a_free_reading_is_what_a_sensor_of_that_shape_reads(tmp_path):
    """Of a channel beside the loop, and of the angle that the controller acts on; a sensor's scale is a straight line."""
    bench = experiment(recordings.hide([], recordings.DEVELOPMENT + 7, longest=6.0, duration=6.0), tmp_path)
    (ch,) = bench.channels.values()
    for channel, variable in (("motor.current", "current"), ("load.angle", "output position")):
        line = {free_law.name(f"reading {channel}", variable, x): 0.05 * x for x in (-100.0, 100.0)}
        scaled = {f"sensor.{channel}.scale_factor": 1.05}
        for shown in ("motor.current", "load.angle", "controller.voltage"):
            if ch.has(shown):
                named, free, plain = (whole.read(shown, values, ch) for values in (scaled, line, {}))
                size = np.sqrt(np.mean((named - plain) ** 2))
                assert np.sqrt(np.mean((named - free) ** 2)) < 1e-6 * max(size, 1.0)
