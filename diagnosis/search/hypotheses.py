"""What may be wrong: every effect of every component, a nominal value, a sensor. One list, from one place each."""

from __future__ import annotations

from dataclasses import dataclass, replace
from math import inf, isfinite

import numpy as np

from selflock.fmus.effect import CONSTANT, OFFSET, ORDER, PERIOD, STEP, SWITCH, VALUE, Effect, Parameter

from ..data.rig import Rig, split
from ..data.signals import COMMANDS, MOVES, RELATIVE, VOLTAGES, along, unit
from ..residuals import driven, whole
from ..residuals.drive import both
from ..residuals.drive import electric as electric_of
from ..residuals.drive_experiment import DriveExperiment
from ..residuals.laws import COMPONENTS, effects, law
from ..residuals.propagated import in_step
from ..residuals.recorder import counts, lies_in, periods, written_step
from ..rules import RULES
from .reach import amounts, spread

SIDES = {"input": 0, "output": 1}
"""Of a wave's shaft, its place among the motions of a drive."""

MEASURE_IT = "the quantity measured by itself on the bench"
"""The run that tells a nominal value."""


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
    places: tuple[float, ...] = ()  # where its effect says that it should be looked for first; a fit goes on from there
    role: str = VALUE  # of fmus.effect.ROLES
    shaft: str = ""  # with whose angle the wave goes of which it is a number
    gears: float = 1.0  # turns of the input shaft in one of that shaft
    on_request: bool = False  # freed only because the rig lists it as uncertain
    of_run: bool = False  # each run has one of its own: see search.phases
    part: tuple[int, int] | None = None  # entries of the flat misfit, from and to, that alone depend on it; None: all
    length: float = 0.0  # on which it matters; 0: as its values and its range have it

    @property
    def of_recorder(self) -> bool:
        """Whether it says how a log was recorded, not what the drive did."""
        return self.name.startswith("recorder.")


@dataclass(frozen=True)
class Hypothesis:
    """One possible cause: the numbers that it sets free."""

    component: str
    effect: str
    free: tuple[Free, ...]
    channel: str = ""  # sensors: whose
    summary: str = ""
    source: str = ""
    advice: str = ""  # the run that would tell it from others
    shown_over: str = ""  # the variable over which it is seen best; "" of a nominal value, which is no function of one
    drifts: bool = False  # it changes in time
    takes: tuple[str, ...] = ()  # nominal values that are others where it acts, with the component

    @property
    def label(self) -> str:
        if self.effect == "parameter":
            return self.free[0].name
        return f"{self.component} {self.effect}" + (f" ({self.channel})" if self.channel else "")

    def same_cause(self, other: Hypothesis) -> bool:
        """Whether the other is this, or of two one is a nominal value that is another where the other acts."""
        return self.label == other.label or other.label in self.takes or self.label in other.takes


def base(component: str) -> tuple[Parameter, ...]:
    """The nominal parameters of a component's law."""
    return law(component).BASE


def vocabulary(rig: Rig, used: set[str], channels: set[str], experiment: DriveExperiment) -> list[Hypothesis]:
    """All hypotheses about the components `used` and the measured `channels` (both with the drive's prefix).

    Whether a log can tell anything about one is found out by trying: a parameter without influence drops out.
    """
    found: list[Hypothesis] = []
    points = rig.kind == "steady"  # a point has no angle and no time
    for name in sorted(used):
        _, component = split(name, rig.drives)
        beside = effects(component)
        most = amounts(rig, name, channels, experiment)
        found += [_effect(rig, name, component, effect, most) for effect in beside if not (points and effect.needs)]
        said = {said for effect in beside for said in (*effect.says, *(p.name for p in effect.parameters))}
        for parameter in base(component):
            full = f"{name}.{parameter.name}"
            if parameter.name in said or parameter.role in (CONSTANT, SWITCH):
                continue
            if rig.questioned(full) and full not in rig.uncertain:
                free = (_parameter(rig, full, parameter, most),)
                found.append(Hypothesis(name, "parameter", free, summary=parameter.description, advice=MEASURE_IT))
    for channel in sorted(channels):
        signal = split(channel, rig.drives)[1]
        if not rig.trusted(channel) and signal not in COMMANDS:
            for effect in effects("sensor"):
                zero = signal in RELATIVE and any(p.role == OFFSET for p in effect.parameters)
                if not zero and not (points and effect.needs):
                    found.append(_sensor(channel, effect, spread(experiment, channel), unit(signal, experiment.rig.linear)))
    found = [_seen_whole(_tried(h, experiment), experiment) for h in found]
    return [h for h in found if h.free]


def _tried(hypothesis: Hypothesis, experiment: DriveExperiment) -> Hypothesis:
    """Steps of time are looked for in whole samples, steps of a reading where its channel has them.

    Of a whole drive only those that the log shows are a question: a period or a step that is off is as good as none. The steps in
    which a controller wrote its command are no fault of a sensor, for none is between.
    """
    if experiment.by_channel:
        shown = tuple(replace(p, trials=_shown(p, hypothesis.channel, experiment)) for p in hypothesis.free)
        return replace(hypothesis, free=tuple(p for p in shown if p.trials or p.role not in (PERIOD, STEP)))
    free = tuple(replace(p, trials=_even(p, hypothesis.channel, experiment)) for p in hypothesis.free)
    return replace(hypothesis, free=tuple(p for p in free if p.role != STEP or not _written(hypothesis.channel, experiment)))


def _written(channel: str, experiment: DriveExperiment) -> bool:
    """Whether a voltage's steps are those of the numbers in which a controller gave it."""
    prefix, signal = split(channel, experiment.rig.drives)
    return signal in VOLTAGES and written_step(signal, experiment.channels[0, prefix]) > 0.0


def _shown(p: Free, channel: str, experiment: DriveExperiment) -> tuple[float, ...]:
    """Periods and steps that a log shows of itself, ascending."""
    found: set[float] = set()
    for ch in experiment.channels.values():
        if p.role == PERIOD:
            found.update(of_command for of_command in periods(ch) if p.low < of_command < p.high)
        if p.role == STEP:
            found.update(lies_in(channel, ch))
    return tuple(sorted(found))


def _even(p: Free, channel: str, experiment: DriveExperiment) -> tuple[float, ...]:
    """Periods of whole samples, and the smallest step of a channel."""
    if p.role == PERIOD:
        step, (fewest, most) = experiment.step, RULES.search.periods
        return tuple(n * step for n in range(fewest, most + 1) if p.low <= n * step <= p.high)
    if p.role == STEP and channel:
        steps = [np.diff(np.unique(run.signals[channel][run.usable(channel)])) for run in experiment.runs]
        return tuple({float(np.quantile(s, RULES.data.smallest_step)) for s in steps if len(s)})
    return ()


def _seen_whole(hypothesis: Hypothesis, experiment: DriveExperiment) -> Hypothesis:
    """A wave comes back: one that no run goes through once whole is a curve, and bends to anything.

    How many there are in a turn matters by what shifts its phase by a radian at the other end of the way.
    """
    free = list(hypothesis.free)
    prefix = split(hypothesis.component, experiment.rig.drives)[0]
    for order in [p for p in free if p.role == ORDER]:
        turns = _turns(experiment, prefix, SIDES[order.shaft])
        low = max(order.low, 1.0 / turns)
        if low < order.high:
            gears = _gears(experiment, prefix) if SIDES[order.shaft] else 1.0
            free[free.index(order)] = replace(order, low=low, length=1.0 / (2.0 * np.pi * turns), gears=gears)
        else:
            free = [p for p in free if p.shaft != order.shaft]
    return replace(hypothesis, free=tuple(free))


def _gears(experiment: DriveExperiment, prefix: str) -> float:
    """Turns of the input shaft in one of the load's, as rig or law have it."""
    runs = (ch for (_, of), ch in experiment.channels.items() if of == prefix)
    return next((ch.setting.value(f"{prefix}reducer.gear_ratio", {}) for ch in runs), 1.0)


def _turns(experiment: DriveExperiment, prefix: str, side: int) -> float:
    """Turns from one end of the way to the other, the longest of all runs, of the input shaft (0) or the load (1)."""
    runs = [ch for (_, of), ch in experiment.channels.items() if of == prefix]
    moves = [ch for ch in runs if any(ch.has(name) for name in MOVES)]
    ways = [float(np.ptp(both({}, ch)[side].angle)) for ch in moves]
    return max(ways, default=0.0) / (2.0 * np.pi) or np.inf


def _effect(rig: Rig, name: str, component: str, effect: Effect, most: dict[str, float]) -> Hypothesis:
    """The hypothesis of a component's effect; most: see reach.amounts."""
    free = []
    for p in effect.parameters:
        full = f"{name}.{p.name}"
        if not rig.questioned(full) or (p.on_request and full not in rig.uncertain):
            continue
        nominal = rig.parameters.get(full, p.off)
        low, high = rig.uncertain.get(full, _within(p, nominal, *_wide_enough(p, nominal, component), most))
        free.append(replace(_free(full, p, nominal, low, high, rig.linear), told=full in rig.parameters))
    for extra in effect.frees:
        full = f"{name}.{extra}"
        parameter = next(p for p in base(component) if p.name == extra)
        if not rig.questioned(full) or full in rig.uncertain:
            continue
        beside = _parameter(rig, full, parameter, most)
        if full not in rig.parameters and beside.nominal > 0.0:  # no data sheet says: a time constant may be anything
            below, above = RULES.search.untold
            low, high = max(parameter.low, beside.nominal / below), min(parameter.high, beside.nominal * above)
            beside = replace(beside, low=low, high=high)
        free.append(beside if beside.above else replace(beside, companion=True))
    return _of(effect, name, tuple(free))


def _of(effect: Effect, component: str, free: tuple[Free, ...], channel: str = "") -> Hypothesis:
    """The hypothesis of an effect, with what the effect says of itself."""
    said = effect.summary, effect.source, effect.advice, effect.shown_over, effect.drifts
    return Hypothesis(component, effect.name, free, channel, *said, tuple(f"{component}.{name}" for name in effect.takes))


def _free(full: str, p: Parameter, nominal: float, low: float, high: float, linear: bool = False) -> Free:
    """A parameter of a law as a fit may change it."""
    inside = tuple(x for x in p.trials if low <= x <= high)
    measure = along(p.unit, p.name) if linear else p.unit
    return Free(
        full, nominal, low, high, measure, p.description, places=inside, role=p.role, shaft=p.shaft, on_request=p.on_request
    )


def _wide_enough(p: Parameter, nominal: float, component: str) -> tuple[float, float]:
    """Bounds of an effect's parameter, no nearer to a nominal value than that is searched itself, within what its law allows.

    An effect's bounds hold for any drive without it: a gear of which a rig says that it has much of it may have far more.
    """
    own = next((known for known in base(component) if known.name == p.name), None)
    if own is None or nominal <= 0.0:
        return p.low, p.high
    factor = RULES.search.nominal_factor
    return min(p.low, max(own.low, nominal / factor)), max(p.high, min(own.high, nominal * factor))


def _within(p: Parameter, nominal: float, low: float, high: float, most: dict[str, float]) -> tuple[float, float]:
    """Bounds of a parameter's search, no farther than its share of what the drive has of its unit; most: see reach.amounts.

    Nor nearer than twice what a rig says of it.
    """
    reach = max(p.of_drive * most.get(p.unit, inf) if p.of_drive else inf, 2.0 * abs(nominal))
    return max(low, -reach), min(high, reach)


def _parameter(rig: Rig, full: str, parameter: Parameter, most: dict[str, float]) -> Free:
    """A nominal value may be off by the rules' `nominal_factor`, within what physics allows; most: see reach.amounts."""
    nominal = rig.parameters.get(full, parameter.off)
    if parameter.above:  # fitted as what lies above the other
        owner, (name, highest, description) = full.rpartition(".")[0], parameter.above
        usual = next(p.off for p in base(split(owner, rig.drives)[1]) if p.name == name)
        over = max(0.0, nominal - rig.parameters.get(f"{owner}.{name}", usual))
        return replace(_free(full, parameter, over, 0.0, highest, rig.linear), description=description, above=f"{owner}.{name}")
    low, high, factor = parameter.low, parameter.high, RULES.search.nominal_factor
    if nominal > 0.0:
        low, high = max(low, nominal / factor), min(high, nominal * factor)
    elif nominal < 0.0:
        low, high = max(low, nominal * factor), min(high, nominal / factor)
    elif not isfinite(high - low):
        low, high = max(low, -RULES.search.nominal_zero), min(high, RULES.search.nominal_zero)
        low, high = _within(parameter, nominal, low, high, most)
    return _free(full, parameter, nominal, low, high, rig.linear)


def uncertain(rig: Rig) -> tuple[Free, ...]:
    """What no data sheet says: free in every fit, the first included."""
    found = []
    for full, (low, high) in rig.uncertain.items():
        known, nominal = Parameter("", "", 0.0, low, high, ""), rig.parameters.get(full)
        prefix, rest = split(full, rig.drives)
        component, _, parameter = rest.partition(".")
        if component in COMPONENTS:
            for p in (*base(component), *(q for e in effects(component) for q in e.parameters)):
                if p.name == parameter:
                    known = p
                    nominal = p.off if nominal is None else nominal
        nominal = 0.5 * (low + high) if nominal is None else min(max(nominal, low), high)
        found.append(_free(full, known, nominal, low, high, rig.linear))
    return tuple(found)


def recorder(experiment: DriveExperiment) -> tuple[Free, ...]:
    """How channels were recorded, within what recorders do: free in every fit, and no cause.

    Of a whole drive all channels; where its parts run on measured inputs the measured voltage: how it is to be read between its rows.
    """
    rules, step, found = RULES.search, experiment.step, []
    if not experiment.by_channel:
        late = 0.5 * step, -step, rules.latest + step  # first taken to go straight from row to row
        return tuple(Free(f"recorder.{channel}.shift", *late, "s") for channel in between_rows(experiment))
    told = {"controller.sample_period", "controller.command_delay"} & {*experiment.rig.parameters, *experiment.rig.uncertain}
    way = driven.of(experiment.channels[0, ""]) if experiment.rig.simulate == whole.WHOLE else ""
    by_rows = bool(way) and driven.row_by_row(experiment.channels[0, ""])
    if way in driven.SETPOINT and not told and not by_rows:
        found.append(Free(whole.HOLD, rules.window_start * step, 0.0, step, "s"))
    if way and whole.makes_its_speed(experiment.channels[0, ""]):  # of a difference over its period half of that is late
        period = max(step, experiment.rig.parameters.get("controller.sample_period", 0.0))
        found.append(Free(whole.FILTER, rules.filter_start, 0.0, rules.slowest_filter + 0.5 * period, "s"))
    for residual in experiment.residuals if experiment.rig.simulate == whole.WHOLE else ():
        latest = rules.latest + step  # what drives an open loop was measured, and may be as late as any channel
        channel, numbers = residual.output, {"shift": (0.0, -latest if way == driven.VOLTAGE else -step, latest)}
        ch = experiment.channels[0, residual.prefix]
        if channel in whole.TURNS and not counts(channel, ch)[1]:
            numbers["filter"] = (rules.filter_start, 0.0, rules.slowest_filter)
            turned = _turns(experiment, residual.prefix, SIDES["output" if channel.startswith("load") else "input"])
            for order in (n for n in RULES.residuals.ripples if n * turned >= 1.0):  # of less than a wave nothing tells it
                numbers |= {f"ripple_{wave}_{order}": (0.0, -rules.tacho_ripple, rules.tacho_ripple) for wave in ("cos", "sin")}
        elif channel.endswith("load.angle") and way == driven.ANGLE:  # the other shaft's zero is nobody's fault however far it is
            half = 0.5 * counts(channel, ch)[0]
            numbers["zero"] = (0.0, -half, half)
        elif channel in VOLTAGES:
            numbers["window"] = (rules.window_start * step, 0.0, step)
        found += [Free(f"recorder.{channel}.{name}", *three) for name, three in numbers.items() if three[2] > three[1]]
    return tuple(found)


def between_rows(experiment: DriveExperiment) -> list[str]:
    """Voltages that were measured and drive a motor's comparison; what stood between their rows nobody logged.

    A command that is a number of a controller in step with the log keeps its value from row to row, and is no question.
    """
    found = []
    for prefix in experiment.rig.drives if not experiment.steady else ():
        ch = experiment.channels[0, prefix]
        electric = electric_of(ch)
        reads = any(prefix + electric in r.reads and r.kind in ("motor", "gear") for r in experiment.residuals)
        if electric in VOLTAGES and reads and not in_step(ch):
            found.append(prefix + electric)
    return found


def _sensor(channel: str, effect: Effect, reach: float, unit: str) -> Hypothesis:
    """A sensor's law knows no unit: what carries the channel's is told in it, and searched within the channel's reach."""
    free = []
    for p in effect.parameters:
        low, high = (max(p.low, -reach), min(p.high, reach)) if p.of_value else (p.low, p.high)
        told = p._replace(unit=unit) if p.of_value else p
        free.append(_free(f"sensor.{channel}.{p.name}", told, p.off, low, high))
    return _of(effect, "sensor", tuple(free), channel)
