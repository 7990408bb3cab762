"""A voltage lost at the brushes against the current: constant in magnitude, or in proportion to small currents."""

from ...effect import AMPLITUDE, SHAPE, Effect, Parameter


def active(p, x):
    return p.brush_voltage


def drop(p, x):
    return p.brush_voltage


def knee(p, x):
    """Current from which on all of the voltage is lost, A: that at which the winding loses s U_b."""
    return p.brush_softness * p.brush_voltage / p.resistance if p.resistance > 0.0 else 0.0


EFFECT = Effect(
    component="motor",
    name="brush_drop",
    summary="U = K_e w + L I' + R I + U_b f(R I / (s U_b)), f(x) = x between -1 and 1, else sgn x",
    parameters=(
        Parameter("brush_voltage", "V", 0.0, 0.0, 3.0, "U_b, voltage lost at the pair of brushes", AMPLITUDE),
        Parameter(
            "brush_softness",
            "",
            0.0,
            0.0,
            2.0,
            "s, of small currents R I / s is lost until that is U_b; 0: U_b at once",
            SHAPE,
            trials=(0.5,),
        ),
    ),
    source="Hughes, Drury: Electric Motors and Drives, ch. 3 (brush volt-drop); a contact's rise to it: Holm, Electric Contacts (1967)",
    hooks={"active": active, "drop": drop, "knee": knee},
    advice="small voltages at standstill, both signs",
    shown_over="current",
)
