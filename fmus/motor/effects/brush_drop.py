"""A voltage lost at the brushes, constant in magnitude and against the current."""

from ...effect import AMPLITUDE, Effect, Parameter


def active(p, x):
    return p.brush_voltage


def drop(p, x):
    return p.brush_voltage


EFFECT = Effect(
    component="motor",
    name="brush_drop",
    summary="U = K_e w + L I' + R I + U_b sgn I",
    parameters=(Parameter("brush_voltage", "V", 0.0, 0.0, 3.0, "voltage lost at the pair of brushes", AMPLITUDE),),
    source="Hughes, Drury: Electric Motors and Drives, ch. 3 (brush volt-drop)",
    hooks={"active": active, "drop": drop},
    advice="small voltages at standstill, both signs",
    shown_over="current",
)
