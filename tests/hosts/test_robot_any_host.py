"""Robot.fmu in a host that is not Python: numpy, numba and pymunk run inside it, or it says what is missing."""

import subprocess
import sys

import pytest
from lives import Extracted, born, by_fmpy, numbers, steps

from selflock.vehicle.robot_fmu import build

PARAMETERS = {"settling_time": 0.1, "chassis_mass": 20.0}


def inputs(i):
    return {"rear_torque": -7.0 - i % 3, "front_torque": -1.5 - i % 2, "sprocket_speed": -3.0}


@pytest.fixture(scope="module")
def robot(tmp_path_factory):
    folder = tmp_path_factory.mktemp("robot")
    return Extracted(build(folder), folder / "Robot")


@pytest.mark.slow
def test_the_numbers_of_fmpy_and_of_a_restored_state(host, robot):
    life = [
        *born(robot, parameters=PARAMETERS),
        *steps(robot, inputs, 0, 20),
        ("save", 0, 1),
        *steps(robot, inputs, 20, 40),
        ("restore", 0, 1),
        *steps(robot, inputs, 20, 40),
        ("pack", 0, 1),
        ("restore", 0, 1),
        *steps(robot, inputs, 20, 40),
        ("drop", 0, 1),
        ("terminate", 0),
        ("free", 0),
    ]
    answers, said = host(life, SELFLOCK_PYTHON=sys.executable)
    assert said == []
    seen, expected = numbers(life, answers), by_fmpy(robot, PARAMETERS, inputs, 40)
    assert seen[:40] == expected  # to the last bit
    assert seen[40:60] == seen[60:] == expected[20:]


@pytest.mark.slow
def test_two_robots_at_once(host, robot):
    life = [*born(robot, 0, "A", PARAMETERS), *born(robot, 1, "B", PARAMETERS)]
    for n in range(5):
        life += [*steps(robot, inputs, n, n + 1, 0), *steps(robot, inputs, n, n + 1, 1)]
    life += [("free", 1), ("free", 0)]
    answers, said = host(life, SELFLOCK_PYTHON=sys.executable)
    seen = numbers(life, answers)
    assert said == [] and seen[::2] == seen[1::2]


@pytest.mark.slow
def test_a_python_without_pymunk_is_told_so(host, robot, tmp_path):
    subprocess.run([sys.executable, "-m", "venv", "--without-pip", "--copies", tmp_path / "bare"], check=True)
    python = tmp_path / "bare" / "bin" / "python"
    if subprocess.run([python, "-c", "import pymunk"], capture_output=True).returncode == 0:
        pytest.skip("this machine's own Python has pymunk: no Python without it to try")
    again = ("new", 1, "A", "again", robot.uri, robot.description.guid)
    answers, said = host([*born(robot)[:2], again], SELFLOCK_PYTHON=python)
    told = [line for line in answers if line.startswith("ImportError")]  # the second line of what pythonfmu logs of it
    assert [line for line in answers if line not in told] == [
        "0",
        "null",
        "null",
    ]  # no instance: hosts stop, and this one lives on
    assert len(told) == 2 and len(said) == 4
    for line in told:
        assert "lacks numpy" in line and "pip install" in line and str(python) in line
