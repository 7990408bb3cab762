"""What of a result moves: the drawings that it carries, a robot known by its columns, else dials for its angles."""

from __future__ import annotations

from math import isfinite, pi
from typing import Any

import numpy as np

from selflock.fmus.errors import SelflockError

from .sheet import Sheet

ROBOT = ("chassis_x", "chassis_y", "chassis_pitch", "front_angle", "rear_angle", "front_sprocket_angle", "rear_sprocket_angle")
STYLES = ("body", "limb", "wheel", "track", "fixed", "mass")
TURNS = {"rad": 1.0, "deg": pi / 180.0}
DIALS = 6  # at most
STAGES, SHAPES, MOVES, POINTS = 4, 100, 12, 5000  # of a page, a drawing, a shape
FAR = 1e6  # m


def stages(tables: list[Sheet]) -> tuple[list[dict[str, Any]], list[str]]:
    """Moving pictures as the page's script has them, one for each component that is drawn; and what should be said of them."""
    notes: list[str] = []
    found: dict[str, list[dict[str, Any]]] = {}
    for number, one in enumerate(tables):
        for name, drawing in _drawings(one, notes).items():
            found.setdefault(name, []).append({"run": number, **drawing})
    if not found:
        for number, one in enumerate(tables):
            if dials := _dials(one):
                found.setdefault("angles", []).append({"run": number, **dials})
    return [{"label": name, "of": of} for name, of in list(found.items())[:STAGES]], list(dict.fromkeys(notes))


def moving(one: Sheet) -> set[str]:
    """Columns that move a drawing of the result, by numbers in the units that it was written in."""
    return {name for drawing in _drawings(one, []).values() for name in columns_of(drawing)}


def _drawings(one: Sheet, notes: list[str]) -> dict[str, dict[str, Any]]:
    said = one.about.get("drawings")
    found = {}
    for owner, drawing in said.items() if isinstance(said, dict) else ():
        try:
            shown = checked(drawing, owner)
        except (TypeError, ValueError, KeyError, AttributeError, OverflowError):
            notes.append(f"What {one.label} says of how {owner} looks cannot be read; it is not drawn.")
            continue
        lost = sorted(set(columns_of(shown)) - set(one.columns))
        if lost:
            more = f" and {len(lost) - 1} more" if len(lost) > 1 else ""
            notes.append(f"{owner} is not drawn: {one.label} lacks the column {lost[0]}{more}.")
        else:
            found[owner] = shown
    if not said:
        for name in one.columns:
            owner, dot, last = name.rpartition(".")
            if last == ROBOT[0] and all(f"{owner}{dot}{part}" in one.columns for part in ROBOT):
                if drawing := _robot(notes, one, owner):
                    found[owner] = drawing
    return found


def _robot(notes: list[str], one: Sheet, owner: str) -> dict[str, Any] | None:
    """A vehicle that is known by its columns alone, such as Robot.fmu in another tool; its parameters, if the file has them."""
    try:
        from selflock.vehicle import Robot
    except ModuleNotFoundError:
        notes.append("The robot is not drawn: pip install 'selflock[vehicle]' brings what knows its lengths.")
        return None
    robot, values = Robot("robot"), one.about.get("values")
    mine = values.get(owner) if isinstance(values, dict) else None
    if isinstance(mine, dict):
        try:
            for name in mine.keys() & robot.values.keys():
                robot.set(name, mine[name])
            return checked(robot.drawing(), owner)
        except (SelflockError, ValueError):  # none that a robot can have, or none that can be drawn
            robot.reset()
    notes.append(
        f"{one.label} says neither the robot's lengths nor its ground: it is drawn with its usual ones, on a flat ground. "
        "A .parquet result says them, and so does --system."
    )
    return checked(robot.drawing(), owner)


def columns_of(drawing: dict[str, Any]) -> list[str]:
    found = list(drawing["follow"])
    for shape in drawing["shapes"]:
        for move in shape["moves"]:
            found += [*move.get("place", ()), *move.get("turn", ())]
        found += shape.get("runs", {}).get("by", ())
    return found


def checked(drawing: dict[str, Any], owner: str) -> dict[str, Any]:
    """A drawing as the script wants it, columns named in full. Raises ValueError and its like where it is none."""
    full = lambda name: f"{owner}.{_word(name)}" if owner else _word(name)
    by = lambda turn: {full(name): _number(factor) for name, factor in list(turn.items())[:MOVES]}
    shapes = []
    for shape in drawing["shapes"][:SHAPES]:
        moves: list[dict[str, Any]] = []
        for move in shape["moves"][:MOVES]:
            new: dict[str, Any] = {"plus": _number(move.get("plus", 0.0))}
            if "place" in move:
                new["place"] = [full(name) for name in _pair(move["place"])]
            if "shift" in move:
                new["shift"] = [_number(x) for x in _pair(move["shift"])]
            if "turn" in move:
                new["turn"] = by(move["turn"])
            moves.append(new)
        style = shape["style"] if shape["style"] in STYLES else "limb"
        new_shape = {"points": _points(shape["points"]), "style": style, "colour": int(shape.get("colour", 0)), "moves": moves}
        new_shape |= {"closed": bool(shape.get("closed", False))}
        if runs := shape.get("runs"):
            pitch = _number(runs["pitch"])
            if not pitch > 0.0:
                raise ValueError
            new_shape["runs"] = {"by": by(runs["by"]), "per": _number(runs["per"]), "pitch": pitch}
        if "label" in shape:
            new_shape |= {
                "label": _word(shape["label"]),
                "foot": [_number(x) for x in _pair(shape["foot"])],
                "room": _number(shape["room"]),
            }
        shapes.append(new_shape)
    width = _number(drawing["width"])
    ground = _points(drawing["ground"]) if drawing.get("ground") else None
    if not width > 0.0 or (ground and any(q[0] < p[0] for p, q in zip(ground, ground[1:]))):
        raise ValueError
    height = _number(drawing.get("height", 0.42 * width))
    return {
        "width": width, "height": height if height > 0.0 else 0.42 * width, "ground": ground, "shapes": shapes,
        "follow": [full(name) for name in drawing.get("follow", ())[:1]],
        "below": _number(drawing.get("below", 0.1 * width)), "middle": _number(drawing.get("middle", 0.0)), "floor": _number(drawing.get("floor", 0.0)),
    }  # fmt: skip


def _points(points: Any) -> list[list[float]]:
    return [[_number(x) for x in _pair(pair)] for pair in points[:POINTS]]


def _pair(pair: Any) -> list[Any]:
    a, b = pair
    return [a, b]


def _number(value: Any) -> float:
    x = float(value)
    if not isfinite(x) or abs(x) > FAR:
        raise ValueError
    return round(x, 6)


def _word(value: Any) -> str:
    if not isinstance(value, str):
        raise TypeError
    return value


def _dials(one: Sheet) -> dict[str, Any] | None:
    """A dial for each angle that moves, side by side."""
    moving = [name for name, x in one.columns.items() if one.units[name] in TURNS and np.nanmax(x) > np.nanmin(x)][:DIALS]
    if not moving:
        return None
    ring = [[float(0.4 * np.cos(a)), float(0.4 * np.sin(a))] for a in np.linspace(0.0, 2.0 * pi, 37)]
    shapes: list[dict[str, Any]] = []
    for place, name in enumerate(moving):
        shift = {"shift": [float(place - 0.5 * (len(moving) - 1)), 0.0]}
        turn = {"turn": {name: TURNS[one.units[name]]}}
        label = {"label": name, "foot": [0.0, -0.58], "room": 0.92}
        shapes.append({"points": ring, "style": "body", "colour": 0, "moves": [shift], **label})
        shapes.append({"points": [[0.0, 0.0], [0.4, 0.0]], "style": "limb", "colour": 1 + place % 2, "moves": [shift, turn]})
    return checked({"width": len(moving) + 0.3, "height": 1.2, "ground": None, "floor": -0.7, "shapes": shapes}, "")
