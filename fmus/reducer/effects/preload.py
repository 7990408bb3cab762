"""Friction without load: the preload N0 of (13) and (14), and the drag of seals and bearings beside the wedge.

N0 itself is in the published law: friction is that of the greater of preload and load. The drag adds to it.
"""

from ...effect import AMPLITUDE, Effect, Parameter


def active(p, x):
    return 1.0 if p.drag_torque != 0.0 else 0.0


def drag(p, x):
    return p.drag_torque


EFFECT = Effect(
    component="reducer",
    name="preload",
    summary="max(N0, |N|) for |N| in (13) and (14), and a constant friction torque beside the wedge",
    parameters=(
        Parameter(
            "preload", "N.m", 0.0, 0.0, 10.0, "N0, between the flanks without load, as torque at the input shaft", AMPLITUDE
        ),
        Parameter(
            "drag_torque", "N.m", 0.0, 0.0, 1.0, "dry friction of the input shaft that knows no load", AMPLITUDE, of_drive=1.0
        ),
    ),
    source="equations 13 and 14 of the published study",
    hooks={"active": active, "drag": drag},
    advice="the same motion with the load taken off",
    shown_over="load",
)
