"""The rig file that goes with a hidden drive: its data sheet and the log's columns, nothing else."""

from __future__ import annotations

import math

from .drive import Drive

COLUMNS = {
    "setpoint_angle": ("controller.angle_setpoint", "rad"),
    "setpoint_speed": ("controller.speed_setpoint", "rad/s"),
    "voltage": ("controller.voltage", "V"),
    "current": ("motor.current", "A"),
    "motor_torque": ("motor.torque", "N.m"),
    "motor_angle": ("reducer.input_angle", "rad"),
    "motor_speed": ("reducer.input_speed", "rad/s"),
    "angle": ("load.angle", "rad"),
    "speed": ("load.speed", "rad/s"),
    "ambient": ("room.temperature", ""),
    "supply": ("motor.supply_voltage", "V"),
    "output_torque": ("reducer.output_torque", "N.m"),
}
SEEN = {
    "forward": (
        "setpoint_angle",
        "setpoint_speed",
        "voltage",
        "current",
        "motor_angle",
        "motor_speed",
        "angle",
        "speed",
        "ambient",
    ),
    "inverse": ("motor_torque", "motor_angle", "motor_speed", "angle", "speed", "ambient"),
    "steady": ("motor_torque", "motor_speed"),
}
SHEETS = {  # the product's parameters for the plant's fields
    "motor": {
        "resistance": "resistance",
        "inductance": "inductance",
        "voltage_constant": "voltage_constant",
        "torque_constant": "torque_constant",
    },
    "reducer": {
        "gear_ratio": "gear_ratio",
        "wedge_angle": "wedge_angle",
        "friction_kinetic": "friction",
        "friction_static": "friction",
        "shaft_inertia": "shaft_inertia",
        "shaft_stiffness": "shaft_stiffness",
        "shaft_damping": "shaft_damping",
    },
    "load": {"mass": "mass", "arm": "arm", "inertia": "load_inertia", "constant_torque": "constant_torque"},
    "controller": {
        "angle_gain": "angle_gain",
        "speed_gain": "speed_gain",
        "voltage_min": "voltage_min",
        "voltage_max": "voltage_max",
    },
}


def signal(channel: str) -> str:
    """The product's name of a channel."""
    return COLUMNS[channel][0]


def rig(drive: Drive, kind: str = "forward", channels: tuple[str, ...] = (), more: dict[str, float] | None = None) -> str:
    """The file. channels: columns of the log, where they are not all that this kind has; more: other parameters."""
    lines = ["[rig]", 'name = "hidden bench"', f'kind = "{kind}"']
    if kind == "steady":
        lines.append('run = "run"')
    lines += ["", "[columns]"]
    for channel in channels or SEEN[kind]:
        name, unit = COLUMNS[channel]
        lines.append(f'"{name}" = {{ column = "{channel}"' + (f', unit = "{unit}" }}' if unit else " }"))
    lines += ["", "[parameters]"]
    for component, fields in SHEETS.items():
        if component in ("motor", "controller") and kind != "forward":
            continue
        lines += [f'"{component}.{name}" = {getattr(drive, field)!r}' for name, field in fields.items()]
    lines.append(f'"load.arm_angle" = {-math.pi / 2!r}')  # at angle 0 the arm hangs down
    if kind == "forward":
        lines.append('"controller.release_time" = 1e9')  # this controller has no rule for resting
        lines.append(f'"motor.supply_voltage" = {drive.supply_voltage!r}')
    lines += [f'"{name}" = {value!r}' for name, value in (more or {}).items()]
    return "\n".join(lines) + "\n"
