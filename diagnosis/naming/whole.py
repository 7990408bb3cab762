"""A model fitted to all that teaches, its errors, and which of two the data that judge ask for."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass

import numpy as np

from ..calibration.fit import End, in_units
from ..calibration.numbers import Number
from ..calibration.run import own, sizes
from ..calibration.slopes import Forward, beside
from ..residuals.mending import rms
from ..rules import RULES
from .extended import Extending, Vanishing
from .guesses import EVENT
from .work import Work


@dataclass
class Whole:
    """A model fitted to all that teaches, and its errors."""

    problem: Extending
    end: End
    values: dict[str, float]
    taught: dict[str, float] | None
    held: dict[str, float] | None
    blocks: dict[str, np.ndarray]  # of each output sums of squares and counts of the blocks that judge


def _unseen(work: Work) -> list[np.ndarray]:
    """Samples that judge, of each run; all where nothing is held out."""
    every = [np.ones(len(run), bool) for run in work.runs]
    if not work.words:
        return every
    return [every[i] if i in work.judges else every[i] & (not work.judges) & ~work.rows[i] for i in range(len(work.runs))]


def learnt(numbers: Iterable[Number]) -> dict[str, np.ndarray] | None:
    """What a fit that starts near its end knows of its slopes: they go on from step to step; None where they do not.

    Of what is bent slopes that were learnt say little: a limit of a house's radiator, alone in what it left, ended at twice its noise.
    """
    return None if any(n.name.endswith(".l") for n in numbers) else {}


def fitted(work: Work, values: dict[str, float], fixed: dict[str, float], vanishing: bool = False) -> Whole:
    """What was found so far, fitted to all that teaches, from these values on, which are near: slopes are those in steps twice as long.

    Simulated anew at each of forty steps they took the most of all time in fine ones, of which a system of six FMUs needs many.
    vanishing: as it would be in steps that vanish; its numbers are not those with which the system runs in its own.
    """
    problem = work.problem()
    known = {n.name for n in problem.numbers}
    problem.fixed |= {name: value for name, value in fixed.items() if name in known}
    places = np.array([np.clip(n.place(values.get(n.name, n.start)), 0.0, 1.0) for n in problem.free])
    sloped, effort = Forward, RULES.calibrate.effort_start
    doubled = work.in_steps(2.0) if vanishing or work.step < 0.75 * work.given_step else None
    if doubled is not None:
        longer = doubled.problem()
        longer.fixed = problem.fixed

        def moved(at: np.ndarray) -> np.ndarray | None:
            longer.units = problem.units  # which are taken anew as the fit goes on
            return longer.misfit(at)

        sloped = beside(moved)
        if vanishing:
            problem = Vanishing.of(problem, longer)
    goes_on = learnt(n for numbers in work.found for n in numbers)
    end = in_units(problem, places, effort, RULES.calibrate.ended_start, sloped, goes_on)
    whole = measured(work, problem, end, problem.values(end.places) | own(problem, work.judges, end, Forward, True))
    if doubled is not None:
        doubled.played.close()
    return whole


def measured(work: Work, problem: Extending, end: End, values: dict[str, float]) -> Whole:
    unseen = _unseen(work)
    taught = [work.rows[i] & (i not in work.judges) for i in range(len(work.runs))]
    which = [i for i, rows in enumerate(unseen) if rows.any()]
    errors = problem.errors(values, which)
    blocks: dict[str, np.ndarray] = {}
    if errors is not None:
        trusted = problem.counted(which, unseen)
        for name, parts in errors.items():
            squares = np.concatenate([e[t] ** 2 for e, t in zip(parts, trusted[name])])
            label = np.concatenate([work.layout.block(i)[t] for i, t in zip(which, trusted[name])])
            blocks[name] = np.stack([np.bincount(label, squares), np.bincount(label)], -1)[np.unique(label)]
    return Whole(problem, end, values, sizes(problem, values, taught), sizes(problem, values, unseen), blocks)


def missed(work: Work, whole: Whole) -> dict[str, float] | None:
    """By how much steps twice as long move each output on the data that judge, at a fit's values; None where a run breaks off."""
    doubled, rows = work.in_steps(2.0), _unseen(work)
    which = [i for i, one in enumerate(rows) if one.any()]
    problem = work.problem()
    fine, twice = (one.errors(whole.values, which) for one in (problem, doubled.problem()))
    doubled.played.close()
    if fine is None or twice is None:
        return None
    trusted = problem.counted(which, rows)
    return {name: rms([(a - b)[t] for a, b, t in zip(fine[name], twice[name], trusted[name])]) for name in fine}


def helps(after: Whole, before: Whole, kind: str = "") -> bool:
    """Whether some output's error on the data that judge falls by enough; an event's on its own run, where it was."""
    new, old = (after.taught, before.taught) if kind == EVENT else (after.held, before.held)
    return falls(new, old)


def falls(new: dict[str, float] | None, old: dict[str, float] | None) -> bool:
    """Whether some output's error is less by as much as a cause must lower it; what breaks off leaves more than any."""
    if new is None or old is None:
        return new is not None
    return any(new[name] < (1.0 - RULES.judge.help) * old[name] for name in new)
