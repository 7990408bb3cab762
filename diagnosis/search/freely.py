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
from .fit import Fit, slope
from .hypotheses import Free, Hypothesis
from .linear import Linear
from .problem import Problem
from .screen import Direction

OVER = {
    "torque": ("speed", "load", "position", "output position", "time"),
    "friction": ("speed", "load", "position", "output position", "time"),
    "voltage": ("speed", "current", "time"),
}
"""Of what a free law at each place is a function. A torque over the current is a voltage's matter, one over the speed is both's."""

ROWS = {"speed": "input_speed", "load": "output_torque", "output position": "angle", "current": "current"}
"""Of a simulation (residuals.forward.ROWS); the others are made of them."""


@dataclass(frozen=True)
class FreeLaw:
    """A free law that was fitted, as a candidate of the first step of a search."""

    place: str
    variable: str
    candidate: Candidate

    @property
    def label(self) -> str:
        """In words."""
        return self.candidate.hypothesis.effect


def free_laws(problem: Problem, base: Fit) -> list[FreeLaw]:
    """The free laws that look best over the base, fitted; best first."""
    near = problem.glance(True)
    fixed = dict(base.values)
    at = near.misfit(fixed).reshape(near.shape)
    linear = Linear(
        base.open.reshape(*problem.shape, -1)[problem.train],
        problem.taught(base.weights),
        problem.fold_of_block[problem.train],
        problem.experiment.layout.run_of[problem.train],
    )
    errors = linear.draws(problem.taught(base.misfit * base.weights))
    ways = []
    for place, variable, free in _laws(problem, fixed):
        none = {p.name: 0.0 for p in free}
        columns = []
        for p in free:
            step = RULES.search.difference * p.high
            columns.append(slope(near.misfit({**fixed, **none, p.name: step}).reshape(near.shape), at, step))
        stacked = np.stack(columns, -1)
        if not (np.all(np.isfinite(stacked)) and np.any(stacked)):
            continue
        hypothesis = Hypothesis("drive", f"free {place} over {variable}", free, shown_over=variable)
        way = Direction(hypothesis, {}, free, stacked)
        way.columns = way.columns[problem.train]
        linear.look(way, errors)
        ways.append((place, variable, way))
    best = sorted((way for way in ways if way[2].gain > 0.0), key=lambda way: -way[2].gain)[: RULES.search.free_fits]
    found = [FreeLaw(place, variable, _fitted(problem, base, way)) for place, variable, way in best]
    return sorted(found, key=lambda law: law.candidate.errors.mean())


def _fitted(problem: Problem, base: Fit, way: Direction) -> Candidate:
    """The fit of a free law, begun at what the linear look says."""
    free = (*base.free, *way.free)
    fitted = problem.fit(free, base.values | way.start(), RULES.search.effort_begin)
    losses = problem.block_loss(problem.held_out(fitted))
    return Candidate(way.hypothesis, way.free, fitted, losses, linear=way.gain)


def _laws(problem: Problem, fixed: dict) -> Iterator[tuple[str, str, tuple[Free, ...]]]:
    """Every free law as the heights at its knots; a height may be as much as the motor gives, or is given, at most."""
    experiment = problem.experiment
    runs = [experiment.channels[i, ""] for i in problem.teaching]
    rows = [whole.simulate(problem.absolute(fixed), ch) for ch in runs]
    for place, variables in OVER.items():
        row = "voltage" if place == "voltage" else "torque"
        most = max(float(abs(one[row]).max()) for one in rows)
        for variable in variables:
            knots = _knots(np.concatenate([_along(variable, one, ch) for one, ch in zip(rows, runs)]))
            if len(knots) > 2 and most > 0.0:
                names = [free_law.name(place, variable, x) for x in knots]
                yield place, variable, tuple(Free(n, 0.0, -most, most, free_law.PLACES[place]) for n in names)


def _along(variable: str, rows: dict[str, np.ndarray], ch) -> np.ndarray:
    """A variable along a simulation."""
    if variable == "time":
        return whole.grid(ch).time
    if variable == "position":
        return rows["input_angle"] % (2.0 * np.pi)
    return rows[ROWS[variable]]


def _knots(x: np.ndarray) -> np.ndarray:
    """Places where there is something to learn: where samples are many, and evenly over the range."""
    x = x[np.isfinite(x)]
    count = RULES.search.free_knots
    if not len(x) or np.ptp(x) <= RULES.judge.constant * max(1.0, float(abs(x).max())):
        return np.zeros(0)
    many = np.quantile(x, np.linspace(0.0, 1.0, count))
    places = np.sort(np.concatenate([many, np.linspace(x.min(), x.max(), count)[1:-1]]))
    least = np.ptp(x) / (RULES.search.free_apart * count)
    found = [places[0]]
    for place in places[1:]:
        if place - found[-1] >= least:
            found.append(place)
    return np.array(found)
