"""A running FMU: its state saved to the bit, every bad value answered, its answers independent of how it is stepped."""

import json
import math

import pytest
from fmpy.fmi1 import FMICallException

from selflock.fmus.motor.fmu import Motor

# Each FMU with inputs that vary, so that its whole state is at work: name -> (parameters, inputs at step i).
LIVELY = {
    "Motor": (
        {"winding_thermal_resistance": 5.0, "cogging_torque": 0.01, "brush_voltage": 0.5, "weakening_per_loss": 0.01},
        lambda i: {"voltage": 10.0 * math.sin(0.3 * i), "speed": 50.0 * math.cos(0.1 * i)},
    ),
    "Controller": (
        {"command_delay": 0.003, "sample_period": 0.002, "dead_zone": 0.1},
        lambda i: {"angle_setpoint": 0.03 * math.sin(0.2 * i), "speed": 0.1 * math.cos(i)},
    ),
    "Load": ({"mass": 1.0, "damping": 0.2}, lambda i: {"torque": math.sin(0.5 * i)}),
    "Sensor": ({"lag_time": 0.01, "resolution": 1e-3}, lambda i: {"value": math.sin(0.5 * i)}),
    "Reducer": (
        {"backlash": 1e-3, "cold_excess": 0.5, "preload": 0.01},
        lambda i: {"motor_torque": 0.3 * math.sin(0.2 * i), "output_angle": 1e-3 * math.sin(0.1 * i), "output_speed": 0.1},
    ),
}


def trace(it, inputs, outputs, first, last, h=1e-3):
    seen = []
    for i in range(first, last):
        it.step(i * h, h, **inputs(i))
        seen.append(it.get(*outputs))
    return seen


def outputs_of(it):
    from fmpy import read_model_description

    return [v.name for v in read_model_description(it.folder).modelVariables if v.causality == "output"]


@pytest.mark.parametrize("name", LIVELY)
def test_state_comes_back_to_the_bit(instance, name):
    parameters, inputs = LIVELY[name]
    it = instance(name).begin(**parameters)
    outputs = outputs_of(it)
    trace(it, inputs, outputs, 0, 20)
    saved = it.raw.getFMUState()
    kept = it.raw.serializeFMUState(saved)
    before = it.get(*outputs)
    ahead = trace(it, inputs, outputs, 20, 50)
    it.raw.setFMUState(saved)
    assert it.get(*outputs) == before
    assert trace(it, inputs, outputs, 20, 50) == ahead
    it.raw.setFMUState(saved)  # a state can be restored more than once
    assert trace(it, inputs, outputs, 20, 50) == ahead
    it.raw.freeFMUState(saved)

    other = instance(name).begin()  # other parameters: the state brings its own
    state = other.raw.deserializeFMUState(kept)
    other.raw.setFMUState(state)
    assert trace(other, inputs, outputs, 20, 50) == ahead
    other.raw.freeFMUState(state)


@pytest.mark.parametrize("name", LIVELY)
def test_reset_starts_over(instance, name):
    parameters, inputs = LIVELY[name]
    it = instance(name).begin(**parameters)
    outputs = outputs_of(it)
    first = trace(it, inputs, outputs, 0, 10)
    it.raw.reset()
    it.begin(**parameters)
    assert trace(it, inputs, outputs, 0, 10) == first


def refused(it, call, words):
    """The call, or at the latest the step after it, answers with an error, says why, and the process lives on."""
    with pytest.raises(FMICallException):
        call()
        it.step(0.0, 1e-3)
    assert words in "\n".join(it.said), it.said


@pytest.mark.parametrize(
    ("name", "values", "words"),
    [
        ("Motor", {"resistance": -1.0}, "resistance = -1 Ohm is outside its range"),
        ("Motor", {"weakening_of_voltage": 1.5}, "weakening_of_voltage = 1.5 must be at most 1"),
        ("Motor", {"inductance": math.nan}, "inductance = nan is not a finite number"),
        ("Motor", {"torque_constant": math.inf}, "not a finite number"),
        ("Motor", {"voltage": math.nan}, "voltage = nan is not a finite number"),
        ("Motor", {"resistance": 0.0, "inductance": 0.0}, "nothing limits the current"),
        ("Motor", {"supply_voltage": 0.0}, "supply_voltage"),
        ("Controller", {"angle_setpoint": -math.inf}, "not a finite number"),
        ("Controller", {"gear_ratio": 0.0}, "gear_ratio = 0 is outside its range"),
        ("Controller", {"voltage_min": 25.0}, "above voltage_max"),
        ("Controller", {"friction_static": 60.0}, "must be below 1"),
        ("Controller", {"irreversible": False, "friction_static": 0.5}, "locks itself"),
        ("Reducer", {"friction_kinetic": -0.01}, "friction_kinetic = -0.01 is outside its range"),
        ("Reducer", {"friction_kinetic": 50.0}, "no torque can drive the gear forward"),
        ("Reducer", {"gear_ratio": 0.0}, "gear_ratio = 0 is outside its range"),
        ("Reducer", {"shaft_inertia": -1e-5}, "shaft_inertia = -1e-05 kg.m2 is outside its range"),
        ("Reducer", {"motor_torque": math.nan}, "motor_torque = nan is not a finite number"),
        ("Reducer", {"output_speed": math.inf}, "output_speed = inf is not a finite number"),
        ("Load", {"inertia": 0.0}, "must be positive"),
        ("Load", {"mass": -1.0}, "outside its range"),
        ("Sensor", {"value": math.nan}, "not a finite number"),
    ],
)
def test_bad_values_before_the_start(instance, name, values, words):
    it = instance(name)
    refused(it, lambda: it.begin(**values), words)
    with pytest.raises(FMICallException):  # and it stays refused
        it.step(1e-3, 1e-3)
    it.raw.reset()
    assert it.begin().step(0.0, 1e-3)


@pytest.mark.parametrize("size", [0.0, -1e-3, math.nan, math.inf])
def test_bad_step_sizes(instance, size):
    it = instance("Motor").begin()
    refused(it, lambda: it.step(0.0, size), "is not a positive finite number")


def test_bad_calls(instance):
    it = instance("Motor").begin()
    refused(it, lambda: it.step(math.nan, 1e-3), "communication point nan")
    for call, words in [
        (lambda it: it.set(current=1.0), "current is an output"),
        (lambda it: it.set(resistance=1.0), "fixed parameter"),
        (lambda it: it.raw.setReal([999], [1.0]), "no variable has the value reference 999"),
        (lambda it: it.raw.getReal([999]), "no variable has the value reference"),
        (lambda it: it.raw.setBoolean([it.vr["voltage"]], [True]), "voltage is of type Real, not Boolean"),
        (lambda it: it.set(voltage=1e308, speed=1e308), "is not finite"),
    ]:
        it = instance("Motor").begin()
        refused(it, lambda: call(it), words)


def test_step_before_initialization(instance):
    it = instance("Motor")
    refused(it, lambda: it.step(0.0, 1e-3), "between initialization and termination")


def test_states_that_are_not_ours_are_refused(instance):
    motor = instance("Motor").begin()
    sensor = instance("Sensor").begin()
    saved = sensor.raw.getFMUState()
    kept = sensor.raw.serializeFMUState(saved)
    sensor.raw.freeFMUState(saved)
    refused(motor, lambda: motor.raw.setFMUState(motor.raw.deserializeFMUState(kept)), "not one of this FMU")
    motor = instance("Motor").begin()
    refused(motor, lambda: motor.raw.setFMUState(motor.raw.deserializeFMUState(b"rubbish \xff")), "its checksum is another")


def test_a_sound_state_restores_a_failed_slave(instance):
    it = instance("Motor").begin(voltage=3.0)
    saved = it.raw.getFMUState()
    refused(it, lambda: it.set(voltage=math.nan), "not a finite number")
    it.raw.setFMUState(saved)
    assert it.step(0.0, 1e-3).get("current") > 0.0
    it.raw.freeFMUState(saved)


def test_no_message_holds_a_format_character():
    motor = Motor(instance_name="m", resources="")
    motor.complain("100% wrong %s %n")
    assert "%" not in motor.log_queue[0].msg


def test_outputs_answer_inputs_while_initializing(instance):
    it = instance("Controller")
    it.raw.setupExperiment(startTime=0.0)
    it.raw.enterInitializationMode()
    for error in (0.01, -0.02):
        it.set(angle_setpoint=error)
        assert it.get("voltage") == 400.0 * error
    it.raw.exitInitializationMode()
    assert it.get("voltage") == 400.0 * -0.02


def test_serialised_state_is_exact():
    motor = Motor(instance_name="m", resources="")
    motor.enter_initialization_mode()
    motor.exit_initialization_mode()
    for value in (0.1 + 0.2, 5e-324, -0.0, 1.7976931348623157e308):
        motor._values[0] = value
        back = Motor._fmu_state_from_bytes(Motor._fmu_state_to_bytes(motor._get_fmu_state()))
        assert math.copysign(1.0, back[1][0]) == math.copysign(1.0, value) and back[1][0] == value
        assert json.loads(json.dumps(back)) is not None


@pytest.mark.alike
@pytest.mark.parametrize("name", LIVELY)
def test_every_step_from_tiny_to_coarse(instance, name):
    for h in (1e-5, 1e-4, 1e-3, 1e-2, 0.1):
        it = instance(name).begin(**LIVELY[name][0])
        for i in range(5):
            it.step(i * h, h, **LIVELY[name][1](i))
        assert all(math.isfinite(it.get(output)) for output in outputs_of(it))
