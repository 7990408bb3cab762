"""The components' laws: plain for their tables, compiled for fitting. The source is the FMUs' own.

They are the laws in force (fmus.laws), which a user's own effects may be among: what is kept is kept for each of these.
"""

from __future__ import annotations

from collections.abc import Iterable
from functools import cache, lru_cache
from types import ModuleType

from selflock.fmus import laws
from selflock.fmus.effect import LAG, SWITCH, Effect
from selflock.fmus.effect_file import LAWS
from selflock.fmus.slave import Variable, rows

from ..data.rig import Rig, split, suggest
from ..data.signals import SIGNALS
from ..errors import DataError

COMPONENTS = ("controller", "motor", "reducer", "load")


def law(component: str) -> ModuleType:
    """The plain law of a component, or of a sensor."""
    return laws.module(LAWS[component])


def effects(component: str) -> tuple[Effect, ...]:
    """The effects that stand beside a component's physics."""
    return law(component).EFFECTS


def winding() -> tuple[str, ...]:
    """Parameters of the reducer that say how its output shaft winds up under a torque, by name."""
    return _winding(laws.in_force())


@cache
def _winding(package: str) -> tuple[str, ...]:
    felt = [effect for effect in effects("reducer") if {"compliance", "play"} & set(effect.hooks)]
    return tuple(
        sorted({"gear_ratio", "shaft_stiffness", "shaft_damping"} | {p.name for effect in felt for p in effect.parameters})
    )


def electric() -> tuple[str, ...]:
    """Parameters of the motor that say what current flows at a voltage and a speed, by name."""
    return _of_motor(laws.in_force(), ("resistance", "weakening", "drop", "lost"), ("torque_constant",))


def driving() -> tuple[str, ...]:
    """Parameters of the motor that say what torque a current makes, by name."""
    return _of_motor(laws.in_force(), ("resistance", "weakening", "torque"), ("inductance", "voltage_constant"))


def in_proportion(motor) -> bool:
    """Whether a motor with these Parameters turns its current into torque by its constant alone: no effect bends that."""
    return _in_proportion(laws.in_force(), motor)


@lru_cache(64)
def _in_proportion(package: str, motor) -> bool:
    bends = [effect.hooks["active"] for effect in effects("motor") if {"weakening", "torque"} & set(effect.hooks)]
    return not any(active(motor, law("motor").Condition(0.0, 0.0, 0.0, 0.0, 0.0)) > 0.0 for active in bends)


@cache
def _of_motor(package: str, hooks: tuple[str, ...], but: tuple[str, ...]) -> tuple[str, ...]:
    """Parameters of the motor's law, `but` these, of the effects that have one of these hooks, and whatever these name."""
    felt = [effect for effect in effects("motor") if set(hooks) & set(effect.hooks)]
    named = {name for effect in felt for hook in effect.hooks.values() for name in hook.__code__.co_names}
    own = {p.name for effect in felt for p in effect.parameters} | {p.name for p in law("motor").BASE if p.name not in but}
    return tuple(sorted(name for name in _types(package, "motor")._fields if name in own | named))


def lags() -> list[str]:
    """Time constants of a sensor; one below 0 stands for its mirror image in time."""
    return _lags(laws.in_force())


@cache
def _lags(package: str) -> list[str]:
    return [p.name for effect in effects("sensor") for p in effect.parameters if p.role == LAG]


def _type(component: str):
    return _types(laws.in_force(), component)


@cache
def _types(package: str, component: str):
    from selflock.master.compiled import parameters

    return parameters(f"{laws.OURS}.{LAWS[component]}")


def parameters(component: str, name: str, values: dict[str, float]):
    """The component's Parameters, with `values` named "<name>.<parameter>" in place of its defaults."""
    return _type(component)(**{key: float(values[full]) for key, full in names(component, name) if full in values})


def default(component: str, parameter: str) -> float:
    """What a component's parameter is where nobody says anything of it."""
    return _defaults(laws.in_force(), component)[parameter]


@cache
def _defaults(package: str, component: str) -> dict[str, float]:
    return {name: float(value) for name, value in _types(package, component)()._asdict().items()}


def names(component: str, name: str) -> tuple[tuple[str, str], ...]:
    """A component's parameters, each with what `values` call it."""
    return _names(laws.in_force(), component, name)


@cache
def _names(package: str, component: str, name: str) -> tuple[tuple[str, str], ...]:
    return tuple((key, f"{name}.{key}") for key in _types(package, component)._fields)


def as_fmu(component: str, name: str, value: float) -> float | bool:
    """A parameter's value as the component's FMU takes it."""
    return bool(value) if any(p.name == name and p.role == SWITCH for p in law(component).BASE) else float(value)


def sensor(channel: str, values: dict[str, float]):
    """The Parameters of a channel's sensor; None where `values` say nothing of it."""
    told = _told(laws.in_force(), channel)
    if told.keys().isdisjoint(values):  # which is asked far oftener than not
        return None
    return _type("sensor")(**{name: values[full] for full, name in told.items() if full in values})


@cache
def _told(package: str, channel: str) -> dict[str, str]:
    """Parameters of a channel's sensor by what `values` call them."""
    return {full: name for name, full in _names(package, "sensor", f"sensor.{channel}")}


def no_sensor():
    """The Parameters of a sensor that reads the value itself."""
    return _type("sensor")()


def check_names(rig: Rig) -> None:
    """Refuse parameters that no FMU has, values that the FMU would refuse, and `known` names that are none."""
    _check(rig, "parameters", rig.parameters.items())
    _check(rig, "uncertain", ((name, end) for name, ends in rig.uncertain.items() for end in ends), sensors=True)
    for pattern, values in rig.logs.items():
        _check(rig, f'logs."{pattern}"', values.items())
    for name in rig.known:
        if split(name, rig.drives)[1] not in SIGNALS and name != "sensor.*":  # those are sensors that are trusted
            _row(rig, "[rig] known", name)


def _check(rig: Rig, table: str, given: Iterable[tuple[str, float]], sensors: bool = False) -> None:
    """Every name is a parameter of a component of a drive (or of a sensor), every value one that its FMU takes."""
    where = f"[{table}]"
    for name, value in given:
        if name.startswith("sensor.") and not sensors:
            raise DataError(
                f"{rig.path}: {where} {name!r}: what a sensor is known to do belongs in [columns], as factor and offset."
            )
        row = _row(rig, where, name)
        if row is None:
            raise DataError(f"{rig.path}: {where} {name!r}: {value:.6g} is a value for all of a component; name the parameter.")
        if isinstance(value, bool) and row.type != "Boolean":
            raise DataError(
                f"{rig.path}: {where} {name!r} = {str(value).lower()}: {row.name} is a number{row.unit and f' in {row.unit}'}."
            )
        low, high = row.low, row.high
        if not low <= value <= high:
            unit = f" {row.unit}" if row.unit else ""
            sign = " A sign belongs in [columns], as a factor." if value < 0.0 <= low else ""
            raise DataError(
                f"{rig.path}: {where} {name!r}: {value:.6g}{unit} is outside the range of {row.name}, [{low:.6g}, {high:.6g}]{unit}.{sign}"
            )


def _row(rig: Rig, where: str, name: str) -> Variable | None:
    """The parameter's row in its FMU; None for all of a component."""
    if name.startswith("sensor."):
        component, (channel, _, parameter) = "sensor", name.removeprefix("sensor.").rpartition(".")
        if split(channel, rig.drives)[1] not in SIGNALS:
            raise DataError(f"{rig.path}: {where} {name!r}: there is no channel {channel!r}.{suggest(channel, SIGNALS)}")
    else:
        prefix, rest = split(name, rig.drives)
        component, _, parameter = rest.partition(".")
        if prefix not in rig.drives or component not in COMPONENTS:
            drives = f" The drives are {', '.join(rig.drives)}: begin with one of them." if rig.drives != ("",) else ""
            raise DataError(
                f"{rig.path}: {where} {name!r}: there is no such component.{drives or suggest(component, COMPONENTS)}"
            )
    table = {row.name: row for row in rows(law(component).BASE, effects(component))}
    if parameter == "*":
        return None
    if parameter not in table:
        raise DataError(
            f"{rig.path}: {where} {name!r}: {component.capitalize()}.fmu has no {parameter!r}.{suggest(parameter, table)}"
        )
    return table[parameter]
