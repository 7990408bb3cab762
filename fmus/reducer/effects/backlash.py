"""Backlash: play between the flanks, seen at the output shaft."""

from ...effect import AMPLITUDE, Effect, Parameter


def active(p, x):
    return 1.0 if p.backlash != 0.0 else 0.0


def play(p, x):
    return p.backlash


EFFECT = Effect(
    component="reducer",
    name="backlash",
    summary="no torque over a play of this width; beyond it P = k (windup -+ play/2) + c rate, which never pulls",
    parameters=(Parameter("backlash", "rad", 0.0, 0.0, 0.5, "full play at the output shaft", AMPLITUDE),),
    source="Nordin, Gutman, Controlling mechanical systems with backlash, Automatica 38(10), 2002",
    hooks={"active": active, "play": play},
    advice="reversals under a load that changes its side, both shafts' angles measured",
    shown_over="load",
    needs=("angle",),
    takes=("shaft_damping",),  # what flanks lose when they meet is on no data sheet, and not what a shaft loses that winds up
)
