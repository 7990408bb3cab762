"""The command is computed at equal intervals and held between them; the first sample is at the start."""

from ...effect import PERIOD, Effect, Parameter


def active(p, x):
    return p.sample_period


def period(p, x):
    return p.sample_period


EFFECT = Effect(
    component="controller",
    name="sampling",
    summary="U(t) = U(n T), n T <= t < (n + 1) T",
    parameters=(Parameter("sample_period", "s", 0.0, 0.0, 0.1, "time between two samples; 0 at every step", PERIOD),),
    source="Astrom, Wittenmark: Computer-Controlled Systems, ch. 2 (zero-order hold)",
    hooks={"active": active, "period": period},
    advice="the command recorded ten times faster than now",
    shown_over="set-point change",
    needs=("time",),
)
