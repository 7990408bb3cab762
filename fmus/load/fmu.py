"""Load.fmu: a load on a bench behind the face of an FMU."""

from ..slave import Slave, Variable, rows
from . import load


class Load(Slave):
    """Rotary load with a mass on an arm: torque in, angle and speed out."""

    law = load
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
