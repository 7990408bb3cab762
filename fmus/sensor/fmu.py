"""Sensor.fmu: the sensor behind the face of an FMU."""

from ..slave import Slave, Variable, rows
from . import sensor


class Sensor(Slave):
    """Sensor of one value with bias, scale, lag and quantisation: value in, reading out."""

    law = sensor
    inputs = (Variable("value", "", 0.0, "what is measured, in any unit"),)
    outputs = (Variable("reading", "", 0.0, "what the sensor says, in the unit of the value", depends_on=("value",)),)
    parameters = rows(sensor.BASE, sensor.EFFECTS)

    def begin(self, p, *inputs):
        return sensor.start(p, *inputs)
