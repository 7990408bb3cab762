"""A residual before and after something is mended, over some blocks: how large its error is, beside its noise."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import Generic, TypeVar

import numpy as np

from ..rules import RULES
from .blocks import compared
from .experiment import Experiment
from .noise import floor
from .residual import Residual

Values = dict[str, float]
Kind = TypeVar("Kind", bound=Experiment)


def samples(experiment: Experiment, residual: Residual, values: Values, blocks: np.ndarray) -> tuple[list, list, list]:
    """Error, trust and measured value of each run at the samples simulated, trusted only in the chosen blocks."""
    errors, trusted, seen = [], [], []
    for i, (simulated, measured, good) in enumerate(experiment.compare(residual, values)):
        block = compared(experiment.layout.block(i), experiment.channels[i, residual.prefix].take, len(good))
        errors.append(measured - simulated)
        trusted.append(good & np.isfinite(simulated) & blocks[block])
        seen.append(measured)
    return errors, trusted, seen


def rms(parts: list[np.ndarray]) -> float:
    """Root mean square over all parts; 0 of nothing."""
    joined = np.concatenate(parts) if parts else np.zeros(0)
    return float(np.sqrt(np.mean(joined**2))) if len(joined) else 0.0


def sizes(experiment: Experiment, misfit: np.ndarray, present: np.ndarray) -> dict[str, float]:
    """Error (root mean square) of each residual in units of its noise, where there is something to compare."""
    parts = {residual.name: experiment.slice(residual) for residual in experiment.residuals}
    return {name: rms([misfit[:, part][present[:, part]]]) for name, part in parts.items()}


def excess(experiment: Experiment, values: Values, blocks: np.ndarray, without: Values | None = None) -> np.ndarray:
    """Error (root mean square) of each residual's samples over their noise, in these blocks; 1 where nothing is compared.

    without: values without the causes that `values` hold. What their formulas may leave of all that they move, a share of
    RULES.residuals.own_formulas, is then taken out of the error's square.
    """
    found = []
    for residual in experiment.residuals:
        errors, trusted, _ = samples(experiment, residual, values, blocks)
        size = rms([e[t] for e, t in zip(errors, trusted)])
        noise = floor(experiment, residual, values, errors, trusted)
        if without is not None and size > noise > 0.0:
            others = samples(experiment, residual, without, blocks)[0]
            moved = rms([(o - e)[t & np.isfinite(o)] for o, e, t in zip(others, errors, trusted)])
            size = np.sqrt(max(size**2 - (RULES.residuals.own_formulas * moved) ** 2, noise**2))
        found.append(size / noise if size > 0.0 and noise > 0.0 else 1.0)
    return np.array(found)


@dataclass(frozen=True, eq=False)
class Mending(Generic[Kind]):
    """One residual of an experiment under the values `before` and `after`, in these `blocks` (bool, one each)."""

    experiment: Kind
    residual: Residual
    before: Values
    after: Values
    blocks: np.ndarray

    @property
    def changed(self) -> bool:
        """Whether a value that matters to the residual is another after."""
        before, after = self.before, self.after
        return any(self.residual.uses(name) and before.get(name) != after.get(name) for name in {*before, *after})

    @cached_property
    def _old(self) -> tuple[list[np.ndarray], list[np.ndarray], float]:
        errors, trusted, measured = samples(self.experiment, self.residual, self.before, self.blocks)
        joined = np.concatenate([m[t] for m, t in zip(measured, trusted)])
        return errors, trusted, float(np.std(joined)) if len(joined) else 0.0

    @property
    def old(self) -> list[np.ndarray]:
        """Errors before, of each run."""
        return self._old[0]

    @property
    def trusted(self) -> list[np.ndarray]:
        """Which samples count, of each run."""
        return self._old[1]

    @property
    def signal(self) -> float:
        """Root mean square of what is measured about its mean, where it is trusted."""
        return self._old[2]

    @cached_property
    def new(self) -> list[np.ndarray]:
        """Errors after, of each run."""
        if not self.changed:
            return self.old
        return samples(self.experiment, self.residual, self.after, self.blocks)[0]

    def size(self, errors: list[np.ndarray]) -> float:
        """Root mean square of errors where they are trusted."""
        return rms([e[t] for e, t in zip(errors, self.trusted)])

    def absolute(self, errors: list[np.ndarray]) -> float:
        """Mean absolute error where it is trusted."""
        joined = np.concatenate([e[t] for e, t in zip(errors, self.trusted)])
        return float(np.mean(abs(joined))) if len(joined) else 0.0

    def levels(self, new: list[np.ndarray] | None = None) -> tuple[float, float, float]:
        """Error (root mean square) before and after, and the noise floor, which is no higher.

        new: errors after, where something else than the values `after` made them.
        """
        new = self.new if new is None else new
        was, now = self.size(self.old), self.size(new)
        return was, now, min(floor(self.experiment, self.residual, self.after, new, self.trusted), now)

    @property
    def improvement(self) -> float:
        """Share by which the error falls."""
        if not self.changed:
            return 0.0
        was = self.size(self.old)
        return 1.0 - self.size(self.new) / was if was > 0.0 else 0.0


def most_mended(experiment: Experiment, before: Values, after: Values, blocks: np.ndarray) -> Residual:
    """The residual whose error falls most in these blocks."""
    return max(experiment.residuals, key=lambda one: Mending(experiment, one, before, after, blocks).improvement)
