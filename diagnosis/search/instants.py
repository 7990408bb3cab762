"""When a set-point jumped: within a row nobody logged it, and all that a drive does after a step depends on it.

It belongs to a run, as where it begins does, and is no cause. The drive that fits best as it is described, recorder and all, is
simulated with its jumps at several places of their rows; each is left where its next moments fit best.
"""

from __future__ import annotations

import numpy as np

from ..residuals import driven, whole
from ..residuals.drive_experiment import DriveExperiment
from ..residuals.mending import samples
from ..residuals.noise import floor
from ..rules import RULES
from .problem import Problem


def place_jumps(experiment: DriveExperiment, problem: Problem) -> bool:
    """Find when each jump of a whole drive's set-points came, and keep it with its run; whether there is any."""
    channels = list(experiment.channels.values())
    if not any(len(driven.jumped(ch)) for ch in channels):
        return False
    rounds = 2 if driven.inputs(channels[0]) else 1  # what is measured jumps in more than a row, and shifts tell where of it
    for _ in range(rounds):
        problem = problem.with_noise()
        values = problem.absolute(problem.fit(problem.base_free, problem.nominal).values)
        values = problem.settled(experiment, values, problem.base_free)
        noise = _noise(experiment, values)
        for ch in channels:
            _place(experiment, ch, values, noise)
        problem = problem.on(problem.experiment.but_with(problem.experiment.setting))
    return True


def _noise(experiment: DriveExperiment, values: dict) -> list[float]:
    """Of each channel. A median of its errors is none: a drive that rests for most of a log has next to no error there."""
    everywhere = np.ones(experiment.layout.count, bool)
    return [
        floor(experiment, residual, values, *samples(experiment, residual, values, everywhere)[:2])
        for residual in experiment.residuals
    ]


def _place(experiment: DriveExperiment, ch, values: dict, noise: list[float]) -> None:
    """Each jump of a run at the best of some places, then of some about it."""
    pairs, time = driven.jumped(ch), ch.taken(ch.run.time)
    known, rules = driven.sooner(ch), RULES.search
    if not len(pairs):
        return
    late = {residual.output: whole.lateness(residual.output, values, ch) for residual in experiment.residuals}
    ch.memory[whole.LATE] = late  # which would follow wherever all jumps are tried
    rows = pairs[:, 1]
    ends = np.minimum(ch.run.time[rows] + rules.jump_shows, np.append(ch.run.time[pairs[1:, 0]], np.inf))
    windows = [(time >= ch.run.time[row]) & (time < end) for row, end in zip(rows, ends)]
    apart = 1.0 / (rules.jump_places - 1)
    best, closer = np.zeros(len(pairs)), np.array([-0.5, 0.0, 0.5]) * apart
    halved = range(int(np.ceil(np.log2((rows - pairs[:, 0]).max()))) + 1)  # to the same part of a row, however many it may take
    for offsets in (np.linspace(0.0, 1.0, rules.jump_places), *(closer / 2**n for n in halved)):
        tried = np.clip(best[:, None] + offsets, 0.0, 1.0 - 2.0 * RULES.residuals.upright)
        losses = []
        for places in tried.T:
            known.update(zip(map(int, rows), map(float, places)))
            losses.append(_losses(experiment, ch, values, windows, noise))
        best = tried[np.arange(len(rows)), np.argmin(losses, axis=0)]
    known.update(zip(map(int, rows), map(float, best)))
    del ch.memory[whole.LATE]
    _forget(ch)


def _losses(experiment: DriveExperiment, ch, values: dict, windows: list[np.ndarray], noise: list[float]) -> np.ndarray:
    """Of each window: squared errors of all channels in units of the noise of each, wild ones held back."""
    _forget(ch)
    found = np.zeros(len(windows))
    for residual, usual in zip(experiment.residuals, noise):
        simulated, measured, good = residual.compute(values, ch)
        error = np.where(good & np.isfinite(simulated), measured - simulated, 0.0)
        if usual > 0.0:
            squares = np.minimum((error / usual) ** 2, RULES.search.jump_wild)
            found += [float(squares[window].sum()) for window in windows]
    return found


def _forget(ch) -> None:
    """What was simulated with other instants."""
    ch.memory.pop("grid", None)
    ch.memory.pop(whole.WHOLE, None)
