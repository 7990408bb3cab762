"""When outputs were read: in the row of an input that they follow at once, which a step answers at its end, or beside their rows' times."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np
from scipy.optimize import minimize_scalar

from ..calibration.fit import Calibrating
from ..calibration.heard import a_row_on
from ..residuals.mending import rms
from ..rules import RULES
from .asked import Model, leaves_less
from .whole import Whole, fitted, helps
from .work import Work

if TYPE_CHECKING:
    from .run import Search


def followed(problem: Calibrating, values: dict[str, float]) -> dict[str, tuple[float, float]]:
    """Of such outputs the error beside what the model computes for its row, and beside that for the next, which leaves less.

    Seen in how errors change from row to row: where an input jumps the output's jump is there, and in the model a row later. What
    else is missing changes slowly beside that. Less than half of what is beyond the noise must be left.
    """
    errors, found = problem.errors(values) or {}, {}
    for name, parts in errors.items():
        variable = problem.played.parts.variables[name]
        if variable.depends_on == () or variable.initial in ("exact", "approx"):
            continue  # a state, or what follows no input
        trusted = problem.trusted[name]
        here, later = [], []
        for i, e, good in zip(problem.which, parts, trusted):
            measured = problem.runs[i].signals[name]
            both = good[:-1] & good[1:]
            here.append(e[:-1][both])
            later.append(a_row_on(measured, e)[both])
        noise, now, then = problem.floor(name, parts), rms(here), rms(later)
        jumps = [rms([np.diff(e) for e in one]) ** 2 - 2.0 * noise**2 for one in (here, later)]
        if now > RULES.search.clean * noise and then < now and jumps[1] < 0.5 * jumps[0]:
            found[name] = now, then
    return found


def told_early(found: dict[str, tuple[float, float]]) -> list[str]:
    """What is to be told of these outputs."""
    return [
        f"{name} was read in the row of an input that it follows at once: it is compared with what the model computes in the next "
        f"step ({now:.3g} -> {then:.3g})"
        for name, (now, then) in found.items()
    ]


def read_late(found: Search) -> Model | None:
    """The base as it is where outputs were read late or early; None where that leaves more than all that was found, or as much as before."""
    if not found.named and found.leaves_noise():
        return None
    work, base = _read_late(found.begins, found.base)
    kind = next((one.winner.guess.kind for one in found.named if one.winner), "")
    if not helps(base, found.base) or leaves_less((found.work, found.best), (work, base), kind):
        return None
    return work, base


def _read_late(work: Work, whole: Whole) -> Model:
    """The same model where each output was read later than its rows say, or earlier, by what leaves least: within a row of the log.

    A recorder reads while its row passes, and stamps what it has with the row's time. What a model follows is no other for that, so
    that the times are fitted to a run that is simulated once, and the model's numbers to them, in turn.
    """
    work = replace(work, played=work.played_on(work.parts, work.runs, work.numbers))
    work.played.extend(work.inserts)
    for _ in range(RULES.naming.read_again):
        settings = whole.problem.settings(whole.values)
        runs = {i: work.played.steps(settings, i) for i in work.which}
        outputs = {i: run[0] for i, run in runs.items() if run is not None}
        work.read_late({name: by for name in work.played.outputs if (by := _late(work, name, outputs))})
        whole = fitted(work, whole.values, whole.problem.fixed)
    return work, whole


def _late(work: Work, name: str, outputs: dict[int, dict[str, np.ndarray]]) -> float:
    """By how much later an output was read than its rows say, s; 0 where that leaves as much."""
    played, step, known = work.played, work.step, work.played.late.get(name, 0.0)
    trusted = dict(zip(outputs, played.trusted(name, [*outputs])))
    row = min((float(np.median(np.diff(work.runs[i].time))) for i in outputs), default=0.0)

    def left(late: float) -> float:
        total = 0.0
        for i, one in outputs.items():
            simulated = np.interp(played.times(i, name) - known + late, step * np.arange(len(one[name])), one[name])
            total += float(np.sum((work.runs[i].signals[name] - simulated)[trusted[i] & work.rows[i]] ** 2))
        return total

    found = minimize_scalar(left, bounds=(-row, row), method="bounded", options={"xatol": 1e-3 * row})
    return float(found.x) if found.fun < (1.0 - RULES.judge.help) ** 2 * left(0.0) else 0.0


def told_late(late: dict[str, float], before: Whole, after: Whole) -> list[str]:
    """What is to be told of outputs that were read late or early."""
    sizes = [one.held or one.taught or {} for one in (before, after)]
    return [
        f"{name} was read {abs(by):.3g} s {'later' if by > 0.0 else 'earlier'} than its rows say, within what a recorder does: it is "
        f"compared with what the model computes then ({sizes[0][name]:.3g} -> {sizes[1][name]:.3g})"
        for name, by in late.items()
        if sizes[1].get(name, 0.0) < (1.0 - RULES.judge.help) * sizes[0].get(name, 0.0)
    ]
