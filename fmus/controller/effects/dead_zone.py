"""Small commands do nothing; larger ones are passed on, less a share of the dead zone, those at the limits of the controller too."""

from math import copysign

from ...effect import AMPLITUDE, SHAPE, Effect, Parameter


def active(p, x):
    return p.dead_zone


def lost(p, x):
    if abs(x.command) <= p.dead_zone:
        return x.command
    return copysign(p.dead_zone * p.dead_zone_share, x.command)


EFFECT = Effect(
    component="controller",
    name="dead_zone",
    summary="U = 0 for |U| <= d, else U - share d sgn U",
    parameters=(
        Parameter("dead_zone", "V", 0.0, 0.0, 5.0, "commands up to this do nothing", AMPLITUDE),
        Parameter("dead_zone_share", "", 1.0, 0.0, 1.0, "part of it that larger commands lose: 1 no jump, 0 full jump", SHAPE),
    ),
    source="Khalil: Nonlinear Systems, ch. 1.2 (dead zone)",
    hooks={"active": active, "lost": lost},
    advice="set-points so small that the command stays within a few tenths of a volt",
    shown_over="set-point change",
)
