"""The limits of the command are not the nominal ones."""

from ...effect import AMPLITUDE, Effect, Parameter


def active(p, x):
    return abs(p.saturation_factor - 1.0)


def limits(p, x):
    return p.saturation_factor


EFFECT = Effect(
    component="controller",
    name="saturation",
    summary="U limited to f [U_min, U_max]",
    parameters=(Parameter("saturation_factor", "", 1.0, 0.05, 2.0, "factor on both voltage limits", AMPLITUDE),),
    source="Khalil: Nonlinear Systems, ch. 1.2 (saturation)",
    hooks={"active": active, "limits": limits},
    advice="a set-point step that drives the command to its limit",
    shown_over="set-point change",
)
