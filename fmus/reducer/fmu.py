"""Reducer.fmu: the wedge with Coulomb friction behind the face of an FMU."""

from math import sqrt

from ..slave import Slave, Variable, rows
from . import shaft, travel, wedge

KINEMATIC = ("imposed_angle", "imposed_speed")
DYNAMIC = ("motor_torque",)
OUTPUT = ("output_angle", "output_speed")
EVERY = (*DYNAMIC, *KINEMATIC, *OUTPUT)


def _dynamic(p, s, motor_torque, imposed_angle, imposed_speed, output_angle, output_speed, dt):
    return shaft.advance(p, s, motor_torque, output_angle, output_speed, dt)


def _kinematic(p, s, motor_torque, imposed_angle, imposed_speed, output_angle, output_speed, dt):
    return shaft.impose(p, s, imposed_angle, imposed_speed, output_angle, output_speed, dt)


class Reducer(Slave):
    """Speed reducer with dry friction up to and beyond self-locking (eq 1-14): torque out, motion of what is driven in."""

    law = shaft
    explained = (wedge, shaft)
    inputs = (
        Variable("motor_torque", "N.m", 0.0, "M, of the motor on the input shaft, held over the step; dynamic mode", nominal=0.1),
        Variable("imposed_angle", "rad", 0.0, "of the input shaft, carried on with imposed_speed; kinematic mode", nominal=100.0),
        Variable("imposed_speed", "rad/s", 0.0, "of the input shaft, exactly 0 at rest; kinematic mode", nominal=100.0),
        Variable("output_angle", "rad", 0.0, "angle of what is driven, carried on with output_speed", nominal=1.0),
        Variable("output_speed", "rad/s", 0.0, "speed of what is driven", nominal=1.0),
    )
    outputs = (
        Variable("input_torque", "N.m", 0.0, "F, torque that drives the input shaft", nominal=0.1, depends_on=EVERY),
        Variable("output_torque", "N.m", 0.0, "P, on what is driven; positive when the load resists positive motion", nominal=1.0,
                 depends_on=(*KINEMATIC, *OUTPUT)),
        Variable("friction_torque", "N.m", 0.0, "F - P/r, what friction adds at the input shaft", nominal=0.1, depends_on=EVERY),
        Variable("input_angle", "rad", 0.0, "angle of the input shaft", nominal=100.0, depends_on=KINEMATIC),
        Variable("input_speed", "rad/s", 0.0, "speed of the input shaft", nominal=100.0, depends_on=KINEMATIC,
                 derivative_of="input_angle"),
        Variable("motor_torque_required", "N.m", 0.0, "F + J dw/dt, what the motor gives or would have to give", nominal=0.1,
                 depends_on=EVERY),
        Variable("normal_force", "N.m", 0.0, "N in the wedge (eq 4), as input-shaft torque", nominal=1.0, depends_on=EVERY),
        Variable("stuck", "", False, "static friction holds the input shaft", depends_on=EVERY),
        Variable("input_power", "W", 0.0, "F times the speed of the input shaft", nominal=10.0, depends_on=EVERY),
        Variable("output_power", "W", 0.0, "P times output_speed", nominal=1.0, depends_on=(*KINEMATIC, *OUTPUT)),
        Variable("loss_power", "W", 0.0, "heat of friction and of the output shaft's damper", minimum=0.0, nominal=1.0,
                 depends_on=EVERY),
    )  # fmt: skip
    parameters = (
        Variable("kinematic", "", False, "false: motor_torque moves the input shaft; true: its motion is imposed"),
        *rows(shaft.BASE, shaft.EFFECTS),
        Variable("initial_speed", "rad/s", 0.0, "of the input shaft at the start; dynamic mode"),
        Variable("initial_torque", "N.m", 0.0, "output torque at the start, 0: relaxed; dynamic mode"),
    )

    def check(self, p):
        mu_t = max(p.friction_static, p.friction_kinetic) * wedge.wedge_tangent(p.gear_ratio, p.wedge_angle)
        if mu_t >= 1.0:
            return (
                f"friction_kinetic = {p.friction_kinetic:.9g}, friction_static = {p.friction_static:.9g}: no torque can drive "
                f"the gear forward, because mu tan(alpha) = {mu_t:.9g} is not below 1; reduce the friction or the wedge angle"
            )
        if p.shaft_stiffness <= 0.0:
            return "shaft_stiffness = 0 N.m/rad: the output shaft must be stiffer than nothing"
        if p.shaft_inertia <= 0.0 and not self.value("kinematic"):
            return "shaft_inertia = 0 kg.m2: dynamic mode moves the input shaft, so that it needs an inertia (the rotor's)"
        return ""

    def begin(self, p, *inputs):
        _, imposed_angle, imposed_speed, output_angle, output_speed = inputs
        if self.value("kinematic"):
            return shaft.start(p, imposed_angle, imposed_speed, output_angle, output_speed)
        return shaft.relaxed(p, self.value("initial_torque"), self.value("initial_speed"), output_angle, output_speed)

    def explain(self, p, s, *inputs):
        size, ratio, most = inputs[-1], p.gear_ratio, travel.PIECES
        if s.effects > 1.0 and 2.0 * size > shaft.INNER_STEP * most:
            return (
                f"effects that vary in a step take two pieces for each {shaft.INNER_STEP:g} s of it, that is "
                f"{2.0 * size / shaft.INNER_STEP:.3g}, and {most} at most are made; try a step of "
                f"{0.4 * most * shaft.INNER_STEP:g} s or less"
            )
        if self.value("kinematic"):
            return ""
        swings = size * sqrt(p.shaft_stiffness / p.shaft_inertia) / ratio
        if swings > most:
            return (
                f"shaft_stiffness = {p.shaft_stiffness:.6g} N.m/rad on shaft_inertia = {p.shaft_inertia:.6g} kg.m2 makes some "
                f"{swings:.3g} pieces of it, from event to event, and {most} at most are made; try a shorter step, a softer "
                "shaft or more shaft_damping"
            )
        return (
            f"its result is not finite, or takes more than {most} pieces from event to event; try a shorter step, a softer drive "
            f"shaft (shaft_stiffness = {p.shaft_stiffness:.6g} N.m/rad) or more shaft_damping ({p.shaft_damping:.6g} N.m.s/rad)"
        )

    def stepper(self):
        return _kinematic if self.value("kinematic") else _dynamic
