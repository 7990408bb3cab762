"""The supply's voltage drops with the current drawn from it.

A chopper with duty d = U / U_s takes d I of the supply in the mean. Where a capacitor at the driver evens that out (smoothing
s = 1) the supply's voltage falls by R_s d I, and the motor sees d times that. Without one (s = 0) the supply gives I while the
switch is on, and falls by R_s I just then. So the sag acts as a resistance R_s (s d^2 + (1 - s) |d|) in the motor's circuit. In the
mean the supply's voltage is the same.
"""

from ...effect import AMPLITUDE, SHAPE, Effect, Parameter, positive


def active(p, x):
    return p.supply_resistance


def resistance(p, x):
    duty = abs(x.voltage) / p.supply_voltage
    return p.supply_resistance * duty * (1.0 + p.supply_smoothing * (duty - 1.0))


def supplied(p, voltage, current):
    """The mean voltage of the supply, V, that gives d I while the motor has this voltage U = d U_s, V, and current I, A."""
    return p.supply_voltage - p.supply_resistance * voltage / p.supply_voltage * current


EFFECT = Effect(
    component="motor",
    name="supply_sag",
    summary="U - R_s (s d^2 + (1 - s) |d|) I instead of U, d = U/U_s",
    parameters=(
        Parameter("supply_resistance", "Ohm", 0.0, 0.0, 1000.0, "inner resistance of the supply", AMPLITUDE, of_drive=10.0),
        Parameter("supply_voltage", "V", 24.0, 1.0, 1000.0, "voltage of the supply without load", SHAPE),
        Parameter(
            "supply_smoothing",
            "",
            1.0,
            0.0,
            1.0,
            "s, how far a capacitor at the driver evens out what it takes: 1 wholly, 0 not at all",
            SHAPE,
            trials=(0.0, 1.0),
        ),
    ),
    source="Mohan, Undeland, Robbins: Power Electronics, ch. 7 (averaged chopper)",
    hooks={"active": active, "resistance": resistance},
    advice="the supply's voltage measured at the driver during high current",
    shown_over="current",
    check=positive("supply_voltage"),
)
