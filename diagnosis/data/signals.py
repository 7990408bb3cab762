"""The signals of a drive that a log may hold: one name each, with unit, and what else the name may be called.

A drive is the chain  set-point → controller → motor → reducer → load.  Two variables that are joined by a
connection are one signal (the motor's speed is the speed of the reducer's input shaft), so a log names it once.
"""

from __future__ import annotations

from selflock.fmus.chain import CONNECTIONS

SIGNALS = {
    # name: (unit, what it is)
    "controller.angle_setpoint": ("rad", "angle that the controller is asked for, output side"),
    "controller.speed_setpoint": ("rad/s", "speed that the controller is asked for, output side"),
    "controller.voltage": ("V", "voltage that the controller commands, signed"),
    "motor.duty": ("1", "part of the supply's voltage that the driver puts on the motor, -1 to 1"),
    "motor.supply_voltage": ("V", "voltage of the supply"),
    "motor.voltage": ("V", "voltage on the motor, signed"),
    "motor.current": ("A", "current through the winding"),
    "motor.torque": ("N.m", "torque of the motor on the input shaft: the gear's and the inertia's"),
    "motor.temperature": ("degC", "temperature of the winding or the casing"),
    "reducer.input_angle": ("rad", "angle of the input shaft"),
    "reducer.input_speed": ("rad/s", "speed of the input shaft, which is the motor's"),
    "reducer.input_torque": ("N.m", "torque that the gear takes at its input, without the shaft's inertia"),
    "reducer.output_torque": ("N.m", "torque that the gear delivers to the load"),
    "load.angle": ("rad", "angle of the load, which is the reducer's output angle"),
    "load.speed": ("rad/s", "speed of the load, which is the reducer's output speed"),
}

ALIASES = {target: source for target, source in CONNECTIONS.items() if target not in SIGNALS} | {
    "motor.angle": "reducer.input_angle",
    "reducer.imposed_angle": "reducer.input_angle",
    "reducer.imposed_speed": "reducer.input_speed",
    "reducer.motor_torque_required": "motor.torque",
}

SPEED_OF = {"reducer.input_angle": "reducer.input_speed", "load.angle": "load.speed"}
"""The speed of the shaft whose angle a signal is."""

ANGLE_OF = {speed: angle for angle, speed in SPEED_OF.items()}
"""The angle of the shaft whose speed a signal is."""

MOVES = tuple(name for pair in SPEED_OF.items() for name in pair)
"""Signals that tell of a motion."""

TORQUES = {"motor.current", "motor.torque", "reducer.input_torque", "reducer.output_torque"}
"""Signals that tell what drives the motion: an impact may show in them for a sample, and in no motion."""

SETPOINTS = {"controller.angle_setpoint", "controller.speed_setpoint"}
"""Signals that somebody made up: no noise is on them."""

COMMANDS = SETPOINTS | {"controller.voltage", "motor.duty"}
"""Signals that the experimenter gives as numbers: no sensor is between."""

RELATIVE = {"reducer.input_angle"}
"""Angles counted from anywhere: where such an encoder's zero lies is nobody's fault."""

GIVEN = COMMANDS | {"motor.voltage"}
"""Signals that follow from what is given: they may rest, jump and saturate without being faulty."""

VOLTAGES = ("controller.voltage", "motor.voltage", "motor.duty")
"""What drives a motor, and a converter may average over its step: a voltage, or a duty of its supply."""


def canonical(name: str) -> str:
    """The one name of a signal."""
    return ALIASES.get(name, name)


def unit(name: str, linear: bool = False) -> str:
    """SI unit of a signal; on a linear drive m, m/s and N stand for rad, rad/s and N.m. Unknown names have none."""
    base = SIGNALS.get(name, ("", ""))[0]
    return along(base) if linear else base


def along(unit: str, name: str = "") -> str:
    """The unit of a number of a linear drive, where a turning one has `unit`: kg for kg.m2, N.s/m for N.m.s/rad.

    name: of the number; a slope, a tilt and the phase of a wave stay angles.
    """
    if name.endswith(("_phase", "wedge_angle", "arm_angle", "tilt_error")):
        return unit
    return unit.replace("N.m", "N").replace("kg.m2", "kg").replace("rad", "m")
