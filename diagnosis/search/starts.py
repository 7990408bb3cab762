"""What no data sheet says: fitted from several starts, and what the log tells of each value."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import asdict, dataclass

import numpy as np

from ..rules import RULES
from .fit import Fit, scale
from .hypotheses import Free


@dataclass(frozen=True)
class Ending:
    """Where a fit from one start ended: values by name, and the loss there."""

    start: dict[str, float]
    end: dict[str, float]
    loss: float


@dataclass(frozen=True)
class Told:
    """What a log tells of a value that no data sheet says; low and high: its 95 % interval, of the fit with all causes."""

    name: str
    value: float
    low: float
    high: float
    unit: str
    at_bound: bool  # of the range that the rig gives
    elsewhere: list[dict[str, float]]  # starts from which the fit of the nominal drive ended at another value: {start, end}
    collinear_with: list[str]  # free values with which it can be changed without a trace

    def row(self) -> dict:
        """As diagnosis.json has it."""
        return asdict(self)

    def sentences(self) -> list[str]:
        """What is doubtful about it, in words."""
        found = []
        if self.at_bound:
            found.append(f"{self.name} = {self.value:.4g} is at the end of its range: the range, or the model, may be wrong")
        if self.elsewhere:
            ways = ", ".join(f"{way['end']:.4g} (from {way['start']:.4g})" for way in self.elsewhere)
            found.append(f"{self.name} = {self.value:.4g} fits best, but from other starts the fit ended at {ways}")
        if self.collinear_with:
            found.append(f"{self.name} cannot be told from {', '.join(self.collinear_with)} in this log")
        return found


def starts(free: Sequence[Free], given: dict[str, float]) -> list[dict[str, float]]:
    """Values to start fits from: those given, then all values at the same place of their ranges."""
    found = [{p.name: _away(p, given[p.name]) for p in free}]
    for place in zip(*map(_places, free)):
        found.append({p.name: float(value) for p, value in zip(free, place)})
    return found


def _away(p: Free, value: float) -> float:
    """A value no nearer to 0 than its scale: a fit's first step is about as long as its start, and from 0 none arrives."""
    least = RULES.search.range_scale * (p.high - p.low)
    return float(np.clip(np.copysign(max(abs(value), least), value), p.low, p.high))


def _places(p: Free) -> list[float]:
    """The middle of a range, and places even in its logarithm, or of a range that holds 0 inside in its values."""
    count = RULES.search.start_places + 2
    inner = np.linspace(p.low, p.high, count)
    if p.low >= 0.0:
        inner = np.geomspace(max(p.low, RULES.search.lowest * p.high), p.high, count)
    return [0.5 * (p.low + p.high), *inner[1:-1]]


def told(fitted: Fit, free: Sequence[Free], endings: Sequence[Ending], rows: np.ndarray, blocks: np.ndarray) -> list[Told]:
    """What the log tells of each value of `free` in a fit that holds them all.

    rows: entries of the flat misfit that teach; blocks: the block of each.
    """
    intervals, together, found = fitted.intervals(rows, blocks), collinear(fitted, rows), []
    errors = dict(zip((p.name for p in fitted.free), np.sqrt(np.maximum(np.diag(fitted.covariance(rows, blocks)), 0.0))))
    felt = fitted.felt(rows)
    best = min(endings, key=lambda e: e.loss).end if endings else {}
    for p in free:
        value, name, rules = fitted.values[p.name], p.name, RULES.search
        low, high = intervals[name]
        near = max(min(rules.at_bound * errors[name], rules.at_end * (p.high - p.low)), rules.tolerances[1] * scale(p, value))
        apart = rules.interval * errors[name] + rules.ends_alike * abs(best.get(name, value))
        elsewhere = [{"start": e.start[name], "end": e.end[name]} for e in endings if abs(e.end[name] - best[name]) > apart]
        at_bound = felt[name] and min(value - p.low, p.high - value) < near
        found.append(Told(name, value, low, high, p.unit, at_bound, elsewhere, together.get(name, [])))
    return found


def collinear(fitted: Fit, rows: np.ndarray) -> dict[str, list[str]]:
    """Of each free value the others with which it can be changed so that the misfit hardly moves.

    Condition indices and variance proportions of the Jacobian's columns at length 1: Belsley, Kuh and Welsch (1980),
    Regression Diagnostics, chapter 3.
    """
    columns = fitted.jacobian[rows] * fitted.weights[rows, None]
    lengths = np.sqrt((columns**2).sum(0))
    felt = np.flatnonzero(lengths > 0.0)
    if len(felt) < 2:
        return {}
    _, sizes, ways = np.linalg.svd(columns[:, felt] / lengths[felt], full_matrices=False)
    sizes = np.maximum(sizes, RULES.search.singular * sizes[0])
    shares = (ways / sizes[:, None]) ** 2  # (ways, values): of each value's variance
    shares /= shares.sum(0)
    found: dict[str, set[str]] = {}
    for size, share in zip(sizes, shares):
        names = {fitted.free[i].name for i in felt[share > RULES.search.collinear_share]}
        if sizes[0] > RULES.search.collinear_index * size and len(names) > 1:
            for name in names:
                found.setdefault(name, set()).update(names - {name})
    return {name: sorted(others) for name, others in found.items()}


def correlated(fitted: Fit, rows: np.ndarray) -> list[dict]:
    """Pairs of fitted values that share more than `collinear_share` of their variance, closest first: {first, second, correlation}.

    Of the fit's own slopes, as white noise would leave it: what of one the log may as well put into the other, whatever its
    noise. rows: entries of the flat misfit that teach.
    """
    columns = fitted.jacobian[rows] * fitted.weights[rows, None]
    lengths = np.sqrt((columns**2).sum(0))
    felt = np.flatnonzero(lengths > 0.0)
    columns = columns[:, felt] / lengths[felt]
    spread = np.linalg.inv(columns.T @ columns + RULES.search.ridge * np.eye(len(felt)))
    like = spread / np.sqrt(np.outer(np.diag(spread), np.diag(spread)))
    pairs = [(i, j) for i in range(len(felt)) for j in range(i) if like[i, j] ** 2 > RULES.search.collinear_share]
    names = [fitted.free[i].name for i in felt]
    return [
        {"first": names[j], "second": names[i], "correlation": float(like[i, j])}
        for i, j in sorted(pairs, key=lambda pair: -abs(like[pair]))
    ]
