"""What the pictures of a report show, as data for the page's script (selflock.view.figures): measured and simulated, where
the error was, the search, the cause as a curve, faults.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace
from typing import Any

import numpy as np

from selflock.view.figures import axis, band, line, points, rule

from ..data.faults import DataFault
from ..data.log import MeasuredRun
from ..data.signals import SIGNALS
from ..judge.rivals import role
from ..residuals.experiment import Experiment
from ..residuals.mending import Mending
from ..search.selection import Selection
from .traces import AFTER, BEFORE, MEASURED, Plots


def where(mending: Mending, noise: float) -> Plots:
    """Size of the error against what it may depend on, before and after, beside the noise floor."""
    experiment, residual, trusted = mending.experiment, mending.residual, mending.trusted
    states = [("nominal", mending.old, BEFORE), ("extended", mending.new, AFTER)]
    plots = []
    for label, parts in experiment.variables(residual, mending.after).items():
        there = [t & np.isfinite(p) for p, t in zip(parts, trusted)]
        x = np.concatenate([p[t] for p, t in zip(parts, there)])
        if label == "direction" or len(x) < 4 or np.ptp(x) == 0.0:
            continue
        marks = [rule(noise, "y", "noise floor")]
        for name, errors, colour in states[: 2 if mending.before != mending.after else 1]:
            middle, means = _binned(x, np.concatenate([q[t] for q, t in zip(errors, there)]) ** 2, 21, 3)
            marks.append(line(middle, np.sqrt(means), name, colour))
        plots.append({"x": variable(experiment, label), "y": axis("error (rms)", residual.unit, start=0.0), "marks": marks})
    return plots[:8]


def _places(x: np.ndarray, most: int, each: int) -> tuple[np.ndarray, np.ndarray]:
    """Edges of at most `most` - 1 bins with as many values in each, more than `each`; and the bin of each value."""
    edges = np.unique(np.quantile(x, np.linspace(0, 1, min(most, len(x) // each + 2))))
    return edges, np.clip(np.searchsorted(edges, x, side="right") - 1, 0, len(edges) - 2)


def _binned(x: np.ndarray, y: np.ndarray, most: int, each: int) -> tuple[np.ndarray, np.ndarray]:
    """Middles of bins, and the mean of y in each."""
    edges, place = _places(x, most, each)
    count = np.maximum(np.bincount(place, minlength=len(edges) - 1), 1)
    return 0.5 * (edges[1:] + edges[:-1]), np.bincount(place, y, len(edges) - 1) / count


KINDS = {"named": "won", "not to be told from it": "like", "best, dropped later": "dropped", "considered": ""}


def search(outcome: Selection) -> list[list[dict[str, Any]]]:
    """What was considered in each step, as bars: the error that it left on blocks that its fit did not see, of its base's."""
    steps = []
    for stage in outcome.stages:
        level, bars = stage.base.errors.mean(), []
        for one in [c for c in stage.candidates if c.fit][:8]:
            what, share = role(outcome, stage, one), float(one.errors.mean() / level)
            said = f"{100.0 * share:.3g} %" + f", {what}" * (what != "considered")
            bars.append({"label": one.hypothesis.label, "share": share, "said": said, "kind": KINDS[what]})
        steps.append(bars)
    return steps


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


def variable(experiment: Experiment, label: str) -> dict[str, Any]:
    """A variable as an axis, with its unit; a channel of the log's own is in what the rig makes of it."""
    unit = UNITS.get(label, "")
    return axis(label, LINEAR.get(unit, unit) if experiment.rig.linear else unit)


def missing(mending: Mending, outcome: Selection | None, rng: np.random.Generator, over: str = "") -> Plots:
    """What the nominal simulation lacks, as a curve: measured means, what the cause adds, with its 95 % band.

    outcome: a search that found causes; else the means stand alone. over: the variable that they are then drawn over, if known.
    """
    experiment, residual = mending.experiment, mending.residual
    known = experiment.variables(residual, mending.after)
    label = outcome.causes[0].hypothesis.shown_over if outcome else over
    label = label if label in known else "speed" if "speed" in known else next(iter(known), "")
    everywhere = replace(mending, blocks=np.ones(experiment.layout.count, bool))
    old, trusted = everywhere.old, everywhere.trusted
    take = lambda parts: np.concatenate([p[t] for p, t in zip(parts, trusted)])
    x, lacking = take(known[label]) if label else np.zeros(0), take(old)
    if len(x) < 4 or np.ptp(x) == 0.0:
        return []
    edges, place = _places(x, 31, 2)
    count = np.maximum(np.bincount(place, minlength=len(edges) - 1), 1)
    mean = lambda y: np.bincount(place, y, len(edges) - 1) / count
    middle, lacks = mean(x), mean(lacking)
    added = lambda values: mean(lacking - take(replace(everywhere, after=values).new))
    marks = [rule(0.0, "y", "nominal", BEFORE, dash=0)] + (_explained(mending, outcome, rng, middle, added) if outcome else [])
    error = np.sqrt(np.maximum(mean(lacking**2) - lacks**2, 0) / count)
    marks.append(points(middle, lacks, "measured", MEASURED, (lacks - error, lacks + error)))
    return [{"x": variable(experiment, label), "y": axis(f"missing {residual.quantity}", residual.unit), "marks": marks}]


def _explained(
    mending: Mending, outcome: Selection, rng: np.random.Generator, x: np.ndarray, added: Callable[[dict], np.ndarray]
) -> list[dict[str, Any]]:
    """What the causes add at each x, and its 95 % band. added: what values of all numbers add."""
    fit, problem = outcome.final, outcome.problem
    spread = fit.covariance(problem.rows, problem.blocks)
    names = [p.name for p in fit.free]
    center = np.array([fit.values[n] for n in names])
    bounds = np.array([[p.low, p.high] for p in fit.free]).T
    # a closed loop is far from linear: intervals from slopes say nothing of its band
    number = 0 if problem.whole else 24
    draws = np.clip(rng.multivariate_normal(center, spread, number, check_valid="ignore"), *bounds)
    curves = [added(mending.after | problem.absolute(dict(zip(names, row)))) for row in draws]
    curves = [curve for curve in curves if np.isfinite(curve).all()]
    marks = []
    if curves:
        low, high = np.quantile(curves, [0.025, 0.975], axis=0)
        marks.append(band(x, low, high, "95 % band", AFTER))
    return [*marks, line(x, added(mending.after), " and ".join(c.hypothesis.label for c in outcome.causes), AFTER)]


def faults(measured_runs: Sequence[MeasuredRun], found: Sequence[DataFault], most: int = 6) -> Plots:
    """Faults marked in place, each in its neighbourhood."""
    plots = []
    for fault in [f for f in found if f.channel != "time"][:most]:
        run = next(
            r
            for r in measured_runs
            if r.log == fault.log and r.name == fault.run and len(r) and r.rows[0] <= fault.first <= r.rows[-1]
        )
        a, b = np.searchsorted(run.rows, [fault.first, fault.last])
        around = slice(max(0, a - 40), min(len(run), b + 41))
        x, y = run.rows[around].astype(float), run.signals[fault.channel][around]
        bad = ~run.good[fault.channel][around]
        marks = [line(x, y, "measured", "soft", thin=True), points(x[bad], y[bad], "left out", 4)]
        title = f"{fault.kind}, {fault.log} {fault.run}"
        unit = SIGNALS[fault.channel][0] if fault.channel in SIGNALS else ""
        plots.append({"title": title, "x": axis("row"), "y": axis(fault.channel, unit), "marks": marks})
    return plots
