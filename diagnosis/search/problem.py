"""What a search is about: the misfit of one experiment, its noise and folds, fits, and what fits leave unseen."""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from ..residuals.drive_experiment import DriveExperiment
from ..residuals.noise import of_bins, of_quiet_bins
from ..rules import RULES
from .candidate import Candidate
from .fit import Fit, fit, held_out, rho
from .hypotheses import Free, Hypothesis, uncertain, vocabulary


@dataclass(frozen=True, eq=False)
class Problem:
    """One experiment, the blocks that teach, and all hypotheses about it. It does not change: another is made of it."""

    experiment: DriveExperiment
    train: np.ndarray  # bool, of each block
    base_free: tuple[Free, ...]  # what no data sheet says
    hypotheses: tuple[Hypothesis, ...]
    nominal: dict[str, float]  # values of `base_free`
    noise: np.ndarray  # of each residual's bins
    quiet: np.ndarray  # noise where there is least of it, over the usual noise of a residual
    present: np.ndarray  # (blocks, bins of all residuals): which entries of the misfit there are
    loss_scale: float = np.inf  # where the robust loss turns, in units of noise
    shift: np.ndarray | float = 0.0  # added to the misfit: a simulated log is a measured one with other errors

    @classmethod
    def of(cls, experiment: DriveExperiment, train: np.ndarray) -> Problem:
        """The problem of an experiment whose noise is not known yet."""
        free = tuple(
            p
            for p in uncertain(experiment.rig)
            if (p.name.rpartition(".")[0] in experiment.components or p.name.startswith("sensor.")) and not p.on_request
        )
        hypotheses = tuple(vocabulary(experiment.rig, experiment.components, experiment.measured, experiment))
        nominal = {p.name: p.nominal for p in free}
        ones = np.ones(len(experiment.residuals))
        return cls(experiment, train, free, hypotheses, nominal, ones, ones, experiment.present(nominal))

    def on(self, experiment: DriveExperiment) -> Problem:
        """The same problem where other samples are simulated."""
        return replace(self, experiment=experiment, present=experiment.present(self.nominal))

    def with_noise(self) -> Problem:
        """With the noise of each residual's bins from neighbouring differences, and where the robust loss turns."""
        experiment, values = self.experiment, {}
        if self.base_free:
            values = fit(self.misfit, {}, self.base_free, self.nominal, self.rows, 1e30, RULES.search.effort_first).values
        noise, quiet = self.noise.copy(), self.quiet.copy()
        for number, residual in enumerate(experiment.residuals):
            r, count = experiment.binned(residual, self.absolute(values))
            lag = 1 + experiment.reach(residual) // experiment.layout.per_bin
            noise[number] = of_bins(r, count > 0, experiment.steady, lag)
            if not experiment.steady:
                quiet[number] = min(1.0, of_quiet_bins(r, count > 0, lag) / noise[number])
        found = replace(self, noise=noise, quiet=quiet, nominal=self.nominal | values)
        r = found.misfit(found.nominal)[self.rows]
        return replace(found, loss_scale=max(RULES.search.loss_scale, RULES.search.loss_median * float(np.median(abs(r)))))

    @property
    def shape(self) -> tuple[int, int]:
        """Of a misfit: blocks, bins of all residuals."""
        return self.present.shape

    @cached_property
    def rows(self) -> np.ndarray:
        """Which entries of a flat misfit teach."""
        return (self.present & self.train[:, None]).ravel()

    @cached_property
    def blocks(self) -> np.ndarray:
        """The block of each entry of a flat misfit."""
        return np.repeat(np.arange(self.shape[0]), self.shape[1])

    @cached_property
    def fold_of_block(self) -> np.ndarray:
        """The fold of each block; of those that do not teach 0."""
        found = np.zeros(self.shape[0], int)
        found[self.train] = np.arange(self.train.sum()) % RULES.search.folds
        return found

    @cached_property
    def folds(self) -> np.ndarray:
        """The fold of each entry of a flat misfit."""
        return np.repeat(self.fold_of_block, self.shape[1])

    @property
    def whole(self) -> bool:
        """Whether a whole drive is simulated, which is far from linear in its parameters."""
        return any(residual.kind == "drive" for residual in self.experiment.residuals)

    def misfit(self, values: dict) -> np.ndarray:
        """Flat, in units of the noise; values counted above another are put back on it."""
        return self.experiment.misfit(self.absolute(values), self.noise).ravel() + self.shift

    def absolute(self, values: dict) -> dict:
        """Values as the laws have them, those counted above another put back on it."""
        out = dict(values)
        for hypothesis in self.hypotheses:
            for p in hypothesis.free:
                if p.above and p.name in values:
                    out[p.name] = self.experiment.setting.value(p.above, values) + values[p.name]
        return out

    def fit(self, free: tuple[Free, ...], start: dict, effort: int = RULES.search.effort) -> Fit:
        """Robust least squares on the samples that teach."""
        tolerances = RULES.search.tolerances_whole if self.whole else RULES.search.tolerances
        return fit(self.misfit, {}, free, start, self.rows, self.loss_scale, effort, tolerances)

    def with_these(self, causes: list[Candidate], fitted: Fit) -> Fit:
        """What is fitted, fitted again with these causes alone."""
        names = {p.name for c in causes for p in c.free} | {p.name for p in self.base_free}
        free = tuple(p for p in fitted.free if p.name in names)
        return self.fit(free, {p.name: fitted.values[p.name] for p in free})

    def held_out(self, fitted: Fit) -> np.ndarray:
        """Misfit of each fold under the fit to the others: linear where that can be believed, else simulated."""
        linear = held_out(fitted, self.rows, self.folds)
        if not self.whole and self.block_loss(linear).sum() < RULES.search.wild * self.block_loss(fitted.misfit).sum():
            return linear
        return held_out(fitted, self.rows, self.folds, self.misfit, self.loss_scale)

    def block_loss(self, misfit: np.ndarray) -> np.ndarray:
        """What each residual adds to the mean loss of each training block, (blocks, residuals)."""
        loss = (rho(misfit, self.loss_scale) * self.rows).reshape(self.shape)
        sums = np.stack([loss[:, self.experiment.slice(residual)].sum(1) for residual in self.experiment.residuals], 1)
        return sums[self.train] / np.maximum(self.rows.reshape(self.shape).sum(1)[self.train, None], 1)

    def residual_errors(self, misfit: np.ndarray) -> np.ndarray:
        """Root of the mean loss over training blocks, for each residual."""
        loss, rows = (rho(misfit, self.loss_scale) * self.rows).reshape(self.shape), self.rows.reshape(self.shape)
        residuals = map(self.experiment.slice, self.experiment.residuals)
        return np.array([np.sqrt(loss[:, s].sum() / max(1, rows[:, s].sum())) for s in residuals])

    def taught(self, samples: np.ndarray) -> np.ndarray:
        """Samples of the training blocks, (blocks, bins of all residuals)."""
        return (samples * self.rows).reshape(self.shape)[self.train]
