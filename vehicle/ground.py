"""Ground as a height profile: a line of text to the points of a polyline."""

from __future__ import annotations

import math

import numpy as np

from ..master.errors import DescriptionError

FAR = 1000.0  # m, how far the ends reach
MOST = 10_000  # points of a ground
KINDS = """flat | slope:ANGLE[,X] | step:HEIGHT[,X] | stairs:RISE,RUN,COUNT[,X] | polyline:X,Y;X,Y;…
(angle in degrees; lengths in m; X: where it begins, 1 unless given; a slope without X is inclined everywhere)"""


def profile(text: str) -> tuple[np.ndarray, np.ndarray]:
    """The points (x, y) of the ground that `text` describes, level or as inclined as it is beyond the ends.

    flat · slope:30 (a plane through the origin) · slope:30,1.0 (level up to x = 1 m) · step:0.1,1.0 ·
    stairs:0.17,0.29,4,1.0 (rise, run, count, start) · polyline:0,0;1,0.1;2,0 (x never decreasing).
    Raises DescriptionError.

    >>> x, y = profile("step:0.1,2.0")
    >>> height(x, y, 1.9), height(x, y, 2.1)  # m
    (0.0, 0.1)
    """
    kind, _, rest = text.partition(":")
    kind = kind.strip().lower()
    if rest.count(";") >= MOST:
        raise DescriptionError(f"ground has {rest.count(';') + 1} points, and {MOST} at most are taken. Leave points out.")
    try:
        if kind == "polyline":
            points = [tuple(float(v) for v in pair.split(",")) for pair in rest.split(";")]
            if any(len(pair) != 2 for pair in points):
                raise ValueError
            values = []
        else:
            points, values = [], [float(v) for v in rest.split(",")] if rest.strip() else []
    except ValueError:
        raise DescriptionError(f"ground = {text!r} cannot be read. Write one of: {KINDS}.") from None
    if not all(math.isfinite(v) for v in [*values, *(v for pair in points for v in pair)]):
        raise DescriptionError(f"ground = {text!r} has a number that is not finite.")

    if kind == "flat" and not values:
        points = [(-FAR, 0.0), (FAR, 0.0)]
    elif kind == "slope" and len(values) in (1, 2) and abs(values[0]) < 80.0:
        rise = math.tan(math.radians(values[0]))
        if len(values) == 1:
            points = [(-FAR, -FAR * rise), (FAR, FAR * rise)]
        else:
            points = [(-FAR, 0.0), (values[1], 0.0), (values[1] + FAR, FAR * rise)]
    elif kind == "step" and len(values) in (1, 2) and values[0] != 0.0:
        x = values[1] if len(values) == 2 else 1.0
        points = [(-FAR, 0.0), (x, 0.0), (x, values[0]), (x + FAR, values[0])]
    elif kind == "stairs" and len(values) in (3, 4) and values[0] != 0.0 and values[1] > 0.0 and values[2] >= 1.0:
        (rise, run, count), x = values[:3], values[3] if len(values) == 4 else 1.0
        if 2.0 * count > MOST:
            raise DescriptionError(f"ground = {text!r} has {count:g} stairs, and {MOST // 2} at most are built.")
        points = [(-FAR, 0.0)]
        for i in range(int(count)):
            points += [(x + i * run, i * rise), (x + i * run, (i + 1) * rise)]
        points.append((x + (int(count) - 1) * run + FAR, int(count) * rise))
    elif kind == "polyline" and len(points) >= 2:
        if any(b[0] < a[0] or a == b for a, b in zip(points, points[1:])):
            raise DescriptionError(f"ground = {text!r}: x must never decrease and no point may stand twice.")
        points = [(points[0][0] - FAR, points[0][1]), *points, (points[-1][0] + FAR, points[-1][1])]
    else:
        raise DescriptionError(f"ground = {text!r} is not known. Write one of: {KINDS}.")
    xs, ys = (np.array(column, float) for column in zip(*points))
    return xs, ys


def height(x: np.ndarray, y: np.ndarray, at: float) -> float:
    """Height of the ground at one place in m, the upper one at a vertical face."""
    i = int(np.searchsorted(x, at, side="right")) - 1
    if i < 0 or i >= len(x) - 1:
        return float(y[0] if i < 0 else y[-1])
    return float(y[i] + (y[i + 1] - y[i]) * (at - x[i]) / (x[i + 1] - x[i]))
