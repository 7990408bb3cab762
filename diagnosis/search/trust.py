"""Least squares within bounds, plain or robust, by a trust region that is reflected at the bounds.

Branch, Coleman and Li 1999 (SIAM J. Sci. Comput. 21, 1); the damping is Moré's (1977, in Lecture Notes in Mathematics 630). Step by
step as scipy.optimize.least_squares has it (method "trf", by singular values, loss "soft_l1"; NOTICE), which ends at the same numbers:
loading that and what it brings along was a sixth of what a replay takes.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from numpy.linalg import svd

EPS = float(np.finfo(float).eps)
STARTS_INSIDE = 1e-10  # relative, from the bounds
DAMPINGS = 10
"""The most that are tried for one radius."""

Vector = np.ndarray


def least_squares(
    misfit: Callable[[Vector], Vector],
    jacobian: Callable[[Vector], np.ndarray],
    start: Vector,
    low: Vector,
    high: Vector,
    c: float,
    effort: int,
    ended: tuple[float, float],
    flat: float,
) -> Vector:
    """Where the robust loss of `misfit` is least between `low` and `high`, begun at `start`.

    misfit, jacobian: each makes an array anew. c: where the loss turns from squares to straight lines; inf: nowhere. effort: the most
    misfits. ended: relative change of the loss, and of the place, that ends it. flat: so does a gradient.
    Raises ValueError where the misfit at the start is no number.
    """
    x = _inside(start, low, high, STARTS_INSIDE)
    f = misfit(x)
    if not np.all(np.isfinite(f)):
        raise ValueError("The misfit is no number where a fit begins.")
    cost = _cost(f, c)
    f, slopes = _weighed(f, jacobian(x), c)
    gradient = slopes.T.dot(f)
    v, _ = _room(x, gradient, low, high)
    radius = _length(x / v**0.5) or 1.0
    damping, tried = 0.0, 1
    while True:
        v, bent = _room(x, gradient, low, high)
        steepest = float(np.max(abs(gradient * v)))
        if steepest < flat or tried == effort:
            return x
        # in "hat" space, where each number is as long as it is far from the bound that the gradient drives it to
        d = v**0.5
        region = Region(slopes * d, f, gradient * bent, d * gradient)
        back = max(0.995, 1 - steepest)
        gained, ends = -1.0, False
        while gained <= 0 and tried < effort:
            step_h, damping = region.damped(radius, damping)
            step, step_h, expected = _reflected(x, region, d * step_h, step_h, d, radius, low, high, back)
            there = _inside(x + step, low, high, 0.0)
            f_there = misfit(there)
            tried += 1
            length_h = _length(step_h)
            if not np.all(np.isfinite(f_there)):
                radius = 0.25 * length_h
                continue
            cost_there = _cost(f_there, c)
            gained = cost - cost_there
            new, ratio = _radius(radius, gained, expected, length_h)
            ends = (gained < ended[0] * cost and ratio > 0.25) or _length(step) < ended[1] * (ended[1] + _length(x))
            if ends:
                break
            damping *= radius / new
            radius = new
        if gained > 0:
            x, cost = there, cost_there
            if ends or tried == effort:
                return x
            f, slopes = _weighed(f_there, jacobian(x), c)
            gradient = slopes.T.dot(f)
        if ends:
            return x


class Region:
    """The linear problem about a place, in hat space: slopes J and misfit f, the bounds' curvature beside J'J, and the gradient."""

    def __init__(self, slopes: np.ndarray, f: Vector, curved: Vector, gradient: Vector):
        self.slopes, self.curved, self.gradient = slopes, curved, gradient
        n = len(gradient)
        self.rows = len(f)
        u, self.s, vt = svd(np.concatenate([slopes, np.diag(curved**0.5)]), full_matrices=False)
        self.v = np.asfortranarray(vt).T
        self.uf = np.asfortranarray(u).T.dot(np.concatenate([f, np.zeros(n)]))

    def damped(self, radius: float, damping: float) -> tuple[Vector, float]:
        """The step that goes farthest down within this radius, and its damping; damping: a first guess."""
        s, suf = self.s, self.s * self.uf
        full = self.rows >= len(s) and s[-1] > EPS * self.rows * s[0]
        if full:
            step = -self.v.dot(self.uf / s)
            if _length(step) <= radius:
                return step, 0.0
        most, least = _length(suf) / radius, 0.0
        if full:
            beyond, slope = _beyond(0.0, suf, s, radius)
            least = -beyond / slope
        elif damping == 0:
            damping = max(0.001 * most, (least * most) ** 0.5)
        for _ in range(DAMPINGS):
            if damping < least or damping > most:
                damping = max(0.001 * most, (least * most) ** 0.5)
            beyond, slope = _beyond(damping, suf, s, radius)
            if beyond < 0:
                most = damping
            ratio = beyond / slope
            least = max(least, damping - ratio)
            damping -= (beyond + radius) * ratio / radius
            if abs(beyond) < 0.01 * radius:
                break
        step = -self.v.dot(suf / (s**2 + damping))
        return step * (radius / _length(step)), damping

    def change(self, step: Vector) -> float:
        """Of half the squared misfit, as the linear problem has it."""
        moved = self.slopes.dot(step)
        return 0.5 * (np.dot(moved, moved) + np.dot(step * self.curved, step)) + np.dot(step, self.gradient)

    def along(self, way: Vector, origin: Vector | None = None) -> tuple[float, float, float]:
        """The change along origin + t way: of t², of t, and what is there at 0."""
        moved = self.slopes.dot(way)
        square = np.dot(moved, moved) + np.dot(way * self.curved, way)
        straight, at = np.dot(self.gradient, way), 0.0
        if origin is not None:
            first = self.slopes.dot(origin)
            straight += np.dot(first, moved)
            at = 0.5 * np.dot(first, first) + np.dot(self.gradient, origin)
            straight += np.dot(origin * self.curved, way)
            at += 0.5 * np.dot(origin * self.curved, origin)
        return square * 0.5, straight, at


def _length(x: Vector) -> float:
    return float(np.linalg.norm(x))


def _beyond(damping: float, suf: Vector, s: Vector, radius: float) -> tuple[float, float]:
    """How much longer a damped step is than the radius, and how that goes with the damping."""
    held = s**2 + damping
    length = _length(suf / held)
    return length - radius, float(-np.sum(suf**2 / held**3)) / length


def _reflected(
    x: Vector, region: Region, p: Vector, p_h: Vector, d: Vector, radius: float, low: Vector, high: Vector, back: float
) -> tuple[Vector, Vector, float]:
    """The best of the step p, what is reflected where it meets a bound, and the way along the gradient; in hat space; what it gains."""
    if np.all((x + p >= low) & (x + p <= high)):
        return p, p_h, -region.change(p_h)
    share, hits = _to_bound(x, p, low, high)
    r_h = np.where(hits, -p_h, p_h)
    r = d * r_h
    p, p_h = p * share, p_h * share
    farthest = _to_radius(p_h, r_h, radius)
    at_bound, _ = _to_bound(x + p, r, low, high)
    length = min(at_bound, farthest)
    least, most = 0.0, -1.0
    if length > 0:
        least = (1 - back) * share / length
        most = back * at_bound if length == at_bound else farthest
    mirrored = np.inf
    if least <= most:
        length, mirrored = _lowest(*region.along(r_h, p_h), least, most)
        r_h = r_h * length + p_h
        r = r_h * d
    p, p_h = p * back, p_h * back
    straight = region.change(p_h)
    down_h = -region.gradient
    down = d * down_h
    farthest = radius / _length(down_h)
    at_bound, _ = _to_bound(x, down, low, high)
    length, descended = _lowest(*region.along(down_h), 0.0, back * at_bound if at_bound < farthest else farthest)
    if straight < mirrored and straight < descended:
        return p, p_h, -straight
    if mirrored < straight and mirrored < descended:
        return r, r_h, -mirrored
    return down * length, down_h * length, -descended


def _lowest(square: float, straight: float, at: float, least: float, most: float) -> tuple[float, float]:
    """Where between these ends square t² + straight t + at is lowest, and what it is there."""
    places = [least, most]
    if square != 0 and least < (extreme := -0.5 * straight / square) < most:
        places.append(extreme)
    t = np.asarray(places)
    values = t * (square * t + straight) + at
    best = np.argmin(values)
    return float(t[best]), float(values[best])


def _to_bound(x: Vector, way: Vector, low: Vector, high: Vector) -> tuple[float, np.ndarray]:
    """How many times `way` leads to the first bound, and which numbers are there then."""
    moves, steps = np.nonzero(way), np.full(len(x), np.inf)
    with np.errstate(over="ignore"):
        steps[moves] = np.maximum((low - x)[moves] / way[moves], (high - x)[moves] / way[moves])
    least = np.min(steps)
    return float(least), (steps == least) & (way != 0.0)


def _to_radius(x: Vector, way: Vector, radius: float) -> float:
    """How many times `way` leads from x to the edge of the region."""
    a, b, c = np.dot(way, way), np.dot(x, way), np.dot(x, x) - radius**2
    q = -(b + np.copysign(np.sqrt(max(b * b - a * c, 0.0)), b))
    return float(max(q / a, c / q))


def _radius(radius: float, gained: float, expected: float, length: float) -> tuple[float, float]:
    """The next radius, and what was gained as a share of what was expected."""
    ratio = gained / expected if expected > 0 else float(expected == gained == 0)
    if ratio < 0.25:
        return 0.25 * length, ratio
    return radius * (2.0 if ratio > 0.75 and length > 0.95 * radius else 1.0), ratio


def _room(x: Vector, gradient: Vector, low: Vector, high: Vector) -> tuple[Vector, Vector]:
    """How far each number is from the bound that the gradient drives it to, 1 where there is none; and how that goes with it."""
    up, down = (gradient < 0) & np.isfinite(high), (gradient > 0) & np.isfinite(low)
    room = np.where(up, high - x, np.where(down, x - low, 1.0))
    return room, np.where(up, -1.0, np.where(down, 1.0, 0.0))


def _inside(x: Vector, low: Vector, high: Vector, share: float) -> Vector:
    """x, moved inside by this share of a bound where it is that near to it; by the last digit where share is 0, on it or beyond."""
    if share == 0.0:
        at_low, at_high = x <= low, x >= high
        above, below = np.nextafter(low, high), np.nextafter(high, low)
    else:
        open_low, open_high = np.isinf(low), np.isinf(high)
        of_low, of_high = (share * np.maximum(1, np.abs(end)) for end in (low, high))
        at_low = ~open_low & (x - low <= np.minimum(high - x, of_low))
        at_high = ~open_high & (high - x <= np.minimum(x - low, of_high))
        above, below = low + np.where(open_low, 0.0, of_low), high - np.where(open_high, 0.0, of_high)
    found = np.where(at_high, below, np.where(at_low, above, x))
    out = (found < low) | (found > high)  # of bounds so near that there is no room between them
    return np.where(out, 0.5 * (np.where(out, low, 0.0) + np.where(out, high, 0.0)), found)


def _cost(f: Vector, c: float) -> float:
    """Half the robust loss."""
    if not np.isfinite(c):
        return 0.5 * np.dot(f, f)
    return 0.5 * c**2 * np.sum(2 * ((1 + (f / c) ** 2) ** 0.5 - 1))


def _weighed(f: Vector, slopes: np.ndarray, c: float) -> tuple[Vector, np.ndarray]:
    """Misfit and slopes of squares that bend as the loss does here; slopes are changed in place."""
    if not np.isfinite(c):
        return f, slopes
    t = 1 + (f / c) ** 2
    pull, bends = t**-0.5, -0.5 * t**-1.5 / c**2
    held = pull + 2 * bends * f**2
    held[held < EPS] = EPS
    held **= 0.5
    slopes *= held[:, None]
    return f * (pull / held), slopes
