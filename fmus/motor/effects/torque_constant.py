"""The torque constant falls with current (saturation, armature reaction) and with heat (magnets)."""

from ...effect import AMPLITUDE, SHAPE, Effect, Parameter


def active(p, x):
    return p.weakening_per_current + p.weakening_per_loss


def weakening(p, x):
    """w of K = K_0 / (1 + w): a part with the current's magnitude (in A), a part with the filtered copper loss."""
    saturated = p.weakening_per_current * abs(x.current) ** p.weakening_exponent if p.weakening_per_current > 0.0 else 0.0
    return saturated + p.weakening_per_loss * x.heat


EFFECT = Effect(
    component="motor",
    name="torque_constant",
    summary="K = K_0 / (1 + a |I / 1 A|^n + b q), q' = (I^2 R - q) / thermal_time",
    parameters=(
        Parameter("weakening_per_current", "1/A", 0.0, 0.0, 100.0, "a: loss of torque constant at 1 A", AMPLITUDE, of_drive=10.0),
        Parameter("weakening_exponent", "", 1.0, 0.5, 4.0, "n: how suddenly it saturates, 1 from the first ampere on", SHAPE),
        Parameter(
            "weakening_per_loss", "1/W", 0.0, 0.0, 100.0, "b: loss of torque constant with copper loss", AMPLITUDE, of_drive=10.0
        ),
    ),
    source="Hughes, Drury: Electric Motors and Drives, ch. 3 (armature reaction); ferrite magnets lose 0.2 percent per K",
    hooks={"active": active, "weakening": weakening},
    frees=("thermal_time",),
    advice="standstill against a force gauge at several currents",
    shown_over="current",
)
