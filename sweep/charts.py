"""The figures of a sweep's report, as data for the page's script (selflock.view.figures), and its tables of shares."""

from __future__ import annotations

from typing import Any

import numpy as np
import pandas as pd

from selflock.view import page
from selflock.view.figures import axis, field, line, points, rule

from .analysis import pareto
from .study import Study

SHOWN = 6  # rows and columns of the overview at most
MOST = 24  # curves of a plot, or plots of a figure
ENERGY = axis("energy of a cycle", "J")
Plots = list[dict[str, Any]]


def over(study: Study, name: str, **more: Any) -> dict[str, Any]:
    """A parameter or a figure as an axis, with its label and its unit."""
    table = study.data["vary"].get(name) or study.data["record"].get(name) or {}
    return axis(table.get("label", name.replace("_", " ")), table.get("unit", ""), **more)


def heading(study: Study, name: str) -> str:
    """A column's name in a table."""
    table = over(study, name)
    return f"{table['label']} in {page.pretty(table['unit'])}" if table["unit"] else table["label"]


def duty(study: Study, good: pd.DataFrame) -> tuple[Plots, pd.DataFrame]:
    """Energy of a cycle, a manoeuvre and a time of holding, over friction for each ratio; and the best friction."""
    wanted = study.report
    friction = wanted["friction"]
    ratio = good[wanted["ratio"]] if wanted["ratio"] in good else pd.Series(float(wanted["ratio"]), good.index)
    plots, best = [], []
    for time, energy in _cycles(study, good):
        marks = []
        for number, level in enumerate(sorted(ratio.unique())):
            mine = ratio == level
            order = np.argsort(good[friction][mine].to_numpy())
            x, y = good[friction][mine].to_numpy(float)[order], energy[mine].to_numpy(float)[order]
            lowest = int(np.argmin(y))
            best.append((level, time, 1.0 / level, x[lowest], y[lowest]))
            if number < MOST:
                marks.append(line(x, y, f"r = {level:g}", number))
                marks.append(points(x[[lowest]], y[[lowest]], "", number, size=4))
                marks.append(rule(1.0 / level, colour=number))
        plots.append(
            {"title": _held(time), "x": over(study, friction), "y": ENERGY | {"from": 0.0}, "marks": marks, "shares": "friction"}
        )
    return plots[:MOST], pd.DataFrame(
        best, columns=["ratio", "holding in s", "self-locking limit", "best friction", "energy in J"]
    )


def _cycles(study: Study, good: pd.DataFrame):
    """Each time of holding in s, and the energy of a cycle with it in J, a number for each run."""
    wanted = study.report
    for time in wanted["hold_times"]:
        yield time, good[wanted["moving"]["figure"]] + time * good[wanted["holding"]["figure"]]


def _held(time: float) -> str:
    return f"holding {time:g} s after each manoeuvre"


def chart(study: Study, good: pd.DataFrame) -> Plots:
    """The same as a map over friction and ratio; none where it takes two of each to draw one."""
    friction, ratio = study.report["friction"], study.report["ratio"]
    if ratio not in good or good[ratio].nunique() < 2 or good[friction].nunique() < 2:
        return []
    plots = []
    for time, energy in list(_cycles(study, good))[:MOST]:
        grid = good.assign(energy=energy).pivot_table(index=ratio, columns=friction, values="energy")
        x, y, z = grid.columns.to_numpy(float), grid.index.to_numpy(float), grid.to_numpy(float)
        if not np.isfinite(z).any(axis=1).all():
            continue
        low, high = float(np.nanmin(z)), float(np.nanmax(z))
        r = np.linspace(y[0], y[-1], 200)
        marks = [field(x, y, z, ENERGY["label"]), line(1.0 / r, r, "self-locking limit μ = 1/r", "ink")]
        marks.append(points(x[np.nanargmin(z, axis=1)], y, "least energy", 0, size=4, ring=True))
        scale = ENERGY | {"low": low, "high": high, "log": 0.0 < low < high}
        plots.append({"title": _held(time), "x": over(study, friction), "y": over(study, ratio), "scale": scale, "marks": marks})
    return plots


def front(study: Study, good: pd.DataFrame) -> tuple[Plots, pd.DataFrame]:
    """Holding against moving, colour the peak torque; and the runs that no other beats in all three."""
    names = [study.report["pareto"][role] for role in ("holding", "moving", "torque")]
    good = good.dropna(subset=names)
    best = good[pareto(good[names].to_numpy(float))].sort_values(names[0])
    columns = lambda table: [table[name].to_numpy(float) for name in names]
    (x, y, torque), (a, b, c) = columns(good), columns(best)
    marks = [points(x, y, "a run", "soft", by=torque), points(a, b, "no other run is better", "soft", by=c, size=5, ring=True)]
    if not len(good):
        return [], _table(study, best, [*study.varied, *names])
    scale = over(study, names[2]) | {"low": float(torque.min()), "high": float(torque.max())}
    plot = {"x": over(study, names[0]), "y": over(study, names[1]), "scale": scale, "marks": marks}
    return [plot], _table(study, best, [*study.varied, *names])


def overview(study: Study, good: pd.DataFrame) -> Plots:
    """Every figure against every parameter."""
    plots = []
    for figure in [one.name for one in study.record][:SHOWN]:
        for name in study.varied[:SHOWN]:
            x, names = good[name], None
            if x.dtype.kind not in "fiub":
                codes, found = pd.factorize(x.astype(str))
                x, names = pd.Series(codes), [str(one) for one in found]
            marks = [points(x.to_numpy(float), good[figure].to_numpy(float), size=2)]
            plots.append({"x": over(study, name, names=names), "y": over(study, figure), "marks": marks, "shares": name})
    return plots


def _table(study: Study, runs: pd.DataFrame, names: list[str]) -> pd.DataFrame:
    """Columns of runs under their headings."""
    return runs[names].set_axis([heading(study, name) for name in names], axis=1)


def figures_of(study: Study, good: pd.DataFrame, by: list[str]) -> pd.DataFrame:
    """All figures of each run, behind what tells the runs apart."""
    return _table(study, good, [*by, *(one.name for one in study.record)])


def sensitivities(found: pd.DataFrame) -> list[dict[str, Any]]:
    """A cell for each figure and parameter: the share of the variance."""
    order = {"index": found["figure"].unique(), "columns": found["parameter"].unique()}  # as in the study
    grids = []
    for kind, title in (("first", "alone"), ("total", "with all interactions")):
        if found[kind].notna().any():
            grid = found.pivot(index="figure", columns="parameter", values=kind).reindex(**order)
            cell = lambda v: {"share": min(max(v, 0.0), 1.0) if np.isfinite(v) else 0.0, "said": _share(v), "kind": ""}
            grids.append(_cells(title, [_plain(name) for name in grid.columns], map(_plain, grid.index), grid, cell))
    return grids


def margins(study: Study, good: pd.DataFrame) -> dict[str, Any]:
    """What is left to each limit, as a share of the limit; below zero it is passed."""
    wanted = study.report["margins"]
    grid = good.groupby(wanted["by"], sort=False)[wanted["figures"]].min()
    names = [" · ".join(map(str, key if isinstance(key, tuple) else (key,))) for key in grid.index]

    def cell(v: float) -> dict[str, Any]:
        return {"share": min(abs(v), 1.0) if np.isfinite(v) else 0.0, "said": _share(v), "kind": "bad" if v < 0.0 else "good"}

    return _cells("", [heading(study, name) for name in grid.columns], names, grid, cell)


def _cells(title: str, columns: list[str], names, grid: pd.DataFrame, cell) -> dict[str, Any]:
    return {"title": title, "columns": columns, "rows": [(n, [cell(v) for v in row]) for n, row in zip(names, grid.to_numpy(float))]}  # fmt: skip


def _share(v: float) -> str:
    return f"{100.0 * v:.0f} %".replace("-", "−") if np.isfinite(v) else "–"


def _plain(name: str) -> str:
    return name.replace("_", " ")


def failures(causes: dict[str, int]) -> list[dict[str, Any]]:
    """How many runs failed of what."""
    most = max(causes.values())
    return [{"label": text, "share": count / most, "said": f"{count} runs", "kind": "failed"} for text, count in causes.items()]


def role(study: Study, *names: str) -> bool:
    """Whether the study says what plays these roles."""
    return all(name in study.report for name in names)
