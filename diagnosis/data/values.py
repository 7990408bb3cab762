"""What the values of a channel say by themselves: where they stay, how far they lie apart, in which steps."""

from __future__ import annotations

import numpy as np

from ..rules import RULES


def stretches(x: np.ndarray, parted: np.ndarray | None = None) -> tuple[np.ndarray, np.ndarray]:
    """Starts and lengths of stretches of one value; a row where `parted` begins a new one."""
    begins = np.concatenate([[True], x[1:] != x[:-1]])
    starts = np.flatnonzero(begins if parted is None else begins | parted)
    return starts, np.diff(np.append(starts, len(x)))


def spread(x: np.ndarray, quantiles: tuple[float, float]) -> float:
    """How far apart these quantiles of x are."""
    return float(np.ptp(np.quantile(x, quantiles)))


def means(x: np.ndarray, rows: int) -> np.ndarray:
    """Means over so many rows each; 0 of fewer rows."""
    whole = len(x) // rows * rows
    return x[:whole].reshape(-1, rows).mean(axis=1) if whole else np.zeros(1)


def liveliest(signals: list[tuple[np.ndarray, float]], starts: np.ndarray, length: int, most: int) -> np.ndarray:
    """Of parts of this length the starts of `most` at most in which signals, each over its size, go up and down most; ascending."""
    stirs = np.sum([[np.std(x[a : a + length]) / size for a in starts] for x, size in signals], axis=0)
    return np.sort(starts[np.argsort(-stirs, kind="stable")[:most]])


def resolution(values: np.ndarray) -> float:
    """Smallest step between values: the resolution of a quantised channel, tiny for a continuous one."""
    steps = np.diff(np.unique(values[np.isfinite(values)]))
    return float(np.quantile(steps, RULES.data.smallest_step)) if len(steps) else 0.0


def arrivals(x: np.ndarray, step: float, zero: float = 0.0) -> np.ndarray:
    """cos(2 pi (x - zero) / step) of values that have just come from another number of steps: 1 at one, -1 half way between two.

    A rounded value lies at one at once, and one that goes on slowly close to the border that it passed. Where one rests says nothing.
    """
    number = np.round((x - zero) / step)
    passed = np.diff(number, prepend=number[:1]) != 0.0
    return np.cos(2.0 * np.pi * (x[passed] - zero) / step)


def noise_of(x: np.ndarray) -> float:
    """Noise of rows, by fourth differences: a motion leaves next to nothing in them, white noise 70 times its variance."""
    return float(np.median(rough(x))) / RULES.residuals.normal_median if len(x) > 4 else 0.0


def rough(x: np.ndarray, apart: int = 1) -> np.ndarray:
    """Absolute fourth differences of samples `apart` from one another, over the deviation that they have of white noise of 1."""
    for _ in range(4):
        x = x[apart:] - x[:-apart]
    return abs(x) / np.sqrt(70.0)
