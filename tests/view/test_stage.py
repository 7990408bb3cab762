"""The robot as it is drawn from its outputs, against the posture of the model that gave them."""

import math

import numpy as np
import pytest

from selflock.vehicle import Robot
from selflock.view import view

GAP = 2e-4  # m: pymunk's joints give a little, and a holder's body is where it is; the drawing is hinged


def placed(shape, values):
    """The shape's points in the world, by matrices of homogeneous coordinates."""
    frame = np.eye(3)
    for move in shape["moves"]:
        if "place" in move:
            frame = frame @ [[1, 0, values[move["place"][0]]], [0, 1, values[move["place"][1]]], [0, 0, 1]]
        if "shift" in move:
            frame = frame @ [[1, 0, move["shift"][0]], [0, 1, move["shift"][1]], [0, 0, 1]]
        if "turn" in move:
            a = sum(factor * values[name] for name, factor in move["turn"].items())
            frame = frame @ [[math.cos(a), -math.sin(a), 0], [math.sin(a), math.cos(a), 0], [0, 0, 1]]
    points = np.array(shape["points"])
    return (frame @ np.column_stack([points, np.ones(len(points))]).T).T[:, :2]


@pytest.mark.slow
@pytest.mark.parametrize("driven", [False, True])
def test_the_drawing_is_the_posture(driven):
    start = {
        "track": "belt",
        "ground": "slope:15,0.2",
        "front_start_angle": 0.5,
        "rear_start_angle": 2.6,
        "driven_sprockets": driven,
    }
    robot = Robot("robot", **start)
    drawn, model = robot.drawing(), robot.model
    robot.exit_initialization()
    robot.set("front_torque", 4.0)
    for k in range(40):
        robot.step(0.005 * k, 0.005)
    values = {name: robot.get(name) for name in robot.variables}
    shown, seen = robot.posture(), iter(drawn["shapes"])
    assert placed(next(seen), values) == pytest.approx(shown["chassis"], abs=GAP)
    for end, zero in zip(("front", "rear"), model.zero):
        track, sprocket, idler, holder = (next(seen) for _ in range(4))
        assert placed(holder, values) == pytest.approx(shown[f"{end}_holder"], abs=GAP)
        turn = np.array([[math.cos(zero), math.sin(zero)], [-math.sin(zero), math.cos(zero)]])  # outputs begin at 0
        for shape, name in ((sprocket, "sprocket"), (idler, "idler")):
            hub, rim = placed(shape, values)[0], placed(shape, values)[1:]
            axis, circle = shown[f"{end}_{name}"][0], shown[f"{end}_{name}"][1:]
            assert hub == pytest.approx(axis, abs=GAP)
            assert (rim[0] - hub) @ turn == pytest.approx(circle[0] - axis, abs=GAP)
        outer, belt = placed(track, values), shown[f"{end}_track"]
        gap = [min(np.hypot(*(belt - point).T)) for point in outer]  # to the nearest point of the belt, 8 mm apart
        assert max(gap) < 0.006
        assert track["runs"]["per"] == pytest.approx(model.geometry.belt_radius)
    ground = np.array(drawn["ground"])
    assert np.interp(1.2, *ground.T) == pytest.approx(math.tan(math.radians(15.0)))


@pytest.mark.slow
def test_a_robot_without_lengths_is_drawn_as_the_usual_one_and_that_is_said(write, rolling, tmp_path):
    text = view(write("a.csv", rolling())).read_text("utf-8")
    assert "it is drawn with its usual ones, on a flat ground" in text
    text = view(write("c.parquet", rolling(), {"values": {"robot": {"ground": "step:0.25,3.0", "track": "belt"}}})).read_text(
        "utf-8"
    )
    assert "usual ones" not in text and "[3.0,0.25]" in text  # as the file says, even where it has no drawing
    for ground in ("a wall", "polyline:0,0;1,1e300", 7):
        text = view(write("d.parquet", rolling(), {"values": {"robot": {"ground": ground}}})).read_text("utf-8")
        assert "usual ones" in text
    short = {name: of for name, of in rolling().items() if name != "robot.rear_angle"}
    text = view(write("b.parquet", short, {"drawings": {"robot": Robot("robot").drawing()}})).read_text("utf-8")
    assert "robot is not drawn: b.parquet lacks the column robot.rear_angle" in text
