"""Free laws of a whole drive, the rivals of all causes: what a function of one variable predicts that nobody gave a name.

A cause is a law with a name and few numbers. Where a free function of some variable, simulated inside the drive like it,
predicts much more of unseen blocks, the cause is not what is missing; and where nothing is believed, it says with what goes
what is missing: by the drive, not by the error of one channel, which a loop spreads over all of them.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from ..residuals import free_law, whole
from ..rules import RULES
from .candidate import Candidate
from .fit import Fit, rho, slope, weight
from .hypotheses import Free, Hypothesis
from .problem import Problem

OVER = {
    "torque": ("speed", "load", "position", "output position", "time"),
    "friction": ("speed", "load", "position", "output position", "time"),
    "voltage": ("speed", "current", "time"),
}
"""Of what a free law at each place is a function. A torque over the current is a voltage's matter, one over the speed is both's."""

OWN = {
    "load.angle": "output position",
    "load.speed": "speed",
    "reducer.input_angle": "position",
    "reducer.input_speed": "speed",
    "motor.current": "current",
    "motor.torque": "current",
    "reducer.output_torque": "load",
    "motor.voltage": "voltage",
    "controller.voltage": "voltage",
}
"""Of what a channel's reading is a function where its sensor is not straight."""


@dataclass(frozen=True, eq=False)
class Normal:
    """Normal equations of each block that teaches: the base's columns, then a free law's, each of length 1 over all blocks."""

    gram: np.ndarray  # (blocks, k, k)
    cross: np.ndarray  # (blocks, k), with the misfit
    lengths: np.ndarray  # (k,)

    def step(self, seen: np.ndarray, amounts: np.ndarray, ridge: float) -> np.ndarray:
        """Least squares over the blocks seen, from these amounts of the free law.

        ridge: holds the heights back, as a share of what all blocks know of each, for little is known of a knot that these
        hardly meet.
        """
        first = len(self.lengths) - len(amounts)
        held = np.full(len(self.lengths), RULES.search.ridge)
        held[first:] = ridge
        pull = self.cross[seen].sum(0)
        pull[first:] += ridge * amounts * self.lengths[first:]
        return -np.linalg.solve(self.gram[seen].sum(0) + np.diag(held), pull)


def free_laws(problem: Problem, base: Fit) -> list[Candidate]:
    """The free laws that look best over the base, as candidates of the first step of a search, simulated; best first.

    The hypothesis of each says in words what it is (`effect`), and its variable (`shown_over`).
    """
    near = problem.glance(True)
    folds = problem.fold_of_block[problem.train]
    looked: dict[tuple[str, str], tuple[float, float, tuple[Free, ...]]] = {}
    for place, variable, free in _laws(problem, base.values):
        columns = _columns(near, base.values, free, np.zeros(len(free)))
        if not (np.all(np.isfinite(columns)) and np.any(columns)):
            continue
        normal = _normal(problem, base, columns, base.misfit)
        gain, ridge = max((_gain(normal, folds, len(free), ridge), ridge) for ridge in RULES.search.free_ridges)
        if gain > max(0.0, looked[place, variable][0] if (place, variable) in looked else 0.0):
            looked[place, variable] = gain, ridge, free
    most = sorted(looked.items(), key=lambda item: -item[1][0])[: RULES.search.free_fits]
    found = [
        _simulated(problem, base, f"free {place} over {variable}", variable, ridge, free)
        for (place, variable), (_, ridge, free) in most
    ]
    return sorted(found, key=lambda law: law.errors.mean())


def _columns(problem: Problem, fixed: dict, free: tuple[Free, ...], amounts: np.ndarray) -> np.ndarray:
    """How the misfit moves with each height, (blocks, samples, heights), at these amounts."""
    values = fixed | {p.name: float(a) for p, a in zip(free, amounts)}
    at = problem.misfit(values).reshape(problem.shape)
    found = []
    for p in free:
        step = RULES.search.difference * p.high
        step = -step if values[p.name] + step > p.high else step
        found.append(slope(problem.misfit({**values, p.name: values[p.name] + step}).reshape(problem.shape), at, step))
    return np.stack(found, -1)


def _normal(problem: Problem, base: Fit, columns: np.ndarray, misfit: np.ndarray) -> Normal:
    """Around a misfit, robust as its samples ask."""
    weights = weight(misfit, problem.loss_scale)
    every = np.concatenate([base.open.reshape(*problem.shape, -1), columns], -1) * weights.reshape(problem.shape)[..., None]
    every = np.nan_to_num(every)[problem.train]
    lengths = np.sqrt(np.maximum(np.einsum("bsk,bsk->k", every, every), 1e-30))
    every /= lengths
    turned = every.transpose(0, 2, 1)
    errors = problem.taught(misfit * weights)
    return Normal(turned @ every, (turned @ errors[..., None])[..., 0], lengths)


def _gain(normal: Normal, folds: np.ndarray, heights: int, ridge: float) -> float:
    """Drop of the squared misfit in each fold under the step that the others ask for, over that of the base alone."""
    numbers = len(normal.lengths) - heights
    alone = Normal(normal.gram[:, :numbers, :numbers], normal.cross[:, :numbers], normal.lengths[:numbers])
    total = 0.0
    for one, amounts, sign in ((normal, np.zeros(heights), -1.0), (alone, np.zeros(0), 1.0)):
        for fold in np.unique(folds) if len(one.lengths) else ():
            step, unseen = one.step(folds != fold, amounts, ridge), folds == fold
            total += sign * float(step @ (2.0 * one.cross[unseen].sum(0) + one.gram[unseen].sum(0) @ step))
    return total


def _simulated(problem: Problem, base: Fit, label: str, variable: str, ridge: float, free: tuple[Free, ...]) -> Candidate:
    """What a free law leaves of each fold, simulated with the heights that the others ask for: two Gauss-Newton steps."""
    every = (*base.free, *free)
    low, high = (np.array([getattr(p, end) for p in every]) for end in ("low", "high"))
    at = np.array([*(base.values[p.name] for p in base.free), *(0.0 for _ in free)])
    named = lambda x: base.values | {p.name: float(v) for p, v in zip(every, x)}
    loss = lambda misfit, rows: float(rho(misfit[rows], problem.loss_scale).sum())
    misfit, all_blocks = base.misfit, np.ones(int(problem.train.sum()), bool)

    def moved(normal: Normal, seen: np.ndarray, rows: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """The longest part of the step that helps where it was learnt, and its misfit; none where none does."""
        step = normal.step(seen, at[len(base.free) :], ridge) / normal.lengths
        for share in RULES.search.free_steps:
            there = np.clip(at + share * step, low, high)
            left = problem.misfit(named(there))
            if loss(left, rows) < loss(misfit, rows):
                return there, left
        return at, misfit

    normal = _normal(problem, base, _columns(problem, base.values, free, at[len(base.free) :]), misfit)
    at, misfit = moved(normal, all_blocks, problem.rows)
    columns = _columns(problem, named(at), free, at[len(base.free) :])
    normal, unseen = _normal(problem, base, columns, misfit), misfit.copy()
    for fold in np.unique(problem.fold_of_block[problem.train]):
        inside = problem.folds == fold
        _, left = moved(normal, problem.fold_of_block[problem.train] != fold, problem.rows & ~inside)
        unseen[inside] = left[inside]
    jacobian = np.concatenate([base.jacobian, columns.reshape(len(misfit), -1)], axis=1)
    fitted = Fit(every, named(at), misfit, jacobian, weight(misfit, problem.loss_scale), problem.by_channel)
    hypothesis = Hypothesis("drive", label, free, shown_over=variable)
    return Candidate(hypothesis, free, fitted, problem.block_loss(unseen))


def _laws(problem: Problem, fixed: dict) -> Iterator[tuple[str, str, tuple[Free, ...]]]:
    """Every free law as the heights at its knots; a height may be as much as there is of what it is added to, at most."""
    experiment = problem.experiment
    runs = [experiment.channels[i, ""] for i in problem.teaching]
    rows = [whole.simulate(problem.absolute(fixed), ch) for ch in runs]
    places = [
        (place, free_law.PLACES[place], over, "voltage" if place == "voltage" else "torque") for place, over in OVER.items()
    ]
    for residual in experiment.residuals:
        if residual.output in OWN:
            place, over = free_law.READING + residual.output, OWN[residual.output]
            places.append((place, residual.unit, (over,), whole.SHOWN[residual.output]))
    for place, unit, variables, row in places:
        most = max(float(abs(one[row]).max()) for one in rows)
        for variable in variables if most > 0.0 else ():
            for knots in _knots(np.concatenate([whole.along(variable, one, ch) for one, ch in zip(rows, runs)])):
                names = [free_law.name(place, variable, x) for x in knots]
                yield place, variable, tuple(Free(n, 0.0, -most, most, unit) for n in names)


def _knots(x: np.ndarray) -> list[np.ndarray]:
    """Knots in two ways: where samples are many and evenly over the range, and close at its ends, where stops are."""
    x = x[np.isfinite(x)]
    if not len(x) or np.ptp(x) <= RULES.judge.constant * max(1.0, float(abs(x).max())):
        return []
    few, ends = (np.quantile(x, quantiles) for quantiles in RULES.judge.knots)
    even = np.linspace(x.min(), x.max(), len(few))[1:-1]
    return [_apart(np.sort(np.append(few, even)), np.ptp(x)), _apart(ends, np.ptp(x))]


def _apart(places: np.ndarray, whole_range: float) -> np.ndarray:
    """Those of the places, ascending, that are far enough from the one before."""
    found = [places[0]]
    for place in places[1:]:
        if place - found[-1] >= RULES.search.free_apart * whole_range:
            found.append(place)
    return np.array(found)
