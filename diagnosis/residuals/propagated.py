"""Noise by propagation: what the noise and the counts of all that is measured make of a comparison.

A comparison smooths, differentiates and filters its measured inputs, and the rounding of an encoder stays the same for many
rows where a shaft creeps: what is left of that in averages over many rows, no difference of neighbours tells. So the drive
is recorded once more: every channel gets noise of its own size, every count another zero, and what this changes in the
comparison is as large as what the first recording's noise changed (a parametric bootstrap of the measurement; Efron and
Tibshirani 1993, ch. 6; of rounding Widrow 1956).
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from ..data.log import VALID, MeasuredRun
from ..data.rig import split
from ..data.signals import SETPOINTS
from ..data.values import noise_of, resolution
from ..rules import RULES
from . import drive
from .blocks import compared
from .channels import Channels, smooth
from .drive_experiment import DriveExperiment
from .experiment import Experiment
from .recorder import measured
from .residual import Compared, Residual


def of_inputs(experiment: DriveExperiment, residual: Residual) -> tuple[float, float]:
    """Noise (root mean square) that a comparison of the nominal drive has of its channels: of rows, and of bins.

    0 of points, whose noise their runs tell, and of a whole drive, into which nothing measured goes but where it begins.
    """
    if experiment.steady or residual.kind in ("drive", "whole"):
        return 0.0, 0.0
    memory = experiment.remembered("noise of inputs")
    if not memory:
        memory |= _of_inputs(experiment)
    return memory[residual.name]


def _of_inputs(experiment: DriveExperiment) -> dict[str, tuple[float, float]]:
    """Of all comparisons, which the drive is recorded once more for."""
    few = experiment.head(experiment.enough(np.ones(experiment.layout.count, bool)))
    alone = {prefix: in_step(few.channels[0, prefix]) for prefix in few.rig.drives}
    others = {
        one: few.recorded([again(run, few.rig.drives, i, one) for i, run in enumerate(few.runs)]) for one in {*alone.values()}
    }
    return {one.name: _moved(few, others[alone[one.prefix]], one) for one in experiment.residuals}


def _moved(few: DriveExperiment, once_more: DriveExperiment, residual: Residual) -> tuple[float, float]:
    """What another recording changes in a comparison, in rows and in bins."""
    moved, good = changes(few.compare(residual, {}), once_more.compare(residual, {}))
    samples = np.concatenate([x[g] for x, g in zip(moved, good)])
    return float(np.sqrt(np.mean(samples**2))) if len(samples) else 0.0, of_means(few, residual, moved, good)


def changes(before: list[Compared], after: list[Compared]) -> tuple[list[np.ndarray], list[np.ndarray]]:
    """By how much each run's error of a comparison is another, and where that can be trusted."""
    moved = [(m1 - s1) - (m0 - s0) for (s0, m0, _), (s1, m1, _) in zip(before, after)]
    return moved, [g0 & g1 & np.isfinite(x) for x, (_, _, g0), (_, _, g1) in zip(moved, before, after)]


def of_means(experiment: Experiment, residual: Residual, parts: list[np.ndarray], trusted: list[np.ndarray]) -> float:
    """Root mean square of the means in bins of what each run of a comparison has."""
    layout = experiment.layout
    sums, count = np.zeros(layout.count * layout.bins), np.zeros(layout.count * layout.bins)
    for i, (x, good) in enumerate(zip(parts, trusted)):
        place = compared(layout.place[i], experiment.channels[i, residual.prefix].take, len(x))
        total, there = layout.bin(place, x, good)
        sums, count = sums + total, count + there
    bins = (sums / np.maximum(count, 1))[count > 0]
    return float(np.sqrt(np.mean(bins**2))) if len(bins) else 0.0


def in_step(ch: Channels) -> bool:
    """Whether the rows are the controller's own, its command a number that it gave.

    Then what stands in a row is what it saw: coarse steps are in the drive, and a cause. Elsewhere they are the recorder's.
    """
    electric = drive.electric(ch)
    return bool(electric) and measured(electric, ch) <= RULES.residuals.exact


def again(run: MeasuredRun, drives: tuple[str, ...], seed: int, noise_alone: bool = False) -> MeasuredRun:
    """A run as if it were recorded once more: other noise, encoders with other zeros. Set-points are numbers."""
    rng = np.random.default_rng([seed, len(run)])
    names = [name for name in run.signals if name != VALID and split(name, drives)[1] not in SETPOINTS]
    return replace(run, signals=run.signals | {name: run.signals[name] + _noise(run, name, rng, noise_alone) for name in names})


def _noise(run: MeasuredRun, name: str, rng: np.random.Generator, alone: bool) -> np.ndarray:
    """As much noise as a channel has. Noise beyond half a count makes that of rounding white, too (Widrow and Kollár 2008, ch. 4)."""
    n, places = len(run), np.flatnonzero(run.usable(name))
    if len(places) <= RULES.residuals.noise_samples:
        return np.zeros(n)
    x = np.interp(np.arange(n), places, run.signals[name][places])
    count = resolution(x)
    if noise_of(x) < RULES.residuals.dithered * count:
        if alone:
            return np.zeros(n)
        true, zero = smooth(x, RULES.residuals.rounded_window), rng.uniform()
        return count * (np.floor(true / count + zero) + 0.5 - zero) - true
    new = np.concatenate([[True], np.diff(x) != 0.0])  # a value that is held is read once
    return (noise_of(x[new]) * rng.standard_normal(int(new.sum())))[np.cumsum(new) - 1]
