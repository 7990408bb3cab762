"""Ripple: friction and torque vary with the angles of the shafts (eccentricity, run-out, teeth)."""

import math

from ...effect import AMPLITUDE, ORDER, PHASE, Effect, Parameter


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


def numbers(shaft):
    """The waves of one shaft, "input" or "output"."""
    of, turn = f"of the {shaft} shaft", 2 * math.pi
    return (
        Parameter(f"{shaft}_ripple", "", 0.0, -1.0, 1.0, f"A {of}: share of dry friction", AMPLITUDE, shaft),
        Parameter(
            f"{shaft}_ripple_torque",
            "N.m",
            0.0,
            -100.0,
            100.0,
            f"B {of}: torque at the input shaft",
            AMPLITUDE,
            shaft,
            of_drive=0.5,
        ),
        Parameter(f"{shaft}_ripple_order", "", 1.0, 1.0, 200.0, f"n {of}: waves in a turn, at least one", ORDER, shaft),
        Parameter(f"{shaft}_ripple_phase", "rad", 0.0, -turn, turn, f"phase {of}'s wave at angle 0", PHASE, shaft),
    )


EFFECT = Effect(
    component="reducer",
    name="ripple",
    summary="dry friction times 1 + A cos(n angle + phase), torque + B cos(n angle + phase), for the angle of either shaft",
    parameters=(*numbers("input"), *numbers("output")),
    source="position-dependent friction: Armstrong-Helouvry, Control of Machines with Friction, 1991",
    hooks={"active": active, "dry": dry, "torque": torque},
    advice="one slow constant speed over many turns",
    shown_over="position",
    needs=("angle",),
)
