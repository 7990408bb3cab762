"""How the drives of fieldbus.py are moved: trapezoids with rests, waves, chirps, ramps of speed, jogs by hand."""

from __future__ import annotations

import math

import numpy as np


def _trapezoids(rng, n, step, fastest, most):
    """Moves from rest to rest with rests between, some long; rates of a trapezoid."""
    rate, at = np.zeros(n), int(rng.choice([0.2, 2.0]) / step)
    side = float(rng.choice([-1.0, 1.0]))
    while at < n:
        top, rises = fastest * rng.uniform(0.2, 0.9), most * rng.uniform(0.2, 0.9)
        up, flat = max(int(top / rises / step), 10), int(rng.uniform(0.05, 0.8) / step)
        shape = np.concatenate([np.linspace(0, 1, up), np.ones(flat), np.linspace(1, 0, up)])[: n - at]
        rate[at : at + len(shape)] = side * top * shape
        side = -side if rng.random() < 0.75 else side
        at += len(shape) + int(rng.choice([0.1, 0.4, 1.2]) / step)
    return rate


def _waves(rng, n, step, fastest, most):
    """Lines at multiples of 0.1 Hz with phases drawn, begun softly."""
    time = step * np.arange(n)
    lines = 0.1 * rng.choice(np.arange(1, 40), size=int(rng.integers(4, 9)), replace=False)
    rate = sum(np.cos(2 * math.pi * f * time + rng.uniform(0, 2 * math.pi)) / math.sqrt(f) for f in lines)
    rate *= np.minimum(time / 0.5, 1.0)
    return rate * min(fastest / abs(rate).max(), most / abs(np.gradient(rate, step)).max())


def _chirp(rng, n, step, fastest, most):
    """From 0.1 Hz to some Hz; the speed falls where the acceleration would be too much."""
    time, end = step * np.arange(n), rng.uniform(2.0, 6.0)
    f = 0.1 * (end / 0.1) ** (time / time[-1])
    size = np.minimum(fastest, most / (2 * math.pi * f))
    return size * np.sin(2 * math.pi * np.cumsum(f) * step) * np.minimum(time / 0.5, 1.0)


def _ramps(rng, n, step, fastest, most):
    """Levels of speed with ramps between, either way."""
    rate, at, level = np.zeros(n), int(0.3 / step), 0.0
    while at < n:
        goal = fastest * rng.uniform(-1.0, 1.0) if rng.random() < 0.8 else 0.0
        ramp = max(int(abs(goal - level) / (most * rng.uniform(0.2, 0.9)) / step), 10)
        shape = np.linspace(level, goal, ramp)[: n - at]
        rate[at : at + len(shape)] = shape
        rate[at + len(shape) :] = goal
        at, level = at + len(shape) + int(rng.uniform(0.2, 1.5) / step), goal
    return rate


def _jogs(rng, n, step):
    """Levels from -1 to 1 as a hand gives them by keys: on, off, the other way, softened or at once."""
    shares, at = np.zeros(n), int(rng.choice([0.3, 1.5]) / step)
    while at < n:
        shares[at : at + int(rng.uniform(0.2, 1.2) / step)] = float(rng.choice([-1, 1])) * rng.uniform(0.25, 0.75)
        at += int(rng.uniform(0.5, 1.9) / step)
    width = int(rng.choice([1, 0.03 / step, 0.15 / step]))
    return np.convolve(shares, np.ones(width) / width)[:n]


def profile(rng: np.random.Generator, s: dict[str, float], of, duration: float, step: float) -> np.ndarray:
    """Set-points of angle and rate, and the voltage or duty of an open loop: (3, steps)."""
    n, most = int(duration / step), 0.35 * s["supply"] / s["resistance"] * s["constant"]
    fastest = 0.6 * s["supply"] / s["constant"] / s["ratio"]
    accelerates = most / (s["rotor"] + s["inertia"] / s["ratio"] ** 2) / s["ratio"]
    if of.way in ("angle", "speed"):
        kinds = [_ramps, _waves] if of.way == "speed" else [_trapezoids, _trapezoids, _waves, _chirp]
        rate = kinds[int(rng.integers(len(kinds)))](rng, n, step, fastest, accelerates)
        return np.stack([step * np.cumsum(rate), rate, np.zeros(n)])
    share = _jogs(rng, n, step) if rng.random() < 0.6 else 0.6 * _waves(rng, n, step, 1.0, 20.0)
    return np.stack([np.zeros(n), np.zeros(n), share * (1.0 if of.way == "duty" else s["supply"])])
