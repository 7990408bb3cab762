"""Fitting a few parameters of a simulation to measured blocks, and judging a fit on blocks it did not see.

A misfit is (measured - simulated) / noise, one entry for each trusted sample, 0 where data are masked. Fits minimise
the sum of rho(r) = 2 c^2 (sqrt(1 + (r/c)^2) - 1), which is r^2 for small r and grows like |r| beyond c, so that a few
wild samples cannot pull a fit (scipy's soft_l1).
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np
from scipy.optimize import least_squares

from ..rules import RULES
from .hypotheses import Free

Misfit = Callable[[dict[str, float]], np.ndarray]


@dataclass
class Fit:
    """Parameters that fit the training samples best, and what the simulation leaves there and elsewhere."""

    free: tuple[Free, ...]
    values: dict[str, float]  # of the free parameters
    misfit: np.ndarray  # at all samples
    jacobian: np.ndarray  # d misfit / d value
    weights: np.ndarray  # of the robust loss, sqrt: 1 where the misfit is small
    by_channel: bool = False  # of a whole drive, compared in all its channels

    def covariance(self, rows: np.ndarray, blocks: np.ndarray) -> np.ndarray:
        """Of the free values, by the sandwich over blocks, so that correlated noise does not make it too small."""
        weighted = self.jacobian[rows] * self.weights[rows, None]
        lengths = np.sqrt(np.maximum((weighted**2).sum(0), 1e-300))
        weighted = weighted / lengths
        errors = self.misfit[rows] * self.weights[rows]
        bread = np.linalg.pinv(weighted.T @ weighted, rcond=RULES.search.singular)
        labels, places = np.unique(blocks[rows], return_inverse=True)
        scores = np.zeros((len(labels), len(self.free)))
        np.add.at(scores, places, weighted * errors[:, None])
        meat = scores.T @ scores * len(labels) / max(1, len(labels) - len(self.free))
        return bread @ meat @ bread / np.outer(lengths, lengths)

    @property
    def open(self) -> np.ndarray:
        """The Jacobian without what cannot move: columns of what recorders did, at the end of its range, are 0."""
        near = RULES.search.at_end
        ends = [
            p.of_recorder and min(self.values[p.name] - p.low, p.high - self.values[p.name]) < near * (p.high - p.low)
            for p in self.free
        ]
        return np.where(ends, 0.0, self.jacobian) if self.free else self.jacobian

    def intervals(
        self, rows: np.ndarray, blocks: np.ndarray, level: float = RULES.search.interval
    ) -> dict[str, tuple[float, float]]:
        """95 % intervals, no wider than the bounds; the bounds of what is not felt: it may as well be anything there."""
        if not self.free:
            return {}
        spread, felt = level * np.sqrt(np.maximum(np.diag(self.covariance(rows, blocks)), 0.0)), self.felt(rows)
        of = lambda p, s: (max(p.low, self.values[p.name] - s), min(p.high, self.values[p.name] + s))
        return {p.name: of(p, s) if felt[p.name] else (p.low, p.high) for p, s in zip(self.free, spread)}

    def felt(self, rows: np.ndarray) -> dict[str, bool]:
        """Whether a value changes anything where it ended; what acts in steps has no slope, and is felt by being there."""
        return {
            p.name: bool(np.any(column[rows])) or self.values[p.name] in p.trials for p, column in zip(self.free, self.jacobian.T)
        }


def weight(misfit: np.ndarray, c: float) -> np.ndarray:
    """Square root of the weight that rho gives a sample."""
    return (1.0 + (misfit / c) ** 2) ** -0.25


def rho(misfit: np.ndarray, c: float) -> np.ndarray:
    """The robust loss of each sample."""
    return 2.0 * c * c * (np.sqrt(1.0 + (misfit / c) ** 2) - 1.0)


def scale(free: Free, value: float) -> float:
    """A length on which this parameter matters."""
    if free.length:
        return free.length
    reach = [abs(value), abs(free.nominal)]
    if np.isfinite(free.high - free.low):
        reach.append(RULES.search.range_scale * (free.high - free.low))
    return max(reach) or 1.0


def change(moved: np.ndarray, at: np.ndarray) -> np.ndarray:
    """How a misfit moves; 0 where no samples are trusted before or after: a sensor's bias can make rest of motion."""
    return np.where((moved == 0.0) | (at == 0.0), 0.0, moved - at)


def slope(moved: np.ndarray, at: np.ndarray, step: float) -> np.ndarray:
    """d misfit / d value by a finite step."""
    return change(moved, at) / step


def jacobian(
    misfit: Misfit,
    fixed: dict,
    free: Sequence[Free],
    values: dict,
    at: np.ndarray,
    rows: np.ndarray | slice = slice(None),
    lengths: np.ndarray | None = None,
) -> np.ndarray:
    """Forward differences, inside the bounds; of these `rows`, over these lengths of the values (1)."""
    found = np.zeros((len(at[rows]), len(free)))
    beside = _beside(misfit, fixed, [p for p in free if p.part], values)
    # what a recorder did first, while the motion that it read is remembered
    for number, parameter in sorted(enumerate(free), key=lambda one: not one[1].of_recorder):
        value = values[parameter.name]
        if value in parameter.trials:  # what acts in steps has no slope that is worth following
            continue
        step = _difference(parameter, value)
        if parameter.part:
            first, last = parameter.part
            column = np.zeros(len(at))
            column[first:last] = slope(beside[parameter.name][first:last], at[first:last], step)
        else:
            column = slope(misfit({**fixed, **values, parameter.name: value + step}), at, step)
        found[:, number] = column[rows] if lengths is None else column[rows] * lengths[number]
    return found


def _difference(parameter: Free, value: float) -> float:
    """By how much a value is moved for a derivative."""
    step = RULES.search.difference * scale(parameter, value)
    return -step if value + step > parameter.high else step


def _beside(misfit: Misfit, fixed: dict, free: Sequence[Free], values: dict) -> dict[str, np.ndarray]:
    """Misfits with each of these moved: together, where none has to do with the parts of the others."""
    groups: list[list[Free]] = []
    for p in free:
        apart = lambda group, p=p: all(q.part[1] <= p.part[0] or p.part[1] <= q.part[0] for q in group)
        group = next((group for group in groups if apart(group)), None)
        groups.append([p]) if group is None else group.append(p)
    found: dict[str, np.ndarray] = {}
    for group in groups:
        moved = misfit({**fixed, **values, **{p.name: values[p.name] + _difference(p, values[p.name]) for p in group}})
        found |= {p.name: moved for p in group}
    return found


def fit(
    misfit: Misfit,
    fixed: dict,
    free: Sequence[Free],
    start: dict,
    rows: np.ndarray,
    c: float,
    effort: int = RULES.search.effort,
    tolerances: tuple[float, float] = RULES.search.tolerances,
    by_channel: bool = False,
) -> Fit:
    """Least squares over `rows` from `start`, within the bounds, robust beyond c.

    tolerances: of the loss, and of the values. by_channel: of a whole drive, compared in all its channels.
    """
    free = tuple(free)
    values, r = ended(misfit, fixed, free, start, rows, c, effort, tolerances, by_channel)
    return Fit(free, values, r, jacobian(misfit, fixed, free, values, r), weight(r, c), by_channel)


def ended(
    misfit: Misfit,
    fixed: dict,
    free: Sequence[Free],
    start: dict,
    rows: np.ndarray,
    c: float,
    effort: int,
    tolerances: tuple[float, float],
    by_channel: bool,
) -> tuple[dict[str, float], np.ndarray]:
    """Where a fit ends, and the misfit there: all of `fit` for those who ask for no slopes."""
    if not free:
        return {}, misfit(fixed)
    start = {p.name: start[p.name] if np.isfinite(start[p.name]) else p.nominal for p in free}
    low = np.array([p.low for p in free])
    high = np.array([p.high for p in free])
    lengths = np.array([scale(p, start[p.name]) for p in free])
    inside = np.minimum(np.maximum([start[p.name] for p in free], low), high)
    tiny = RULES.search.inside * lengths
    origin = np.clip(inside, low + np.minimum(tiny, (high - low) / 4), high - np.minimum(tiny, (high - low) / 4))
    known: dict[bytes, np.ndarray] = {}
    places = np.flatnonzero(rows)  # a mask would be looked through each time

    # of a whole drive from 1 on: from 0 on the solver's first step has no length; elsewhere rules were made without that
    zero = origin - lengths if by_channel else np.zeros(len(free))

    def named(x):
        return {p.name: float(v) for p, v in zip(free, np.clip(zero + x * lengths, low, high))}

    def value(x):
        key = x.tobytes()
        if key not in known:
            known.clear()
            known[key] = misfit({**fixed, **named(x)})
        return known[key]

    least, most = (low - zero) / lengths, (high - zero) / lengths
    found = least_squares(
        lambda x: value(x)[places],
        np.clip((origin - zero) / lengths, np.nextafter(least, np.inf), np.nextafter(most, -np.inf)),
        jac=lambda x: jacobian(misfit, fixed, free, named(x), value(x), places, lengths),
        bounds=(least, most),
        loss="soft_l1" if np.isfinite(c) else "linear",
        f_scale=c if np.isfinite(c) else 1.0,
        max_nfev=effort,
        ftol=tolerances[0],
        xtol=tolerances[1],
        gtol=RULES.search.flat,
    )
    return named(found.x), value(found.x)


def held_out(fitted: Fit, rows: np.ndarray, folds: np.ndarray, misfit: Misfit | None = None, c: float = np.inf) -> np.ndarray:
    """Misfit of each training fold under the fit to the other folds; other samples keep the fit's own misfit.

    The fit to the other folds is one Gauss-Newton step away from the fit to all, which is exact where the
    simulation is linear in its parameters and close to it where blocks are many. Where it is far from linear, as that
    of a whole drive, give its `misfit` and where the robust loss turns: steps more and more damped are then tried,
    until one fits the other folds better than the fit itself does.
    """
    out = fitted.misfit.copy()
    if not fitted.free:
        return out
    slopes = fitted.open
    weighted = slopes * fitted.weights[:, None]
    errors = fitted.misfit * fitted.weights
    lengths = np.sqrt((weighted[rows] ** 2).sum(axis=0))
    lengths[lengths == 0.0] = 1.0
    weighted = weighted / lengths
    for fold in np.unique(folds[rows]):
        seen = rows & (folds != fold)
        unseen = rows & (folds == fold)
        here = np.flatnonzero(seen)
        columns = weighted.take(here, 0)
        others = columns.copy()  # of two arrays BLAS adds up in another order than of one
        gram, pull = columns.T @ others, columns.T @ errors.take(here)
        low = np.array([p.low - fitted.values[p.name] for p in fitted.free]) * lengths
        high = np.array([p.high - fitted.values[p.name] for p in fitted.free]) * lengths
        steps = [
            np.clip(-np.linalg.solve(gram + damping * np.eye(len(gram)), pull), low, high) / lengths
            for damping in (RULES.search.dampings if misfit else RULES.search.dampings[:1])
        ]
        if misfit is None:
            out[unseen] = fitted.misfit[unseen] + slopes[unseen] @ steps[0]
            continue
        moved = [{p.name: fitted.values[p.name] + float(x) for p, x in zip(fitted.free, step)} for step in steps]
        before = rho(fitted.misfit[seen], c).sum()
        better = (r for r in map(misfit, moved) if rho(r[seen], c).sum() < before)
        out[unseen] = next(better, fitted.misfit)[unseen]
    return out
