"""The chain of the drive: complete, of variables that there are, and what the compiled loop over a whole drive does."""

from importlib import resources

import numpy as np
import pytest

from selflock import master
from selflock.diagnosis.residuals import loops
from selflock.fmus import chain
from selflock.fmus.build import face_of

FACES = {part: face_of(part.capitalize()) for part in chain.ORDER}
GIVEN = {"angle_setpoint", "speed_setpoint", "imposed_angle", "imposed_speed"}  # by the log


def test_every_input_has_its_output():
    for part, face in FACES.items():
        assert {row.name for row in face.inputs} - GIVEN == set(chain.inputs(part))
        for source in chain.inputs(part).values():
            owner, output = source.split(".")
            assert output in {row.name for row in FACES[owner].outputs}


@pytest.mark.parametrize("closed", [False, True])
def test_the_loop_over_a_whole_drive_follows_it(closed):
    n, step, parts = 200, 1e-3, 2
    time = step * np.arange(n)
    wanted, rate, voltage = 0.05 * np.sin(20.0 * time), np.cos(20.0 * time), 10.0 * np.sin(30.0 * time)
    start = np.array([2.5, 3.0, 0.05, 0.06])
    slaves = {part: face(instance_name=part, resources="") for part, face in FACES.items()}
    now = {f"{part}.{row.name}": 0.0 for part, face in FACES.items() for row in face.outputs}
    now |= dict(zip(("reducer.input_angle", "reducer.input_speed", "load.angle", "load.speed"), start))

    def give(part, **more):
        named = {name: now[source] for name, source in chain.inputs(part).items()} | more
        slaves[part].set_real([slaves[part]._place[name] for name in named], list(named.values()))

    def take(part):
        now.update({f"{part}.{row.name}": slaves[part].value(row.name) for row in FACES[part].outputs})

    for part, own in {"reducer": {"initial_speed": 3.0}, "load": {"start_angle": 0.05, "start_speed": 0.06}}.items():
        slaves[part].set_real([slaves[part]._place[name] for name in own], list(own.values()))
    first = {"controller": {"angle_setpoint": wanted[0], "speed_setpoint": rate[0]}}
    for part, slave in slaves.items():
        give(part, **first.get(part, {}))
        slave.enter_initialization_mode()
        slave.exit_initialization_mode()
    found = np.zeros((8, n))
    rows = ("controller.voltage", "motor.current", "motor.torque", "reducer.input_angle", "reducer.input_speed",
            "reducer.output_torque", "load.angle", "load.speed")  # fmt: skip
    for i in range(n):
        for _ in range(parts if i else 0):
            for part in chain.ORDER[:-1]:
                give(part)
                assert slaves[part].do_step(0.0, step / parts)
                take(part)
        now["controller.voltage"] = voltage[i]
        if closed:
            give("controller", angle_setpoint=wanted[i], speed_setpoint=rate[i])
            assert slaves["controller"].do_step(0.0, step)
            take("controller")
        found[:, i] = [now[name] for name in rows]
    laws = [loops.pd.Parameters(), loops.dc.Parameters(), loops.shaft.Parameters(), loops.load.Parameters()]
    expected = np.zeros((8, n))
    whole = (np.ones(n), np.zeros(n), voltage, wanted, rate, np.full(n, step), parts, start, expected)
    loops.whole(*laws, float(closed), *whole)
    np.testing.assert_allclose(found, expected, rtol=1e-9, atol=1e-12)


@pytest.mark.parametrize("name", ["robot.toml", "four_drives.toml"])
def test_the_study_s_systems_follow_it(name):
    """Each drive of the robot, up to what it drives."""
    system = master.load(resources.files("selflock.study") / name)
    drives = [part.removesuffix("controller") for part in system.components if part.endswith("_controller")]
    assert drives
    for target, source in chain.CONNECTIONS.items():
        if "load" not in target + source:
            assert [system.connections[drive + target].source for drive in drives] == [drive + source for drive in drives]
