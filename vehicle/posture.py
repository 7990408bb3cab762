"""Lines to draw the vehicle with, in the plane, metres."""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from . import kernel
from .model import Geometry, Model

ROOF = 0.09  # m, upper side of the drawn chassis above the line of the hinges
VIEW = 2.0  # m of ground to either side


def posture(model: Model) -> dict[str, np.ndarray]:
    """Polylines of shape (points, 2): chassis, holders, tracks (outer face), wheels (from the axis: their turn shows), ground."""
    v, g = model.values, model.geometry
    place = model.positions()
    cx, cy, pitch = place[0]

    def at_chassis(points):
        return _moved(np.asarray(points, float) - (v["chassis_center_x"], v["chassis_center_y"]), cx, cy, pitch)

    lines = {"chassis": at_chassis(plan(v, g))}
    turns = np.linspace(0.0, 2.0 * math.pi, 37)
    center = float(model.constants["holder_center"][0])
    for track, name in enumerate(("front", "rear")):
        hx, hy, angle = place[1 + track]
        hinge, tip = _moved(np.array([(-center, 0.0), (g.length - center, 0.0)]), hx, hy, angle)
        lines[f"{name}_holder"] = np.array([hinge, tip])
        wheel = model.state[track] + (0.0 if v["driven_sprockets"] else pitch)
        belt = g.belt_radius * (wheel - angle)
        for what, axis, turn in (("sprocket", hinge, wheel), ("idler", tip, wheel)):
            circle = np.column_stack([np.cos(turns + turn), np.sin(turns + turn)]) * (g.center_radius - 0.25 * v["shoe_height"])
            lines[f"{name}_{what}"] = np.vstack([axis, axis + circle])
        lines[f"{name}_track"] = _belt(model, hinge, angle, belt) if model.belt else _shoes(model, track, place)
    x, y = cx, np.interp([cx - VIEW, cx + VIEW], model.gx, model.gy)
    inside = (model.gx > x - VIEW) & (model.gx < x + VIEW)
    lines["ground"] = np.vstack([(x - VIEW, y[0]), np.column_stack([model.gx[inside], model.gy[inside]]), (x + VIEW, y[1])])
    return lines


def plan(v: dict[str, Any], g: Geometry) -> list[list[float]]:
    """The chassis' outline about the middle between the hinges, m."""
    half = 0.5 * v["wheelbase"]
    low, high, end = v["belly_height"], ROOF, half + g.pitch_radius
    return [[-end, 0.0], [-half, low], [half, low], [end, 0.0], [half, high], [-half, high], [-end, 0.0]]


def _moved(points: np.ndarray, x: float, y: float, angle: float) -> np.ndarray:
    c, s = math.cos(angle), math.sin(angle)
    return points @ np.array([[c, s], [-s, c]]) + (x, y)


def _shoes(model: Model, track: int, place: np.ndarray) -> np.ndarray:
    """Outer corners of the segments, one after the other round the loop."""
    n = model.values["segments"]
    x, y, angle = place[3 + track * n : 3 + (track + 1) * n].T
    along = np.column_stack([np.cos(angle), np.sin(angle)])
    middle = np.column_stack([x, y]) + model.values["shoe_height"] * np.column_stack([np.sin(angle), -np.cos(angle)])
    reach = 0.45 * model.geometry.pitch
    corners = np.stack([middle - reach * along, middle + reach * along], axis=1).reshape(-1, 2)
    return np.vstack([corners, corners[:1]])


def _belt(model: Model, hinge: np.ndarray, angle: float, travel: float) -> np.ndarray:
    p, radius = model.constants[0], model.geometry.guide_radius
    perimeter = 2.0 * (model.geometry.length + math.pi * radius)
    points = []
    for share in np.linspace(0.0, 1.0, 97):
        x, y, ux, uy = kernel.outline(p, (travel + share * perimeter) % perimeter)
        points.append((x + model.values["shoe_height"] * uy, y - model.values["shoe_height"] * ux))
    return _moved(np.array(points), hinge[0], hinge[1], angle)
