"""Which waves over a turn an error may hold: a look at its spectrum over the angles, instead of a simulation for each order."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from selflock.fmus.effect import ORDER

from ..residuals import drive, whole
from ..residuals.drive_experiment import DriveExperiment
from ..residuals.grid import grid
from ..rules import RULES
from .hypotheses import Free, Hypothesis

SHAFTS = ("input", "output")


def looked_for(
    experiment: DriveExperiment, values: dict, hypotheses: list[Hypothesis]
) -> tuple[list[Hypothesis], dict[str, tuple[float, ...]]]:
    """The hypotheses about a whole drive; those of a wave with the orders that the error under these values speaks for.

    And for each shaft those among them that stand out of all others, as a wave's do: of shares that are chance's, the
    largest of so many is less than this many times their mean, but for `significant` of the cases.
    """
    shares = _shares(experiment, values)
    found = {shaft: np.argsort(-share, kind="stable") + 1.0 for shaft, share in shares.items()}
    level = np.log(RULES.search.highest_order / RULES.search.significant)
    lines = {shaft: np.flatnonzero(share > level * np.median(share) / np.log(2.0)) + 1.0 for shaft, share in shares.items()}

    def narrowed(hypothesis: Hypothesis) -> Hypothesis:
        free = tuple(replace(p, trials=_most(found[p.shaft], p)) if p.role == ORDER else p for p in hypothesis.free)
        return replace(hypothesis, free=free)

    return [narrowed(h) for h in hypotheses], {shaft: tuple(map(float, orders)) for shaft, orders in lines.items()}


def _most(orders: np.ndarray, p: Free) -> tuple[float, ...]:
    """The first of the orders that a wave may have, ascending: of fewer than its shaft went through nothing can be told."""
    return tuple(sorted([float(n) for n in orders if p.low <= n <= p.high][: RULES.search.waves]))


def _shares(experiment: DriveExperiment, values: dict) -> dict[str, np.ndarray]:
    """For each shaft the largest share that 1, 2, ... waves in a turn have of some channel's error.

    Errors as they are, or with the sign of the speed and the load as friction has them, are weighted with the speed: over the
    angle, that is, in which a shaft at rest has one place. The angle is the measured one, for the simulated one lags
    behind by more than a wave where much is wrong. A share is that of a sum of products' square in the product of
    the sums of squares, at most 1, so that channels can be held against each other.
    """
    rules, shares = RULES.search, {shaft: np.zeros(RULES.search.highest_order) for shaft in SHAFTS}
    for residual in experiment.residuals:
        sums = {shaft: np.zeros((rules.highest_order, 3), complex) for shaft in SHAFTS}
        squares, energy = np.zeros(3), 0.0
        for i, (simulated, measured, good) in enumerate(experiment.compare(residual, values)):
            ch = experiment.channels[i, residual.prefix]
            there, rows = grid(ch).time, whole.simulate(values, ch)
            when = ch.taken(ch.run.time) - ch.run.time[0]
            at = lambda name, when=when, there=there, rows=rows: np.interp(when, there, rows[name])
            angles = {shaft: ch.taken(motion.angle) for shaft, motion in zip(SHAFTS, drive.both(values, ch))}
            error, speed = (measured - simulated)[good], at("input_speed")[good]
            way, load = np.sign(speed), abs(at("output_torque")[good])
            forms = np.stack([np.ones(len(way)), way, way * load])
            weights = abs(speed) * forms
            squares += (weights * forms).sum(1)
            energy += float((abs(speed) * error**2).sum())
            for shaft, angle in angles.items():
                waves = np.cumprod(np.broadcast_to(np.exp(1j * angle[good]), (rules.highest_order, len(way))), axis=0)
                sums[shaft] += waves @ (weights * error).T
        for shaft in SHAFTS:
            share = abs(sums[shaft]) ** 2 / np.maximum(squares * energy, 1e-300)  # (orders, weights)
            shares[shaft] = np.maximum(shares[shaft], share.max(1))
    return shares
