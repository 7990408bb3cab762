"""Figures of a page over whatever their axes say, for its script: plain data, with the numbers of all of them in one list.

A figure is a list of plots; a plot is {"x": axis, "y": axis, "marks": [...]}, and may have a "title", a "scale" (an axis with
"low", "high" and "log": what colours say) and "shares", a word: plots of one word zoom together. A mark of nothing but what is
given here: `line`, `points`, `band`, `rule`, `window`, `field`. Colours are numbers of the palette, or "ink" and "soft", or as "#c2413a".
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from . import thin

POINTS = 3000  # of a curve or a cloud at most
ARRAYS = ("x", "y", "low", "high", "by")


def axis(label: str, unit: str = "", **more: Any) -> dict[str, Any]:
    """What an axis says; `start`, `end`: values that are seen at least (the first: with no room below); `since`: how high
    a plot is say only values from this x on, where some are seen; `names`: of 0, 1, 2 …"""
    spelt = {"start": "from", "end": "to"}
    return {"label": label, "unit": unit, **{spelt.get(key, key): value for key, value in more.items() if value is not None}}


def line(x: np.ndarray, y: np.ndarray, label: str = "", colour: int | str = 0, **look: Any) -> dict[str, Any]:
    """A curve, broken where y is NaN; look: dots, thin, faint (behind the others, not read), dash. Long ones need a rising x."""
    every = thin.stride(len(x), POINTS)
    return {"kind": "line", "x": thin.times(x, every), "y": thin.values(y, every), "label": label, "colour": colour, **look}


def points(
    x: np.ndarray,
    y: np.ndarray,
    label: str = "",
    colour: int | str = 0,
    ends: tuple[np.ndarray, np.ndarray] | None = None,
    by: np.ndarray | None = None,
    **look: Any,
) -> dict[str, Any]:
    """Single points; ends: of their intervals; by: numbers that their colours say; look: size in px, ring.

    Of more than POINTS every few are drawn, and the least and greatest of each kind of number.
    """
    arrays = {"x": x, "y": y} | ({"low": ends[0], "high": ends[1]} if ends else {}) | ({"by": by} if by is not None else {})
    if len(x) > POINTS:
        outer = [k for a in arrays.values() if np.isfinite(a).any() for k in (int(np.nanargmin(a)), int(np.nanargmax(a)))]
        kept = np.unique([*np.linspace(0, len(x) - 1, POINTS - len(outer)).astype(int), *outer])
        arrays = {name: a[kept] for name, a in arrays.items()}
    return {"kind": "points", "label": label, "colour": colour, **arrays, **look}


def band(x: np.ndarray, low: np.ndarray, high: np.ndarray, label: str = "", colour: int | str = 0) -> dict[str, Any]:
    """What lies between two curves."""
    return {"kind": "band", "x": x, "low": low, "high": high, "label": label, "colour": colour}


def rule(at: float, along: str = "x", label: str = "", colour: int | str = "soft", dash: int = 2) -> dict[str, Any]:
    """A straight line at a value of x, or along = "y" of y."""
    return {"kind": "rule", "at": float(at), "along": along, "label": label, "colour": colour, "dash": dash}


def window(low: float, high: float, name: str) -> dict[str, Any]:
    """A stretch of x, shaded behind all, with its name where there is room."""
    return {"kind": "window", "from": float(low), "to": float(high), "name": name}


def field(x: np.ndarray, y: np.ndarray, by: np.ndarray, label: str) -> dict[str, Any]:
    """A colour for each value of a grid, (len(y), len(x)); its plot has a scale."""
    return {"kind": "field", "x": x, "y": y, "by": np.ravel(by), "label": label}


def carried(figures: Mapping[str, Sequence[dict[str, Any]] | None], least: Mapping[str, int] | None = None) -> dict[str, Any]:
    """What page.write takes: those figures that have plots. least: width of a plot in px below which it takes the next row."""
    numbers: dict[str, int] = {}  # each array once, however many marks have it

    def placed(mark: dict[str, Any]) -> dict[str, Any]:
        of = {key: thin.packed(np.asarray(mark[key], float), "<f8") for key in ARRAYS if key in mark}
        return mark | {key: numbers.setdefault(text, len(numbers)) for key, text in of.items()}

    made = {
        name: {
            "least": (least or {}).get(name, 300),
            "plots": [p | {"marks": [placed(m) for m in p["marks"] if np.isfinite(m.get("at", 0.0))]} for p in plots],
        }
        for name, plots in figures.items()
        if plots
    }
    return {"figures": made, "numbers": list(numbers)} if made else {}
