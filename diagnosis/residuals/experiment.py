"""All runs of a measurement under one rig, and how far a simulation with given parameter values is off in each residual."""

from __future__ import annotations

from copy import copy
from threading import Lock

import numpy as np

from ..data.log import MeasuredRun
from ..data.rig import Rig, split
from ..errors import DataError
from .blocks import Blocks, compared
from .channels import Channels
from .kernels import kernels
from .laws import parameters
from .residual import Residual, residuals

MOST = 3_000
"""Samples of the gear's friction simulated in a fit: of longer logs, stretches spread over all of it."""

MOST_WHOLE = 4_500
"""Samples of a whole drive simulated in a fit: of longer logs, the first part of each block, started as measured."""

LONGEST = 0.045
"""s; a longer smoothing window would blur the motion itself."""

STRETCH = 80
"""Samples in such a stretch."""

SHOWN = 60_000
"""Samples that show what an FMU or a finer step leaves: FMPy would take longer for an hour than the whole diagnosis."""

SHORT = 100
"""Samples kept of a run that has none to show: it is there for its place among the others."""


class Experiment(Blocks):
    """All runs of a measurement under one rig, and the misfit of a simulation with given parameter values."""

    def __init__(self, rig: Rig, runs: list[MeasuredRun], sampled: bool = False):
        self.rig, self.steady = rig, rig.kind == "steady"
        self.original = runs
        self.runs, owner = points(runs, bool(rig.run)) if self.steady else (runs, None)
        self.channels = {
            (i, prefix): Channels(run, prefix, self.steady) for i, run in enumerate(self.runs) for prefix in rig.drives
        }
        self.kernels = kernels()  # laws that run; extend puts FMUs in their place
        self._memory: dict[str, dict] = {}
        self._lock = Lock()
        self.smoothing = {prefix: 11 for prefix in rig.drives}
        self.samples = total = sum(len(run) for run in self.runs)
        for ch in self.channels.values():
            ch.take = stretches(len(ch.run), MOST / total) if sampled and total > 1.5 * MOST and not self.steady else None
        self.choosing = False  # the smoothing
        self.residuals = [
            residual
            for prefix in rig.drives
            for residual in residuals(self, prefix)
            if not rig.only or residual.components == (rig.only,)
        ]
        if not self.residuals:
            have = sorted({name for run in self.runs for name in run.signals})
            raise DataError(
                f"{rig.path}: the columns {', '.join(have)} allow no comparison. A log needs a motion and a torque, "
                "current or voltage, or set-points and a voltage; docs/rig.md lists what goes together."
            )
        super().__init__(self.runs, self.steady)
        if owner is not None:
            self.owner = owner
        if sampled and any(residual.name.endswith("drive") for residual in self.residuals):
            for (i, _), ch in self.channels.items():
                ch.take = self.firsts(i, MOST_WHOLE / total) if total > 1.5 * MOST_WHOLE else None
        for prefix in rig.drives:
            self._choose_smoothing(prefix)

    def _choose_smoothing(self, prefix: str) -> None:
        """The shortest window over which the noise of the acceleration matters no more than that of the torque."""
        gear = next((residual for residual in self.residuals if residual.name == prefix + "gear"), None)
        if gear is None or self.steady:
            return
        if self.rig.smoothing > 0.0:
            self.smoothing[prefix] = max(5, int(round(self.rig.smoothing / float(np.median(self.channels[0, prefix].dt)))) | 1)
            return
        levels = {}
        self.choosing = True  # the balance is not smoothed meanwhile
        step = self.step
        for samples in (n for n in (5, 7, 11, 17, 25, 41, 61) if n == 5 or n * step <= LONGEST):
            self.smoothing[prefix] = samples
            steps, count = 0.0, 0
            for simulated, measured, good in self.compare(gear, {}):
                e = (measured - simulated)[good]
                if len(e) > 20:
                    steps, count = steps + float(np.median(abs(e - np.median(e)))) * len(e), count + len(e)
            levels[samples] = steps / max(count, 1)
        self.choosing = False
        self.smoothing[prefix] = min(samples for samples, level in levels.items() if level <= 1.15 * min(levels.values()))

    def reach(self, residual: Residual) -> int:
        """Samples over which smoothing ties the misfit of a residual together."""
        return self.smoothing[residual.prefix] if residual.name.endswith(("gear", "input", "output")) and not self.steady else 1

    def take_all(self) -> bool:
        """From now on simulate all samples; False where that is done already."""
        sampled = any(ch.take is not None for ch in self.channels.values())
        for ch in self.channels.values():
            ch.take = None
        self._memory.clear()
        return sampled

    def forget(self) -> None:
        """Let go of all motions: those that are asked for next are remembered in their place."""
        for run in self.runs:
            for key in [key for key in run.memory if key[0] == "motion"]:
                del run.memory[key]

    def enough(self, blocks: np.ndarray) -> list[int]:
        """Samples of each run within which there are `SHOWN` samples of these blocks, for what is slow or large."""
        left, found = SHOWN, []
        for i, block in enumerate(self.block_of):
            first = int(np.flatnonzero(self.block_run == i)[0])
            places = np.flatnonzero(blocks[first + block])[:left]
            left -= len(places)
            found.append(min(len(block), max(SHORT, int(places[-1]) + 1 if len(places) else 0)))
        return found

    def head(self, samples: list[int]) -> Experiment:
        """The same blocks, residuals and smoothing over the first samples of each run."""
        short = copy(self)
        short.runs = [run.head(n) for run, n in zip(self.runs, samples)]
        short.channels = {(i, prefix): Channels(short.runs[i], prefix, self.steady) for i, prefix in self.channels}
        short.place, short.block_of = ([x[:n] for x, n in zip(of, samples)] for of in (self.place, self.block_of))
        short._memory = {}
        return short

    # --- the misfit --------------------------------------------------------------------------------------

    def compare(self, residual: Residual, values: dict[str, float]):
        """Simulated, measured, trusted of each run: trusted where the residual says so and all its channels are sound."""
        found = []
        for i, run in enumerate(self.runs):
            ch = self.channels[i, residual.prefix]
            simulated, measured, good = residual.compute(self, values, ch)
            sound = _sound(run, residual)
            if sound is not None:
                good = good & compared(sound, ch.take, len(good))
            found.append((simulated, measured, good))
        return found

    def binned(self, residual: Residual, values: dict[str, float]) -> tuple[np.ndarray, np.ndarray]:
        """Mean misfit (measured - simulated) and count in each bin, arrays (blocks, bins)."""
        total, count = np.zeros(self.blocks * self.bins), np.zeros(self.blocks * self.bins, int)
        for i, (simulated, measured, good) in enumerate(self.compare(residual, values)):
            error = measured - simulated
            wild = ~np.isfinite(error) & good  # a simulation that breaks down is wrong, not absent
            if wild.any():
                known = measured[np.isfinite(measured)]
                error = np.where(wild, 1e3 * np.std(known) if len(known) else np.inf, error)
            place = compared(self.place[i], self.channels[i, residual.prefix].take, len(error))
            sums, counts = self.bin(place, error, good)
            total += sums
            count += counts
        return (total / np.maximum(count, 1)).reshape(self.blocks, self.bins), count.reshape(self.blocks, self.bins)

    def misfit(self, values: dict[str, float]) -> np.ndarray:
        """(blocks, bins of all residuals): misfits in units of their noise; 0 where there are no trusted samples."""
        return np.concatenate([self._remembered(residual, values) / residual.noise for residual in self.residuals], axis=1)

    def _remembered(self, residual: Residual, values: dict[str, float]) -> np.ndarray:
        """A residual's misfit, computed only when a value that it uses is new: a fit changes few residuals at a time."""
        key = tuple(sorted((name, value) for name, value in values.items() if residual.uses(name)))
        memory = self._memory.setdefault(residual.name, {})
        found = memory.get(key)
        if found is None:
            found = self.binned(residual, values)[0]
            with self._lock:
                while len(memory) >= 24:
                    memory.pop(next(iter(memory)))
                memory[key] = found
        return found

    def present(self, values: dict[str, float]) -> np.ndarray:
        """Which entries of the misfit are backed by samples."""
        return np.concatenate([self.binned(residual, values)[1] > 0 for residual in self.residuals], axis=1)

    def slice(self, residual: Residual) -> slice:
        """Columns of `misfit` that belong to a residual."""
        place = self.residuals.index(residual)
        return slice(place * self.bins, (place + 1) * self.bins)

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

    def value(self, name: str, values: dict[str, float]) -> float:
        """A parameter's value: fitted, else nominal, else the law's default."""
        component, _, parameter = name.rpartition(".")
        base = split(component, self.rig.drives)[1]
        return float(values.get(name, self.rig.parameters.get(name, getattr(parameters(base, component, {}), parameter))))


def _sound(run: MeasuredRun, residual: Residual) -> np.ndarray | None:
    """Samples at which all channels of a residual can be trusted; None where that is everywhere."""
    key = ("sound", *residual.reads, residual.output)
    if key not in run.memory:
        sound = run.usable(*residual.reads, residual.output)
        run.memory[key] = None if sound.all() else sound
    return run.memory[key]


def stretches(n: int, share: float) -> np.ndarray:
    """Places of short stretches spread evenly over n samples, about this share of them."""
    count = max(1, int(n * share / STRETCH))
    firsts = np.linspace(0, max(0, n - STRETCH), count).astype(int)
    return np.unique((firsts[:, None] + np.arange(STRETCH)).ravel().clip(0, n - 1))


def points(runs: list[MeasuredRun], averaged: bool) -> tuple[list[MeasuredRun], np.ndarray]:
    """All steady-state points as one run, and to which run each belongs: means over trusted samples of runs, or rows."""
    names = list(runs[0].signals)
    if averaged:
        mean = lambda x: np.array([x.mean() if len(x) else np.nan])
        parts = [{name: mean(run.signals[name][run.usable(name)]) for name in names} for run in runs]
        good = [{name: np.isfinite(x) for name, x in part.items()} for part in parts]
        rows = [run.rows[:1] for run in runs]
    else:
        parts, rows = [run.signals for run in runs], [run.rows for run in runs]
        good = [{name: run.usable(name) for name in names} for run in runs]
    owner = np.repeat(np.arange(len(runs)), [len(r) for r in rows])
    join = lambda which: {name: np.concatenate([part[name] for part in which]) for name in names}
    return [
        MeasuredRun(runs[0].log, "", np.concatenate(rows), np.arange(len(owner), dtype=float), join(parts), join(good))
    ], owner
