"""How large a number of a law can be in a drive: what its motor and its load have of the same unit.

An effect's own bounds hold for any drive, from a toy's to a crane's. A thousandth of them may be more than a small motor can turn,
and a derivative taken over it says nothing.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from math import inf

import numpy as np

from ..data.log import MeasuredRun
from ..data.rig import Rig, split
from ..data.signals import VOLTAGES
from ..residuals.drive_experiment import DriveExperiment
from ..residuals.laws import law


def spread(experiment: DriveExperiment, channel: str) -> float:
    """How far a channel's values reach."""
    return _farthest(experiment.runs, channel) or 1.0


def _farthest(runs: list[MeasuredRun], channel: str) -> float:
    return max(float(np.nanmax(abs(run.signals[channel]), initial=0.0)) for run in runs)


def with_supply(rig: Rig, runs: list[MeasuredRun]) -> Rig:
    """The rig, with the voltage of each motor's supply where neither it nor the logs say it: the highest that the motor is given, V.

    A supply's resistance acts by the share of its voltage that a driver passes on. That is never more than all of it, and how much
    more there might be no log tells: the one makes up for the other.
    """
    found = {}
    for prefix in rig.drives:
        name, duty = prefix + "motor.supply_voltage", prefix + "motor.duty"
        seen = [prefix + volts for volts in VOLTAGES if prefix + volts in runs[0].signals]
        if name in runs[0].signals or name in rig.parameters or name in rig.uncertain or duty in seen or not seen:
            continue
        limits = [abs(rig.parameters[limit]) for limit in _limits(prefix) if limit in rig.parameters]
        if (voltage := max(limits or [_farthest(runs, volts) for volts in seen])) > 0.0:
            found[name] = voltage
    return replace(rig, parameters=rig.parameters | found) if found else rig


def told_of_supply(rig: Rig, supplied: Rig) -> list[str]:
    """What `with_supply` took for the voltage of each motor's supply, in words: an inner resistance goes with its square."""
    more = {name: value for name, value in supplied.parameters.items() if name not in rig.parameters}
    return [f"{name} as the highest that the motor may be given, {value:.4g} V" for name, value in more.items()]


def _limits(prefix: str) -> list[str]:
    """Parameters that limit what a drive's controller commands."""
    return [f"{prefix}controller.{name}" for name in ("voltage_min", "voltage_max")]


def amounts(rig: Rig, component: str, channels: set[str], experiment: DriveExperiment) -> dict[str, float]:
    """What the drive of a component has of the units fmus.effect.OF_DRIVE, at the component's shaft, of those that something tells.

    Torque: what the motor gives at rest at the highest voltage, K_m U / R (eq 15 to 17), at the load r times that. Its fall with
    speed, K_m K_e / R; the yielding by a radian under it; the inertia of load and shaft together; the mass that it holds on
    the load's arm, and the arm on which it holds the load's mass. The winding's resistance; one over the current and the copper loss
    at rest, U / R and U^2 / R. One over the way that the shaft went in the longest of the runs, which no motor need tell.
    """
    prefix, here = split(component, rig.drives)
    value = lambda of, name: rig.parameters.get(f"{prefix}{of}.{name}", next(p.off for p in law(of).BASE if p.name == name))
    constant, resistance = value("motor", "torque_constant"), value("motor", "resistance")
    ratio, arm, mass = value("reducer", "gear_ratio"), value("load", "arm"), value("load", "mass")
    over = lambda a, b: a / b if b > 0.0 else inf
    way = max(_way(run, prefix, ratio) for run in experiment.runs) / (ratio if here == "load" else 1.0)
    found = {"1/rad": over(1.0, way)}
    known = prefix + "motor" in experiment.components or f"{prefix}motor.torque_constant" in rig.parameters
    if not (known and resistance > 0.0):
        return _told(found)
    voltage = _voltage(rig, prefix, value, channels, experiment)
    torque = constant * voltage / resistance
    falls = constant * value("motor", "voltage_constant") / resistance
    delivered, weight = torque * ratio, value("load", "gravity")
    inertia = value("load", "inertia") + mass * arm**2 + value("reducer", "shaft_inertia") * ratio**2
    found |= {
        "N.m": delivered if here == "load" else torque,
        "N.m.s/rad": falls * ratio**2 if here == "load" else falls,
        "rad/N.m": over(1.0, delivered),
        "kg.m2": inertia,
        "kg": over(delivered, weight * arm),
        "m": over(delivered, weight * mass),
        "Ohm": resistance,
        "1/A": over(resistance, voltage),
        "1/W": over(resistance, voltage**2),
    }
    return _told(found)


def _told(found: dict[str, float]) -> dict[str, float]:
    return {unit: most for unit, most in found.items() if 0.0 < most < inf}


def _way(run: MeasuredRun, prefix: str, ratio: float) -> float:
    """How far the input shaft went in a run, rad, to and fro: by the first of its channels that tell; 0 where none does."""
    for name, factor in (
        ("reducer.input_angle", 1.0),
        ("load.angle", ratio),
        ("reducer.input_speed", 1.0),
        ("load.speed", ratio),
    ):
        if (values := run.signals.get(prefix + name)) is not None:
            steps = np.diff(values) if name.endswith("angle") else values[1:] * np.diff(run.time)
            return factor * float(np.nansum(abs(steps)))
    return 0.0


def _voltage(rig: Rig, prefix: str, value: Callable[[str, str], float], channels: set[str], experiment: DriveExperiment) -> float:
    """The highest, V: the controller's limit where the rig gives it, else the highest of the logs, else the controller's own."""
    limits = _limits(prefix)
    of_supply = {prefix + "motor.duty", prefix + "motor.supply_voltage"} <= channels  # the limits of a duty are no voltage
    supply = spread(experiment, prefix + "motor.supply_voltage") if of_supply else 1.0
    seen = [spread(experiment, prefix + name) for name in VOLTAGES if prefix + name in channels]
    if not any(name in rig.parameters for name in limits) and seen:
        voltage = max(seen)
    else:
        voltage = max(abs(value("controller", name)) for name in ("voltage_min", "voltage_max"))
    return voltage * supply
