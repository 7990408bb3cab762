"""What a run was of, in words that a result file can hold: limits, and what is to be seen of each component.

A Parquet file of results has it as JSON in its metadata, so that a viewer needs nothing else. Beside a CSV file it is told
of the system file again (`of_system`): no FMU is loaded for that, and no code of others.

**A drawing** is what a part's `drawing()` gives: plain data, lengths in m, x forward and y up.

    {
        "width": 1.6, "height": 0.7, "below": 0.1,      # m that should be seen, and how much of it below the ground's mean height
        "ground": [[x, y], ...] or None,                # a polyline
        "follow": ["chassis_x"] or [],                  # the output that the eye goes along with
        "shapes": [{
            "points": [[x, y], ...],                    # in the shape's own frame
            "style": "body" | "limb" | "wheel" | "track" | "fixed" | "mass",
            "colour": 0, 1, 2, ...                      # shapes of one number have one colour
            "closed": True,
            "moves": [                                  # from the world to the shape's frame, one after the other
                {"place": ["chassis_x", "chassis_y"]},  # outputs, m
                {"turn": {"chassis_pitch": 1.0}},       # outputs times factors, summed up, rad
                {"shift": [0.2, 0.0]},                  # m
            ],
            "runs": {"by": {"angle": 1.0}, "per": 0.05, "pitch": 0.025},  # of a track: outputs in rad, m/rad, m
        }],
    }
"""

from __future__ import annotations

import json
from math import isfinite
from typing import Any

import numpy as np

from ..fmus.errors import SelflockError
from .binary import open_fmu
from .described import units_of, variables_of
from .errors import DescriptionError
from .face import Part, Variable
from .seen import Seen, Watch, number, watch
from .slips import checked
from .system import System
from .values import resolved
from .wiring import Wiring, fmu_path, linked, make, typed

Drawing = dict[str, Any]
PARAMETERS = 1000  # of a component, that a file has room for


def about(columns: list[Variable], wiring: Wiring) -> dict[str, Any]:
    """Of parts with their values set: the system's name, which columns are inputs, sources, limits, remarks, parameters, drawings."""
    seen = Seen(columns)
    watch(seen, wiring)
    drawings = {name: drawn for name, part in wiring.parts.items() if (drawn := _drawing(wiring, name, part))}
    return {
        "system": wiring.system.name,
        "inputs": [c.name for c in columns if c.causality == "input"],
        "sources": sorted(seen.sources),
        "limits": [_plain(one, seen) for one in seen.watches],
        "remarks": seen.remarks,
        "values": {name: mine for name, part in wiring.parts.items() if (mine := _parameters(wiring, name, part))},
        "drawings": drawings,
    }


def _parameters(wiring: Wiring, name: str, part: Part) -> dict[str, Any]:
    """What a component was run with, as far as it is plain; {} of one with very many."""
    values = {v.name: v.start for v in part.variables.values() if v.causality == "parameter"}
    values |= {key: value for key, value in wiring.values.get(name, {}).items() if key in values}
    plain = {key: x for key, x in values.items() if isinstance(x, (str, int)) or (isinstance(x, float) and isfinite(x))}
    return plain if len(plain) <= PARAMETERS else {}


def _plain(one: Watch, seen: Seen) -> dict[str, Any]:
    name = [c.name for c in seen.columns]
    voltage = name[one.voltage] if isinstance(one.voltage, int) else one.voltage
    ends = {end: value for end in ("low", "high") if isfinite(value := float(getattr(one, end)))}
    rest = {"voltage": voltage, "resistance": one.resistance, "least": one.least} if one.stalls else {}
    return {"name": one.name, "column": name[one.place], "unit": one.unit, **ends, **rest}


def seen_of(columns: list[Variable], said: dict[str, Any]) -> Seen:
    """What watches the columns of a file as the run that wrote it did. What of `said` is not as `about` has it is left out."""
    inputs, sources = (set(filter(_word, _list(said, key))) for key in ("inputs", "sources"))
    columns = [Variable(c.name, c.unit, type=c.type, causality="input" if c.name in inputs else "output") for c in columns]
    seen = Seen(columns)
    seen.sources = sources
    seen.remarks = [text for text in _list(said, "remarks") if _word(text)]
    places = {c.name: place for place, c in enumerate(seen.columns)}
    for one in _list(said, "limits"):
        if not isinstance(one, dict) or not (_word(one.get("name")) and _word(one.get("column")) and one["column"] in places):
            continue
        voltage: Any = one.get("voltage")
        voltage = places.get(voltage, voltage) if _word(voltage) else voltage
        low, high, ohms, least = (
            one.get(k, d) for k, d in (("low", -np.inf), ("high", np.inf), ("resistance", 0.0), ("least", 0.0))
        )
        fine = all(_number(x) for x in (low, high, ohms, least)) and (
            voltage is None or (_number(voltage) and ohms > 0.0 and high > 0.0)
        )
        if fine:
            unit = one["unit"] if _word(one.get("unit")) else ""
            seen.watches.append(Watch(one["name"], places[one["column"]], unit, low, high, voltage, ohms, least))
    return seen


def _list(said: dict[str, Any], key: str) -> list[Any]:
    value = said.get(key)
    return value if isinstance(value, list) else []


def _word(value: Any) -> bool:
    return isinstance(value, str)


def _number(value: Any) -> bool:
    return isinstance(value, (int, float)) and not isinstance(value, bool) and value == value


def _drawing(wiring: Wiring, name: str, part: Part) -> Drawing | None:
    """A part's own; of any part with a mass on an arm and an angle, such as Load.fmu, the arm."""
    if drawn := part.drawing():
        try:
            return dict(json.loads(json.dumps(drawn, default=np.ndarray.tolist)))
        except (TypeError, ValueError):
            raise DescriptionError(
                f"{name}: drawing() gives what is no plain data: names, numbers, lists and dictionaries are."
            ) from None
    known = part.variables
    arm, mass, lean = (number(wiring, name, key) for key in ("arm", "mass", "arm_angle"))
    if arm is None or mass is None or lean is None or "angle" not in known or known["angle"].causality != "output":
        return None
    return arm_drawing(arm if mass > 0.0 and arm > 0.0 else 0.0, lean)


def arm_drawing(arm: float, lean: float) -> Drawing:
    """A rotor on a stand, with a mass at the distance `arm`, m, at `lean`, rad, where the output `angle` is 0."""
    size = max(arm, 0.1)
    round_ = [[float(np.cos(a)), float(np.sin(a))] for a in np.linspace(0.0, 2.0 * np.pi, 25)]
    wheel = lambda r, x: [[x, 0.0]] + [[x + r * a, r * b] for a, b in round_]
    turned: dict[str, Any] = {"turn": {"angle": 1.0}, "plus": lean}
    floor = -1.5 * size
    shapes: list[dict[str, Any]] = [
        {
            "points": [[-0.35 * size, floor], [0.0, 0.0], [0.35 * size, floor]],
            "style": "fixed",
            "colour": 0,
            "closed": True,
            "moves": [],
        },
        {"points": wheel(0.3 * size, 0.0), "style": "wheel", "colour": 0, "moves": [turned]},
    ]
    if arm:
        shapes.append({"points": [[0.0, 0.0], [arm, 0.0]], "style": "limb", "colour": 0, "moves": [turned]})
        shapes.append({"points": wheel(0.16 * arm, arm), "style": "mass", "colour": 1, "moves": [turned]})
    return {"width": 3.4 * size, "height": 2.9 * size, "ground": [[-1e3, floor], [1e3, floor]], "follow": [], "shapes": shapes}


def of_system(system: System, columns: list[Variable]) -> dict[str, Any]:
    """`about` without a run: FMUs are read and not loaded, parts of others are left out, as is what cannot be read."""
    system = resolved(checked(system))
    wiring = Wiring(system)
    for name, component in system.components.items():
        try:
            if component.fmu:
                described = open_fmu(fmu_path(component, system), system.unlimited).description
                part = Part(name, variables_of(described))
                part.units = units_of(described)
            elif component.host:  # nobody is asked for it
                continue
            else:
                part = make(name, component, system)
            wiring.parts[name] = part
        except SelflockError:
            continue
    for name, part in wiring.parts.items():
        for key, value in system.components[name].start.items():
            if key in part.variables:
                wiring.values.setdefault(name, {})[key] = typed(part.variables[key], value, f"[components.{name}.start] {key}")
                part.set(key, wiring.values[name][key])
    for target, connection in system.connections.items():
        try:
            wiring.links.append(linked(wiring, target, connection))
        except (SelflockError, KeyError):  # of a component that was left out
            continue
    return about(columns, wiring)
