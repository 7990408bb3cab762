"""How the tests drive the robot: a stiff shaft from a set-point to each holder, as the study's reducers are."""

import numpy as np
import pytest

from selflock.vehicle import Robot
from selflock.vehicle.tables import OUTPUTS

INPUTS = ("front_torque", "rear_torque", "front_sprocket_torque", "rear_sprocket_torque")


@pytest.fixture
def run():
    """run(robot, time, front=angle, rear=angle, sprockets=f(outputs)) -> dict of arrays, one value for each ms."""

    def run(
        robot: Robot, time: float, front: float = 0.0, rear: float = 0.0, sprockets=None, size: float = 1e-3
    ) -> dict[str, np.ndarray]:
        stiffness, damping = 2e4, 8.0
        robot.bind(INPUTS, OUTPUTS)
        robot.exit_initialization()
        robot.read()
        rows = []
        for i in range(round(time / size)):
            y = robot.y
            robot.u[0] = stiffness * (front - y[0] - size * y[1]) - damping * y[1]
            robot.u[1] = stiffness * (rear - y[2] - size * y[3]) - damping * y[3]
            if sprockets:
                robot.u[2:] = sprockets(dict(zip(OUTPUTS, y)))
            robot.write()
            robot.step(i * size, size)
            robot.read()
            rows.append((*robot.u, *robot.y))
        return dict(zip((*INPUTS, *OUTPUTS), np.array(rows).T))

    return run
