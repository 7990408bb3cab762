"""Motor.fmu: the DC motor behind the face of an FMU."""

from ..slave import Slave, Variable, rows
from . import dc


class Motor(Slave):
    """Permanent magnet DC motor (eq 15-20): voltage and speed in, torque and current out."""

    law = dc
    inputs = (
        Variable("voltage", "V", 0.0, "voltage U at the terminals, held over the step", nominal=24.0),
        Variable("speed", "rad/s", 0.0, "speed of the rotor, held over the step", nominal=100.0),
    )
    outputs = (
        Variable("current", "A", 0.0, "armature current I", nominal=1.0, depends_on=("voltage", "speed")),
        Variable("torque", "N.m", 0.0, "torque M = K_m I on the rotor", nominal=0.1, depends_on=("voltage", "speed")),
        Variable("electric_power", "W", 0.0, "P_E = U I (eq 18)", nominal=10.0, depends_on=("voltage", "speed")),
        Variable("mechanical_power", "W", 0.0, "P_M = M w (eq 20)", nominal=10.0, depends_on=("voltage", "speed")),
    )
    parameters = rows(dc.BASE, dc.EFFECTS)

    def check(self, p):
        if p.resistance == 0.0 and p.inductance == 0.0:
            return "resistance and inductance are both 0: nothing limits the current; give one of them a positive value"
        return ""
