"""Torque that varies with the rotor's angle without any current: magnets and slots attract each other."""

from math import pi, sin

from ...effect import AMPLITUDE, ORDER, PHASE, Effect, Parameter


def active(p, x):
    return abs(p.cogging_torque)


def torque(p, x):
    return p.cogging_torque * sin(p.cogging_periods * x.angle + p.cogging_phase) if p.cogging_torque != 0.0 else 0.0


EFFECT = Effect(
    component="motor",
    name="cogging",
    summary="M_c = A sin(n angle + phase); angle 0 at the start",
    parameters=(
        Parameter("cogging_torque", "N.m", 0.0, 0.0, 100.0, "amplitude", AMPLITUDE, "input", of_drive=0.1),
        Parameter("cogging_periods", "", 12.0, 1.0, 60.0, "periods per turn of the rotor", ORDER, "input"),
        Parameter("cogging_phase", "rad", 0.0, -2 * pi, 2 * pi, "phase at the start", PHASE, "input"),
    ),
    source="Hendershot, Miller: Design of Brushless Permanent-Magnet Machines, ch. 5",
    hooks={"active": active, "torque": torque},
    advice="turning the motor slowly without current",
    shown_over="position",
    needs=("angle",),
)
