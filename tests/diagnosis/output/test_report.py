"""What a report says in words."""

from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest

from selflock.diagnosis.data.signals import along
from selflock.diagnosis.judge.cause import Cause
from selflock.diagnosis.judge.models import OpenModel
from selflock.diagnosis.output.report import convention, dependences, following, left_over


@pytest.mark.parametrize(
    "value, unit, said",
    [(-1.5 * np.pi, "rad", "-270°"), (np.pi / 2 + 0.01, "rad", "90°"), (0.01, "rad", ""), (np.pi, "A", ""), (1.0, "rad", "")],
)
def test_a_bias_of_quarters_of_a_turn_is_another_zero(value, unit, said):
    number = {"value": value, "low": value - 0.001, "high": value + 0.001, "unit": unit, "determined": True, "doubt": ""}
    told = convention(Cause("sensor", "bias", {"sensor.load.angle.bias": number}, 1.0, channel="load.angle"))
    assert (f" is {said}: no fault of a sensor" in told) if said else told == ""


@pytest.mark.parametrize(
    "verdict, count, loop", [("ambiguous", 2, True), ("unknown", 2, False), ("none", 2, True), ("explained", 1, True)]
)
def test_a_plan_is_offered_where_there_is_something_to_tell_apart_and_a_loop_to_plan_for(verdict, count, loop):
    models = [OpenModel(name, {}, {}) for name in ("wear", "warm-up")[:count]]
    told = " ".join(following(SimpleNamespace(causes=[], verdict=verdict, models=models, best=None, folder=Path("out")), loop))
    assert ("selflock plan out finds the run to record that tells apart: wear; warm-up." in told) == (verdict == "ambiguous")


def test_what_is_left_is_said_in_words():
    assert left_over("time, period 2.35 s") == "comes again every 2.35 s" and left_over("time") == "changes with time"
    assert left_over("position", linear=True) == left_over("output position", linear=True) == "comes at places of its way"
    assert left_over("room.temperature") == "depends on room.temperature"


@pytest.mark.parametrize(
    "name, unit, told",
    [("shaft_inertia", "kg.m2", "kg"), ("damping", "N.m.s/rad", "N.s/m"), ("torque_constant", "N.m/A", "N/A"), ("backlash", "rad", "m"),
     ("shaft_stiffness", "N.m/rad", "N/m"), ("compliance", "rad/N.m", "m/N"), ("input_ripple_phase", "rad", "rad"), ("wedge_angle", "rad", "rad")],
)  # fmt: skip
def test_units_of_a_linear_drive(name, unit, told):
    assert along(unit, name) == told


def test_of_much_that_is_left_the_first_lines_say_the_most():
    assert dependences(["a", "b", "a", "c"]) == "a; b; c"
    assert dependences(["a", "b", "c", "d", "e"]) == "a; b; c; and with 2 more, below"
