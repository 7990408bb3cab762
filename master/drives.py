"""A drive as a unit of the system file: motor, gear, controller and sensor wired once, their ratio said once.

    [drives.front]
    ratio = "= ratio"
    setpoint = "setpoints.front"     # front_angle and front_speed of setpoints
    load = "robot.front"             # front_angle and front_speed come back, front_torque goes there
    [drives.front.motor]
    resistance = 0.3

It becomes plain components, front_controller, front_motor, front_reducer, and their connections before anything else looks at
the system.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import fields
from typing import Any

from .errors import DescriptionError
from .system import Component, System, connection_of, did_you_mean, fits, formula, made, one_line_each

PARTS = {
    "controller": "selflock:Controller",
    "sensor": "selflock:Sensor",
    "motor": "selflock:Motor",
    "reducer": "selflock:Reducer",
}
ENDS = {"setpoint": ("angle", "speed"), "imposed": ("angle", "speed"), "load": ("angle", "speed", "torque")}
KEYS = ("like", "ratio", *ENDS, *PARTS)
SIDES = ("motor", "load")
KNOWN = {  # what a controller is told of its drive, where nobody tells it otherwise: of which part it is
    "gear_ratio": "reducer",
    "wedge_angle": "reducer",
    "friction_static": "reducer",
    "preload": "reducer",
    "resistance": "motor",
    "torque_constant": "motor",
}


def join(system: System, tables: Any) -> None:
    """Put the drives of a file into its system, as components before those that they drive, and connections."""
    if not isinstance(tables, dict):
        raise DescriptionError("[drives] should be a table of drives, each as [drives.NAME].")
    one_line_each("[drives]", tables)
    found: dict[str, dict[str, Component]] = {kind: {} for kind in PARTS}
    driven = set()
    for name in tables:
        told = _told(name, tables, ())
        ends = {key: _ends(name, key, told[key]) for key in ENDS if key in told}
        driven |= {end.partition(".")[0] for end in ends.get("load", {}).values()}
        parts = {kind: _part(name, kind, told) for kind in PARTS if kind in told or kind in ("motor", "reducer")}
        for kind, component in parts.items():
            if f"{name}_{kind}" in system.components:
                raise DescriptionError(
                    f"[drives.{name}] makes a component {name}_{kind}, which is there already: call one of them otherwise."
                )
            found[kind][f"{name}_{kind}"] = component
        for target, source in _wires(name, told, ends):
            if target in system.connections:
                raise DescriptionError(f"[drives.{name}] connects {target}, and [connections] does, too: leave one of them out.")
            system.connections[target] = connection_of(target, source)
        words = [f"{key} {told[key]}" for key in ("ratio", *ENDS) if isinstance(told.get(key), (str, float, int))]
        system.drives[name] = "; ".join([", ".join(f"{name}_{kind}" for kind in parts), *words])
    new = {name: component for components in found.values() for name, component in components.items()}
    old = system.components
    first = next((k for k, name in enumerate(old) if name in driven), len(old))
    system.components = dict([*list(old.items())[:first], *new.items(), *list(old.items())[first:]])


def _told(name: str, tables: dict[str, Any], seen: tuple[str, ...]) -> dict[str, Any]:
    """What is said of a drive, over what is said of the one that it is like."""
    where, table = f"[drives.{name}]", tables[name]
    if not isinstance(table, dict):
        raise DescriptionError(f"{where} should be a table.")
    for key in table:
        if key not in KEYS:
            raise DescriptionError(f"{where} has no key {key}{did_you_mean(key, KEYS)}")
    for kind in PARTS:
        if not isinstance(table.get(kind, {}), dict):
            raise DescriptionError(f"{where} {kind} should be a table of start values, [drives.{name}.{kind}].")
    other = table.get("like")
    if other is None:
        return table
    if other not in tables or other in (name, *seen):
        known = [one for one in tables if one not in (name, *seen)]
        raise DescriptionError(f"{where} like = {other!r}: there is no such drive to be like{did_you_mean(str(other), known)}")
    base = _told(other, tables, (*seen, name))
    return {**base, **table, **{kind: {**base.get(kind, {}), **table[kind]} for kind in PARTS if kind in table}}


def _ratio(name: str, told: dict[str, Any]) -> float | str:
    """Of the gear; a number or an expression over the system's values."""
    ratio: Any = told.get("ratio")
    if not fits(ratio, "float | str") or (not isinstance(ratio, str) and not ratio > 0.0):
        raise DescriptionError(
            f'[drives.{name}] ratio = {ratio!r}: the gear\'s ratio is wanted here, a number above 0 or an expression such as "= ratio".'
        )
    return ratio


def _ends(name: str, key: str, value: Any) -> dict[str, str]:
    """The variables at an end of a drive: "weight" has weight.angle and so on, "robot.front" has robot.front_angle."""
    names = ENDS[key]
    if isinstance(value, str) and value:
        return {one: f"{value}{'_' if '.' in value else '.'}{one}" for one in names}
    if (
        isinstance(value, dict)
        and set(value) == set(names)
        and all(isinstance(one, str) and "." in one for one in value.values())
    ):
        return dict(value)
    each = ", ".join(f'{one} = "component.variable"' for one in names)
    raise DescriptionError(
        f'[drives.{name}] {key} = {value!r}: write the component, such as "weight", or the begin of its variables, such as '
        f'"robot.front", or each of them, {{ {each} }}.'
    )


def _part(name: str, kind: str, told: dict[str, Any]) -> Component:
    """A part of a drive: keys of a component are that, all else start values."""
    where, given = f"[drives.{name}.{kind}]", dict(told.get(kind, {}))
    if kind == "sensor":
        given.pop("at", None)
    own = {one.name for one in fields(Component)} - {"part", "manoeuvre"}
    table = {key: given.pop(key) for key in list(given) if key in own and key != "start"}
    start = {**table.pop("start", {}), **given.pop("start", {}), **given}
    if kind in ("controller", "reducer"):
        if "gear_ratio" in start:
            raise DescriptionError(f"{where} gear_ratio: the ratio is said once, as [drives.{name}] ratio.")
        start = {"gear_ratio": _ratio(name, told), **start}
    if kind == "controller":
        beside = {key: told.get(part, {}).get(key) for key, part in KNOWN.items()}
        start = {**{key: value for key, value in beside.items() if value is not None}, **start}
    if kind == "reducer" and "imposed" not in told:  # inputs of the other mode
        start = {"imposed_angle": 0.0, "imposed_speed": 0.0, **start}
    return made(Component, {"fmu": PARTS[kind], **table, "start": start}, where)


def _wires(name: str, told: dict[str, Any], ends: dict[str, dict[str, str]]) -> Iterator[tuple[str, Any]]:
    """Target and source of each connection."""
    controller, sensor, motor, reducer = (f"{name}_{kind}" for kind in PARTS)
    load, setpoint = ends.get("load"), ends.get("setpoint")
    if "controller" in told:
        ratio = _ratio(name, told)
        down = f"= 1 / ({formula(ratio)})" if isinstance(ratio, str) else 1.0 / ratio
        if setpoint is None:
            raise DescriptionError(
                f'[drives.{name}] setpoint: say what its controller follows, such as setpoint = "setpoints.{name}".'
            )
        seen: Any = {"from": f"{reducer}.input_angle", "factor": down}
        if "sensor" in told:
            side = told["sensor"].get("at", SIDES[0])
            if side not in SIDES or (side == "load" and load is None):
                raise DescriptionError(
                    f'[drives.{name}.sensor] at = {side!r}: "motor", an encoder on its shaft, or "load", where the drive has one.'
                )
            yield f"{sensor}.value", load["angle"] if side == "load" and load else f"{reducer}.input_angle"
            seen = {"from": f"{sensor}.reading", "factor": 1.0 if side == "load" else down}
        yield f"{controller}.angle_setpoint", setpoint["angle"]
        yield f"{controller}.speed_setpoint", setpoint["speed"]
        yield f"{controller}.angle", seen
        yield f"{controller}.speed", {"from": f"{reducer}.input_speed", "factor": down}
        yield f"{controller}.motor_speed", f"{reducer}.input_speed"
        yield f"{controller}.output_torque", f"{reducer}.output_torque"
        yield f"{motor}.voltage", f"{controller}.voltage"
    elif setpoint is not None or "sensor" in told:
        what = "setpoint" if setpoint is not None else "sensor"
        raise DescriptionError(
            f"[drives.{name}] {what}: there is no controller for it. Write [drives.{name}.controller], or leave it out."
        )
    yield f"{motor}.speed", f"{reducer}.input_speed"
    yield f"{reducer}.motor_torque", f"{motor}.torque"
    if "imposed" in ends:
        yield f"{reducer}.imposed_angle", ends["imposed"]["angle"]
        yield f"{reducer}.imposed_speed", ends["imposed"]["speed"]
    if load is not None:
        yield f"{reducer}.output_angle", load["angle"]
        yield f"{reducer}.output_speed", load["speed"]
        yield load["torque"], f"{reducer}.output_torque"
