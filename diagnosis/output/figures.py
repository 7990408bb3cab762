"""The figures of a report: measured and simulated, where the error was, the search, the cause as a curve, faults."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import Any, Literal

import numpy as np
from matplotlib import rc_context
from matplotlib.figure import Figure
from matplotlib.patches import Patch

from selflock.fmus.shown import literal

from ..judge.rivals import role
from ..residuals.experiment import Experiment
from ..residuals.mending import Mending
from ..search.selection import Selection

BEFORE, AFTER, MEASURED, BAND = "#c2571a", "#1f6fb2", "#222222", "#1f6fb233"
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


def save(figure: Figure, path: Path) -> Path:
    """Write a figure."""
    literal(figure)
    if figure.get_layout_engine() is None:
        figure.tight_layout()
    figure.savefig(path)
    return path


@styled
def traces(mending: Mending, path: Path, compared: list | None = None, title: str = "") -> Path:
    """Measured against simulated, before and after: over time where it was worst, steady points over speed.

    compared: what was simulated before, where something else than the laws did it."""
    experiment, residual, changed = mending.experiment, mending.residual, mending.before != mending.after
    old = experiment.compare(residual, mending.before) if compared is None else compared
    new = experiment.compare(residual, mending.after) if changed else old
    figure, (top, low) = subplots(2, 1, figsize=(9, 5.4), sharex=True, height_ratios=[2, 1])
    if experiment.steady:
        x = experiment.variables(residual, mending.after)["speed"][0]
        order = np.argsort(x)
        i, x, part = 0, x[order], order
        if (x < 0.0).any() and (x > 0.0).any():  # no line through standstill, where the torque is another
            turn = np.searchsorted(x, 0.0)
            x, part = np.insert(x, turn, np.nan), np.insert(order, turn, order[0])
        top.plot(x, np.where(old[0][2][part], old[0][1][part], np.nan), "o", color=MEASURED, ms=4, label="measured")
        label = "speed in rad/s" if not experiment.rig.linear else "speed in m/s"
    else:
        i, stretch = _worst(experiment, old, mending.blocks)
        part = np.arange(len(experiment.runs[i]))[stretch]
        x, label = experiment.runs[i].time[part], "time in s"
        shown = np.where(old[i][2][part], old[i][1][part], np.nan)
        top.plot(x, shown, color=MEASURED, lw=1.0, label="measured")
        top.plot(x, np.where(old[i][2][part], np.nan, old[i][1][part]), color=MEASURED, lw=0.6, alpha=0.25)
    style = "o-" if experiment.steady else "-"
    hide = lambda run, y: np.where(run[i][2][part], y, np.nan)
    top.plot(x, hide(old, old[i][0][part]), style, color=BEFORE, lw=1.2, ms=3, label="simulated, nominal")
    low.plot(x, hide(old, (old[i][1] - old[i][0])[part]), style, color=BEFORE, lw=0.9, ms=3)
    if changed:
        top.plot(x, hide(new, new[i][0][part]), style, color=AFTER, lw=1.2, ms=3, label="simulated, extended")
        low.plot(x, hide(new, (new[i][1] - new[i][0])[part]), style, color=AFTER, lw=0.9, ms=3)
    top.set_title(title, loc="left")
    low.set_xlabel(label)
    top.set_ylabel(f"{residual.quantity}\n{residual.unit}")
    low.set_ylabel(f"measured - simulated\n{residual.unit}")
    top.legend(loc="best", ncols=3, fontsize=9)
    return save(figure, path)


def _worst(experiment: Experiment, compared, held: np.ndarray) -> tuple[int, slice]:
    """A stretch of held-out data in which the nominal simulation is off most."""
    best, where = -1.0, (0, slice(0, len(experiment.runs[0])))
    for i, (simulated, measured, good) in enumerate(compared):
        block = experiment.layout.block(i)
        for b in np.unique(block):
            mine = (block == b) & good
            if held[b] and mine.sum() > 20:
                level = float(np.sqrt(np.mean((measured - simulated)[mine] ** 2)))
                if level > best:
                    places = np.flatnonzero(block == b)
                    wide = 2 * (places[-1] - places[0])
                    best, where = (
                        level,
                        (i, slice(max(0, places[0] - wide // 4), min(len(block), places[-1] + wide // 4))),
                    )
    return where


@styled
def where(mending: Mending, noise: float, path: Path) -> Path:
    """Size of the error against what it may depend on, before and after, beside the noise floor."""
    experiment, residual, changed = mending.experiment, mending.residual, mending.before != mending.after
    old, new, trusted = mending.old, mending.new, mending.trusted

    def varies(parts):
        x = np.concatenate(parts)
        x = x[np.isfinite(x)]
        return len(x) > 0 and np.ptp(x) > 0.0

    wanted = [
        (label, parts)
        for label, parts in experiment.variables(residual, mending.after).items()
        if label != "direction" and varies(parts)
    ][:8]
    rows = int(np.ceil(len(wanted) / 4))
    figure, axes = subplots(rows, 4, figsize=(11, 2.6 * rows), squeeze=False, sharey=True)
    for axis, (label, parts) in zip(axes.flat, wanted):
        there = [t & np.isfinite(p) for p, t in zip(parts, trusted)]
        x = np.concatenate([p[t] for p, t in zip(parts, there)])
        for errors, color in ((old, BEFORE), (new, AFTER))[: 2 if changed else 1]:
            e = np.concatenate([q[t] for q, t in zip(errors, there)])
            if len(x) < 4 or np.ptp(x) == 0.0:
                continue
            edges = np.unique(np.quantile(x, np.linspace(0, 1, min(21, len(x) // 3 + 2))))
            place = np.clip(np.searchsorted(edges, x, side="right") - 1, 0, len(edges) - 2)
            count = np.maximum(np.bincount(place, minlength=len(edges) - 1), 1)
            axis.plot(
                0.5 * (edges[1:] + edges[:-1]),
                np.sqrt(np.bincount(place, e**2, len(edges) - 1) / count),
                "-",
                color=color,
                lw=1.4,
            )
        axis.axhline(noise, color="gray", ls=":", lw=1.0)
        axis.set_xlabel(axis_label(experiment, label))
    for axis in axes.flat[len(wanted) :]:
        axis.set_visible(False)
    for row in axes:
        row[0].set_ylabel(f"error (rms), {residual.unit}")
    figure.suptitle(
        "orange: nominal, blue: extended, dotted: noise floor" if changed else "orange: nominal, dotted: noise floor",
        fontsize=10,
    )
    return save(figure, path)


ROLES: dict[str, dict[str, Any]] = {
    "named": {"facecolor": AFTER},
    "not to be told from it": {"facecolor": "#7fa8c9"},
    "best, dropped later": {"facecolor": "white", "edgecolor": AFTER, "hatch": "////"},
    "considered": {"facecolor": "#b8b8b8"},
}


@styled
def search(outcome: Selection, path: Path) -> Path | None:
    """What was considered in each step, and the error that each left on blocks that its fit did not see."""
    stages = [s for s in outcome.stages if any(c.fit for c in s.candidates)]
    if not stages:
        return None
    figure, axes = subplots(1, len(stages), figsize=(5.2 * len(stages), 3.9), squeeze=False, layout="constrained")
    seen = set()
    for number, (axis, stage) in enumerate(zip(axes[0], stages)):
        fitted = [c for c in stage.candidates if c.fit][:8][::-1]
        level = stage.base.errors.mean()
        roles = [role(outcome, stage, c) for c in fitted]
        bars = axis.barh([c.hypothesis.label for c in fitted], [c.errors.mean() / level for c in fitted])
        for bar, what in zip(bars, roles):
            bar.set(**ROLES[what])
        seen.update(roles)
        axis.axvline(1.0, color=BEFORE, lw=1.2)
        axis.set_title(f"step {number + 1}", fontsize=10)
        axis.set_xlim(0.0, 1.2)
        axis.set_xlabel("loss on unseen blocks / base's")
    figure.legend(
        handles=[Patch(label=what, **look) for what, look in ROLES.items() if what in seen],
        loc="outside lower center",
        ncols=len(ROLES),
        fontsize=9,
        frameon=False,
    )
    return save(figure, path)


UNITS = {
    "speed": "rad/s",
    "load": "N·m",
    "acceleration": "rad/s²",
    "position": "rad",
    "output position": "rad",
    "current": "A",
    "temperature": "°C",
    "supply voltage": "V",
    "set-point change": "rad/s",
    "time": "s",
}
LINEAR = {"rad/s": "m/s", "N·m": "N", "rad/s²": "m/s²", "rad": "m"}


def axis_label(experiment: Experiment, label: str) -> str:
    """The name of a variable with its unit; a channel of the log's own is in what the rig makes of it."""
    unit = UNITS.get(label, "")
    unit = LINEAR.get(unit, unit) if experiment.rig.linear else unit
    return f"{label} in {unit}" if unit else label


@styled
def missing(mending: Mending, outcome: Selection, path: Path, rng: np.random.Generator) -> Path | None:
    """What the nominal simulation lacks, as a curve: measured means, what the cause adds, with its 95 % band."""
    experiment, residual, problem = mending.experiment, mending.residual, outcome.problem
    known = experiment.variables(residual, mending.after)
    label = outcome.causes[0].hypothesis.shown_over
    label = label if label in known else "speed" if "speed" in known else next(iter(known))
    everywhere = replace(mending, blocks=np.ones(experiment.layout.count, bool))
    old, trusted = everywhere.old, everywhere.trusted
    take = lambda parts: np.concatenate([p[t] for p, t in zip(parts, trusted)])
    x, lacking = take(known[label]), take(old)
    if len(x) < 4 or np.ptp(x) == 0.0:
        return None
    edges = np.unique(np.quantile(x, np.linspace(0, 1, min(31, len(x) // 2 + 2))))
    place = np.clip(np.searchsorted(edges, x, side="right") - 1, 0, len(edges) - 2)
    count = np.maximum(np.bincount(place, minlength=len(edges) - 1), 1)
    mean = lambda y: np.bincount(place, y, len(edges) - 1) / count
    middle = mean(x)

    def added(values: dict) -> np.ndarray:
        return mean(lacking - take(replace(everywhere, after=values).new))

    fit = outcome.final
    spread = fit.covariance(problem.rows, problem.blocks)
    names = [p.name for p in fit.free]
    center = np.array([fit.values[n] for n in names])
    bounds = np.array([[p.low, p.high] for p in fit.free]).T
    # a closed loop is far from linear: intervals from slopes say nothing of its band
    number = 0 if problem.whole else 24
    draws = np.clip(rng.multivariate_normal(center, spread, number, check_valid="ignore"), *bounds)
    curves = [added(mending.after | problem.absolute(dict(zip(names, row)))) for row in draws]
    curves = [curve for curve in curves if np.isfinite(curve).all()]
    figure, axis = subplots(figsize=(7, 3.8))
    axis.errorbar(
        middle,
        mean(lacking),
        yerr=np.sqrt(np.maximum(mean(lacking**2) - mean(lacking) ** 2, 0) / count),
        fmt="o",
        ms=4,
        color=MEASURED,
        lw=0.8,
        label="missing in the nominal simulation, measured",
    )
    if curves:
        axis.fill_between(middle, *np.quantile(curves, [0.025, 0.975], axis=0), color=BAND, label="95 % band")
    axis.plot(middle, added(mending.after), color=AFTER, lw=1.6, label=" and ".join(c.hypothesis.label for c in outcome.causes))
    axis.axhline(0.0, color=BEFORE, lw=1.0)
    axis.set_xlabel(axis_label(experiment, label))
    axis.set_ylabel(f"{residual.quantity} in {residual.unit}")
    beside = 2 if len(outcome.causes) == 1 else 1  # names of several causes are as wide as the figure
    axis.legend(loc="lower center", bbox_to_anchor=(0.45, 1.0), ncols=beside, fontsize=8.5, frameon=False)
    return save(figure, path)


@styled
def faults(measured_runs, found, path: Path, most: int = 6) -> Path | None:
    """Faults marked in place, each in its neighbourhood."""
    shown = [f for f in found if f.channel != "time"][:most]
    if not shown:
        return None
    columns = min(3, len(shown))
    rows = int(np.ceil(len(shown) / columns))
    figure, axes = subplots(rows, columns, figsize=(3.6 * columns, 2.4 * rows), squeeze=False)
    for axis, fault in zip(axes.flat, shown):
        run = next(
            r
            for r in measured_runs
            if r.log == fault.log and r.name == fault.run and len(r) and r.rows[0] <= fault.first <= r.rows[-1]
        )
        a, b = np.searchsorted(run.rows, [fault.first, fault.last])
        around = slice(max(0, a - 40), min(len(run), b + 41))
        x, y = run.rows[around], run.signals[fault.channel][around]
        bad = ~run.good[fault.channel][around]
        axis.plot(x, y, "-", color="#999999", lw=0.8)
        axis.plot(x[bad], y[bad], "x", color="#c00000", ms=7)
        axis.set_title(f"{fault.kind}: {fault.channel}, {fault.log} {fault.run}", fontsize=7)
        axis.set_xlabel("row", fontsize=8)
    for axis in axes.flat[len(shown) :]:
        axis.set_visible(False)
    return save(figure, path)
