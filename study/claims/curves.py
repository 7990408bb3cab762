"""What the claims read off a run's table: curves, windows, means, energies."""

from __future__ import annotations

import math
from collections.abc import Iterable
from dataclasses import dataclass, field
from itertools import combinations

import numpy as np
import pandas as pd

from selflock.master.errors import ResultError

from ..manoeuvre import WINDOWS

LIMIT = 0.02  # the self-locking limit, tan alpha = 1/r at r = 50


class Curves:
    """One run's table, read by column and window. F and P are the rear reducer's input and output torque in N.m."""

    def __init__(self, table: pd.DataFrame):
        self.table = table
        self.time = table["time"].to_numpy()

    def __getitem__(self, name: str) -> np.ndarray:
        try:
            return self.table[name].to_numpy(dtype=float)
        except KeyError:
            raise ResultError(f"The run has no column {name}; it has {', '.join(self.table.columns[:8])}, ….") from None

    @property
    def F(self) -> np.ndarray:
        """Input torque of the rear reducer, N.m."""
        return self["rear_reducer.input_torque"]

    @property
    def P(self) -> np.ndarray:
        """Output torque of the rear reducer, N.m."""
        return self["rear_reducer.output_torque"]

    def inside(self, window: str | tuple[float, float]) -> np.ndarray:
        """Mask of a window given by name or as (start, stop) in s."""
        start, stop = WINDOWS[window] if isinstance(window, str) else window
        mask = (self.time >= start - 1e-9) & (self.time <= stop + 1e-9)
        if mask.sum() < 3:
            raise ResultError(f"The run ends at {self.time[-1]:g} s and has nothing to say about {start:g}–{stop:g} s.")
        return mask

    def mean(self, values, window) -> float:
        """Mean over a window, in the values' unit."""
        return float(self._values(values)[self.inside(window)].mean())

    def ripple(self, values, window) -> float:
        """Standard deviation over the magnitude of the mean."""
        part = self._values(values)[self.inside(window)]
        return float(part.std() / abs(part.mean()))

    def energy(self, power, *windows) -> float:
        """Integral of a power in W over the windows, J."""
        values = self._values(power)
        return float(sum(np.trapezoid(values[mask], self.time[mask]) for mask in map(self.inside, windows)))

    def _values(self, values) -> np.ndarray:
        return self[values] if isinstance(values, str) else values

    def settled_after(self, start: float, stop: float, values: np.ndarray, bound: float) -> float:
        """Time from `start` until the magnitude stays within the bound until `stop`, s."""
        mask = self.inside((start, stop))
        outside = np.flatnonzero(np.abs(values[mask]) > bound)
        return float(self.time[mask][outside[-1]] - start) if len(outside) else 0.0


@dataclass(frozen=True)
class Facts:
    """Parameters the claims need. SI."""

    gear_ratio: float
    resistance: float
    torque_constant: float
    sprocket_radius: float
    preload: float = 0.0

    @property
    def alpha(self) -> float:
        """Lead angle of the wedge, rad: tan alpha = 1 / gear_ratio."""
        return math.atan(1.0 / self.gear_ratio)

    def sliding_ratio(self, mu: float, direction: int) -> float:
        """F(mu)/F(0) while sliding: tan(alpha + phi)/tan alpha against the load (+1), tan(alpha - phi)/tan alpha with it (-1)."""
        return math.tan(self.alpha + direction * math.atan(mu)) / math.tan(self.alpha)


@dataclass
class Runs:
    """All runs of the study, by what they vary."""

    facts: Facts
    kinematic: dict[float, Curves] = field(default_factory=dict)  # by friction coefficient
    dynamic: dict[float, Curves] = field(default_factory=dict)
    standstill: Curves | None = None  # the manoeuvre without driving
    contact: dict[tuple[str, float], Curves] = field(default_factory=dict)  # by contact parameter and factor
    sweep: dict[float, Curves] = field(default_factory=dict)  # belt track, by friction coefficient

    def each(self) -> Iterable[tuple[str, float, Curves]]:
        """The eight runs: mode, friction coefficient, curves."""
        for mode, runs in (("kinematic", self.kinematic), ("dynamic", self.dynamic)):
            for mu, curves in sorted(runs.items()):
                yield mode, mu, curves


def pairs(runs: dict) -> Iterable[tuple]:
    """All pairs of values, by rising key."""
    return combinations([runs[key] for key in sorted(runs)], 2)


def rms(values: np.ndarray) -> float:
    """Root mean square, in the values' unit."""
    return float(np.sqrt(np.mean(np.square(values))))


def largest(values: Iterable[float]) -> float:
    """The maximum; NaN when one of the values is NaN, so that no check can pass over it."""
    return float(np.max(list(values)))


def least(values: Iterable[float]) -> float:
    """The minimum; NaN when one of the values is NaN."""
    return float(np.min(list(values)))


def least_step(values: Iterable[float]) -> float:
    """The smallest difference between neighbours: above zero if and only if they increase."""
    return float(np.min(np.diff(np.array(list(values), dtype=float))))


def apart(a: float, b: float) -> float:
    """Difference over the larger magnitude."""
    return abs(a - b) / max(abs(a), abs(b))
