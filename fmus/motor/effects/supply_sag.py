"""The supply's voltage drops with the current drawn from it.

A chopper with duty d = U / U_s passes d I to the supply, whose voltage falls by R_s d I; the motor sees d times
that. So the sag acts as a resistance R_s d^2 in the motor's circuit, and shows at high duty only.
"""

from ...effect import AMPLITUDE, SHAPE, Effect, Parameter, positive


def active(p, x):
    return p.supply_resistance


def resistance(p, x):
    duty = x.voltage / p.supply_voltage
    return p.supply_resistance * duty * duty


def supplied(p, voltage, current):
    """The voltage of the supply, V, that gives d I while the motor has this voltage U = d U_s, V, and current I, A."""
    return p.supply_voltage - p.supply_resistance * voltage / p.supply_voltage * current


EFFECT = Effect(
    component="motor",
    name="supply_sag",
    summary="U - R_s (U/U_s)^2 I instead of U",
    parameters=(
        Parameter("supply_resistance", "Ohm", 0.0, 0.0, 1000.0, "inner resistance of the supply", AMPLITUDE, of_drive=10.0),
        Parameter("supply_voltage", "V", 24.0, 1.0, 1000.0, "voltage of the supply without load", SHAPE),
    ),
    source="Mohan, Undeland, Robbins: Power Electronics, ch. 7 (averaged chopper)",
    hooks={"active": active, "resistance": resistance},
    advice="the supply's voltage measured at the driver during high current",
    shown_over="current",
    check=positive("supply_voltage"),
)
