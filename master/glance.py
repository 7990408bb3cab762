"""A result at a glance: a small table with curves for a notebook, and curves over time as a figure."""

from __future__ import annotations

from fnmatch import fnmatchcase
from typing import TYPE_CHECKING, Any

import numpy as np
import pandas as pd
from markupsafe import escape

from ..fmus.shown import literal, visible
from .errors import ResultError
from .system import did_you_mean

if TYPE_CHECKING:
    from .results import Result

COLUMNS = 16  # told of in a table
BYTES = 200 << 20  # of a file, beyond which its curves are not drawn
WIDE, HIGH, POINTS = 180, 30, 150  # px; points of a curve


def page(result: Result) -> str:
    """What the summary says, and a row for each column: unit, least, greatest, last, and its curve."""
    peaks = result.peaks
    table = None if result.path is not None and result.path.stat().st_size > BYTES else result.table
    rows = [
        f"<tr><td>{_text(name)}</td><td>{_text(row.unit)}</td>"
        + "".join(f'<td style="text-align: right">{x:.5g}</td>' for x in (row.least, row.greatest, row["last"]))
        + f"<td>{'' if table is None else curve(table['time'], table[name])}</td></tr>"
        for name, row in peaks.iloc[:COLUMNS].iterrows()
    ]
    more = f"<p>… and {len(peaks) - COLUMNS} columns more</p>" if len(peaks) > COLUMNS else ""
    head = "".join(f"<th>{word}</th>" for word in ("", "unit", "least", "greatest", "last", "over time"))
    first, _, rest = result.summary().partition("\n")
    details = f"<details><summary>{_text(first)}</summary><pre>{_text(rest)}</pre></details>"
    return f"<div>{details}<table><thead><tr>{head}</tr></thead><tbody>{''.join(rows)}</tbody></table>{more}</div>"


def curve(time: pd.Series, values: pd.Series) -> str:
    """A small line over time, with the peaks of what it leaves out."""
    x, y = np.asarray(time, dtype=float), np.asarray(values, dtype=float)
    if len(x) > 2 * POINTS:
        edges = np.linspace(0, len(x), POINTS + 1).astype(int)[:-1]
        both = np.stack([np.minimum.reduceat(y, edges), np.maximum.reduceat(y, edges)], axis=1)
        x, y = np.repeat(x[edges], 2), both.reshape(-1)
    good = np.isfinite(y)
    x, y = x[good], y[good]
    if len(x) < 2:
        return ""
    across = (x - x[0]) / ((x[-1] - x[0]) or 1.0) * (WIDE - 4) + 2
    span = y.max() - y.min()
    down = (y.max() - y) / span * (HIGH - 4) + 2 if span > 0.0 else np.full(len(y), HIGH / 2)
    points = " ".join(f"{a:.1f},{b:.1f}" for a, b in zip(across, down))
    return (
        f'<svg width="{WIDE}" height="{HIGH}" viewBox="0 0 {WIDE} {HIGH}">'
        f'<polyline points="{points}" fill="none" stroke="#1f6f8b" stroke-width="1.2"/></svg>'
    )


def plot(result: Result, names: tuple[str, ...], ax: Any = None) -> list[Any]:
    """Columns of a result over time, those of one unit in one axes. Returns the axes."""
    table = result.table
    numbers = [name for name in table if name != "time" and pd.api.types.is_numeric_dtype(table[name])]
    chosen = [name for name in numbers if not names or any(fnmatchcase(name, pattern) for pattern in names)]
    for pattern in names:
        if not any(fnmatchcase(name, pattern) for name in numbers):
            raise ResultError(f"plot: there is no column {pattern}{did_you_mean(pattern, numbers)}")
    if not chosen:
        raise ResultError("plot: the result has no column of numbers. Name what to record under [run] record.")
    units = list(dict.fromkeys(result.units[name] for name in chosen)) if ax is None else [None]
    if ax is None:
        from matplotlib import pyplot

        figure, grid = pyplot.subplots(
            len(units), sharex=True, squeeze=False, figsize=(8.0, 1.0 + 1.9 * len(units)), layout="constrained"
        )
        axes = list(grid[:, 0])
        figure.suptitle(visible(result.system))
    else:
        figure, axes = ax.figure, [ax]
    for one, unit in zip(axes, units):
        mine = [name for name in chosen if unit is None or result.units[name] == unit]
        for name in mine:
            label = visible(name if unit is not None or not result.units[name] else f"{name} [{result.units[name]}]")
            one.plot(table["time"], np.asarray(table[name], dtype=float), label=label.lstrip("_"), linewidth=1.2)
        one.set_ylabel(visible(unit or ""))
        one.grid(alpha=0.3)
        one.legend(loc="upper left", bbox_to_anchor=(1.0, 1.0), fontsize="small", frameon=False)
    axes[-1].set_xlabel("time [s]")
    literal(figure)
    return axes


def _text(words: object) -> str:
    return str(escape(visible(words)))
