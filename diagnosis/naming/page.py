"""What a naming writes beside the extended system: its page with pictures, and naming.json."""

from __future__ import annotations

import base64
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
from markupsafe import Markup

from selflock.fmus.correction import law
from selflock.view import page

from ..calibration.numbers import label
from ..output import figures
from .outcome import FreeCurve, Naming

if TYPE_CHECKING:
    from .run import Search

ROWS, POINTS = 4, 200


def write(result: Naming, found: Search, out: Path) -> Path:
    """report.html, its pictures, naming.json; `result` then knows them."""
    result.folder = out
    pictures = [("Before and after, on what judges", traces(found, out / "traces.png"))]
    if result.curve is not None:
        pictures.insert(0, ("What is missing", curve(result.curve, found, out / "curve.png")))
    result.files += [path.name for _, path in pictures] + ["report.html", result.write(out).name]
    shown = [(title, base64.b64encode(path.read_bytes()).decode()) for title, path in pictures]
    made = page.environment("selflock.diagnosis.naming", strict=False)
    made.filters["num"] = lambda v: Markup("&ndash;") if v is None else f"{v:.4g}"
    return page.write(out / "report.html", made, "naming.html.j2", result=result, pictures=shown)


def _own_shape(x: np.ndarray, y: np.ndarray, knots: np.ndarray, at: np.ndarray) -> np.ndarray:
    """y without the straight line through its values at the knots: what the base's own numbers may make up for."""
    slope, offset = np.polyfit(knots, at, 1)
    return np.asarray(y - slope * x - offset)


@figures.styled
def curve(one: FreeCurve, found: Search, path: Path) -> Path:
    """The free curve with its standard errors, and over it the law that was named there."""
    knots, heights, errors = np.array(one.x), np.array(one.y), np.array(one.error)
    x = np.linspace(knots[0], knots[-1], POINTS)
    figure, axes = figures.subplots(1, 1, figsize=(7.0, 3.4), layout="constrained", squeeze=False)
    axis = axes[0][0]
    shape = lambda y, at: _own_shape(x if len(y) == POINTS else knots, y, knots, at)
    y = shape(np.interp(x, knots, heights), heights)
    axis.plot(x, y, color=figures.BEFORE, lw=1.2, label="free curve")
    axis.errorbar(knots, shape(heights, heights), 1.96 * errors, fmt="o", ms=3, color=figures.BEFORE, lw=1.0)
    first = found.work.inserts[0] if found.work.inserts else None
    if first is not None and not law.BY_NAME[first.law].is_path and first.law != "table" and first.goes_with == one.over:
        settings = found.best.problem.settings(found.best.values)[found.work.which[0]]
        p = [0.0] * law.SIZE
        p[law.LAW] = law.BY_NAME[first.law].code
        for k, word in enumerate(law.BY_NAME[first.law].numbers):
            p[law.FIRST + k] = settings.get(f"{first.name}.{word}", 0.0)
        at = np.array([law.still(p, float(u)) for u in knots])
        if at.any():
            named = np.array([law.still(p, float(u)) for u in x])
            axis.plot(x, shape(named, at), color=figures.AFTER, lw=1.2, label=first.law)
    axis.set_xlabel(one.over, fontsize=8)
    axis.set_ylabel(f"{'share of' if one.multiplies else 'added to'} {one.place}, but for a straight line", fontsize=8)
    axis.legend(fontsize=8)
    return figures.save(figure, path)


@figures.styled
def traces(found: Search, path: Path) -> Path:
    """Measured and simulated of a run that judges, and the errors before and after."""
    work = found.work
    i = min(work.judges, default=work.which[0])
    run, names = work.runs[i], work.played.outputs[:ROWS]
    work.played.extend(found.work.inserts)
    after = found.best.problem.errors(found.best.values, [i])
    work.played.extend(())
    before = found.base.problem.errors(found.base.values, [i])
    work.played.extend(found.work.inserts)
    figure, axes = figures.subplots(len(names), 2, figsize=(9.6, 2.6 * len(names)), layout="constrained", squeeze=False)
    for row, name in enumerate(names):
        good = work.played.trusted(name, [i])[0]
        measured, axis = run.signals[name], axes[row][0]
        axis.plot(run.time, np.where(good, measured, np.nan), color=figures.MEASURED, lw=1.0, label="measured")
        for errors, color, words in ((before, figures.BEFORE, "calibrated"), (after, figures.AFTER, "extended")):
            if errors is not None:
                axis.plot(run.time, measured - errors[name][0], color=color, lw=0.8, label=words)
                left = np.where(good, errors[name][0], np.nan)
                axes[row][1].plot(run.time, left, color=color, lw=0.8, label=f"error, {words}")
        axis.set_title(label(run), fontsize=8)
        axis.set_ylabel(f"{name} in {work.parts.variables[name].unit or '1'}", fontsize=8)
        for one in axes[row]:
            one.set_xlabel("time in s", fontsize=8)
            one.legend(fontsize=7)
    return figures.save(figure, path)
