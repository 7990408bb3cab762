"""A model fitted to all that teaches, its errors, and which of two the data that judge ask for."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ..calibration.fit import End, in_units
from ..calibration.run import own, sizes
from ..calibration.slopes import Forward
from ..rules import RULES
from .extended import Extending
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


def fitted(work: Work, values: dict[str, float], fixed: dict[str, float]) -> Whole:
    """What was found so far, fitted to all that teaches, from these values on, which are near: slopes of there go on from step to step.

    Simulated anew at each of forty steps they took the most of all time in fine steps, of which a system of six FMUs needs many. Of
    what is bent slopes that were learnt say little: a limit of a house's radiator, alone in what it left, ended at twice its noise.
    """
    problem = work.problem()
    known = {n.name for n in problem.numbers}
    problem.fixed |= {name: value for name, value in fixed.items() if name in known}
    places = np.array([np.clip(n.place(values.get(n.name, n.start)), 0.0, 1.0) for n in problem.free])
    bends = any(n.name.endswith(".l") for numbers in work.found for n in numbers)
    end = in_units(problem, places, RULES.calibrate.effort_start, RULES.calibrate.ended_start, Forward, None if bends else {})
    return measured(work, problem, end, problem.values(end.places) | own(problem, work.judges, end))


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


def helps(after: Whole, before: Whole, kind: str = "") -> bool:
    """Whether some output's error on the data that judge falls by enough; an event's on its own run, where it was."""
    new, old = (after.taught, before.taught) if kind == EVENT else (after.held, before.held)
    return falls(new, old)


def falls(new: dict[str, float] | None, old: dict[str, float] | None) -> bool:
    """Whether some output's error is less by as much as a cause must lower it; what breaks off leaves more than any."""
    if new is None or old is None:
        return new is not None
    return any(new[name] < (1.0 - RULES.judge.help) * old[name] for name in new)
