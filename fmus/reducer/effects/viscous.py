"""Viscous friction: lubricant and seals on the input shaft."""

from ...effect import AMPLITUDE, Effect, Parameter


def active(p, x):
    return 1.0 if p.viscous_damping != 0.0 else 0.0


def viscous(p, x):
    return p.viscous_damping


EFFECT = Effect(
    component="reducer",
    name="viscous",
    summary="torque on the input shaft proportional to its speed, b w",
    parameters=(Parameter("viscous_damping", "N.m.s/rad", 0.0, 0.0, 1.0, "b, at the input shaft", AMPLITUDE, of_drive=10.0),),
    source="Armstrong-Helouvry, Dupont, Canudas de Wit, Automatica 30(7), 1994",
    hooks={"active": active, "viscous": viscous},
    advice="constant speeds up to the highest, at one load",
    shown_over="speed",
)
