"""The example: the robot climbs stairs by four drives."""

import importlib.util
from math import atan
from pathlib import Path

import pytest

from selflock import examples, master

EXAMPLE = Path(__file__).parents[2] / "examples" / "climb.py"


def test_its_table_comes_with_it(tmp_path):
    assert {path.name for path in examples.copy("climb", tmp_path)} == {"climb.py", "climb.csv"}


@pytest.mark.slow
def test_it_leans_on_the_edges_of_the_stairs_and_gains_a_rise_with_each_run():
    spec = importlib.util.spec_from_file_location("climb", EXAMPLE)
    example = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(example)
    system = example.system()
    system.run.record = ["robot.chassis_*"]
    table = master.run(system, stop=14.5, step=1e-3).table.set_index("time")
    up = table[12.8:]  # straight, on the edges: as steep as the line through them
    assert up["robot.chassis_pitch"].mean() == pytest.approx(atan(0.17 / 0.29), abs=0.02)
    gained = up["robot.chassis_y"].iloc[-1] - up["robot.chassis_y"].iloc[0]
    assert gained / (up["robot.chassis_x"].iloc[-1] - up["robot.chassis_x"].iloc[0]) == pytest.approx(0.17 / 0.29, abs=0.03)
    assert up["robot.chassis_y"].iloc[-1] > 2 * 0.17
