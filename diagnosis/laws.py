"""The components' laws: plain for their tables, compiled for fitting. The source is the FMUs' own."""

from __future__ import annotations

from functools import cache
from importlib import import_module

from .errors import DataError
from .rig import Rig, split, suggest

MODULES = {
    "controller": "fmus.controller.pd",
    "motor": "fmus.motor.dc",
    "reducer": "fmus.reducer.shaft",
    "load": "fmus.load.load",
}
_TABLES = {**MODULES, "reducer": "fmus.reducer.law"}
LAWS = {component: import_module(module) for component, module in _TABLES.items()}


@cache
def compiled(module: str):
    """A module of the laws with all its functions compiled by numba."""
    from master.compiled import compiled as compile_module

    return compile_module(module)


@cache
def _type(component: str):
    return compiled(_TABLES[component]).Parameters


def parameters(component: str, name: str, values: dict[str, float]):
    """The component's Parameters, with `values` named "<name>.<parameter>" in place of its defaults."""
    kind, start = _type(component), len(name) + 1
    given = {key[start:]: value for key, value in values.items() if key.startswith(name + ".")}
    return kind(**{key: float(value) for key, value in given.items() if key in kind._fields})


def check_names(rig: Rig) -> None:
    """Refuse parameters that the FMU does not have, and values that it would refuse."""
    for full in (*rig.parameters, *rig.uncertain):
        if full.startswith("sensor."):
            continue
        prefix, rest = split(full, rig.drives)
        component, _, parameter = rest.partition(".")
        if component not in LAWS:
            raise DataError(
                f"{rig.path}: parameter {full!r}: there is no component {component!r}.{suggest(component, LAWS)}"
            )
        fields = LAWS[component].Parameters._fields
        if parameter not in fields:
            raise DataError(
                f"{rig.path}: parameter {full!r}: {component.capitalize()}.fmu has no {parameter!r}."
                f"{suggest(parameter, fields)}"
            )
    for prefix in rig.drives:
        defaults = LAWS["reducer"].Parameters()
        mu = rig.parameters.get(f"{prefix}reducer.friction_kinetic", defaults.friction_kinetic)
        ratio = rig.parameters.get(f"{prefix}reducer.gear_ratio", defaults.gear_ratio)
        if ratio <= 0.0 or mu < 0.0:
            raise DataError(
                f"{rig.path}: {prefix}reducer: gear_ratio must be above 0 and friction_kinetic not below 0; "
                "signs belong in [columns]."
            )
