"""The winding's resistance rises with its temperature, which follows the copper loss I^2 R."""

from ...effect import AMPLITUDE, SHAPE, Effect, Parameter


def active(p, x):
    return p.winding_thermal_resistance


def resistance(p, x):
    """Ohm added: R a dT, dT = R_th times the copper loss filtered with the thermal time constant."""
    return p.resistance * p.winding_temperature_coefficient * p.winding_thermal_resistance * x.heat


EFFECT = Effect(
    component="motor",
    name="winding_heating",
    summary="R = R_0 (1 + a R_th q), q' = (I^2 R - q) / thermal_time",
    parameters=(
        Parameter("winding_thermal_resistance", "K/W", 0.0, 0.0, 500.0, "R_th: temperature rise per copper loss", AMPLITUDE),
        Parameter("winding_temperature_coefficient", "1/K", 0.00393, 0.003, 0.0045, "a: rise of the resistance (copper)", SHAPE),
    ),
    source="IEC 60034-1, clause 8.6.2 (resistance method); copper 0.00393 1/K",
    hooks={"active": active, "resistance": resistance},
    frees=("thermal_time",),
    advice="a high current held for minutes, then the same voltage steps cold and warm",
    shown_over="time",
    needs=("time",),
    drifts=True,
)
