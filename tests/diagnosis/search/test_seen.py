"""Where a controller's sensors are is found of what a drive leaves, where no command tells."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from selflock.diagnosis.data.faults import check
from selflock.diagnosis.data.log import MeasuredRun
from selflock.diagnosis.data.rig import DUAL, LOAD, MOTOR, LogColumn, Rig
from selflock.diagnosis.pipeline.run import diagnose_runs
from selflock.diagnosis.residuals import whole
from selflock.diagnosis.residuals.drive_experiment import DriveExperiment
from selflock.diagnosis.search.problem import Problem
from selflock.diagnosis.search.seen import places

RATIO, INERTIA = 50.0, 0.05
SHARE = {"controller.voltage": 1e-3, "motor.current": 1e-3}  # of its size is a channel's noise
NOISE = {"reducer.input_angle": 1e-3, "reducer.input_speed": 0.05, "load.angle": 2e-5}  # rad, rad/s


def logged(at, rng, names, said="", **more):
    """The experiment of a log that the product's own drive makes of set-points, an arm on a soft shaft, its sensors `at` one place.

    said: what its rig says of that; more: what the drive has otherwise than the rig.
    """
    time, wave = np.arange(0.0, 6.0, 2e-3), rng.uniform(3.0, 5.0)
    given = {
        "controller.angle_gain": 60.0, "controller.speed_gain": 2.0, "controller.release_time": 1e9, "motor.resistance": 0.9,
        "motor.voltage_constant": 0.021, "motor.torque_constant": 0.021, "motor.inductance": 6e-4, "reducer.gear_ratio": RATIO,
        "reducer.friction_kinetic": 0.02, "reducer.shaft_inertia": 1.2e-5, "reducer.shaft_stiffness": 300.0,
        "reducer.shaft_damping": 2.0, "load.inertia": INERTIA, "load.mass": 1.0, "load.arm": 0.3,
    }  # fmt: skip
    signals = {name: np.zeros(len(time)) for name in names}
    signals["controller.angle_setpoint"] = 0.6 * np.sin(wave * time) * np.sin(0.7 * time)
    rig = Rig(
        Path("rig.toml"), "bot", "forward", tuple(LogColumn(n, n) for n in signals), given, time=LogColumn("time", "time"),
        simulate=whole.WHOLE, loop=at,
    )  # fmt: skip
    run = MeasuredRun("log.csv", "", np.arange(len(time)), time, signals)
    hidden = {name.replace("__", "."): value for name, value in more.items()}
    bench = DriveExperiment(replace(rig, parameters=given | hidden), [run])
    ch = bench.channels[0, ""]
    made, here = whole.simulate({}, ch), whole.grid(ch).time
    read = {}
    for name in names:
        true = np.interp(time, here, made[whole.SHOWN[name]])
        noise = NOISE[name] if name in NOISE else SHARE[name] * np.std(true)
        read[name] = true + noise * rng.standard_normal(len(time))
    run = MeasuredRun("log.csv", "", np.arange(len(time)), time, signals | read)
    check([run], rig)
    return replace(rig, loop=said), run


def placed(rig, run):
    """Where the sensors are taken to be in the end."""
    of = lambda place: DriveExperiment(replace(rig, loop=place), [run])
    problem = lambda place: Problem.of(bench := of(place), np.ones(bench.layout.count, bool))
    first = of(rig.loop)
    return [*places(first, problem), first.rig.loop or LOAD][0]


@pytest.mark.parametrize("command", [(), ("controller.voltage",)], ids=["no command", "command"])
@pytest.mark.parametrize("at", [LOAD, MOTOR, DUAL])
def test_the_place_that_leaves_least_is_kept(at, command, rng):
    assert placed(*logged(at, rng, ("motor.current", "reducer.input_angle", "load.angle", *command))) == at


def test_a_speed_of_the_motor_alone_may_be_the_controllers(rng):
    """Its angle is not logged, so that it can be LOAD or DUAL."""
    assert placed(*logged(DUAL, rng, ("controller.voltage", "motor.current", "reducer.input_speed", "load.angle"))) == DUAL


@pytest.mark.slow
@pytest.mark.in_turn
@pytest.mark.parametrize("at", [LOAD, MOTOR, DUAL])
def test_a_cause_is_found_wherever_they_are(at, rng):
    """A drive that something is missing of may leave less with its sensors at another shaft; with what is found there it does not."""
    name, value = [("motor.resistance", 1.1), ("reducer.viscous_damping", 2e-4), ("load.damping", 0.5)][rng.integers(3)]
    rig, run = logged(at, rng, ("motor.current", "reducer.input_angle", "load.angle"), **{name.replace(".", "__"): value})
    found = diagnose_runs(rig, [run], [], [False], None, lambda *_: None, 1)
    assert [list(cause.parameters) for cause in found.causes] == [[name]]
    assert found.causes[0].parameters[name]["value"] == pytest.approx(value, rel=0.1)
