"""What is in a window about each row: its highest, its lowest, its middle value, whether it holds for most of it.

A window of an even number of rows has one more before its row than behind it. The ends are mirrored. As scipy.ndimage has it, which
takes a tenth of a second to load with what it brings along.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

PIECE = 4096
"""Rows whose windows are laid out at a time."""

SHORT = 50_000
"""Rows up to which windows are laid out; SciPy keeps them in order as it goes, and is worth being loaded beyond that."""


def highest(x: np.ndarray, rows: int) -> np.ndarray:
    """Of x (n,) within so many rows about each, (n,)."""
    return _extreme(np.maximum, _beyond(x, rows, "edge"), rows)


def lowest(x: np.ndarray, rows: int) -> np.ndarray:
    """Of x (n,) within so many rows about each, (n,)."""
    return _extreme(np.minimum, _beyond(x, rows, "edge"), rows)


def mostly(x: np.ndarray, rows: int) -> np.ndarray:
    """Whether x (n,), bool, holds in more than half of so many rows about each, bool (n,)."""
    sums = np.concatenate([[0], np.cumsum(_beyond(x, rows, "symmetric"))])
    return 2 * (sums[rows:] - sums[:-rows]) > rows


def middle(x: np.ndarray, rows: int) -> np.ndarray:
    """The median of x (n,) within so many rows, an odd number, about each, (n,)."""
    if len(x) > SHORT:
        from scipy.ndimage import median_filter

        return median_filter(x, size=rows, mode="reflect")
    windows, found = np.lib.stride_tricks.sliding_window_view(_beyond(x, rows, "symmetric"), rows), np.empty(len(x))
    for first in range(0, len(x), PIECE):
        found[first : first + PIECE] = np.partition(windows[first : first + PIECE], rows // 2, -1)[:, rows // 2]
    return found


def deep(x: np.ndarray, rows: int) -> np.ndarray:
    """Whether x (n,), bool, holds so many rows to both sides of each, too, bool (n,); beyond the ends nothing does."""
    around = np.pad(x, rows)
    return _extreme(np.minimum, around, 2 * rows + 1)


def lasting(x: np.ndarray, rows: int) -> np.ndarray:
    """Whether x (n,), bool, holds in a stretch of at least so many rows, in which each is, bool (n,)."""
    begins = _extreme(np.minimum, np.pad(x, (0, rows - 1)), rows)
    return _extreme(np.maximum, np.pad(begins, (rows - 1, 0)), rows)


def _beyond(x: np.ndarray, rows: int, how: str) -> np.ndarray:
    """x, and as much of it before and behind as windows about its first and last row reach."""
    return np.pad(x, (rows // 2, (rows - 1) // 2), how)  # type: ignore[call-overload]


def _extreme(of: Callable, x: np.ndarray, rows: int) -> np.ndarray:
    """`of` every so many rows of x one after another, by windows twice as long each time."""
    width = 1
    while 2 * width <= rows:
        x, width = of(x[:-width], x[width:]), 2 * width
    return of(x[: len(x) - rows + width], x[rows - width :]) if width < rows else x
