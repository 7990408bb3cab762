"""The command acts late by a constant time."""

from ...effect import DELAY, Effect, Parameter


def active(p, x):
    return p.command_delay


def delay(p, x):
    return p.command_delay


EFFECT = Effect(
    component="controller",
    name="delay",
    summary="U(t) = U_command(t - delay)",
    parameters=(Parameter("command_delay", "s", 0.0, 0.0, 0.1, "time by which the command acts late", DELAY),),
    source="Franklin, Powell, Emami-Naeini: Feedback Control of Dynamic Systems, ch. 6.7",
    hooks={"active": active, "delay": delay},
    advice="a step of the set-point sampled ten times faster",
    shown_over="set-point change",
    needs=("time",),
)
