"""Where the samples of each run go: blocks, which a fit sees or does not see, and bins, whose averages are compared."""

from __future__ import annotations

from copy import copy

import numpy as np

from ..data.log import MeasuredRun
from ..rules import RULES


class Blocks:
    """Runs cut into blocks of about equal length, blocks into bins; steady-state points are a block each.

    count, bins: of blocks, and of bins in each; per_bin: samples in a bin, at most.
    run_of: of each block. owner: of each block, the run as it was read; of joined points another than the one joined.
    place: of each run, the bin of each sample. inside: of each run, the block of each sample, counted within the run.
    """

    def __init__(self, runs: list[MeasuredRun], steady: bool, owner: np.ndarray | None = None):
        total, rules = sum(len(run) for run in runs), RULES.residuals
        if steady:
            length, per_bin = 1, 1
        else:
            length = max(rules.shortest_block, min(int(np.ceil(total / rules.blocks)), max(len(run) for run in runs)))
            per_bin = max(1, int(np.ceil(length / rules.bins)))
        self.per_bin = per_bin
        run_of: list[int] = []
        self.place: list[np.ndarray] = []
        self.inside: list[np.ndarray] = []
        for i, run in enumerate(runs):
            n = len(run)
            if steady:
                count, block = n, np.arange(n, dtype=np.int32)
            else:
                count = max(1, int(round(n / length)))
                block = np.minimum(np.arange(n, dtype=np.int32) // int(np.ceil(n / count)), count - 1)
                length, count = max(length, int(np.bincount(block).max())), int(block[-1]) + 1  # the last may stay empty
            self.inside.append(block)
            run_of += [i] * count
        self.bins = int(np.ceil(length / per_bin))
        first = 0
        for block in self.inside:
            starts = np.concatenate([[0], np.flatnonzero(np.diff(block)) + 1])
            inside = np.arange(len(block), dtype=np.int32) - starts.astype(np.int32)[block]
            self.place.append((first + block) * self.bins + inside // per_bin)
            first += block[-1] + 1
        self.count = len(run_of)
        self._counts: list[tuple[np.ndarray, np.ndarray]] = []
        self.run_of = np.array(run_of)
        self.owner = self.run_of if owner is None else owner

    def block(self, i: int) -> np.ndarray:
        """The block of each sample of run i."""
        return int(np.flatnonzero(self.run_of == i)[0]) + self.inside[i]

    def picked(self, samples: list[np.ndarray]) -> Blocks:
        """The same blocks for runs that are made of these samples of the runs."""
        other = copy(self)
        other._counts = []
        other.place, other.inside = ([x[pick] for x, pick in zip(of, samples)] for of in (self.place, self.inside))
        return other

    def firsts(self, i: int, share: float) -> np.ndarray:
        """Places of the samples of run i in the first share of its blocks."""
        lengths = np.bincount(self.inside[i])
        inside = np.arange(len(self.inside[i])) - (np.cumsum(lengths) - lengths)[self.inside[i]]
        return np.flatnonzero(inside < np.ceil(share * lengths)[self.inside[i]])

    def bin(self, place: np.ndarray, samples: np.ndarray, good: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Sums and counts of the good samples in all bins; `place`: the bin of each."""
        size = self.count * self.bins
        if good.all():
            return np.bincount(place, samples, size), self._all(place)
        place, samples = place[good], samples[good]
        return np.bincount(place, samples, size), np.bincount(place, minlength=size)

    def _all(self, place: np.ndarray) -> np.ndarray:
        """Counts of all samples of a run in all bins, which are asked for again and again."""
        found = next((counts for known, counts in self._counts if known is place), None)
        if found is None:
            found = np.bincount(place, minlength=self.count * self.bins)
            found.flags.writeable = False
            if any(place is one for one in self.place[: RULES.residuals.derived_remembered]):
                self._counts.append((place, found))
        return found


def compared(x: np.ndarray, take: np.ndarray | None, n: int) -> np.ndarray:
    """x, which has all samples of a run, at the n that a residual compares: all of them, or those that it takes."""
    return x if n == len(x) else x[take]
