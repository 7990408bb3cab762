"""Controller.fmu: the controller behind the face of an FMU."""

from ..slave import Slave, Variable, rows
from . import pd


class Controller(Slave):
    """PD controller with limited voltage that lets go at rest (eq 21, 22): angles and speeds in, voltage out."""

    law = pd
    tunable = ("angle_gain", "speed_gain", "voltage_min", "voltage_max")
    needs = ("reducer/wedge.py",)
    inputs = (
        Variable("angle_setpoint", "rad", 0.0, "wanted angle phi_D of what the gear drives"),
        Variable("speed_setpoint", "rad/s", 0.0, "wanted speed w_D; exactly 0 where it shall rest"),
        Variable("angle", "rad", 0.0, "angle phi"),
        Variable("speed", "rad/s", 0.0, "speed w"),
        Variable("motor_speed", "rad/s", 0.0, "speed of the motor (the reducer's input_speed): is it stopped?", nominal=100.0),
        Variable("output_torque", "N.m", 0.0, "load torque (the reducer's output_torque), for the hold voltage"),
    )
    outputs = (
        Variable("voltage", "V", 0.0, "voltage U for the motor", nominal=24.0, depends_on=tuple(row.name for row in inputs)),
    )
    parameters = rows(pd.BASE, pd.EFFECTS)

    def begin(self, p, *inputs):
        return pd.start(p, *inputs)

    def check(self, p):
        if p.voltage_min > p.voltage_max:
            return f"voltage_min = {p.voltage_min:.9g} V is above voltage_max = {p.voltage_max:.9g} V"
        t = pd.wedge_tangent(p.gear_ratio, p.wedge_angle)
        if p.friction_static * t >= 1.0:
            return f"friction_static = {p.friction_static:.9g}: mu tan(alpha) = {p.friction_static * t:.6g} must be below 1"
        if p.irreversible == 0.0 and p.friction_static > t:
            return "irreversible is false, but friction_static is above tan(alpha): this gear locks itself"
        return ""
