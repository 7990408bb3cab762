"""A system exported as .ssp gives in libcosim and Ecos what our Jacobi gives.

Needs the extra `masters` (libcosimpy, ecospy) and for Ecos the system library libtbb12: `make test-masters`.
"""

import shutil
import sys
from pathlib import Path

import numpy as np
import pytest

from selflock import master, study
from selflock.master.ssp import export

HERE = Path(__file__).parent
sys.path.insert(0, str(HERE))
import others  # noqa: E402

STEP, COUNT = 1e-3, 500
ROBOT_STEP, ROBOT_COUNT = 1e-4, 1500  # Jacobi is stable with the stiff drive shafts of the robot up to about 0.1 ms


def needs(name):
    try:
        __import__(name)
    except (ImportError, OSError) as error:
        pytest.skip(f"{name} cannot be loaded ({error}); install the extra `masters`, and libtbb12 for Ecos")


@pytest.fixture(scope="module")
def libcosim():
    """Before all that is prepared for a comparison with it."""
    needs("libcosimpy")


@pytest.fixture(scope="module")
def ecos():
    needs("ecospy")


@pytest.fixture(scope="module")
def archive(tmp_path_factory):
    return export(HERE / "servo.toml", tmp_path_factory.mktemp("ssp") / "servo.ssp")


@pytest.fixture(scope="module")
def ours(archive):
    table = master.run(archive, stop=STEP * COUNT).table
    assert np.ptp(table["load.angle"]) > 0.5  # the servo moves: there is something to compare
    return table


def difference(theirs, ours, first):
    """Largest difference of each column from point `first` on, as a share of the column's largest value."""
    return {
        name: float(np.max(np.abs(column[first:] - ours[name].to_numpy()[first:])) / (np.max(np.abs(column)) or 1.0))
        for name, column in theirs.items()
    }


def test_our_own_export_comes_back_the_same(archive, ours):
    table = master.run(HERE / "servo.toml", stop=STEP * COUNT).table
    assert table.equals(ours)


def test_libcosim(libcosim, archive, ours):
    """Before its first step libcosim's observer shows zeros, so row 0 is left out. What remains is rounding: libcosim
    keeps time in whole nanoseconds and takes each step's length as the difference of two rounded times."""
    worst = difference(others.libcosim(archive, STEP, COUNT), ours, first=1)
    assert max(worst.values()) <= 1e-9, worst


def test_ecos(ecos, archive, ours):
    worst = difference(others.ecos(archive, STEP, COUNT), ours, first=0)
    assert max(worst.values()) <= 1e-9, worst


@pytest.fixture(scope="module")
def robot(tmp_path_factory):
    """The whole robot, with Robot.fmu and Setpoints.fmu in the place of the parts in process."""
    return export(Path(study.__file__).parent / "robot.toml", tmp_path_factory.mktemp("ssp") / "robot.ssp")


@pytest.fixture(scope="module")
def our_robot(robot):
    system = master.load(robot)
    system.run.algorithm, system.run.order, system.run.step = "jacobi", [], ROBOT_STEP
    return master.run(system, stop=ROBOT_STEP * ROBOT_COUNT).table


@pytest.mark.slow
def test_the_robot_as_fmus_is_the_robot_in_process(our_robot):
    """Bit for bit, but for the set-points' clock: the master computes t + h, an FMU's host gives it t and h."""
    system = master.load(Path(study.__file__).parent / "robot.toml")
    system.run.algorithm, system.run.step = "jacobi", ROBOT_STEP
    table = master.run(system, stop=ROBOT_STEP * ROBOT_COUNT).table
    for name in table:
        if name.startswith("setpoints."):
            np.testing.assert_allclose(our_robot[name], table[name], rtol=1e-14, atol=1e-300)
        else:
            assert our_robot[name].equals(table[name]), name


@pytest.mark.slow
def test_the_robot_in_libcosim(libcosim, robot, our_robot):
    worst = difference(others.libcosim(robot, ROBOT_STEP, ROBOT_COUNT), our_robot, first=1)
    assert max(worst.values()) <= 1e-9, worst


def test_the_robot_in_ecos(ecos, robot, our_robot):
    worst = difference(others.ecos(robot, ROBOT_STEP, ROBOT_COUNT), our_robot, first=0)
    assert max(worst.values()) <= 1e-9, worst


RING = """<?xml version="1.0" encoding="utf-8"?>
<OspSystemStructure xmlns="http://opensimulationplatform.com/MSMI/OSPSystemStructure" version="0.1">
  <StartTime>0.0</StartTime><EndTime>0.5</EndTime><BaseStepSize>1e-2</BaseStepSize><Algorithm>fixedStep</Algorithm>
  <Simulators>
    <Simulator name="a" source="relaxation.fmu"><InitialValues><InitialValue variable="rate"><Real value="2"/></InitialValue></InitialValues></Simulator>
    <Simulator name="b" source="relaxation.fmu" stepSize="0.025"><InitialValues><InitialValue variable="rate"><Real value="3"/></InitialValue></InitialValues></Simulator>
    <Simulator name="c" source="relaxation.fmu"><InitialValues><InitialValue variable="rate"><Real value="4"/></InitialValue></InitialValues></Simulator>
  </Simulators>
  <Functions><LinearTransformation name="scale" factor="-0.5" offset="1.5"/><Sum name="sum" inputCount="2"/></Functions>
  <Connections>
    <SignalConnection><Variable simulator="a" name="x"/><Signal function="scale" name="in"/></SignalConnection>
    <SignalConnection><Signal function="scale" name="out"/><Variable simulator="b" name="u"/></SignalConnection>
    <SignalConnection><Variable simulator="a" name="x"/><Signal function="sum" name="in[0]"/></SignalConnection>
    <SignalConnection><Variable simulator="b" name="x"/><Signal function="sum" name="in[1]"/></SignalConnection>
    <SignalConnection><Signal function="sum" name="out"/><Variable simulator="c" name="u"/></SignalConnection>
    <VariableConnection><Variable simulator="a" name="u"/><Variable simulator="c" name="x"/></VariableConnection>
  </Connections>
</OspSystemStructure>"""


def test_a_structure_of_osp_in_libcosim(libcosim, native, tmp_path):
    """With a transformation, a sum, and a longer step that is no multiple: bit by bit but for the last digit."""
    shutil.copy(native("relaxation"), tmp_path)
    (tmp_path / "OspSystemStructure.xml").write_text(RING)
    names = ["a.x", "b.x", "c.x"]
    table = master.run(tmp_path / "OspSystemStructure.xml").table
    assert table[names].iloc[-1].to_numpy() == pytest.approx(others.libcosim_of(tmp_path, names, 50), rel=1e-14)
