"""What a naming writes beside the extended system: its page with figures, and naming.json."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from selflock.fmus.correction import law
from selflock.view import figures, page
from selflock.view.figures import axis, line, points

from ..calibration.numbers import label
from ..calibration.page import measured
from ..output.traces import AFTER, BEFORE, Plots
from .outcome import FreeCurve, Naming

if TYPE_CHECKING:
    from .run import Search

ROWS, POINTS = 4, 200


def write(result: Naming, found: Search, out: Path) -> Path:
    """report.html and naming.json; `result` then knows them."""
    result.folder = out
    missing = curve(result.curve, found) if result.curve is not None else None
    drawn = figures.carried({"missing": missing, "traces": traces(found)}, least={"missing": 900, "traces": 400})
    result.files += ["report.html", result.write(out).name]
    made = page.environment("selflock.diagnosis.naming", strict=False)
    return page.write(out / "report.html", made, "naming.html.j2", drawn, result=result)


def own_shape(x: np.ndarray, y: np.ndarray, knots: np.ndarray, at: np.ndarray, errors: np.ndarray) -> np.ndarray:
    """y without the straight line through its values at the knots, by their errors: what the base's own numbers may make up for."""
    slope, offset = np.polyfit(knots, at, 1, w=1.0 / np.maximum(errors, 1e-3 * np.max(errors) or 1.0))
    return np.asarray(y - slope * x - offset)


def curve(one: FreeCurve, found: Search) -> Plots:
    """The free curve with its standard errors, and over it the law that was named there."""
    knots, heights, errors = np.array(one.x), np.array(one.y), np.array(one.error)
    x = np.linspace(knots[0], knots[-1], POINTS)
    own, spread = own_shape(knots, heights, knots, heights, errors), 1.96 * errors
    marks = [
        line(x, own_shape(x, np.interp(x, knots, heights), knots, heights, errors), "free curve", BEFORE),
        points(knots, own, "", BEFORE, (own - spread, own + spread)),
    ]
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
            marks.append(line(x, own_shape(x, named, knots, at, errors), first.law, AFTER))
    unit = found.work.parts.unit
    means = f"{'share of' if one.multiplies else 'added to'} {one.place}, but for a straight line"
    return [{"x": axis(one.over, unit(one.over)), "y": axis(means, "" if one.multiplies else unit(one.place)), "marks": marks}]


def traces(found: Search) -> Plots:
    """Measured and simulated of a run that judges, and the errors before and after."""
    work = found.work
    i = min(work.judges, default=work.which[0])
    run = work.runs[i]
    work.played.extend(found.work.inserts)
    after = found.best.problem.errors(found.best.values, [i])
    work.played.extend(())
    before = found.base.problem.errors(found.base.values, [i])
    work.played.extend(found.work.inserts)
    plots = []
    for name in work.played.outputs[:ROWS]:
        x, unit, good = run.signals[name], work.parts.variables[name].unit, work.played.trusted(name, [i])[0]
        top, low = measured(run.time, x, good), []
        for errors, words, colour in ((before, "calibrated", BEFORE), (after, "extended", AFTER)):
            if errors is not None:
                top.append(line(run.time, x - errors[name][0], words, colour))
                low.append(line(run.time, np.where(good, errors[name][0], np.nan), words, colour, thin=True))
        for title, over, marks in ((label(run), axis(name, unit), top), (label(run), axis("measured − simulated", unit), low)):
            plots.append({"title": title, "x": axis("time", "s"), "y": over, "marks": marks, "shares": "x"})
    return plots
