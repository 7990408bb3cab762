"""Load.fmu: a load on a bench behind the face of an FMU."""

from ..slave import Slave, Variable, rows
from . import load


class Load(Slave):
    """Rotary load with a mass on an arm: torque in, angle and speed out."""

    law = load
    tunable = ("mass", "damping", "constant_torque")  # a mass that is taken up moves with the arm
    inputs = (Variable("torque", "N.m", 0.0, "driving torque M, held over the step", nominal=10.0),)
    outputs = (
        Variable("angle", "rad", 0.0, "angle of the load"),
        Variable("speed", "rad/s", 0.0, "speed of the load", derivative_of="angle"),
        Variable("acceleration", "rad/s2", 0.0, "acceleration of the load", nominal=10.0, depends_on=("torque",)),
        Variable("load_torque", "N.m", 0.0, "torque that gravity, damping and the constant torque oppose", nominal=10.0),
    )
    parameters = rows(load.BASE, load.EFFECTS)

    def check(self, p):
        inertia = load.moment_of_inertia(p, load.start(p))
        return "" if inertia > 0.0 else f"the moment of inertia J + m d^2 = {inertia:.9g} kg.m2 must be positive"

    def explain(self, p, s, *inputs):
        torque, size = inputs
        inertia, weight, net = load.moment_of_inertia(p, s), load.gravity_moment(p, s), torque - p.constant_torque
        parts = load.needed(inertia, weight, p.damping, net, s.speed, size)
        if parts <= 0.5 * load.MOST:
            return ""
        if parts == load.needed(inertia, weight, p.damping, 0.0, 0.0, size):
            what = f"gravity's m g d = {weight:.6g} N.m swings the inertia of {inertia:.6g} kg.m2 too fast for it"
        else:
            what = f"with the speed of {s.speed:.6g} rad/s and the torque of {torque:.6g} N.m the arm turns too far in it"
        return (
            f"{what}: that takes {2.0 * parts:.3g} inner steps, and {load.MOST} at most are made; try a shorter step, or, where "
            "torque or speed ran away before, a softer drive shaft (shaft_stiffness) or less voltage"
        )
