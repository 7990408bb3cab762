"""Fewer numbers to draw the same curve with: of each stretch of rows the least and the greatest, in their order."""

from __future__ import annotations

import base64

import numpy as np


def stride(rows: int, points: int) -> int:
    """Rows in a stretch, of which two are kept, so that at most `points` are; 1 where all can be."""
    return 1 if rows <= points else -(-2 * rows // max(points, 2))


def times(time: np.ndarray, every: int) -> np.ndarray:
    """Of each stretch the times after a quarter and three quarters of its rows; the first and the last as they are."""
    if every == 1:
        return time
    begin = np.arange(0, len(time), every)
    last = np.minimum(begin + every, len(time)) - 1
    kept = np.column_stack([time[begin + (last - begin) // 4], time[begin + 3 * (last - begin) // 4]]).ravel()
    kept[0], kept[-1] = time[0], time[-1]
    return kept


def values(x: np.ndarray, every: int) -> np.ndarray:
    """Of each stretch its least and its greatest number, the earlier one first; NaN where it has none."""
    if every == 1:
        return x
    full = np.concatenate([x, np.full(-len(x) % every, np.nan)]).reshape(-1, every)
    none = np.isnan(full)
    low = np.argmin(np.where(none, np.inf, full), axis=1)
    high = np.argmax(np.where(none, -np.inf, full), axis=1)
    pair = np.sort(np.column_stack([low, high]), axis=1)
    return np.take_along_axis(full, pair, axis=1).ravel()


def packed(x: np.ndarray, kind: str) -> str:
    """Numbers as base64 of little-endian `kind`, such as "<f4"."""
    with np.errstate(over="ignore"):
        return base64.b64encode(x.astype(kind).tobytes()).decode()
