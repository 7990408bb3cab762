"""The whole drive in time: from its voltage, or from its set-points with the loop closed, simulated motor to load."""

from __future__ import annotations

import numpy as np

from ..data.log import VALID
from ..rules import RULES
from . import drive
from .channels import Channels
from .compare import Compared, everywhere
from .laws import COMPONENTS, law

ROWS = ("voltage", "current", "torque", "input_angle", "input_speed", "output_torque", "angle", "speed")

SHOWN = {
    "load.angle": "angle",
    "reducer.input_angle": "input_angle",
    "load.speed": "speed",
    "reducer.input_speed": "input_speed",
}
"""Signals that the whole is compared by, the first that a log has, and their rows."""


def motion(shown: str, closed: bool, values: dict, ch: Channels) -> Compared:
    """The motion of the whole drive against the measured one."""
    simulated = simulate(values, ch, closed)[SHOWN[shown]]
    measured = ch.taken(ch.raw(shown))
    return drive.read(shown, ch.taken(simulated), values, ch), measured, everywhere(len(measured))


def simulate(values: dict, ch: Channels, closed: bool) -> dict[str, np.ndarray]:
    """All signals of the drive over one run, or over the stretches of it that are taken; each starts as measured."""
    first, second = drive.both(values, ch)
    n = len(ch.dt)
    laws = [drive.law(part, values, ch) for part in COMPONENTS]
    reducer, load = laws[2], laws[3]
    stiffness, damping, parts = by_turns(reducer, load, float(np.median(ch.dt)))
    laws[2] = reducer._replace(shaft_stiffness=stiffness, shaft_damping=damping)
    zero = np.zeros(n)
    voltage = supply = zero
    if ch.has("motor.duty", "motor.supply_voltage"):
        supply = ch.true("motor.supply_voltage", values)
        voltage = drive.voltage("motor.duty", values, ch)
    elif not closed:
        voltage = drive.voltage(drive.electric(ch), values, ch)
    wanted = ch.raw("controller.angle_setpoint") if ch.has("controller.angle_setpoint") else zero
    rate = drive.speed_setpoint(wanted, {}, ch)
    powered = ch.run.signals.get(VALID, np.ones(n))
    out = np.zeros((8, n))
    for here in stretches(ch):
        i = here.start
        start = np.array([second.angle[i] * reducer.gear_ratio, first.speed[i], second.angle[i], second.speed[i]])
        given = (x[here] for x in (powered, supply, voltage, wanted, rate, ch.dt))
        ch.setting.kernels.whole(*laws, 1.0 if closed else 0.0, *given, parts, start, out[:, here])
    return dict(zip(ROWS, out))


def stretches(ch: Channels) -> list[slice]:
    """Where samples that are taken follow one another without a gap."""
    if ch.take is None:
        return [slice(0, len(ch.dt))]
    return [slice(int(part[0]), int(part[-1]) + 1) for part in np.split(ch.take, ch.gaps + 1)]


def by_turns(reducer, load, step: float) -> tuple[float, float, int]:
    """Stiffness and damping of the output shaft, N.m/rad, N.m.s/rad, and the parts of a step, for components that take turns.

    As given, or what most parts carry; the damping is at least what such a coupling needs to be stable.
    """
    rules, together = RULES.residuals, swinging(reducer, load)
    least, most = rules.turns_damping
    parts = int(np.clip(np.ceil(step * np.sqrt(reducer.shaft_stiffness / together) / rules.turns_step), 1, rules.turns_parts))
    stiffness = min(reducer.shaft_stiffness, together * (rules.turns_step * parts / step) ** 2)
    usual = np.sqrt(stiffness * together)
    return stiffness, max(min(reducer.shaft_damping, most * usual), least * usual), parts


def stable(
    reducer, load, step: float, fastest: float = np.inf, shaft_step: float = RULES.residuals.shaft_step
) -> tuple[float, float, int]:
    """The same for the simulation of second order: as given, or what most parts carry.

    fastest: rad/s, beyond which nobody sees how fast the shaft swings. shaft_step: rad of that swing in a part, at most.
    A softer shaft swings damped by the same share c / (2 sqrt(k m)), which alone says with how much of their speed flanks part
    that have met (exp(-pi d / sqrt(1 - d^2)): Nordin and Gutman 2002), however stiff they are.
    """
    rules, together = RULES.residuals, swinging(reducer, load)
    swings = max(np.sqrt(reducer.shaft_stiffness / together), reducer.shaft_damping / together)
    parts = int(np.clip(np.ceil(step * min(swings, fastest) / shaft_step - 1e-9), 1, rules.shaft_parts))
    most = min(shaft_step * parts / step, fastest)
    stiffness = min(reducer.shaft_stiffness, together * most**2)
    softer = np.sqrt(stiffness / reducer.shaft_stiffness) if reducer.shaft_stiffness > 0.0 else 1.0
    return stiffness, min(reducer.shaft_damping * softer, together * most), parts


def swinging(reducer, load) -> float:
    """The inertia that swings on the output shaft, kg.m2: that of the load, and that of the input shaft behind the gear."""
    of_load = law("load")
    inertia = max(of_load.moment_of_inertia(load, of_load.State(0.0, 0.0)), 1e-12)
    behind = reducer.shaft_inertia * reducer.gear_ratio**2
    return max(inertia * behind / max(inertia + behind, 1e-300) if behind > 0.0 else inertia, 1e-12)
