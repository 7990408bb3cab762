"""Compliance: wind-up under load beyond that of the nominal shaft."""

from ...effect import AMPLITUDE, Effect, Parameter


def active(p, x):
    return 1.0 if p.compliance != 0.0 else 0.0


def compliance(p, x):
    return p.compliance


EFFECT = Effect(
    component="reducer",
    name="compliance",
    summary="1/k + C in the place of 1/k",
    parameters=(Parameter("compliance", "rad/N.m", 0.0, 0.0, 1.0, "C, seen at the output shaft", AMPLITUDE, of_drive=1.0),),
    source="Spong, Modeling and control of elastic joint robots, J. Dyn. Sys. Meas. Control 109(4), 1987",
    hooks={"active": active, "compliance": compliance},
    advice="slowly rising load at standstill, both shafts' angles measured",
    shown_over="load",
    needs=("angle",),
    says=("shaft_stiffness",),
)
