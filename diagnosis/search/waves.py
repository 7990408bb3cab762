"""Which waves over a turn an error may hold: a look at its spectrum over the angles, instead of a simulation for each order."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from selflock.fmus.effect import ORDER

from ..residuals import whole
from ..residuals.drive_experiment import DriveExperiment
from ..rules import RULES
from .hypotheses import Hypothesis

SHAFTS = {"input": "input_angle", "output": "angle"}


def looked_for(experiment: DriveExperiment, values: dict, hypotheses: list[Hypothesis]) -> list[Hypothesis]:
    """The hypotheses about a whole drive; those of a wave with the orders that the error under these values speaks for."""
    found = _orders(experiment, values)

    def narrowed(hypothesis: Hypothesis) -> Hypothesis:
        free = tuple(
            replace(p, trials=tuple(n for n in found[p.shaft] if p.low <= n <= p.high)) if p.role == ORDER else p
            for p in hypothesis.free
        )
        return replace(hypothesis, free=free)

    return [narrowed(h) for h in hypotheses]


def _orders(experiment: DriveExperiment, values: dict) -> dict[str, tuple[float, ...]]:
    """For each shaft the waves in a turn, ascending, whose share in some channel's error is largest.

    As they are, or with the sign of the speed and the load as friction has them.
    """
    rules, shares = RULES.search, {shaft: np.zeros(RULES.search.highest_order) for shaft in SHAFTS}
    for residual in experiment.residuals:
        sums = {shaft: np.zeros((rules.highest_order, 3), complex) for shaft in SHAFTS}
        for i, (simulated, measured, good) in enumerate(experiment.compare(residual, values)):
            ch = experiment.channels[i, residual.prefix]
            there, rows = whole.grid(ch).time, whole.simulate(values, ch)
            when = ch.taken(ch.run.time)[good] - ch.run.time[0]
            at = lambda name, when=when, there=there, rows=rows: np.interp(when, there, rows[name])
            error, way = (measured - simulated)[good], np.sign(at("input_speed"))
            weights = np.stack([np.ones(len(way)), way, way * abs(at("output_torque"))])
            size = np.sqrt(np.maximum((weights**2).sum(1), 1e-300))
            for shaft, row in SHAFTS.items():
                waves = np.cumprod(np.broadcast_to(np.exp(1j * at(row)), (rules.highest_order, len(way))), axis=0)
                sums[shaft] += waves @ (weights * error).T / size
        for shaft in SHAFTS:
            found = abs(sums[shaft])  # (orders, weights)
            shares[shaft] = np.maximum(shares[shaft], (found / np.maximum(found.max(0), 1e-300)).max(1))
    best = {shaft: np.argsort(-share, kind="stable")[: rules.waves] for shaft, share in shares.items()}
    return {shaft: tuple(float(n + 1) for n in sorted(places)) for shaft, places in best.items()}
