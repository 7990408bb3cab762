"""Robot.fmu: the same bits as the part, in FMPy and through the master; states; a host that lacks what it needs."""

import os
import shutil
import subprocess
import sys
import zipfile

import numpy as np
import pytest
from fmpy import extract, read_model_description
from fmpy.fmi2 import FMU2Slave
from fmpy.validation import validate_fmu

from selflock import master
from selflock.fmus.errors import BuildError
from selflock.vehicle import Robot
from selflock.vehicle.robot_fmu import build
from selflock.vehicle.tables import OUTPUTS

SYSTEM = """
[run]
stop = 0.15
step = 0.001
[components.robot]
{robot}
[components.robot.start]
settling_time = 0.2
track = "{track}"
ground = "step:0.04,0.7"
rear_torque = -7.0
front_torque = -1.5
front_sprocket_torque = 0.0
rear_sprocket_torque = 0.0
sprocket_speed = -3.0
"""


@pytest.fixture(scope="module")
def fmu(tmp_path_factory):
    return build(tmp_path_factory.mktemp("robot"))


class Host:
    """FMPy as a host: start values, steps with inputs, all outputs."""

    def __init__(self, path, folder, **starts):
        self.description = read_model_description(path)
        self.reference = {v.name: v.valueReference for v in self.description.modelVariables}
        self.type = {v.name: v.type for v in self.description.modelVariables}
        self.folder = extract(path, unzipdir=str(folder))
        self.slave = FMU2Slave(
            guid=self.description.guid,
            unzipDirectory=self.folder,
            modelIdentifier=self.description.coSimulation.modelIdentifier,
            instanceName="robot",
        )
        self.said = []
        self.slave.instantiate(loggingOn=True)
        self.slave.setupExperiment(startTime=0.0)
        for name, value in starts.items():
            getattr(self.slave, f"set{self.type[name]}")([self.reference[name]], [value])
        self.slave.enterInitializationMode()
        self.slave.exitInitializationMode()

    def drive(self, steps):
        told = []
        inputs = [self.reference["front_torque"], self.reference["rear_torque"]]
        outputs = [self.reference[name] for name in OUTPUTS]
        for i in range(steps):
            self.slave.setReal(inputs, [-1.0 - i % 4, -6.0 - i % 3])
            self.slave.doStep(i * 1e-3, 1e-3)
            told.append(self.slave.getReal(outputs))
        return np.array(told)


@pytest.mark.slow
def test_it_is_valid_and_builds_the_same_bytes_twice(fmu, tmp_path):
    assert validate_fmu(str(fmu)) == []
    assert build(tmp_path).read_bytes() == Robot.pack(tmp_path / "again").read_bytes() == fmu.read_bytes()
    names = {v.name for v in read_model_description(fmu).modelVariables}
    with zipfile.ZipFile(fmu) as archive:
        assert b"<svg" in archive.read("documentation/index.html") and b"(eq 23)" in archive.read("documentation/index.html")
    assert {"rear_torque", "ground", "track", "driven_sprockets", "rear_pressure_x"} <= names
    with pytest.raises(BuildError, match="wheels"):
        build(tmp_path, wheels=4)


@pytest.mark.slow
@pytest.mark.parametrize("track", ["segmented", "belt"])
def test_its_numbers_are_the_parts_to_the_last_bit(fmu, track, tmp_path):
    host = Host(fmu, tmp_path / "fmu", track=track, ground="stairs:0.05,0.3,3,0.7", settling_time=0.2)
    part = Robot("robot", track=track, ground="stairs:0.05,0.3,3,0.7", settling_time=0.2)
    part.bind(["front_torque", "rear_torque"], OUTPUTS)
    part.exit_initialization()
    for i, row in enumerate(host.drive(60)):
        part.u[:] = -1.0 - i % 4, -6.0 - i % 3
        part.write()
        part.step(i * 1e-3, 1e-3)
        part.read()
        assert part.y.tobytes() == row.tobytes()
    host.slave.terminate()
    host.slave.freeInstance()


def test_it_goes_on_from_a_saved_and_from_a_serialised_state(fmu, tmp_path):
    host = Host(fmu, tmp_path / "fmu", settling_time=0.1)
    host.drive(20)
    state = host.slave.getFMUState()
    data = host.slave.serializeFMUState(state)
    first = host.drive(30)
    host.slave.setFMUState(state)
    assert host.drive(30).tobytes() == first.tobytes()
    host.slave.setFMUState(host.slave.deSerializeFMUstate(data))
    assert host.drive(30).tobytes() == first.tobytes()
    host.slave.terminate()
    host.slave.freeInstance()


@pytest.mark.slow
@pytest.mark.parametrize("track", ["segmented", "belt"])
def test_through_the_master_it_equals_the_part(fmu, track, tmp_path):
    tables = []
    for name, robot in (("part", 'part = "selflock.vehicle:Robot"'), ("fmu", f'fmu = "{fmu}"')):
        system = tmp_path / f"{name}.toml"
        system.write_text(SYSTEM.format(robot=robot, track=track))
        tables.append(master.run(system).table)
    part, packed = tables
    shared = [f"robot.{name}" for name in OUTPUTS]
    assert part[shared].to_numpy().tobytes() == packed[shared].to_numpy().tobytes()


def test_a_python_without_pymunk_is_told_what_is_missing(fmu, tmp_path):
    """The sources alone, in a fresh interpreter that finds nothing but them and pythonfmu."""
    with zipfile.ZipFile(fmu) as archive:
        archive.extractall(tmp_path)
    script = (tmp_path / "resources" / "slavemodule.txt").read_text()
    program = f"""
import sys
sys.path[:0] = [r"{tmp_path / "resources"}"]
import {script} as module
try:
    module.Robot(instance_name="robot", resources="")
except ImportError as error:  # which pythonfmu logs; there is no instance then
    print(error)
"""
    environment = {k: v for k, v in os.environ.items() if k != "PYTHONPATH"}
    python = shutil.which("python3", path="/usr/bin:/usr/local/bin") or sys.executable
    done = subprocess.run(
        [python, "-S", "-c", program], capture_output=True, text=True, timeout=60, env=environment, cwd=tmp_path
    )
    assert "lacks numpy" in done.stdout or "lacks pymunk" in done.stdout or "lacks numba" in done.stdout, (
        done.stdout + done.stderr
    )
    assert "pip install" in done.stdout and done.returncode == 0
