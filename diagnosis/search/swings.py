"""How fast a swing of the output shaft a log shows: one that is stiffer is simulated no stiffer, in fewer parts of each step.

A hundred rows a second of coarse counts do not tell a shaft that swings a thousand times a second from one that swings a hundred
times, and what they do not tell need not be paid for. The nominal drive is simulated with an ever stiffer shaft, until no channel
is off by more than a share of its noise from what the most parts of a step make of it.
"""

from __future__ import annotations

import numpy as np

from ..residuals import whole
from ..residuals.channels import Channels
from ..residuals.drive_experiment import DriveExperiment
from ..residuals.grid import grid
from ..rules import RULES
from .problem import Problem


def place_swings(experiment: DriveExperiment, problem: Problem) -> bool:
    """Find the fastest swing of the shaft that a log shows, rad/s, and keep it with its runs; whether any is left out by it."""
    channels = [*experiment.channels.values(), *problem.experiment.channels.values()]
    _carry(channels, np.inf)  # whatever was found of these runs before
    problem = problem.with_noise_at(problem.nominal)
    taught, values = problem.experiment, problem.absolute(problem.nominal)
    step = min(float(grid(ch).dt[1:].max()) for ch in taught.channels.values())
    most = max(whole.carried_in(values, ch)[2] for ch in taught.channels.values())
    finest = _bins(taught, values)
    for parts in range(1, most):
        _carry(channels, RULES.residuals.shaft_step * parts / step)
        off = np.sqrt(np.mean((_bins(taught, values) - finest) ** 2, axis=(1, 2)))
        if (off <= RULES.residuals.shaft_unseen * problem.noise).all():
            return True
    _carry(channels, np.inf)
    return False


def _carry(channels: list[Channels], fastest: float) -> None:
    """Simulate these runs with a shaft that swings so fast at most, rad/s."""
    for ch in channels:
        ch.run.memory[whole.FASTEST] = fastest
        ch.memory.pop(whole.WHOLE, None)


def _bins(experiment: DriveExperiment, values: dict) -> np.ndarray:
    """Misfit of each residual, (residuals, blocks, bins), nothing of it remembered."""
    return np.stack([experiment.binned(residual, values)[0] for residual in experiment.residuals])
