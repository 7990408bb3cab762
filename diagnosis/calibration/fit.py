"""One calibration: numbers fitted to runs from several starts, robustly, each channel in units of its own.

At first a channel's unit is its spread: far from the answer nothing else is known. From the best end the fit goes on with
what remains of a channel as its unit (the deviation that its usual error tells, no less than its noise), taken anew
some times: the likeliest values where each channel has an error of an unknown size. The loss is that of all fits of the
diagnosis (search.fit): squares up to some units, beyond that like the size, so that few wild samples pull nothing.

A simulation that breaks off is a point without any worth: the solver takes a shorter step from where it was.
"""

from __future__ import annotations

import hashlib
import json
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property
from typing import Any, ClassVar

import numpy as np
from scipy.optimize import least_squares

from ..data.log import MeasuredRun
from ..data.rig import Rig
from ..data.values import resolution
from ..residuals.noise import of_samples
from ..rules import RULES
from ..search.fit import rho
from ..search.kept import Kept
from ..systems.parts import Parts
from .numbers import Number
from .played import Effort, Played, Settings
from .slopes import Forward, Learnt, Slopes

Rows = dict[str, list[np.ndarray]]
"""Which samples count, of each output, in each run that is simulated."""


@dataclass
class Calibrating:
    """What a fit needs, as plain data that can travel to other processes; the system is played where it is first asked."""

    rig: Rig
    runs: list[MeasuredRun]
    numbers: tuple[Number, ...]
    which: list[int]  # runs that teach
    rows: list[np.ndarray]  # of each run, samples that may count
    fixed: dict[str, float] = field(default_factory=dict)  # by name, of numbers that are not fitted
    units: dict[str, float] = field(default_factory=dict)  # of each output
    kept: Kept | None = None  # where fits are kept
    every: ClassVar[bool] = False  # whether noise is told by all changes from row to row, and not by their median alone

    def __getstate__(self) -> dict[str, Any]:
        return {name: value for name, value in vars(self).items() if name != "played"}

    @cached_property
    def played(self) -> Played:
        return Played(self.rig, Parts(self.rig), self.runs, self.numbers)

    def open(self, folder: Any) -> None: ...

    def hear(self, runs: list[MeasuredRun]) -> None:
        """From now on the system is played on these runs, in which more is given to it."""
        before = self.played
        self.runs = runs
        vars(self)["played"] = now = Played(self.rig, before.parts, runs, self.numbers)
        now.effort, now.reusable, now.notes = before.effort, before.reusable, before.notes
        before.close()

    def close(self) -> None:
        if "played" in vars(self):
            self.played.close()

    @property
    def free(self) -> list[Number]:
        return [number for number in self.numbers if number.name not in self.fixed]

    def values(self, places: np.ndarray) -> dict[str, float]:
        """All numbers by name, at these places of the free ones."""
        return self.fixed | {number.name: number.at(place) for number, place in zip(self.free, places)}

    def settings(self, values: dict[str, float]) -> list[Settings]:
        """What is set in each run."""
        return [
            {n.variable: values[n.name] for n in self.numbers if n.name in values and n.run in (None, i)}
            for i in range(len(self.runs))
        ]

    def errors(self, values: dict[str, float], which: Sequence[int] | None = None) -> Rows | None:
        return self.played.errors(self.settings(values), self.which if which is None else which)

    @cached_property
    def trusted(self) -> Rows:
        return self.counted(self.which, self.rows)

    def counted(self, which: Sequence[int], rows: Sequence[np.ndarray]) -> Rows:
        """Which samples of these count in these runs."""
        return {
            name: [good & rows[i] for i, good in zip(which, self.played.trusted(name, which))] for name in self.played.outputs
        }

    def misfit(self, places: np.ndarray) -> np.ndarray | None:
        """Errors in units, one after the other; None where a run broke off."""
        errors = self.errors(self.values(places))
        if errors is None:
            return None
        return np.concatenate([e[t] / self.units[name] for name in errors for e, t in zip(errors[name], self.trusted[name])])

    def measured(self, name: str) -> np.ndarray:
        """What was measured of an output where it counts, of all runs."""
        return np.concatenate([self.runs[i].signals[name][t] for i, t in zip(self.which, self.trusted[name])])

    def floor(self, name: str, errors: list[np.ndarray], quantum: float = 0.0) -> float:
        """Noise of an output, in its unit, by its errors in the runs that teach. quantum: resolution of what was recorded."""
        return float(of_samples(errors, self.trusted[name], 1, quantum, self.every))

    def loss(self, misfit: np.ndarray | None) -> float:
        return np.inf if misfit is None else float(rho(misfit, RULES.search.loss_scale).sum())

    def begins(self) -> list[Any]:
        """What decides a fit beside the misfit where it begins."""
        return [self.numbers, self.which, [rows.tobytes() for rows in self.rows], sorted(self.fixed.items()), self.units]

    def blocks(self, of_run: Sequence[np.ndarray]) -> np.ndarray:
        """The label of each entry of a misfit, from those of each run's samples."""
        return np.concatenate([of_run[i][t] for name in self.played.outputs for i, t in zip(self.which, self.trusted[name])])


@dataclass
class End:
    """Where a fit from a start ended."""

    start: np.ndarray
    places: np.ndarray
    loss: float
    misfit: np.ndarray | None = None
    jacobian: np.ndarray | None = None  # d misfit / d place


def spreads(played: Played) -> dict[str, float]:
    """The units of the first fits."""
    return {name: played.spread(name) or 1.0 for name in played.outputs}


def remaining(problem: Calibrating, values: dict[str, float]) -> dict[str, tuple[float, float]]:
    """Of each output what its usual error tells as a deviation, and its noise."""
    errors, found = problem.errors(values), {}
    assert errors is not None, "of an end of a fit, which was simulated"
    for name, parts in errors.items():
        trusted = problem.trusted[name]
        noise = problem.floor(name, parts, resolution(problem.measured(name)))
        joined = np.concatenate([e[t] for e, t in zip(parts, trusted)])
        usual = float(np.median(abs(joined))) / RULES.residuals.normal_median if len(joined) else 0.0
        found[name] = usual, noise
    return found


def fit_from(
    problem: Calibrating,
    start: np.ndarray,
    effort: int,
    ended: tuple[float, float] = RULES.calibrate.ended,
    sloped: type[Slopes] | type[Forward] = Slopes,
    known: Mapping[str, np.ndarray] | None = None,
) -> End:
    """Least squares from a start, in places of ranges; an infinite loss where the start itself breaks off.

    known: slopes of numbers by name, from which on they are learnt from the fit's own steps; those of others by `sloped`.

    A fit that is kept is taken from there, with what it took.
    """
    at = problem.misfit(start)
    if at is None or not problem.free:
        return End(start, start, problem.loss(at), at, None if at is None else np.zeros((len(at), 0)))
    if problem.kept is None:
        return _squares(problem, start, at, effort, ended, sloped, known)
    took = problem.played.effort
    key = problem.kept.key(at, start.tobytes(), problem.begins(), effort, ended, sloped.__name__, _told(known))
    if found := problem.kept.get(key):
        took.add(Effort.of(json.loads(str(found["effort"]))))
        end = End(start, found["places"], float(found["loss"]), found["misfit"], found["jacobian"])
    else:
        before = replace(took, failed=took.failed.copy())
        end = _squares(problem, start, at, effort, ended, sloped, known)
        told = json.dumps(took.since(before).plain())
        problem.kept.put(key, places=end.places, loss=end.loss, misfit=end.misfit, jacobian=end.jacobian, effort=told)
    problem.played.forget()  # so that what comes next is simulated as often, whether the fit was kept or made
    return end


def _told(known: Mapping[str, np.ndarray] | None) -> str:
    """Slopes known beforehand, as what decides a fit."""
    return "" if known is None else hashlib.sha256(b"".join(x.tobytes() for x in known.values())).hexdigest()


def _squares(
    problem: Calibrating,
    start: np.ndarray,
    at: np.ndarray,
    effort: int,
    ended: tuple[float, float],
    sloped: type[Slopes] | type[Forward],
    known: Mapping[str, np.ndarray] | None,
) -> End:
    free = problem.free
    sides = sloped(problem.misfit, free)
    slopes = sides if known is None else Learnt(sides, known)
    seen = {start.tobytes(): at}

    def value(x: np.ndarray) -> np.ndarray:
        key = x.tobytes()
        if key not in seen:
            found = problem.misfit(x)
            seen.clear()
            seen[key] = np.full(len(at), np.inf) if found is None else found
        return seen[key]

    last: dict[bytes, np.ndarray] = {}  # slopes where they were taken last, which is mostly where the fit ends
    # The solver is given copies of both: it weighs them by the loss, in place.

    def slope(x: np.ndarray) -> np.ndarray:
        last.clear()
        last[x.tobytes()] = slopes(x, value(x))
        return last[x.tobytes()].copy()

    edge = RULES.search.inside
    found = least_squares(
        lambda x: value(x).copy(),
        np.clip(start, edge, 1.0 - edge),
        jac=slope,
        bounds=(0.0, 1.0),
        x_scale="jac",
        loss="soft_l1",
        f_scale=RULES.search.loss_scale,
        max_nfev=effort,
        ftol=ended[0],
        xtol=ended[1],
        gtol=None,
    )
    places = _settled(problem, found.x, problem.loss(value(found.x)))
    misfit = value(places)
    jacobian = last[places.tobytes()] if places.tobytes() in last else slopes(places, misfit)
    return End(start, places, problem.loss(misfit), misfit, jacobian)


def _settled(problem: Calibrating, places: np.ndarray, loss: float) -> np.ndarray:
    """Numbers near an end of their range put there, where that is no worse: a solver inside its bounds never arrives."""
    for j in range(len(places)):
        end = float(round(places[j]))
        if 0.0 < abs(places[j] - end) < RULES.calibrate.bound:
            moved = places.copy()
            moved[j] = end
            if problem.loss(problem.misfit(moved)) <= loss * (1.0 + RULES.search.tolerances[0]):
                places = moved
    return places


def from_start(problem: Calibrating, item: dict[str, Any]) -> dict[str, Any]:
    """A fit from a start as plain data in and out, with what it took, for whatever spreads fits over processes."""
    before = problem.played.effort
    problem.played.effort = mine = Effort()
    try:
        end = fit_from(problem, np.array(item["places"]), item["effort"], RULES.calibrate.ended_start)
    finally:
        problem.played.effort = before
    return {"places": end.places.tolist(), "loss": end.loss, "effort": mine.plain()}


def scattered(problem: Calibrating, seed: int) -> np.ndarray:
    """Points of all ranges, evenly scattered: Sobol's, scrambled."""
    from scipy.stats import qmc  # a second to load, for those who scatter

    return qmc.Sobol(max(1, len(problem.free)), seed=seed).random(RULES.calibrate.scattered)


def fit(
    problem: Calibrating, origin: np.ndarray, starts: int, seed: int, spread: Callable, tell: Callable[[str, float], None]
) -> list[End]:
    """Fits from the start given and from the best of the scattered points, best end first. Units are the spreads."""
    rules = RULES.calibrate
    problem.units = spreads(problem.played)
    begins = [origin]
    if problem.free and starts > 1:
        points = scattered(problem, seed)
        losses = []
        for k, point in enumerate(points):
            losses.append(problem.loss(problem.misfit(point)))
            tell("looking where to start", 0.3 * (k + 1) / len(points))
        order = [k for k in np.argsort(losses, kind="stable") if np.isfinite(losses[k])]
        begins += [points[k] for k in order[: starts - 1]]
    items = [{"places": [float(p) for p in begin], "effort": rules.effort_start} for begin in begins]
    rows = spread(from_start, items, problem)
    ends = []
    for begin, row in zip(begins, rows):
        if row.get("status", "ok") != "ok":
            continue
        problem.played.effort.add(Effort.of(row["effort"]))
        ends.append(End(begin, np.array(row["places"]), float(row["loss"])))
    return sorted(ends, key=lambda end: end.loss)


def polished(problem: Calibrating, end: End) -> End:
    """The fit from an end on, in units of what remains of each channel."""
    origin, start = end.start, end.places
    for _ in range(RULES.calibrate.rounds):
        problem.units = units(problem, problem.values(start))
        end = fit_from(problem, start, RULES.calibrate.effort_end)
        start = end.places
    return End(origin, end.places, end.loss, end.misfit, end.jacobian)


def in_units(
    problem: Calibrating,
    start: np.ndarray,
    effort: int,
    ended: tuple[float, float],
    sloped: type[Slopes] | type[Forward] = Slopes,
    known: Mapping[str, np.ndarray] | None = None,
) -> End:
    """The fit from a start in units of what remains, taken anew where the fit leaves less: far from an end they say nothing of it.

    An output that the start is far off has next to no weight, beside the others' noise. Where the start breaks off there is no fit.
    """
    if problem.errors(problem.values(start)) is None:
        problem.units = spreads(problem.played)
        return End(start, start, np.inf)
    for _ in range(RULES.calibrate.rounds):
        problem.units = units(problem, problem.values(start))
        end = fit_from(problem, start, effort, ended, sloped, known)
        left = units(problem, problem.values(end.places))
        if all(left[name] >= (1.0 - RULES.search.matters) * size for name, size in problem.units.items()):
            break
        start = end.places
    return end


def units(problem: Calibrating, values: dict[str, float]) -> dict[str, float]:
    """What remains of each output, no less than its noise, and no less than any error that matters."""
    least = {name: RULES.pipeline.fine * size for name, size in spreads(problem.played).items()}
    return {name: max(usual, noise, least[name]) for name, (usual, noise) in remaining(problem, values).items()}
