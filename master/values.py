"""Shared values of a system: a number is said once, and what follows from it is computed wherever it stands.

    [values]
    ratio = 50.0
    friction = 0.01

    [components.gear.start]
    gear_ratio = "= ratio"
    [connections]
    "controller.angle" = { from = "gear.input_angle", factor = "= 1 / ratio" }

A value is a number, true or false, or an expression over those above it. What may stand in an expression is in expression.py.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from math import isfinite
from typing import Any

import numpy as np

from .errors import DescriptionError
from .expression import parse
from .system import Connection, System, did_you_mean, formula


def given(system: System, settings: Mapping[str, Any]) -> tuple[System, dict[str, Any]]:
    """The system with those settings that name one of its values, and the other settings."""
    mine = {name: _number(name, value) for name, value in settings.items() if name in system.values}
    for name, value in mine.items():
        if isinstance(value, bool) and type(system.values[name]) in (int, float):
            raise DescriptionError(f"settings: {name} = {str(value).lower()} is no number.")
    rest = {name: value for name, value in settings.items() if name not in mine}
    for name in rest:
        if system.values and "." not in name and not system.alone:
            raise DescriptionError(f"settings: {name} is no value of the system{did_you_mean(name, system.values)}")
    return (replace(system, values={**system.values, **mine}) if mine else system), rest


def resolved(system: System) -> System:
    """The system with numbers in place of all expressions; itself where there are none."""
    known = numbers(system)
    if not known:
        return system
    components = {
        name: replace(component, start={v: _of(f"[components.{name}.start] {v}", x, known) for v, x in component.start.items()})
        for name, component in system.components.items()
    }
    connections = {target: _connected(target, connection, known) for target, connection in system.connections.items()}
    return replace(system, components=components, connections=connections, values={})


def numbers(system: System) -> dict[str, float | bool]:
    """The values by name, each computed from those above it."""
    known: dict[str, float | bool] = {}
    for name, value in system.values.items():
        found = _of(f"[values] {name}", value, known)
        known[name] = found if isinstance(found, bool) else float(found)
    return known


def made_of(system: System, value: Any) -> str:
    """A sentence about what `value` is computed from, where it is an expression: so that who set a value finds it in a message."""
    text = formula(value)
    if text is None:
        return ""
    known = numbers(system)
    those = ", ".join(f"{name} = {known[name]:g}" for name in parse(text).names)
    return f' It is "{value}"{" with " if those else ""}{those}.'


def _connected(target: str, connection: Connection, known: Mapping[str, Any]) -> Connection:
    where = f"[connections] {target}"
    found = {key: _of(f"{where} {key}", getattr(connection, key), known) for key in ("factor", "offset")}
    for key, value in found.items():
        if isinstance(value, bool):
            raise DescriptionError(f'{where} {key} = "{getattr(connection, key)}": its value is {str(value).lower()}, no number.')
    return replace(connection, factor=float(found["factor"]), offset=float(found["offset"]))


def _of(where: str, value: Any, known: Mapping[str, Any]) -> Any:
    """A value as it stands, or what its expression gives."""
    text = formula(value)
    if text is None:
        return value
    try:
        expression = parse(text)
        for name in (*expression.names, *expression.columns.values()):
            if name not in known:
                raise DescriptionError(f"there is no value {name} above it{did_you_mean(name, known)}")
        found = np.asarray(expression(known))
    except DescriptionError as error:
        raise DescriptionError(f'{where} = "{value}": {error}') from None
    if found.ndim or found.dtype.kind not in "fb" or not isfinite(found):
        raise DescriptionError(f'{where} = "{value}": its value is {found}, no finite number.')
    return found.item()


def _number(name: str, value: Any) -> float | bool:
    """What somebody sets a value to; text as a number."""
    if isinstance(value, str) and value.lower() in ("true", "false"):
        return value.lower() == "true"
    try:
        number = value if isinstance(value, bool) else float(value)
    except (TypeError, ValueError):
        raise DescriptionError(f"settings: {name} = {value!r} is no number.") from None
    if not isfinite(number):
        raise DescriptionError(f"settings: {name} = {value!r} is no finite number.")
    return number
