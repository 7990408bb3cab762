"""The supply's voltage drops with the current drawn from it.

What is drawn hangs on the driver. A chopper with duty d = U / U_s takes d I of the supply in the mean. Where a capacitor at the
driver evens that out (driver s = 1) the supply's voltage falls by R_s d I, and the motor sees d times that. Without one (s = 0) the
supply gives I while the switch is on, and falls by R_s I just then. So the sag acts as a resistance R_s (s d^2 + (1 - s) |d|) in the
motor's circuit, and a motor that brakes raises the supply's voltage. A linear stage (s = -1) takes all of |I| from its supply at any
voltage, also while the motor brakes, for its transistors burn the rest; where it holds the drop across itself, |U| is less by R_s |I|,
down to 0. In the mean the supply's voltage behind a chopper is the same with a capacitor and without.
"""

from math import copysign

from ...effect import AMPLITUDE, SHAPE, Effect, Parameter, positive


def active(p, x):
    return p.supply_resistance


def resistance(p, x):
    duty, linear = abs(x.voltage) / p.supply_voltage, p.supply_resistance * max(-p.supply_driver, 0.0)
    chopped = (p.supply_resistance - linear) * duty * (1.0 + max(p.supply_driver, 0.0) * (duty - 1.0))
    if linear == 0.0 or x.current == 0.0:
        return chopped + linear
    return chopped + max(min(linear, x.voltage / x.current), 0.0)


def lost(p, x):
    """What a linear stage loses of its voltage while the motor's current flows against it, V: it raises that current."""
    if p.supply_driver >= 0.0 or x.voltage * x.current >= 0.0:
        return 0.0
    return copysign(min(-p.supply_driver * p.supply_resistance * abs(x.current), abs(x.voltage)), x.voltage)


def supplied(p, voltage, current):
    """The mean voltage of the supply, V, where the motor has this voltage U = d U_s, V, and current I, A: of a chopper it gives d I."""
    linear = max(-p.supply_driver, 0.0)
    taken = (1.0 - linear) * voltage / p.supply_voltage * current + linear * abs(current)
    return p.supply_voltage - p.supply_resistance * taken


EFFECT = Effect(
    component="motor",
    name="supply_sag",
    summary="U - R_s (s d^2 + (1 - s) |d|) I instead of U, d = U/U_s; of a linear stage (s = -1) |U| - R_s |I|",
    parameters=(
        Parameter("supply_resistance", "Ohm", 0.0, 0.0, 1000.0, "inner resistance of the supply", AMPLITUDE, of_drive=10.0),
        Parameter("supply_voltage", "V", 24.0, 1.0, 1000.0, "voltage of the supply without load", SHAPE),
        Parameter(
            "supply_driver",
            "",
            1.0,
            -1.0,
            1.0,
            "s, what takes the current: 1 a chopper with a capacitor, 0 one without, -1 a linear stage",
            SHAPE,
            trials=(-1.0, 0.0, 1.0),
        ),
    ),
    source="Mohan, Undeland, Robbins: Power Electronics, ch. 7 (averaged chopper); Sedra, Smith: Microelectronic Circuits, ch. 11 (linear output stages)",
    hooks={"active": active, "resistance": resistance, "lost": lost},
    advice="the supply's voltage measured at the driver during high current",
    shown_over="current",
    check=positive("supply_voltage"),
)
