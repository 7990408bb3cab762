"""What a contest is fought on: the residual of one bench, its noise and folds, fits, and what fits leave unseen."""

from __future__ import annotations

import numpy as np

from .bench import Bench
from .fit import Fit, fit, held_out, rho
from .hypotheses import ON_REQUEST, Free, uncertain, vocabulary
from .noise import of_bins, of_quiet_bins

FOLDS = 5

WILD = 1.03
"""Where a linear step leaves so many times more on unseen blocks than the fit itself, it is worth simulating."""


class Ground:
    """One bench, the blocks that teach, and all hypotheses about it."""

    def __init__(self, bench: Bench, train: np.ndarray):
        self.bench, self.train = bench, train
        bench.forget()  # another bench of these runs may smooth otherwise
        self.base_free = tuple(
            p
            for p in uncertain(bench.rig)
            if (p.name.rpartition(".")[0] in bench.components or p.name.startswith("sensor."))
            and p.name.rpartition(".")[2] not in ON_REQUEST
        )
        self.hypotheses = vocabulary(bench.rig, bench.components, bench.measured, bench)
        self.nominal = {p.name: p.nominal for p in self.base_free}
        self.shape = bench.residual(self.nominal).shape
        self.quiet = np.ones(len(bench.cuts))  # noise where there is least of it, over the usual noise of a cut
        self.turn = np.inf  # where the robust loss turns, in units of noise
        self.whole = any(cut.name.endswith("drive") for cut in bench.cuts)  # far from linear in its parameters
        self.blocks = np.repeat(np.arange(bench.blocks), self.shape[1])
        self.fold_of_block = np.zeros(bench.blocks, int)
        self.fold_of_block[train] = np.arange(train.sum()) % FOLDS
        self.folds = np.repeat(self.fold_of_block, self.shape[1])
        self.count_samples()

    def count_samples(self) -> None:
        """Which entries of the residual there are, and which of them teach."""
        self.present = self.bench.present(self.nominal)
        self.rows = (self.present & self.train[:, None]).ravel()

    def residual(self, values: dict) -> np.ndarray:
        """Flat; values counted above another are put back on it."""
        return self.bench.residual(self.absolute(values)).ravel()

    def absolute(self, values: dict) -> dict:
        """Values as the laws have them, those counted above another put back on it."""
        out = dict(values)
        for hypothesis in self.hypotheses:
            for p in hypothesis.free:
                if p.above and p.name in values:
                    out[p.name] = self.bench.value(p.above, values) + values[p.name]
        return out

    def measure_noise(self) -> None:
        """Noise of each cut's bins from neighbouring differences, and where the robust loss turns."""
        fitted = fit(self.residual, {}, self.base_free, self.nominal, self.rows, 1e30, effort=15) if self.base_free else None
        values = fitted.values if fitted else {}
        for number, cut in enumerate(self.bench.cuts):
            r, count = self.bench.binned(cut, self.absolute(values))
            lag = 1 + self.bench.reach(cut) // self.bench.per_bin
            cut.noise = of_bins(r, count > 0, self.bench.steady, lag)
            if not self.bench.steady:
                self.quiet[number] = min(1.0, of_quiet_bins(r, count > 0, lag) / cut.noise)
        r = self.residual({**self.nominal, **values})[self.rows]
        self.turn = max(3.0, 2.0 * float(np.median(abs(r))))
        self.nominal.update(values)

    def fit(self, free: tuple[Free, ...], start: dict, effort: int = 25) -> Fit:
        """Robust least squares on the samples that teach."""
        return fit(self.residual, {}, free, start, self.rows, self.turn, effort, *((1e-4, 1e-4) if self.whole else ()))

    def held_out(self, fitted: Fit) -> np.ndarray:
        """Residual of each fold under the fit to the others: linear where that can be believed, else simulated."""
        linear = held_out(fitted, self.rows, self.folds)
        if not self.whole and self.block_loss(linear).sum() < WILD * self.block_loss(fitted.residual).sum():
            return linear
        return held_out(fitted, self.rows, self.folds, self.residual, self.turn)

    def block_loss(self, residual: np.ndarray) -> np.ndarray:
        """What each cut adds to the mean loss of each training block, (blocks, cuts)."""
        loss = (rho(residual, self.turn) * self.rows).reshape(self.shape)
        sums = np.stack([loss[:, self.bench.slice(cut)].sum(1) for cut in self.bench.cuts], 1)
        return sums[self.train] / np.maximum(self.rows.reshape(self.shape).sum(1)[self.train, None], 1)

    def cut_errors(self, residual: np.ndarray) -> np.ndarray:
        """Root of the mean loss over training blocks, for each cut."""
        loss, rows = (rho(residual, self.turn) * self.rows).reshape(self.shape), self.rows.reshape(self.shape)
        cuts = map(self.bench.slice, self.bench.cuts)
        return np.array([np.sqrt(loss[:, s].sum() / max(1, rows[:, s].sum())) for s in cuts])

    def taught(self, samples: np.ndarray) -> np.ndarray:
        """Samples of the training blocks, (blocks, bins of all cuts)."""
        return (samples * self.rows).reshape(self.shape)[self.train]
