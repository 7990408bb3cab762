"""The figures of a sweep's report."""

from __future__ import annotations

import numpy as np
import pandas as pd
from matplotlib import colormaps
from matplotlib.colors import LogNorm, Normalize
from matplotlib.figure import Figure as Plot
from matplotlib.ticker import FuncFormatter

from .analysis import pareto
from .study import Study

SHOWN = 6  # rows and columns of the overview at most


def label(study: Study, name: str) -> str:
    """A parameter's or a figure's name with its unit."""
    table = study.data["vary"].get(name) or study.data["record"].get(name) or {}
    unit = f" [{table['unit']}]" if table.get("unit") else ""
    return table.get("label", name.replace("_", " ")) + unit


def duty(study: Study, good: pd.DataFrame) -> tuple[Plot, pd.DataFrame]:
    """Energy of a cycle, a manoeuvre and a time of holding, over friction for each ratio; and the best friction."""
    wanted = study.report
    friction, times = wanted["friction"], wanted["hold_times"]
    moving, holding = good[wanted["moving"]["figure"]], good[wanted["holding"]["figure"]]
    ratio = good[wanted["ratio"]] if wanted["ratio"] in good else pd.Series(float(wanted["ratio"]), good.index)
    levels = sorted(ratio.unique())
    colours = colormaps["viridis"](np.linspace(0.0, 0.85, len(levels)))
    plot = Plot(figsize=(5.2 * min(len(times), 2), 4.2 * ((len(times) + 1) // 2)), layout="constrained")
    best = []
    for axes, time in zip(np.ravel(plot.subplots((len(times) + 1) // 2, min(len(times), 2), squeeze=False)), times):
        energy = moving + time * holding
        for level, colour in zip(levels, colours):
            mine = ratio == level
            x, y = good[friction][mine].to_numpy(), energy[mine].to_numpy()
            lowest = int(np.argmin(y))
            axes.plot(x, y, color=colour, label=f"r = {level:g}")
            axes.plot(x[lowest], y[lowest], "o", color=colour)
            axes.axvline(1.0 / level, color=colour, linestyle=":", linewidth=1.2)
            best.append((level, time, 1.0 / level, x[lowest], y[lowest]))
        axes.set(
            title=f"holding {time:g} s after each manoeuvre",
            xlabel=label(study, friction),
            ylabel="energy of a cycle [J]",
            ylim=(0, None),
        )
        axes.grid(alpha=0.3)
    plot.axes[0].legend(title="dotted: self-locking limit\nμ = 1/r; dot: least energy", fontsize=8, title_fontsize=8)
    return plot, pd.DataFrame(best, columns=["ratio", "holding [s]", "self-locking limit", "best friction", "energy [J]"])


def chart(study: Study, good: pd.DataFrame) -> Plot | None:
    """The same as a map over friction and ratio; None where it takes two of each to draw one."""
    wanted = study.report
    friction, ratio, times = wanted["friction"], wanted["ratio"], wanted["hold_times"]
    if ratio not in good or good[ratio].nunique() < 2 or good[friction].nunique() < 2:
        return None
    plot = Plot(figsize=(5.2 * min(len(times), 2), 4.2 * ((len(times) + 1) // 2)), layout="constrained")
    for axes, time in zip(np.ravel(plot.subplots((len(times) + 1) // 2, min(len(times), 2), squeeze=False)), times):
        energy = good[wanted["moving"]["figure"]] + time * good[wanted["holding"]["figure"]]
        grid = good.assign(energy=energy).pivot_table(index=ratio, columns=friction, values="energy")
        low, high = grid.min().min(), grid.max().max()
        norm = LogNorm(low, high) if 0.0 < low < high else None
        levels = np.geomspace(low, high, 20) if norm else 18
        drawn = axes.contourf(grid.columns, grid.index, grid.to_numpy(), levels=levels, norm=norm, cmap="YlOrRd")
        digits = FuncFormatter(lambda x, _: f"{x:.0f}" if x >= 100.0 else f"{x:.3g}")
        plot.colorbar(drawn, ax=axes, label="energy of a cycle [J]", format=digits)
        r = np.linspace(grid.index.min(), grid.index.max(), 200)
        axes.plot(1.0 / r, r, color="black", linewidth=2, label="self-locking limit μ = 1/r")
        lowest = grid.columns.to_numpy()[np.nanargmin(grid.to_numpy(), axis=1)]
        axes.plot(lowest, grid.index, "o", color="tab:blue", label="least energy")
        axes.set(title=f"holding {time:g} s after each manoeuvre", xlabel=label(study, friction), ylabel=label(study, ratio))
        axes.set_xlim(grid.columns.min(), grid.columns.max())
    plot.axes[0].legend(fontsize=8)
    return plot


def front(study: Study, good: pd.DataFrame) -> tuple[Plot, pd.DataFrame]:
    """Holding against moving, colour the peak torque; and the runs that no other beats in all three."""
    names = [study.report["pareto"][role] for role in ("holding", "moving", "torque")]
    best = good[pareto(good[names].to_numpy(float))].sort_values(names[0])
    plot = Plot(figsize=(7, 4.8), layout="constrained")
    axes = plot.subplots()
    scale = Normalize(good[names[2]].min(), good[names[2]].max())
    drawn = axes.scatter(good[names[0]], good[names[1]], c=good[names[2]], s=18, alpha=0.5, cmap="plasma", norm=scale)
    axes.scatter(
        best[names[0]],
        best[names[1]],
        c=best[names[2]],
        s=55,
        edgecolor="black",
        cmap="plasma",
        norm=scale,
        label="no other run is better",
    )
    plot.colorbar(drawn, ax=axes, label=label(study, names[2]))
    axes.set(xlabel=label(study, names[0]), ylabel=label(study, names[1]))
    axes.grid(alpha=0.3)
    axes.legend(fontsize=8)
    return plot, best[[*study.varied, *names]]


def sensitivities(study: Study, found: pd.DataFrame) -> Plot:
    """A cell for each figure and parameter."""
    kinds = [kind for kind in ("first", "total") if found[kind].notna().any()]
    order = {"index": found["figure"].unique(), "columns": found["parameter"].unique()}  # as in the study
    grids = [found.pivot(index="figure", columns="parameter", values=kind).reindex(**order) for kind in kinds]
    rows, columns = grids[0].shape
    plot = Plot(figsize=(2.5 + 1.5 * columns * len(kinds), 1.6 + 0.42 * rows), layout="constrained")
    for axes, kind, grid in zip(np.ravel(plot.subplots(1, len(kinds), squeeze=False, sharey=True)), kinds, grids):
        axes.imshow(grid.to_numpy(float), vmin=0.0, vmax=1.0, cmap="Blues", aspect="auto")
        for (row, column), value in np.ndenumerate(grid.to_numpy(float)):
            axes.text(
                column,
                row,
                f"{value:.2f}",
                ha="center",
                va="center",
                color="white" if value > 0.6 else "black",
                fontsize=9,
            )
        axes.set_xticks(range(columns), [name.replace("_", " ") for name in grid.columns], rotation=20)
        axes.set_yticks(range(rows), [name.replace("_", " ") for name in grid.index])
        axes.set_title({"first": "alone", "total": "with all interactions"}[kind], fontsize=10)
    return plot


def margins(study: Study, good: pd.DataFrame) -> Plot:
    """What is left to each limit, as a share of the limit; below zero it is passed."""
    wanted = study.report["margins"]
    grid = good.groupby(wanted["by"], sort=False)[wanted["figures"]].min()
    names = [" · ".join(map(str, key if isinstance(key, tuple) else (key,))) for key in grid.index]
    plot = Plot(figsize=(3.2 + 1.25 * len(grid.columns), 1.5 + 0.34 * len(grid)), layout="constrained")
    axes = plot.subplots()
    axes.imshow(grid.to_numpy(float), vmin=-1.0, vmax=1.0, cmap="RdYlGn", aspect="auto")
    for (row, column), value in np.ndenumerate(grid.to_numpy(float)):
        text, color = f"{100 * value:.0f} %" if np.isfinite(value) else "–", "white" if abs(value) > 0.7 else "black"
        axes.text(column, row, text, ha="center", va="center", fontsize=9, color=color)
    axes.set_xticks(range(len(grid.columns)), [label(study, name) for name in grid.columns], rotation=20, ha="right")
    axes.set_yticks(range(len(grid)), names)
    return plot


def overview(study: Study, good: pd.DataFrame) -> Plot:
    """Every figure against every parameter."""
    figures, parameters = [one.name for one in study.record][:SHOWN], study.varied[:SHOWN]
    plot = Plot(figsize=(1.0 + 3.0 * len(parameters), 0.6 + 2.2 * len(figures)), layout="constrained")
    grid = plot.subplots(len(figures), len(parameters), squeeze=False, sharex="col", sharey="row")
    for row, figure in zip(grid, figures):
        for axes, parameter in zip(row, parameters):
            axes.plot(
                good[parameter].astype(str) if good[parameter].dtype.kind not in "fib" else good[parameter],
                good[figure],
                ".",
                alpha=0.6,
            )
            axes.grid(alpha=0.3)
        row[0].set_ylabel(label(study, figure), fontsize=8)
    for axes, parameter in zip(grid[-1], parameters):
        axes.set_xlabel(label(study, parameter), fontsize=9)
        axes.tick_params(axis="x", labelrotation=20 if good[parameter].dtype.kind in "fib" else 90, labelsize=8)
    return plot


def failures(causes: dict[str, int]) -> Plot:
    """How many runs failed of what."""
    plot = Plot(figsize=(8, 1.0 + 0.45 * len(causes)), layout="constrained")
    axes = plot.subplots()
    axes.barh([text[:90] for text in causes], list(causes.values()), color="tab:red", height=0.6)
    axes.invert_yaxis()
    axes.set_xlabel("failed runs")
    return plot


def role(study: Study, *names: str) -> bool:
    """Whether the study says what plays these roles."""
    return all(name in study.report for name in names)
