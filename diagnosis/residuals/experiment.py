"""All runs of a measurement under one rig, and how far a simulation with given parameter values is off in each residual.

An experiment does not change. What looks at the same measurement otherwise (more samples, finer steps, FMUs in the laws'
places) is another experiment, made by `but`. Two kinds share all that is here: those of a drive (drive_experiment.py) and
those of any system of FMUs (systems.system).
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from copy import copy
from typing import Any, Self

import numpy as np

from ..data.log import MeasuredRun
from ..data.rig import Rig
from ..rules import RULES
from . import memory
from .blocks import Blocks, compared
from .residual import Compared, Residual


class Experiment:
    """Runs, the blocks that they are cut into, and the residuals that they allow.

    rig, runs; original: the runs as they were read, where `runs` are points made of them.
    layout: blocks and bins. residuals: what is compared. channels: of each run and drive, what a residual computes from.
    """

    rig: Rig
    runs: list[MeasuredRun]
    original: list[MeasuredRun]
    layout: Blocks
    residuals: tuple[Residual, ...]
    channels: Mapping[tuple[int, str], Any]
    steady = False

    def __init__(self) -> None:
        self._memory: dict[str, dict] = {}

    def but(self, **changes: Any) -> Self:
        """Another experiment that differs in these attributes; it remembers nothing yet."""
        other = copy(self)
        for name, value in changes.items():
            setattr(other, name, value)
        other._memory = {}
        return other

    def variables(self, residual: Residual, values: dict) -> Mapping[str, list[np.ndarray]]:
        """What the error of a residual may depend on, by name: one array for each run."""
        raise NotImplementedError

    def moves(self, residual: Residual, values: dict) -> list[tuple[np.ndarray, np.ndarray]]:
        """Speed of the input shaft and output torque of a residual's drive, for each run; empty where nothing moves."""
        return []

    def window(self, residual: Residual) -> int:
        """Samples over which the motions that a residual is computed from are smoothed."""
        return 1

    def reach(self, residual: Residual) -> int:
        """Samples over which smoothing ties the errors of a residual together."""
        return self.window(residual) if residual.smoothed else 1

    def forget(self) -> None:
        """Let go of what was derived from channels: what is asked for next is remembered in its place."""

    def head(self, samples: list[int]) -> Self:
        """The same blocks and residuals over the first samples of each run."""
        raise NotImplementedError

    def enough(self, blocks: np.ndarray, left: int = RULES.residuals.shown) -> list[int]:
        """Samples of each run that hold so many (`left`) of these blocks' samples, for what is slow or large."""
        found = []
        for i in range(len(self.runs)):
            block = self.layout.block(i)
            places = np.flatnonzero(blocks[block])[:left]
            left -= len(places)
            found.append(min(len(block), max(RULES.residuals.shown_least, int(places[-1]) + 1 if len(places) else 0)))
        return found

    # --- residuals ---------------------------------------------------------------------------------------------------

    @property
    def by_channel(self) -> bool:
        """Whether every channel is compared with a whole drive's: then it has its own noise, and no other's."""
        return all(residual.kind == "whole" for residual in self.residuals)

    def compare(self, residual: Residual, values: dict[str, float]) -> list[Compared]:
        """Simulated, measured, trusted of each run: trusted where the residual says so and all its channels are sound."""
        found = []
        for i, run in enumerate(self.runs):
            ch = self.channels[i, residual.prefix]
            simulated, measured, good = residual.compute(values, ch)
            found.append((simulated, measured, self._trusted(i, residual, good, ch.take, run)))
        return found

    def _trusted(self, i: int, residual: Residual, good: np.ndarray, take: np.ndarray | None, run: MeasuredRun) -> np.ndarray:
        """Of the samples of a run that a residual itself trusts those that are trusted; of what it has for good, found once."""
        known, key = self.remembered("trusted"), (i, residual.name)
        own, trusted = known.get(key, (None, good))
        if own is good:
            return trusted
        trusted = good
        for more in (_sound(run, residual), self._away_from_gaps(i, residual)):
            if more is not None:
                trusted = trusted & compared(more, take, len(good))
        if take is not None and len(good) == len(run):  # what has all samples counts no more than what has few
            trusted = trusted & _among(take, len(run))
        if not good.flags.writeable:
            trusted.flags.writeable = False
            known[key] = good, trusted
        return trusted

    def _away_from_gaps(self, i: int, residual: Residual) -> np.ndarray | None:
        """Samples of a run that no gap reaches, by smoothing or by what the drive did in it; None where there is none.

        A whole drive is not asked: it goes through a gap, and says itself where that is known again.
        """
        run, samples = self.runs[i].within or (self.runs[i], slice(None))
        key = ("away from gaps", reach := self.window(residual))
        if residual.kind == "whole" or self.steady:
            return None
        if key not in run.memory:
            behind, away = np.flatnonzero(run.behind_gaps), np.ones(len(run), bool)
            for row in behind:
                away[max(0, row - reach - 1) : row + reach + 1] = False
                away[row : np.searchsorted(run.time, run.time[row] + RULES.residuals.settling)] = False
            run.memory[key] = away if len(behind) else None
        away = run.memory[key]
        return None if away is None else away[samples]

    def binned(self, residual: Residual, values: dict[str, float]) -> tuple[np.ndarray, np.ndarray]:
        """Mean of measured - simulated and count in each bin, arrays (blocks, bins)."""
        layout = self.layout
        total, count = np.zeros(layout.count * layout.bins), np.zeros(layout.count * layout.bins, int)
        for i, (simulated, measured, good) in enumerate(self.compare(residual, values)):
            error = measured - simulated
            if not (finite := np.isfinite(error)).all():
                wild = ~finite & good  # a simulation that breaks down is wrong, not absent
                known = measured[np.isfinite(measured)]
                error = np.where(wild, RULES.residuals.broken * np.std(known) if len(known) else np.inf, error)
            sums, counts = self._summed(i, residual, error, good)
            total += sums
            count += counts
        return (total / np.maximum(count, 1)).reshape(layout.count, layout.bins), count.reshape(layout.count, layout.bins)

    def _summed(self, i: int, residual: Residual, error: np.ndarray, good: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Sums and counts of the trusted samples of a run in all bins; where these lie is found once of what is trusted for good."""
        layout, place = self.layout, self._place(i, residual, len(error))
        if good.flags.writeable:
            return layout.bin(place, error, good)
        known, key = self.remembered("bins"), (i, residual.name)
        if known.get(key, (None,))[0] is not good:
            rows = np.flatnonzero(good)
            known[key] = good, rows, place[rows], layout.bin(place, error, good)[1]
        _, rows, place, counts = known[key]
        return np.bincount(place, error[rows], len(counts)), counts

    def _place(self, i: int, residual: Residual, samples: int) -> np.ndarray:
        """The bin of each of the samples of a run that a residual compares."""
        known, place = self.remembered("places"), self.layout.place[i]
        if samples == len(place):
            return place
        if (key := (i, residual.prefix)) not in known:
            known[key] = compared(place, self.channels[key].take, samples)
        return known[key]

    def misfit(self, values: dict[str, float], noise: np.ndarray | None = None, of: Sequence[int] | None = None) -> np.ndarray:
        """(blocks, bins of all residuals), each in units of its `noise` or as it is; 0 where there are no trusted samples.

        of: the residuals that are asked for, by their places; all.
        """
        asked = range(len(self.residuals)) if of is None else of
        found = [self._remembered(self.residuals[i], values) for i in asked]
        return np.concatenate(found if noise is None else [x / noise[i] for i, x in zip(asked, found)], axis=1)

    def _remembered(self, residual: Residual, values: dict[str, float]) -> np.ndarray:
        """A residual's bins, computed only when a value that it uses is new: a fit changes few residuals at a time."""
        used = self.remembered(f"{residual.name} uses")
        for name in values:
            if name not in used:
                used[name] = residual.uses(name)
        key = frozenset((name, value) for name, value in values.items() if used[name])
        most = RULES.residuals.remembered
        return memory.kept(self.remembered(residual.name), key, lambda: self.binned(residual, values)[0], most)

    def remembered(self, what: str) -> dict:
        """What this experiment keeps under a name, for those who fill it."""
        return self._memory.setdefault(what, {})

    def present(self, values: dict[str, float]) -> np.ndarray:
        """Which entries of the misfit are backed by samples."""
        return np.concatenate([self.binned(residual, values)[1] > 0 for residual in self.residuals], axis=1)

    def slice(self, residual: Residual) -> slice:
        """Columns of `misfit` that belong to a residual."""
        place = self.residuals.index(residual)
        return slice(place * self.layout.bins, (place + 1) * self.layout.bins)

    @property
    def step(self) -> float:
        """The usual time from a sample to the next, s."""
        return float(np.median(np.concatenate([np.diff(run.time) for run in self.runs])))

    @property
    def components(self) -> set[str]:
        """Components that some residual runs."""
        return {name for residual in self.residuals for name in residual.components}

    @property
    def measured(self) -> set[str]:
        """Channels that some residual reads or compares."""
        return {name for residual in self.residuals for name in (*residual.reads, residual.output)}


def _among(places: np.ndarray, n: int) -> np.ndarray:
    """Which of n samples are at these places."""
    found = np.zeros(n, bool)
    found[places] = True
    return found


def _sound(run: MeasuredRun, residual: Residual) -> np.ndarray | None:
    """Samples at which all channels of a residual can be trusted; None where that is everywhere."""
    key = ("sound", *residual.reads, residual.output)
    if key not in run.memory:
        sound = run.usable(*residual.reads, residual.output)
        run.memory[key] = None if sound.all() else sound
    return run.memory[key]
