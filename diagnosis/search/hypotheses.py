"""What may be wrong: every effect of every component, a nominal value, a sensor. One list, from one place each."""

from __future__ import annotations

from dataclasses import dataclass, replace
from importlib import import_module
from math import isfinite

import numpy as np

from ..data.rig import Rig, split
from ..data.signals import COMMANDS
from ..residuals.drive import both
from ..residuals.residual import MOVES

NOT_IN_POINTS = set("ripple cogging backlash compliance warm_up wear winding_heating lag quantisation".split())
"""Effects of angle and time, of which steady-state points know nothing."""

ON_REQUEST = {"stribeck_asymmetry"}
"""Freed only where a rig lists them as uncertain."""

ORDERS = ("_order", "_periods")
"""How the names of numbers end that count waves in a turn."""

COMPONENTS = ("controller", "motor", "reducer", "load")

SAID_BY_EFFECTS = {"load.mass", "load.arm", "load.inertia", "load.arm_angle", "load.gravity", "reducer.shaft_stiffness"}
"""Nominal values whose errors have names of their own (mass, centre_of_mass, inertia, tilt, compliance)."""


@dataclass(frozen=True)
class Free:
    """A number that a fit may change."""

    name: str  # component.parameter, with the drive's prefix; sensors: sensor.<channel>.<parameter>
    nominal: float  # where the effect is off, or what the data sheet says
    low: float
    high: float
    unit: str = ""
    description: str = ""
    companion: bool = False  # a nominal value that an effect frees beside its own parameters
    told: bool = False  # the rig gives it
    above: str = ""  # counted from this other parameter's value on, so that it can never fall below it
    trials: tuple[float, ...] = ()  # values to try where it acts only from a finite amount on


@dataclass(frozen=True)
class Hypothesis:
    """One possible cause: the numbers that it sets free."""

    component: str
    effect: str
    free: tuple[Free, ...]
    channel: str = ""  # sensors: whose
    summary: str = ""
    source: str = ""

    @property
    def label(self) -> str:
        if self.effect == "parameter":
            return self.free[0].name
        return f"{self.component} {self.effect}" + (f" ({self.channel})" if self.channel else "")

    def same_cause(self, other: Hypothesis) -> bool:
        return self.label == other.label


def effects(component: str) -> tuple:
    """The effects that stand beside a component's physics."""
    return import_module(f"selflock.fmus.{component}.effects").EFFECTS


def base(component: str) -> tuple:
    """The nominal parameters of a component's law."""
    from ..residuals.laws import LAWS

    return LAWS[component].BASE


def vocabulary(rig: Rig, used: set[str], channels: set[str], experiment) -> list[Hypothesis]:
    """All hypotheses about the components `used` and the measured `channels` (both with the drive's prefix).

    Whether a log can tell anything about one is found out by trying: a parameter without influence drops out.
    """
    found: list[Hypothesis] = []
    for name in sorted(used):
        _, component = split(name, rig.drives)
        for effect in effects(component):
            found.append(_effect(rig, name, component, effect))
        declared = {p.name for effect in effects(component) for p in effect.parameters}
        for parameter in base(component):
            full = f"{name}.{parameter.name}"
            if parameter.name in declared or f"{component}.{parameter.name}" in SAID_BY_EFFECTS:
                continue
            if rig.questioned(full) and full not in rig.uncertain:
                found.append(Hypothesis(name, "parameter", (_parameter(rig, full, parameter),), summary=parameter.description))
    for channel in sorted(channels):
        if rig.questioned(channel) and split(channel, rig.drives)[1] not in COMMANDS:
            for effect in effects("sensor"):
                # where an encoder's zero lies is nobody's fault
                if not (effect.name == "bias" and channel.endswith("reducer.input_angle")):
                    found.append(_sensor(channel, effect, spread(experiment, channel)))
    if rig.kind == "steady":  # a point has no angle and no time
        found = [h for h in found if h.effect not in NOT_IN_POINTS]
    found = [_seen_whole(_tried(h, experiment), experiment) for h in found]
    return [h for h in found if h.free]


def _tried(hypothesis: Hypothesis, experiment) -> Hypothesis:
    """Steps of time are looked for in whole samples, steps of a reading where its channel has them."""

    def trials(p: Free) -> tuple[float, ...]:
        if p.name.endswith("sample_period"):
            step = experiment.step
            return tuple(n * step for n in range(2, 41) if p.low <= n * step <= p.high)
        if p.name.endswith("resolution"):
            steps = [
                np.diff(np.unique(run.signals[hypothesis.channel][run.usable(hypothesis.channel)])) for run in experiment.runs
            ]
            return tuple({float(np.quantile(s, 0.05)) for s in steps if len(s)})
        return ()

    return replace(hypothesis, free=tuple(replace(p, trials=trials(p)) for p in hypothesis.free))


def _seen_whole(hypothesis: Hypothesis, experiment) -> Hypothesis:
    """A wave comes back: one that no run goes through once whole is a curve, and bends to anything."""
    free = list(hypothesis.free)
    prefix = split(hypothesis.component, experiment.rig.drives)[0]
    for order in [p for p in free if p.name.endswith(ORDERS)]:
        low = max(order.low, 1.0 / _turns(experiment, prefix, 1 if ".output_" in order.name else 0))
        if low < order.high:
            free[free.index(order)] = replace(order, low=low)
        else:
            wave = order.name.removesuffix("_order").removesuffix("_periods")
            free = [p for p in free if not p.name.startswith(wave)]
    return replace(hypothesis, free=tuple(free))


def _turns(experiment, prefix: str, side: int) -> float:
    """Turns from one end of the way to the other, the longest of all runs, of the input shaft (0) or the load (1)."""
    runs = [ch for (_, of), ch in experiment.channels.items() if of == prefix]
    moves = [ch for ch in runs if any(ch.has(name) for name in MOVES)]
    ways = [float(np.ptp(both(experiment, prefix, {}, ch)[side].angle)) for ch in moves]
    return max(ways, default=0.0) / (2.0 * np.pi) or np.inf


def spread(experiment, channel: str) -> float:
    """How far a channel's values reach."""
    return max(float(np.nanmax(abs(run.signals[channel]), initial=0.0)) for run in experiment.runs) or 1.0


def _effect(rig: Rig, name: str, component: str, effect) -> Hypothesis:
    free = []
    for p in effect.parameters:
        full = f"{name}.{p.name}"
        if not rig.questioned(full) or (p.name in ON_REQUEST and full not in rig.uncertain):
            continue
        low, high = rig.uncertain.get(full, (p.low, p.high))
        free.append(Free(full, rig.parameters.get(full, p.off), low, high, p.unit, p.description, told=full in rig.parameters))
    for extra in effect.frees:
        full = f"{name}.{extra}"
        parameter = next(p for p in base(component) if p.name == extra)
        if not rig.questioned(full) or full in rig.uncertain:
            continue
        p = _parameter(rig, full, parameter)
        if full not in rig.parameters and p.nominal > 0.0:  # no data sheet says: a time constant may be anything
            p = replace(p, low=max(parameter.low, p.nominal / 1000.0), high=min(parameter.high, p.nominal * 10.0))
        free.append(p if p.above else replace(p, companion=True))
    return Hypothesis(name, effect.name, tuple(free), summary=effect.summary, source=effect.source)


def _parameter(rig: Rig, full: str, parameter) -> Free:
    """A nominal value may be off by a factor of five, within what physics allows."""
    nominal = rig.parameters.get(full, parameter.off)
    if split(full, rig.drives)[1] == "reducer.friction_static":  # at least the kinetic one: fitted as what lies above it
        kinetic = f"{full.rpartition('.')[0]}.friction_kinetic"
        usual = next(p.off for p in base("reducer") if p.name == "friction_kinetic")
        return Free(full, max(0.0, nominal - rig.parameters.get(kinetic, usual)), 0.0, 1.0, "", "mu_s - mu_k", above=kinetic)
    low, high = parameter.low, parameter.high
    if nominal > 0.0:
        low, high = max(low, nominal / 5.0), min(high, nominal * 5.0)
    elif nominal < 0.0:
        low, high = max(low, nominal * 5.0), min(high, nominal / 5.0)
    elif not isfinite(high - low):
        low, high = max(low, -1e3), min(high, 1e3)
    return Free(full, nominal, low, high, parameter.unit, parameter.description)


def uncertain(rig: Rig) -> tuple[Free, ...]:
    """What no data sheet says: free in every fit, the first included."""
    found = []
    for full, (low, high) in rig.uncertain.items():
        unit, description, nominal = "", "", rig.parameters.get(full)
        prefix, rest = split(full, rig.drives)
        component, _, parameter = rest.partition(".")
        if component in COMPONENTS:
            for p in (*base(component), *(q for e in effects(component) for q in e.parameters)):
                if p.name == parameter:
                    unit, description = p.unit, p.description
                    nominal = p.off if nominal is None else nominal
        nominal = 0.5 * (low + high) if nominal is None else min(max(nominal, low), high)
        found.append(Free(full, nominal, low, high, unit, description))
    return tuple(found)


def _sensor(channel: str, effect, reach: float) -> Hypothesis:
    """A sensor's law knows no unit: what carries the channel's is searched within the channel's reach."""
    free = []
    for p in effect.parameters:
        low, high = (max(p.low, -reach), min(p.high, reach)) if not p.unit and p.off == 0.0 else (p.low, p.high)
        free.append(Free(f"sensor.{channel}.{p.name}", p.off, low, high, p.unit, p.description))
    return Hypothesis("sensor", effect.name, tuple(free), channel=channel, summary=effect.summary, source=effect.source)
