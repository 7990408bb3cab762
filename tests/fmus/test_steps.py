"""Each FMU alone under FMPy, from one communication step of 1e-5 to one of 0.1 s: the results converge with the step.

Inputs vary smoothly and are sampled at the start of each step, as a master does; results are compared at t = 0.2 s.
Held inputs make any FMU first order: ten times smaller a step, ten times smaller an error.
"""

from math import cos, sin

import pytest

STOP = 0.2
COUNTS = 2, 20, 200, 2000, 20000  # steps of 0.1, 1e-2, 1e-3, 1e-4 and 1e-5 s
HOLDER = {"output_angle": lambda t: 0.004 * sin(9 * t), "output_speed": lambda t: 0.036 * cos(9 * t)}
TORQUE = {"motor_torque": lambda t: 0.05 * sin(25 * t), **HOLDER}
CASES = {
    "Motor": ("Motor", {}, {"voltage": lambda t: 12 * sin(7 * t) + 6, "speed": lambda t: 100 * sin(3 * t)}, ("current", "torque")),
    "Controller": (
        "Controller", {},
        {"angle_setpoint": lambda t: 0.1 * sin(9 * t), "speed_setpoint": lambda t: 0.9 * cos(9 * t), "angle": lambda t: 0.09 * sin(9 * t)},
        ("voltage",),
    ),
    "Reducer": ("Reducer", {"friction_kinetic": 0.01, "shaft_damping": 20.0}, TORQUE, ("input_angle", "output_torque")),
    "Reducer, self-locking": ("Reducer", {"friction_kinetic": 0.03, "shaft_damping": 20.0}, TORQUE, ("output_torque",)),
    "Reducer, kinematic": (
        "Reducer", {"friction_kinetic": 0.01, "kinematic": True},
        {"imposed_angle": lambda t: 0.3 * sin(9 * t), "imposed_speed": lambda t: 2.7 * cos(9 * t), **HOLDER},
        ("input_torque", "output_torque", "motor_torque_required"),
    ),
    "Load": ("Load", {"mass": 2.0}, {"torque": lambda t: 3 * sin(20 * t)}, ("angle", "speed")),
    "Sensor": ("Sensor", {"lag_time": 0.02}, {"value": lambda t: sin(20 * t)}, ("reading",)),
}  # fmt: skip


@pytest.mark.slow
@pytest.mark.parametrize("case", CASES)
def test_results_converge_with_the_communication_step(instance, case):
    name, parameters, inputs, outputs = CASES[case]
    ends = []
    for count in COUNTS:
        it, size = instance(name).begin(**parameters, **{key: value(0.0) for key, value in inputs.items()}), STOP / count
        for i in range(count):
            it.step(i * size, size, **{key: value(i * size) for key, value in inputs.items()})
        ends.append([it.get(output) for output in outputs])
    for values in zip(*ends):
        errors = [abs(value - values[-1]) for value in values[:-1]]
        assert errors[2] <= 0.2 * errors[1] and errors[3] <= 0.2 * errors[2], errors
        assert errors[3] <= 2e-3 * max(map(abs, values)), errors  # the whole way from coarse to fine ends near the limit
