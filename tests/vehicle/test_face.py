"""The robot as a part: variables, refusals, failure, saving, repeating, drawing."""

import hashlib
import math
import subprocess
import sys

import numpy as np
import pytest

from selflock.master.errors import DescriptionError, PartFailed
from selflock.master.face import Part
from selflock.vehicle import Robot, munk
from selflock.vehicle.ground import profile
from selflock.vehicle.model import Model
from selflock.vehicle.parameters import INPUTS, VARIABLES
from selflock.vehicle.tables import OUTPUTS

PROGRAM = """
import hashlib, numpy
from selflock.vehicle import Robot
robot = Robot("r", track={track!r}, front_start_angle=0.3, ground="step:0.03,0.8")
robot.bind(["rear_torque"], list(robot.variables)[-22:])
robot.exit_initialization()
told = []
for i in range(150):
    robot.u[0] = -8.0 + 3.0 * (i % 7)
    robot.write(); robot.step(i * 1e-3, 1e-3); robot.read()
    told.append(robot.y.tobytes())
print(hashlib.sha256(b"".join(told)).hexdigest())
"""


def drive(robot: Robot, steps: int, size: float = 1e-3) -> np.ndarray:
    told = []
    for i in range(steps):
        robot.u[:] = -7.0 + i % 5, -5.0 - i % 3
        robot.write()
        robot.step(i * size, size)
        robot.read()
        told.append(robot.y.copy())
    return np.array(told)


def started(**settings) -> Robot:
    robot = Robot("robot", settling_time=0.2, **settings)
    robot.bind(["front_torque", "rear_torque"], OUTPUTS)
    robot.exit_initialization()
    robot.read()
    return robot


def test_it_is_a_part_with_described_variables():
    robot = Robot()
    assert isinstance(robot, Part)
    for variable in VARIABLES.values():
        assert variable.description and variable.name.isidentifier()
        assert variable.type != "Real" or variable.unit or variable.name in ("ground_exponent", "ground_friction")
        if variable.causality == "parameter" and variable.minimum is not None:
            assert variable.minimum <= variable.start <= variable.maximum
    assert {v.name for v in VARIABLES.values() if v.causality == "output"} == set(OUTPUTS)
    assert robot.get("sprocket_radius") == pytest.approx(0.025 / (2 * math.sin(math.pi / 12)))
    assert robot.get("rear_torque") == 0.0 and robot.get("track") == "segmented"


@pytest.mark.parametrize(
    "name, value, words",
    [
        ("chassis_mass", -1.0, "outside"),
        ("segment_mass", 0.0, "outside"),
        ("ground_friction", math.nan, "not a finite number"),
        ("segments", 35, "even"),
        ("segments", 36.5, "whole"),
        ("track", "wheel", "segmented or belt"),
        ("ground", "sea", "ground ="),
        ("weight", 1.0, "no variable"),
        ("front_angle", 1.0, "cannot be set"),
        ("inner_step", "fast", "not a number"),
    ],
)
def test_a_bad_value_is_refused_by_name(name, value, words):
    with pytest.raises(DescriptionError, match=words):
        robot = Robot()
        robot.set(name, value)
        robot.exit_initialization()


def test_parameters_are_fixed_once_it_runs():
    robot = started(track="belt")
    with pytest.raises(DescriptionError, match="before the start"):
        robot.set("chassis_mass", 10.0)
    robot.set("rear_torque", 1.5)
    assert robot.get("rear_torque") == 1.5


def test_an_infinite_input_and_an_explosion_stop_with_what_to_try():
    robot = started(track="belt")
    robot.u[:] = math.inf, 0.0
    robot.write()
    with pytest.raises(PartFailed, match="an input is not finite"):
        robot.step(0.0, 1e-3)
    with pytest.raises(DescriptionError, match="positive"):
        robot.step(0.0, -1e-3)
    with pytest.raises(
        DescriptionError,
        match="inner_step = 0.000333333333 s, and 2000 at most are made with .*; try a step of 0.666666667 s or less, a longer inner_step",
    ):
        robot.step(0.0, 10.0)
    robot = started()
    with pytest.raises(PartFailed, match="shorter inner_step") as failure:
        for i in range(200):
            robot.u[:] = 1e6 * (-1) ** i, 0.0
            robot.write()
            robot.step(i * 1e-3, 1e-3)
    assert "no longer sane" in str(failure.value) and failure.value.inputs["rear_torque"] == 0.0


@pytest.mark.parametrize("track", ["segmented", "belt"])
def test_rolled_back_it_repeats_every_bit(track):
    robot = started(track=track)
    assert robot.can_roll_back
    drive(robot, 20)
    saved = robot.save()
    first = drive(robot, 30)
    robot.restore(saved)
    again = drive(robot, 30)
    assert first.tobytes() == again.tobytes()
    other = started(track=track)  # another instance goes on from there as well
    other.restore(saved)
    assert drive(other, 30).tobytes() == first.tobytes()


def test_a_held_input_makes_the_communication_step_irrelevant():
    results = []
    for parts in (1, 3):
        robot = started()
        robot.u[:] = -1.0, -8.0
        robot.write()
        for i in range(20 * parts):
            robot.step(i * 1e-3 / parts, 1e-3 / parts)
        robot.read()
        results.append(robot.y.tobytes())
    assert results[0] == results[1]


def test_reset_starts_anew():
    robot = started()
    first = drive(robot, 10)
    robot.reset()
    robot.bind(["front_torque", "rear_torque"], OUTPUTS)
    robot.exit_initialization()
    assert drive(robot, 10).tobytes() == first.tobytes()


@pytest.mark.slow
@pytest.mark.parametrize("track", ["segmented", "belt"])
def test_runs_repeat_bit_for_bit_in_fresh_processes(track):
    program = PROGRAM.format(track=track)
    said = [
        subprocess.run([sys.executable, "-c", program], capture_output=True, text=True, check=True, timeout=120).stdout.strip()
        for _ in range(2)
    ]
    assert said[0] == said[1] and len(said[0]) == len(hashlib.sha256().hexdigest())


@pytest.mark.parametrize("track", ["segmented", "belt"])
def test_through_pymunks_batch_interface_the_numbers_are_the_same(track):
    values = {v.name: v.start for v in VARIABLES.values() if v.causality in ("parameter", "input")} | {
        "track": track,
        "settling_time": 0.05,
    }
    told = []
    for direct in (True, False):
        model = Model(values, direct=direct)
        model.inputs[: len(INPUTS)] = [values[name] for name in INPUTS]
        model.settle(0.05)
        for _ in range(20):
            model.inputs[:2] = -1.0, -8.0
            model.advance(1e-3)
        told.append(model.tell().tobytes())
        assert model.exact is direct
    assert told[0] == told[1]


def test_the_door_to_pymunks_memory_opens_here_and_shuts_when_places_are_not_found(monkeypatch):
    assert munk.layout() is not None
    munk.layout.cache_clear()
    monkeypatch.setattr(munk, "WORDS", 9)  # as if the structure had moved
    try:
        assert munk.layout() is None
        robot = Robot(track="belt", settling_time=0.01)
        assert not robot.can_roll_back
        robot.exit_initialization()
        with pytest.raises(DescriptionError, match="without rollback"):
            robot.save()
    finally:
        munk.layout.cache_clear()


@pytest.mark.parametrize("track", ["segmented", "belt"])
def test_its_posture_is_where_its_outputs_say(track):
    robot = started(track=track, ground="stairs:0.1,0.3,3,1.0")
    lines = robot.posture()
    assert set(lines) == {
        "chassis",
        "ground",
        *(f"{end}_{what}" for end in ("front", "rear") for what in ("holder", "track", "sprocket", "idler")),
    }
    for line in lines.values():
        assert line.ndim == 2 and line.shape[1] == 2 and len(line) >= 2 and np.isfinite(line).all()
    y = dict(zip(OUTPUTS, robot.y))
    middle = 0.5 * (lines["front_holder"][0] + lines["rear_holder"][0])
    assert middle == pytest.approx((y["chassis_x"], y["chassis_y"]), abs=1e-4)
    along = lines["rear_holder"][1] - lines["rear_holder"][0]
    assert np.hypot(*along) == pytest.approx(0.3) and math.atan2(along[1], along[0]) == pytest.approx(
        y["rear_angle"] + y["chassis_pitch"]
    )
    lowest = min(lines["front_track"][:, 1].min(), lines["rear_track"][:, 1].min())
    assert -0.003 < lowest < 0.003  # it stands on the ground


def test_a_robot_that_would_settle_for_hours_is_refused():
    """Each value is one that is accepted; together they were 6e7 inner steps before the first of the run."""
    robot = Robot("robot")
    robot.set("settling_time", 60.0)
    robot.set("inner_step", 1e-6)
    with pytest.raises(DescriptionError, match="settling_time = 60 s takes more than [0-9]+ inner steps of inner_step = 1e-06 s"):
        _ = robot.model


def test_who_asks_for_short_inner_steps_is_said():
    stiff = Robot("robot", settling_time=0.0, guide_stiffness=2e7).model
    assert "what a segment's springs ask for" in stiff.too_long(0.5) and "softer guides and contacts" in stiff.too_long(0.5)
    assert Robot("robot", settling_time=0.0, guide_stiffness=2e7, track="belt").model.too_long(0.5) == ""  # it has no segments


def test_what_a_step_has_to_do_is_counted_with_its_segments_iterations_and_ground():
    """The more there is to do in an inner step, the fewer are made: what a step may cost is the same."""
    plain = Robot("robot", settling_time=0.0).model
    assert plain.too_long(0.5) == ""
    many = Robot("robot", settling_time=0.0, segments=400, teeth=100, iterations=200).model
    assert many.most_steps < 0.01 * plain.most_steps
    assert "with 400 segments and 200 iterations; try a step of" in many.too_long(0.01)
    rough = Robot("robot", settling_time=0.0, ground="polyline:" + ";".join(f"{k / 3000},0" for k in range(9000))).model
    assert rough.most_steps < 0.5 * plain.most_steps


@pytest.mark.parametrize(
    "ground, said", [("stairs:0.1,0.3,1e9", "1e\\+09 stairs"), ("polyline:" + "0,0;" * 20000, "20001 points")]
)
def test_a_ground_without_end_is_refused(ground, said):
    with pytest.raises(DescriptionError, match=said) as error:
        profile(ground)
    assert len(str(error.value)) < 200
