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


SOFT = {"angle_gain": 20.0, "speed_gain": 1.0}  # of a loop that does not hunt
ROWS = ("controller.voltage", "motor.current", "motor.torque", "reducer.input_angle", "reducer.input_speed",
        "reducer.output_torque", "load.angle", "load.speed")  # fmt: skip


def coupled(closed, parts):
    """The faces one after another, and the loop of their laws, in `parts` steps a millisecond: rows of each millisecond."""
    n, step = 100 * parts, 1e-3 / parts
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

    began = {"controller": SOFT, "reducer": {"initial_speed": 3.0}, "load": {"start_angle": 0.05, "start_speed": 0.06}}
    for part, own in began.items():
        slaves[part].set_real([slaves[part]._place[name] for name in own], list(own.values()))
    first = {"controller": {"angle_setpoint": wanted[0], "speed_setpoint": rate[0]}}
    for part, slave in slaves.items():
        give(part, **first.get(part, {}))
        slave.enter_initialization_mode()
        slave.exit_initialization_mode()
    found = np.zeros((8, n))
    for i in range(n):
        for part in chain.ORDER[:-1] if i else ():
            give(part)
            assert slaves[part].do_step(0.0, step)
            take(part)
        now["controller.voltage"] = voltage[i]
        if closed:
            give("controller", angle_setpoint=wanted[i], speed_setpoint=rate[i])
            assert slaves["controller"].do_step(0.0, step)
            take("controller")
        found[:, i] = [now[name] for name in ROWS]
    laws = [loops.pd.Parameters(**SOFT), loops.dc.Parameters(), loops.shaft.Parameters(), loops.load.Parameters()]
    expected = np.zeros((8, n))
    loops.whole(*laws, float(closed), np.ones(n), np.zeros(n), voltage, wanted, rate, np.full(n, step), 1, start, expected)
    return found[:, ::parts], expected[:, ::parts]


@pytest.mark.parametrize("closed", [False, True])
def test_the_loop_over_a_whole_drive_is_what_it_comes_to_in_short_steps(closed):
    """Components that take turns are of first order in the step: a quarter of it, a quarter of the difference, about."""
    coarse, fine = (np.sqrt(np.mean((found - loop) ** 2, axis=1)) for found, loop in (coupled(closed, 4), coupled(closed, 16)))
    moved = slice(0 if closed else 1, None)  # the voltage is given where the loop is open
    assert np.all(fine[moved] < 0.4 * coarse[moved]), fine / coarse


@pytest.mark.parametrize("name", ["robot.toml", "four_drives.toml"])
def test_the_study_s_systems_follow_it(name):
    """Each drive of the robot, up to what it drives."""
    system = master.load(resources.files("selflock.study") / name)
    drives = [part.removesuffix("controller") for part in system.components if part.endswith("_controller")]
    assert drives
    for target, source in chain.CONNECTIONS.items():
        if "load" not in target + source:
            assert [system.connections[drive + target].source for drive in drives] == [drive + source for drive in drives]
