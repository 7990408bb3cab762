"""Reducer.fmu: valid, exact in its state, alone, and with a sentence for every bad value."""

import math
import subprocess
import sys

import pytest
from fmpy.fmi1 import FMICallException
from fmpy.validation import validate_fmu

from selflock.fmus.build import build
from selflock.fmus.reducer import shaft
from selflock.fmus.reducer.fmu import Reducer

OUT = tuple(row.name for row in Reducer.outputs)
ISSUE = {
    "parameters": "kinematic gear_ratio wedge_angle friction_kinetic friction_static preload "
    "shaft_inertia shaft_stiffness shaft_damping",
    "inputs": "motor_torque imposed_angle imposed_speed output_angle output_speed",
    "outputs": "input_torque output_torque friction_torque input_angle input_speed motor_torque_required normal_force stuck "
    "input_power output_power loss_power",
}


def drive(it, first, last, h=1e-3):
    seen = []
    for i in range(first, last):
        it.step(i * h, h, motor_torque=0.1 * math.sin(0.2 * i), output_angle=0.4 * i * h, output_speed=0.4)
        seen.append(it.get(*OUT))
    return seen


def test_variables_and_validity(fmu):
    assert validate_fmu(str(fmu("Reducer"))) == []
    for table, names in ISSUE.items():
        have = [row.name for row in getattr(Reducer, table)]
        assert have[: len(names.split())] == names.split()
    assert all(row.description for row in (*Reducer.inputs, *Reducer.outputs, *Reducer.parameters))
    assert OUT == shaft.Output._fields


def test_the_fmu_is_the_law(instance):
    it = instance("Reducer").begin(friction_kinetic=0.01, initial_speed=5.0, initial_torque=0.5)
    p = shaft.Parameters(friction_kinetic=0.01)
    state = shaft.relaxed(p, 0.5, 5.0, 0.0, 0.0)
    for i, row in enumerate(drive(it, 0, 100)):
        state, out = shaft.advance(p, state, 0.1 * math.sin(0.2 * i), 0.4 * i * 1e-3, 0.4, 1e-3)
        assert row == list(out)


@pytest.mark.parametrize(
    "extra", [{}, {"stribeck_speed": 3.0, "friction_static": 0.05, "heat_coefficient": 0.01, "wear_rate": 1e-3}]
)
def test_run_save_run_restore_run_gives_the_same_bits(instance, extra):
    it = instance("Reducer").begin(friction_kinetic=0.01, backlash=1e-3 if extra else 0.0, **extra)
    drive(it, 0, 40)
    state = it.raw.getFMUstate()
    frozen = it.raw.serializeFMUstate(state)
    first = drive(it, 40, 90)
    it.raw.setFMUstate(state)
    assert drive(it, 40, 90) == first
    it.raw.setFMUstate(it.raw.deSerializeFMUstate(frozen))
    assert drive(it, 40, 90) == first
    it.raw.freeFMUstate(state)


def test_kinematic_mode(instance):
    it = instance("Reducer").begin(kinematic=True, friction_kinetic=0.03, imposed_angle=0.1)
    assert it.get("output_torque") == pytest.approx(40.0) and it.get("input_torque") == 0.0 and it.get("stuck")
    it.step(0.0, 1e-3, imposed_angle=0.1, imposed_speed=2.0, output_angle=0.0, output_speed=0.04)
    assert it.get("input_angle") == pytest.approx(0.102) and not it.get("stuck")
    required = it.get("motor_torque_required") - it.get("input_torque")
    assert required == pytest.approx(shaft.Parameters().shaft_inertia * 2.0 / 1e-3)


BAD = [
    ({"friction_kinetic": -0.1}, "friction_kinetic"),
    ({"friction_static": -0.1}, "friction_static"),
    ({"friction_kinetic": 50.0}, "tan"),
    ({"gear_ratio": 2.0, "friction_static": 2.0}, "tan"),
    ({"wedge_angle": 1.4, "friction_kinetic": 0.3}, "tan"),
    ({"gear_ratio": 0.0}, "gear_ratio"),
    ({"gear_ratio": math.nan}, "gear_ratio"),
    ({"shaft_inertia": -1e-5}, "shaft_inertia"),
    ({"shaft_inertia": 0.0}, "shaft_inertia"),
    ({"shaft_stiffness": 0.0}, "shaft_stiffness"),
    ({"shaft_damping": -1.0}, "shaft_damping"),
    ({"preload": -1.0}, "preload"),
    ({"stribeck_exponent": 0.0}, "stribeck_exponent"),
    ({"warm_up_time": 0.0}, "warm_up_time"),
    ({"backlash": -0.1}, "backlash"),
    ({"output_angle": math.inf}, "output_angle"),
]


@pytest.mark.parametrize("values, word", BAD)
def test_bad_start_values_are_told(instance, values, word):
    it = instance("Reducer")
    with pytest.raises(FMICallException):
        it.begin(**values).step(0.0, 1e-3)
    assert any(word in sentence for sentence in it.said)


@pytest.mark.parametrize("values, size, word", [
    ({"motor_torque": math.nan}, 1e-3, "motor_torque"),
    ({"output_speed": -math.inf}, 1e-3, "output_speed"),
    ({}, -1e-3, "step"),
    ({}, math.nan, "step"),
    ({"motor_torque": 1e308}, 1e-3, "finite"),
])  # fmt: skip
def test_bad_inputs_and_steps_are_told(instance, values, size, word):
    it = instance("Reducer").begin()
    it.step(0.0, 1e-3)
    with pytest.raises(FMICallException):
        it.step(1e-3, size, **values)
    assert any(word in sentence for sentence in it.said)


def test_without_inertia_only_kinematic_mode_runs(instance):
    it = instance("Reducer").begin(kinematic=True, shaft_inertia=0.0, imposed_speed=1.0)
    it.step(0.0, 1e-3)
    assert it.get("motor_torque_required") == it.get("input_torque")


@pytest.mark.slow
def test_builds_repeat(tmp_path):
    one, two = build("Reducer", tmp_path / "1"), build("Reducer", tmp_path / "2")
    assert one.read_bytes() == two.read_bytes()


ALONE = """
import sys
from fmpy import simulate_fmu
result = simulate_fmu(sys.argv[1], stop_time=0.05, step_size=1e-3, output_interval=1e-3, start_values={"initial_speed": 20.0})
assert len(result) == 51 and result["input_speed"][-1] == 0.0 and result["stuck"][-1], result[-1]
try:
    from selflock import fmus
except ImportError:
    print("alone")
"""


@pytest.mark.slow
def test_runs_alone(fmu, tmp_path):
    """A fresh process that cannot import this project."""
    out = subprocess.run([sys.executable, "-I", "-c", ALONE, str(fmu("Reducer"))], cwd=tmp_path, capture_output=True, text=True)
    assert out.returncode == 0, out.stderr
