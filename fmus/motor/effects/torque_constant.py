"""The torque constant falls with current (saturation, armature reaction) and with heat (magnets).

Where it is the magnets' flux that falls the voltage constant does as much; a torque that is lost elsewhere (in iron, to a brush
that has moved) it does not feel. A measurement tells.
"""

from ...effect import AMPLITUDE, SHAPE, Effect, Parameter


def active(p, x):
    return p.weakening_per_current + p.weakening_per_loss


def weakening(p, x):
    """w of K = K_0 / (1 + w): a part with the current's magnitude (in A), a part with the filtered copper loss."""
    saturated = p.weakening_per_current * abs(x.current) ** p.weakening_exponent if p.weakening_per_current > 0.0 else 0.0
    return saturated + p.weakening_per_loss * x.heat


def unfelt(p, x):
    """Of w what the voltage constant has not: K_e = K_e0 / (1 + c w)."""
    return (1.0 - p.weakening_of_voltage) * weakening(p, x) if p.weakening_of_voltage != 1.0 else 0.0


def check(p):
    """A share is no more than all."""
    return f"weakening_of_voltage = {p.weakening_of_voltage:.9g} must be at most 1" if p.weakening_of_voltage > 1.0 else ""


EFFECT = Effect(
    component="motor",
    name="torque_constant",
    summary="K_m = K_0 / (1 + w), K_e = K_e0 / (1 + c w), w = a |I / 1 A|^n + b q, q' = (I^2 R - q) / thermal_time",
    parameters=(
        Parameter("weakening_per_current", "1/A", 0.0, 0.0, 100.0, "a: loss of torque constant at 1 A", AMPLITUDE, of_drive=10.0),
        Parameter("weakening_exponent", "", 1.0, 0.5, 4.0, "n: how suddenly it saturates, 1 from the first ampere on", SHAPE),
        Parameter(
            "weakening_per_loss", "1/W", 0.0, 0.0, 100.0, "b: loss of torque constant with copper loss", AMPLITUDE, of_drive=10.0
        ),
        Parameter(
            "weakening_of_voltage",
            "",
            1.0,
            0.0,
            1.0,
            "c: share of it that the voltage constant has, 1 where the flux falls",
            SHAPE,
        ),
    ),
    source="Hughes, Drury: Electric Motors and Drives, ch. 3 (armature reaction); ferrite magnets lose 0.2 percent per K",
    hooks={"active": active, "weakening": weakening, "unfelt": unfelt},
    frees=("thermal_time",),
    advice="standstill against a force gauge at several currents",
    shown_over="current",
    check=check,
)
