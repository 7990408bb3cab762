"""Pictures in files, for what has no page: drawn from the same data as the page's (pictures.py)."""

from __future__ import annotations

from io import BytesIO
from pathlib import Path
from typing import Any, Literal, TypeVar

from matplotlib import rc_context
from matplotlib.figure import Figure

from selflock.fmus.shown import literal
from selflock.view.page import pretty

from . import traces
from .traces import Plots

BEFORE, AFTER, MEASURED = "#c2571a", "#1f6fb2", "#222222"
COLOURS = {traces.BEFORE: BEFORE, traces.AFTER: AFTER, traces.MEASURED: MEASURED}
Place = TypeVar("Place", Path, BytesIO)
STYLE: dict[str, Any] = {
    "font.size": 10,
    "axes.grid": True,
    "grid.alpha": 0.25,
    "axes.spines.top": False,
    "axes.spines.right": False,
    "figure.dpi": 110,
}
styled = rc_context(STYLE)  # type: ignore[arg-type]
"""Decorates what draws: the style holds while it does, and nobody else's is touched."""


def subplots(
    rows: int = 1, columns: int = 1, figsize: tuple = (6.4, 4.8), layout: Literal["constrained", "tight"] | None = None, **more
) -> tuple:
    """A figure and its axes, known to nobody else."""
    figure = Figure(figsize=figsize, layout=layout)
    return figure, figure.subplots(rows, columns, **more)


def save(figure: Figure, path: Place) -> Place:
    """Write a figure."""
    literal(figure)
    if figure.get_layout_engine() is None:
        figure.tight_layout()
    figure.savefig(path)
    return path


@styled
def drawn(plots: Plots, title: str = "") -> bytes:
    """Measured against simulated, and below it their difference (traces.py), as PNG."""
    figure, axes = subplots(2, 1, figsize=(9, 5.4), sharex=True, height_ratios=[2, 1])
    for one, plot in zip(axes, plots):
        for mark in plot["marks"]:
            style = {"points": "o", "line": "o-" if mark.get("dots") else "-"}[mark["kind"]]
            look = {"lw": 0.9 if mark.get("thin") else 1.2, "ms": 3.5, "alpha": 0.25 if mark.get("faint") else 1.0}
            one.plot(mark["x"], mark["y"], style, color=COLOURS[mark["colour"]], label=mark["label"] or "_", **look)
        one.set_ylabel(f"{plot['y']['label']}\nin {pretty(plot['y']['unit'])}")
    axes[0].set_title(title, loc="left")
    axes[1].set_xlabel(f"{plots[1]['x']['label']} in {pretty(plots[1]['x']['unit'])}")
    axes[0].legend(loc="best", ncols=3, fontsize=9)
    save(figure, buffer := BytesIO())
    return buffer.getvalue()
