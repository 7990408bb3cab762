"""The example: motors fail while the robot stands on its tips."""

import importlib.util
from pathlib import Path

import pytest

EXAMPLE = Path(__file__).parents[2] / "examples" / "motor_failure.py"


@pytest.fixture(scope="module")
def example():
    spec = importlib.util.spec_from_file_location("motor_failure", EXAMPLE)
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


@pytest.mark.parametrize("friction, stays", [(0.0, False), (0.03, True)])
@pytest.mark.slow
def test_a_self_locking_gear_holds_the_robot_up_when_its_motors_fail(example, friction, stays):
    table = example.run(friction, track="belt").table.set_index("time")
    height = table["robot.chassis_y"]
    down, up, after = height.iloc[5500], height.iloc[8400], height.iloc[-1]
    assert up > down + 0.1
    assert abs(table["front_motor.torque"].iloc[8501:]).max() == 0.0
    assert after == (pytest.approx(up, abs=0.005) if stays else pytest.approx(down, abs=0.02))
