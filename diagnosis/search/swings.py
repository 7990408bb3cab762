"""How fast a swing of the output shaft a log shows: one that is stiffer is simulated no stiffer, in fewer parts of each step.

A hundred rows a second of coarse counts do not tell a shaft that swings a thousand times a second from one that swings a hundred
times, and what they do not tell need not be paid for. The nominal drive is simulated with an ever stiffer shaft, until no channel
is off by more than a share of its noise from what the most parts of a step make of it.

And how fast it swings where no data sheet says: an effect's own number is one for any drive, and a gear that locks itself under a
load that drives it rattles as its shaft lets it.
"""

from __future__ import annotations

import numpy as np

from ..residuals import drive, whole
from ..residuals.channels import Channels
from ..residuals.drive_experiment import DriveExperiment
from ..residuals.forward import swinging
from ..residuals.grid import grid
from ..rules import RULES
from .hypotheses import Free
from .problem import Problem

STIFFNESS, DAMPING = SHAFT = "reducer.shaft_stiffness", "reducer.shaft_damping"


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


def place_shaft(experiment: DriveExperiment, problem: Problem) -> dict[str, float]:
    """Stiffness and damping of an output shaft of which the rig says nothing, with which the drive leaves no more than noise.

    None where the rig says either, where the drive is right without them, and where no shaft makes it right: then something else is
    wrong, and a shaft would make up for it.
    """
    if any(name in experiment.rig.parameters or name in experiment.rig.uncertain for name in SHAFT):
        return {}
    problem = problem.with_noise()
    fitted = problem.fit(problem.base_free, problem.nominal)
    if problem.excess(fitted.values).max() <= RULES.search.sound:
        return {}
    rules, loss = RULES.search, lambda values: problem.loss(problem.misfit(values))
    tried = sorted((fitted.values | shaft for shaft in _shafts(problem)), key=loss)
    for start in tried[: rules.shafts_fitted]:
        about = lambda name, start=start: (start[name], start[name] / rules.shaft_about, start[name] * rules.shaft_about)
        free = tuple(Free(name, *about(name)) for name in SHAFT)
        found = problem.fit((*problem.base_free, *free), start, rules.effort_begin)
        if problem.excess(found.values).max() > rules.natural:  # of something else that is wrong
            continue
        found = problem.fit(found.free, dict(found.values))
        if problem.excess(found.values).max() <= rules.sound:
            return {name: found.values[name] for name in SHAFT}
    return {}


def _shafts(problem: Problem) -> list[dict[str, float]]:
    """Shafts that are tried: from the stiffest that is simulated to one that swings slowly, each with more and less of a damper."""
    ch, rules, found = problem.experiment.channels[0, ""], RULES.search, []
    values = problem.absolute(problem.nominal)
    inertia = swinging(drive.law("reducer", values, ch), drive.law("load", values, ch))
    fastest = np.sqrt(whole.carried_in(values, ch)[0] / inertia)
    for swing in fastest * rules.shaft_slower ** -np.arange(rules.shaft_swings):
        for damped in rules.shaft_damped:
            found.append({STIFFNESS: float(inertia * swing**2), DAMPING: float(2.0 * damped * inertia * swing)})
    return found


def _carry(channels: list[Channels], fastest: float) -> None:
    """Simulate these runs with a shaft that swings so fast at most, rad/s."""
    for ch in channels:
        ch.run.memory[whole.FASTEST] = fastest
        ch.memory.pop(whole.WHOLE, None)


def _bins(experiment: DriveExperiment, values: dict) -> np.ndarray:
    """Misfit of each residual, (residuals, blocks, bins), nothing of it remembered."""
    return np.stack([experiment.binned(residual, values)[0] for residual in experiment.residuals])
