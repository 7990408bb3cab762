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
    best: dict[tuple[str, str], Direction] = {}
    for place, variable, free in _laws(problem, fixed):
        none = {p.name: 0.0 for p in free}
        moved = lambda p, none=none: near.misfit({**fixed, **none, p.name: RULES.search.difference * p.high}).reshape(near.shape)
        columns = np.stack([slope(moved(p), at, RULES.search.difference * p.high) for p in free], -1)
        if not (np.all(np.isfinite(columns)) and np.any(columns)):
            continue
        way = Direction(Hypothesis("drive", f"free {place} over {variable}", free, shown_over=variable), {}, free, columns)
        way.columns = way.columns[problem.train]
        linear.look(way, errors)
        if way.gain > max(0.0, best[place, variable].gain if (place, variable) in best else 0.0):
            best[place, variable] = way
    most = sorted(best.items(), key=lambda item: -item[1].gain)[: RULES.search.free_fits]
    found = [FreeLaw(place, variable, _fitted(problem, base, way)) for (place, variable), way in most]
    return sorted(found, key=lambda law: law.candidate.errors.mean())


def _fitted(problem: Problem, base: Fit, way: Direction) -> Candidate:
    """The fit of a free law, begun at what the linear look says."""
    free = (*base.free, *way.free)
    fitted = problem.fit(free, base.values | way.start(), RULES.search.effort_begin)
    losses = problem.block_loss(problem.held_out(fitted))
    return Candidate(way.hypothesis, way.free, fitted, losses, linear=way.gain)


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
