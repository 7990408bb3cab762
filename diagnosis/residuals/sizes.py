"""How large a residual is at which samples, before and after, beside its noise."""

from __future__ import annotations

import numpy as np

from .blocks import compared
from .experiment import Experiment
from .noise import floor
from .residual import Residual


def samples(
    experiment: Experiment, residual: Residual, values: dict, blocks: np.ndarray
) -> tuple[list[np.ndarray], list[np.ndarray]]:
    """Misfit and trust of each run at the samples simulated, trusted only in the chosen blocks."""
    errors, trusted = [], []
    for i, (simulated, measured, good) in enumerate(experiment.compare(residual, values)):
        first = int(np.flatnonzero(experiment.block_run == i)[0])
        block = compared(experiment.block_of[i], experiment.channels[i, residual.prefix].take, len(good))
        errors.append(measured - simulated)
        trusted.append(good & np.isfinite(simulated) & blocks[first + block])
    return errors, trusted


def rms(parts: list[np.ndarray]) -> float:
    """Root mean square over all parts; 0 of nothing."""
    joined = np.concatenate(parts) if parts else np.zeros(0)
    return float(np.sqrt(np.mean(joined**2))) if len(joined) else 0.0


def sizes(experiment: Experiment, misfit: np.ndarray, present: np.ndarray) -> dict[str, float]:
    """Error (root mean square) of each cut in units of its noise, where there is something to compare."""
    parts = {residual.name: experiment.slice(residual) for residual in experiment.residuals}
    return {name: rms([misfit[:, part][present[:, part]]]) for name, part in parts.items()}


def improvement(experiment: Experiment, residual: Residual, before: dict, after: dict, blocks: np.ndarray) -> float:
    """Share by which a residual's error falls in these blocks."""
    if not any(residual.uses(name) and before.get(name) != after.get(name) for name in {*before, *after}):
        return 0.0
    old, trusted = samples(experiment, residual, before, blocks)
    new, _ = samples(experiment, residual, after, blocks)
    was = rms([e[t] for e, t in zip(old, trusted)])
    return 1.0 - rms([e[t] for e, t in zip(new, trusted)]) / was if was > 0.0 else 0.0


def most_mended(experiment: Experiment, before: dict, after: dict, blocks: np.ndarray) -> Residual:
    """The residual whose error falls most in these blocks."""
    return max(experiment.residuals, key=lambda residual: improvement(experiment, residual, before, after, blocks))


def levels(
    experiment: Experiment,
    residual: Residual,
    values: dict,
    old: list[np.ndarray],
    new: list[np.ndarray],
    trusted: list[np.ndarray],
) -> tuple[float, float, float]:
    """Error (root mean square) before and after, and the noise floor, which is no higher; `values`: those after."""
    was, now = (rms([e[t] for e, t in zip(errors, trusted)]) for errors in (old, new))
    return was, now, min(floor(experiment, residual, values, new, trusted), now)
