"""The vehicle as shapes that its outputs move (selflock.master.about says how): what `posture` draws, without a model."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Any

import numpy as np

from . import ground
from .model import RAMP, Geometry
from .posture import plan

if TYPE_CHECKING:
    from ..master.about import Drawing

NEAR = 200.0  # m from the start, as far as the ground is drawn
MOST = 4000  # points of it
CORNERS = 24  # of a wheel


def drawing(values: dict[str, Any]) -> Drawing:
    """Chassis, holders, wheels, tracks and ground of a vehicle with these parameters."""
    g = Geometry(values)
    half, shoe = 0.5 * values["wheelbase"], values["shoe_height"]
    base: list[dict[str, Any]] = [{"place": ["chassis_x", "chassis_y"]}, {"turn": {"chassis_pitch": 1.0}}]
    shapes = [{"points": plan(values, g), "style": "body", "colour": 0, "closed": True, "moves": base}]
    turns = np.linspace(0.0, 2.0 * math.pi, CORNERS + 1)
    radius = g.center_radius - 0.25 * shoe
    wheel = [[0.0, 0.0], *(radius * np.column_stack([np.cos(turns), np.sin(turns)])).tolist()]
    along = _outline(values, g)
    for colour, (end, side) in enumerate((("front", 1.0), ("rear", -1.0)), 1):
        hinge = [*base, {"shift": [side * half, 0.0]}]
        holder = [*hinge, {"turn": {f"{end}_angle": 1.0}}]
        spin = {f"{end}_sprocket_angle": 1.0, f"{end}_angle": -1.0}  # of the sprocket against its holder
        shapes += [
            {"points": along, "style": "track", "colour": colour, "closed": True, "moves": holder,
             "runs": {"by": spin, "per": g.belt_radius, "pitch": g.pitch}},
            {"points": wheel, "style": "wheel", "colour": colour, "moves": [*hinge, {"turn": {f"{end}_sprocket_angle": 1.0}}]},
            {"points": wheel, "style": "wheel", "colour": colour, "moves": [*holder, {"shift": [g.length, 0.0]}, {"turn": spin}]},
            {"points": [[0.0, 0.0], [g.length, 0.0]], "style": "limb", "colour": colour, "moves": holder},
        ]  # fmt: skip
    land = _ground(values)
    rough = len({y for _, y in land}) > 1  # it may stand as steep as its ground
    size = values["wheelbase"] + 2.0 * (g.length + g.guide_radius + shoe)  # stretched out
    tall = {"height": 0.78 * size, "below": 0.29 * size} if rough else {"height": 0.5 * size, "below": 0.05 * size}
    return {"width": 1.25 * size, **tall, "ground": land, "follow": ["chassis_x"], "shapes": shapes}


def _outline(values: dict[str, Any], g: Geometry) -> list[list[float]]:
    """A track's outer face in its holder's frame, counter-clockwise from under the hinge; rails rise on straight ramps."""
    radius, ramp = g.guide_radius + values["shoe_height"], min(0.5 * g.length, RAMP * g.pitch)
    arc = np.linspace(-0.5 * math.pi, 0.5 * math.pi, CORNERS // 2 + 1)
    high = radius + values["rail_height"]
    tip = np.column_stack([g.length + radius * np.cos(arc), radius * np.sin(arc)])
    root = np.column_stack([-radius * np.cos(arc), -radius * np.sin(arc)])
    under, over = [[ramp, -high], [g.length - ramp, -high]], [[g.length - ramp, high], [ramp, high]]
    return [*under, *tip.tolist(), *over, *root.tolist()]


def _ground(values: dict[str, Any]) -> list[list[float]]:
    x, y = ground.profile(values["ground"])
    ends = values["start_x"] + np.array([-NEAR, NEAR])
    inside = (x > ends[0]) & (x < ends[1])
    at = [[float(end), float(np.interp(end, x, y))] for end in ends]
    return [at[0], *np.column_stack([x[inside], y[inside]])[:MOST].tolist(), at[1]]
