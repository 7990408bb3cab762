"""Ripple: friction and torque vary with the angles of the shafts (eccentricity, run-out, teeth)."""

import math

from ...effect import Effect, Parameter


def wave(angle, order, phase):
    """cos(n angle + phase), angle and phase in rad, n waves in a turn."""
    return math.cos(order * angle + phase)


def active(p, x):
    still = p.input_ripple == 0.0 and p.output_ripple == 0.0
    return 0.0 if still and p.input_ripple_torque == 0.0 and p.output_ripple_torque == 0.0 else 2.0


def dry(p, x):
    factor = 1.0
    if p.input_ripple != 0.0:
        factor += p.input_ripple * wave(x.angle, p.input_ripple_order, p.input_ripple_phase)
    if p.output_ripple != 0.0:
        factor += p.output_ripple * wave(x.output_angle, p.output_ripple_order, p.output_ripple_phase)
    return factor


def torque(p, x):
    added = 0.0
    if p.input_ripple_torque != 0.0:
        added += p.input_ripple_torque * wave(x.angle, p.input_ripple_order, p.input_ripple_phase)
    if p.output_ripple_torque != 0.0:
        added += p.output_ripple_torque * wave(x.output_angle, p.output_ripple_order, p.output_ripple_phase)
    return added


EFFECT = Effect(
    component="reducer",
    name="ripple",
    summary="dry friction times 1 + A cos(n angle + phase), torque + B cos(n angle + phase), for the angle of either shaft",
    parameters=(
        Parameter("input_ripple", "", 0.0, -1.0, 1.0, "A of the input shaft: share of dry friction"),
        Parameter("input_ripple_torque", "N.m", 0.0, -1.0, 1.0, "B of the input shaft: torque at the input shaft"),
        Parameter("input_ripple_order", "", 1.0, 1.0, 200.0, "n of the input shaft: waves in a turn, at least one"),
        Parameter("input_ripple_phase", "rad", 0.0, -2 * math.pi, 2 * math.pi, "phase of the input shaft's wave at angle 0"),
        Parameter("output_ripple", "", 0.0, -1.0, 1.0, "A of the output shaft: share of dry friction"),
        Parameter("output_ripple_torque", "N.m", 0.0, -1.0, 1.0, "B of the output shaft: torque at the input shaft"),
        Parameter("output_ripple_order", "", 1.0, 1.0, 200.0, "n of the output shaft: waves in a turn, at least one"),
        Parameter("output_ripple_phase", "rad", 0.0, -2 * math.pi, 2 * math.pi, "phase of the output shaft's wave at angle 0"),
    ),
    source="position-dependent friction: Armstrong-Helouvry, Control of Machines with Friction, 1991",
    hooks={"active": active, "dry": dry, "torque": torque},
)
