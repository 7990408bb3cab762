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
    found = {shaft: _orders(experiment, values, row) for shaft, row in SHAFTS.items()}

    def narrowed(hypothesis: Hypothesis) -> Hypothesis:
        free = tuple(
            replace(p, trials=tuple(n for n in found[p.shaft] if p.low <= n <= p.high)) if p.role == ORDER else p
            for p in hypothesis.free
        )
        return replace(hypothesis, free=free)

    return [narrowed(h) for h in hypotheses]


def _orders(experiment: DriveExperiment, values: dict, row: str) -> tuple[float, ...]:
    """Waves in a turn of this shaft, ascending, whose share in some channel's error is largest.

    As they are, or with the sign of the speed and the load as friction has them.
    """
    rules = RULES.search
    shares: dict[int, float] = {}
    for residual in experiment.residuals:
        sums = np.zeros((rules.highest_order, 3), complex)
        for i, (simulated, measured, good) in enumerate(experiment.compare(residual, values)):
            ch = experiment.channels[i, residual.prefix]
            there, rows = whole.grid(ch).time, whole.simulate(values, ch)
            at = lambda name: np.interp(whole.taken(ch.run.time, ch)[good] - ch.run.time[0], there, rows[name])
            error, angle, way = (measured - simulated)[good], at(row), np.sign(at("input_speed"))
            weights = np.stack([np.ones(len(angle)), way, way * abs(at("output_torque"))])
            turn, wave = np.exp(1j * angle), np.ones(len(angle), complex)
            here = []
            for _ in range(rules.highest_order):
                wave = wave * turn
                here.append((weights * error) @ wave)
            sums = sums + np.array(here) / np.sqrt(np.maximum((weights**2).sum(1), 1e-300))
        size = abs(sums)  # (orders, weights)
        for n, share in enumerate((size / np.maximum(size.max(0), 1e-300)).max(1), 1):
            shares[n] = max(shares.get(n, 0.0), float(share))
    best = sorted(shares, key=lambda n: -shares[n])[: rules.waves]
    return tuple(float(n) for n in sorted(best))
