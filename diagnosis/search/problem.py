"""What a search is fought on: the misfit of one experiment, its noise and folds, fits, and what fits leave unseen."""

from __future__ import annotations

import numpy as np

from ..residuals.experiment import Experiment
from ..residuals.noise import of_bins, of_quiet_bins
from .fit import Fit, fit, held_out, rho
from .hypotheses import Free, uncertain, vocabulary

FOLDS = 5

WILD = 1.03
"""Where a linear step leaves so many times more on unseen blocks than the fit itself, it is worth simulating."""


class Problem:
    """One experiment, the blocks that teach, and all hypotheses about it."""

    def __init__(self, experiment: Experiment, train: np.ndarray):
        self.experiment, self.train = experiment, train
        experiment.forget()  # another experiment of these runs may smooth otherwise
        self.base_free = tuple(
            p
            for p in uncertain(experiment.rig)
            if (p.name.rpartition(".")[0] in experiment.components or p.name.startswith("sensor.")) and not p.on_request
        )
        self.hypotheses = vocabulary(experiment.rig, experiment.components, experiment.measured, experiment)
        self.nominal = {p.name: p.nominal for p in self.base_free}
        self.shape = experiment.misfit(self.nominal).shape
        self.quiet = np.ones(len(experiment.residuals))  # noise where there is least of it, over the usual noise of a residual
        self.loss_scale = np.inf  # where the robust loss turns, in units of noise
        self.whole = any(
            residual.name.endswith("drive") for residual in experiment.residuals
        )  # far from linear in its parameters
        self.blocks = np.repeat(np.arange(experiment.blocks), self.shape[1])
        self.fold_of_block = np.zeros(experiment.blocks, int)
        self.fold_of_block[train] = np.arange(train.sum()) % FOLDS
        self.folds = np.repeat(self.fold_of_block, self.shape[1])
        self.count_samples()

    def count_samples(self) -> None:
        """Which entries of the misfit there are, and which of them teach."""
        self.present = self.experiment.present(self.nominal)
        self.rows = (self.present & self.train[:, None]).ravel()

    def misfit(self, values: dict) -> np.ndarray:
        """Flat; values counted above another are put back on it."""
        return self.experiment.misfit(self.absolute(values)).ravel()

    def absolute(self, values: dict) -> dict:
        """Values as the laws have them, those counted above another put back on it."""
        out = dict(values)
        for hypothesis in self.hypotheses:
            for p in hypothesis.free:
                if p.above and p.name in values:
                    out[p.name] = self.experiment.value(p.above, values) + values[p.name]
        return out

    def measure_noise(self) -> None:
        """Noise of each residual's bins from neighbouring differences, and where the robust loss turns."""
        fitted = fit(self.misfit, {}, self.base_free, self.nominal, self.rows, 1e30, effort=15) if self.base_free else None
        values = fitted.values if fitted else {}
        for number, residual in enumerate(self.experiment.residuals):
            r, count = self.experiment.binned(residual, self.absolute(values))
            lag = 1 + self.experiment.reach(residual) // self.experiment.per_bin
            residual.noise = of_bins(r, count > 0, self.experiment.steady, lag)
            if not self.experiment.steady:
                self.quiet[number] = min(1.0, of_quiet_bins(r, count > 0, lag) / residual.noise)
        r = self.misfit({**self.nominal, **values})[self.rows]
        self.loss_scale = max(3.0, 2.0 * float(np.median(abs(r))))
        self.nominal.update(values)

    def fit(self, free: tuple[Free, ...], start: dict, effort: int = 25) -> Fit:
        """Robust least squares on the samples that teach."""
        return fit(self.misfit, {}, free, start, self.rows, self.loss_scale, effort, *((1e-4, 1e-4) if self.whole else ()))

    def held_out(self, fitted: Fit) -> np.ndarray:
        """Misfit of each fold under the fit to the others: linear where that can be believed, else simulated."""
        linear = held_out(fitted, self.rows, self.folds)
        if not self.whole and self.block_loss(linear).sum() < WILD * self.block_loss(fitted.misfit).sum():
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
