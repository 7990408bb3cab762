"""Runs in pieces: what each channel does over a stretch of sound samples. Means have little noise, however fast the log."""

from __future__ import annotations

from functools import cached_property

import numpy as np

from ..rules import RULES
from .log import MeasuredRun
from .signals import MOVES, SETPOINTS
from .values import liveliest, means

MOVED = {*MOVES, *SETPOINTS}


class Pieces:
    """All runs of a log in pieces, for one drive. Every answer has a number for each piece, nan where a sample is not sound.

    prefix: of the drive's signals. most: pieces of a run.
    """

    def __init__(self, runs: list[MeasuredRun], prefix: str, most: int):
        self.runs, self.prefix = runs, prefix
        self._known: dict[tuple[str, str], np.ndarray] = {}  # logs are long, and asked again and again
        self.edges = [
            np.linspace(0, len(run) - 1, max(1, min(most, (len(run) - 1) // RULES.data.piece_samples)) + 1).astype(int)
            for run in runs
        ]

    def has(self, signal: str) -> bool:
        """Whether all runs have this channel."""
        return all(self.prefix + signal in run.signals for run in self.runs)

    def change(self, signal: str) -> np.ndarray:
        """Of an angle: by how much it goes on over each piece."""
        return self._each("change", lambda run, edges: np.diff(run.signals[self.prefix + signal][edges]), signal)

    def way(self, signal: str) -> np.ndarray:
        """A channel's integral over each piece: of a speed the way."""
        return self._each("way", self._integral(signal), signal)

    def mean(self, signal: str) -> np.ndarray:
        """A channel's mean over each piece."""
        return self.way(signal) / self.lasting

    def at_ends(self, signal: str) -> np.ndarray:
        """A channel's mean at the end of each piece, over the last samples of it, less that at its begin."""
        few = RULES.data.piece_samples // 2

        def differ(run: MeasuredRun, edges: np.ndarray) -> np.ndarray:
            total = np.concatenate([[0.0], np.cumsum(np.nan_to_num(run.signals[self.prefix + signal]))])
            low, high = np.maximum(edges - few, 0), np.minimum(edges + few + 1, len(run))
            return np.diff((total[high] - total[low]) / (high - low))

        return self._each("at ends", differ, signal)

    def samples(self, *signals: str) -> list[np.ndarray]:
        """Sound samples of all these channels, some of a long log's."""
        names = [self.prefix + signal for signal in signals]
        every = max(1, sum(map(len, self.runs)) // RULES.data.ahead_samples)
        rows = [np.flatnonzero(run.usable(*names))[::every] for run in self.runs]
        found = [np.concatenate([run.signals[name][at] for run, at in zip(self.runs, rows)]) for name in names]
        sound = np.all(np.isfinite(found), axis=0)
        return [x[sound] for x in found]

    @cached_property
    def lasting(self) -> np.ndarray:
        """s of each piece."""
        return np.concatenate([np.diff(run.time[edges]) for run, edges in zip(self.runs, self.edges)])

    @cached_property
    def middle(self) -> np.ndarray:
        """Time of each piece, s."""
        return np.concatenate([(run.time[e[1:]] + run.time[e[:-1]]) / 2.0 for run, e in zip(self.runs, self.edges)])

    def slope(self, means: np.ndarray) -> np.ndarray:
        """Derivative of what is given for each piece, over the pieces beside it; nan at the ends of runs."""
        found, first = np.full(len(means), np.nan), 0
        for edges in self.edges:
            last = first + len(edges) - 1
            if last - first > 2:
                x, t = means[first:last], self.middle[first:last]
                found[first + 1 : last - 1] = (x[2:] - x[:-2]) / (t[2:] - t[:-2])
            first = last
        return found

    def smooth(self, means: np.ndarray) -> np.ndarray:
        """As `slope` smoothes: a piece and half of each beside it."""
        found = np.full(len(means), np.nan)
        if len(means) > 2:
            found[1:-1] = (means[:-2] + 2.0 * means[1:-1] + means[2:]) / 4.0
        return found

    def _integral(self, signal: str):
        def over(run: MeasuredRun, edges: np.ndarray) -> np.ndarray:
            x = np.nan_to_num(run.signals[self.prefix + signal])
            total = np.concatenate([[0.0], np.cumsum(0.5 * (x[1:] + x[:-1]) * np.diff(run.time))])
            return np.diff(total[edges])

        return over

    def _each(self, what: str, of, signal: str) -> np.ndarray:
        if (what, signal) not in self._known:
            self._known[what, signal] = self._told(of, signal)
        return self._known[what, signal].copy()

    def _told(self, of, signal: str) -> np.ndarray:
        parts = []
        for run, edges in zip(self.runs, self.edges):
            with np.errstate(all="ignore"):
                values = of(run, edges)
            bad = np.concatenate([[0], np.cumsum(~run.usable(self.prefix + signal))])
            values = np.where(bad[edges[1:] + 1] == bad[edges[:-1]], values, np.nan)
            parts.append(values)
        return np.concatenate(parts)


def telling(runs: list[MeasuredRun], prefix: str) -> list[MeasuredRun]:
    """The runs; of one so long that whole motions cancel in a piece, the parts with most motion, whose pieces are shorter."""
    return [part for run in runs for part in _parts(run, prefix)]


def _parts(run: MeasuredRun, prefix: str) -> list[MeasuredRun]:
    rules, samples = RULES.data, len(run) // RULES.data.pieces
    named = {n.removeprefix(prefix): x for n, x in run.signals.items() if n.removeprefix(prefix) in MOVED}
    speeds = {name: x for name, x in named.items() if name.partition(".")[2].startswith(("speed", "input_speed"))}
    least = rules.kept_speed if speeds else rules.kept_angle
    moved = [np.where(np.isfinite(x), x, np.nanmean(x)) for x in (speeds or named).values() if np.isfinite(x).any()]
    whole = [(x, float(np.std(means(x, rules.piece_samples)))) for x in moved] if samples else []  # with little noise
    whole = [(x, size) for x, size in whole if size]
    if samples < 2 * rules.piece_samples or not whole:
        return [run]
    kept = lambda: max(np.std(means(x, samples)) / size for x, size in whole)
    while samples >= 2 * rules.piece_samples and kept() < least:
        samples //= 2
    length = samples * rules.pieces
    if 2 * length > len(run):
        return [run]
    chosen = liveliest(whole, np.arange(0, len(run) - length + 1, length), length, rules.most_parts)
    return [run.picked(np.arange(start, start + length)) for start in chosen]
