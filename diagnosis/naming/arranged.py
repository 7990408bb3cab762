"""What is compared of a system, in blocks: samples of all outputs, side by side."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from ..calibration.fit import Calibrating, End, Rows
from ..residuals.blocks import Blocks
from ..residuals.noise import of_samples
from ..rules import RULES
from ..search.fit import rho
from .extended import Extending


@dataclass
class Arranged:
    """Where the entries of a misfit lie in blocks: (blocks, samples of all outputs)."""

    problem: Extending
    layout: Blocks
    together: int = 1  # neighbouring blocks that are one here: as long as errors last

    def __post_init__(self) -> None:
        problem, layout = self.problem, self.layout
        labels, outputs = [], []
        for k, name in enumerate(problem.played.outputs):
            for i, t in zip(problem.which, problem.trusted[name]):
                first = int(layout.block(i)[0])
                labels.append((first + (layout.block(i) - first) // self.together * self.together)[t])
                outputs.append(np.full(int(t.sum()), k))
        block, self.output = np.concatenate(labels), np.concatenate(outputs)
        self.names, self.block = np.unique(block, return_inverse=True)
        order = np.lexsort((np.arange(len(block)), self.block))
        starts = np.searchsorted(self.block[order], np.arange(len(self.names)))
        place = np.empty(len(block), int)
        place[order] = np.arange(len(block)) - starts[self.block[order]]
        self.place, self.width = place, int(place.max()) + 1
        self.folds = np.arange(len(self.names)) % RULES.search.folds
        self.runs = layout.run_of[self.names]

    def put(self, entries: np.ndarray) -> np.ndarray:
        """Entries, (entries, ...), as (blocks, samples, ...); 0 where a block has fewer."""
        found = np.zeros((len(self.names), self.width, *entries.shape[1:]), np.float32)
        with np.errstate(over="ignore"):  # what is beyond any measure stays so
            found[self.block, self.place] = entries
        return found

    def taken(self, columns: np.ndarray, part: slice) -> np.ndarray:
        """Columns of (blocks, samples of a part, ...) as entries: `put` turned round."""
        found = np.zeros((len(self.names), self.width, *columns.shape[2:]))
        found[:, part] = columns
        return found[self.block, self.place]

    def losses(self, misfit: np.ndarray) -> np.ndarray:
        """What each output adds to the mean loss of each block, (blocks, outputs)."""
        count = len(self.problem.played.outputs)
        sums = np.zeros((len(self.names), count))
        np.add.at(sums, (self.block, self.output), rho(misfit, RULES.search.loss_scale))
        return sums / np.maximum(np.bincount(self.block, minlength=len(self.names)), 1)[:, None]

    def errors(self, misfit: np.ndarray) -> np.ndarray:
        """Root of the mean loss of each output."""
        loss = rho(misfit, RULES.search.loss_scale)
        count = len(self.problem.played.outputs)
        return np.sqrt(np.bincount(self.output, loss, count) / np.maximum(np.bincount(self.output, minlength=count), 1))

    def deviations(self, misfit: np.ndarray) -> np.ndarray:
        """Root of the mean square of each output."""
        count = len(self.problem.played.outputs)
        return np.sqrt(np.bincount(self.output, misfit**2, count) / np.maximum(np.bincount(self.output, minlength=count), 1))

    def quieter(self, noise: Mapping[str, float], misfit: np.ndarray) -> np.ndarray:
        """The noise that is left beside a misfit, in units of that."""
        units = self.problem.units
        return np.array([size / units[name] for name, size in self.noise(noise, misfit).items()])

    def noise(self, noise: Mapping[str, float], misfit: np.ndarray | None) -> dict[str, float]:
        """This noise of each output, or what changes of a misfit from sample to sample tell, where that is less.

        What a base lacks may change as fast as noise does; of what explains it noise alone is left.
        """
        assert misfit is not None
        problem, found = self.problem, {}
        for k, name in enumerate(problem.played.outputs):
            mine = misfit[self.output == k]
            own = float(of_samples([mine], [np.ones(len(mine), bool)], every=True)) * problem.units[name]
            found[name] = max(min(noise[name], own), RULES.pipeline.fine * problem.played.spread(name))
        return found

    def begins(self, problem: Calibrating, end: End) -> set[str]:
        """Numbers that a single block tells, as where a run begins: no other block could say them."""
        assert end.jacobian is not None
        found = set()
        for j, n in enumerate(problem.free):
            energy = np.bincount(self.block, end.jacobian[:, j] ** 2)
            if energy.max(initial=0.0) > RULES.naming.one_block * energy.sum() > 0.0:
                found.add(n.name)
        return found

    def of_begins(self, problem: Calibrating, end: End, begins: set[str]) -> np.ndarray:
        """What these numbers move in the blocks that tell them, (entries, numbers)."""
        assert end.jacobian is not None
        columns = end.jacobian[:, [n.name in begins for n in problem.free]].copy()
        for column in columns.T:
            column[self.block != np.bincount(self.block, column**2).argmax()] = 0.0
        return columns


def determined(slopes: np.ndarray, weights: np.ndarray) -> np.ndarray:
    """The directions in which numbers move a misfit, (entries, directions), each as much; not those that only rounding tells.

    slopes: (entries, numbers); weights: (entries,). Numbers of a row of FMUs may make up for each other: what is told of their
    difference by the last digits would be taken for a step without end on blocks that were not seen.
    """
    weighted = slopes * weights[:, None]
    lengths = np.sqrt((weighted**2).sum(0))
    flat = slopes[:, lengths > 0.0] / lengths[lengths > 0.0]
    _, sizes, ways = np.linalg.svd(flat * weights[:, None], full_matrices=False)
    kept = sizes > RULES.naming.degenerate * sizes.max(initial=0.0)
    return flat @ (ways[kept].T / sizes[kept])


def lasting(errors: Rows, layout: Blocks) -> int:
    """Blocks that errors last for: as long as they go on as they are no block says anything of its own."""
    longest, shortest = 0, min(int(np.bincount(inside).max()) for inside in layout.inside)
    for parts in errors.values():
        for e in parts:
            e = np.where(np.isfinite(e), e, 0.0) - np.nanmean(e)
            power = abs(np.fft.rfft(e, 2 * len(e))) ** 2
            like = np.fft.irfft(power)[: len(e)]
            below = np.flatnonzero(like < RULES.naming.lasts * like[0]) if like[0] > 0.0 else np.zeros(1, int)
            longest = max(longest, int(below[0]) if len(below) else len(e))
    most = max(1, layout.count // RULES.pipeline.fewest_blocks)
    return int(np.clip(np.ceil(longest / shortest), 1, most))


def over_noise(problem: Extending, values: dict[str, float]) -> tuple[dict[str, float], dict[str, float]]:
    """Of each output the noise of single samples, and its error over that."""
    errors = problem.errors(values)
    assert errors is not None
    noise, ratios = {}, {}
    for name, parts in errors.items():
        trusted = problem.trusted[name]
        noise[name] = problem.floor(name, parts)
        size = float(np.sqrt(np.mean(np.concatenate([e[t] for e, t in zip(parts, trusted)]) ** 2)))
        least = max(noise[name], RULES.pipeline.fine * problem.played.spread(name))
        ratios[name] = size / least if least else 0.0
    return noise, ratios
