"""What the numbers of columns say of each other: which is the derivative of which, which are proportional, which leads.

Over pieces of a run: means have next to no noise, and neither counts nor a filter's lag matter much.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from functools import cached_property

import numpy as np

from ..data.values import liveliest, means
from ..rules import RULES


@dataclass
class Columns:
    """The numeric columns of a log on one time axis; `parts`: the rows of each run. `time` in s, or in whatever the log has."""

    time: np.ndarray
    values: dict[str, np.ndarray]
    parts: list[slice]
    _memory: dict = field(default_factory=dict, repr=False)

    @cached_property
    def edges(self) -> list[np.ndarray]:
        """Rows between which pieces lie, for each run; of one in whose pieces whole motions would cancel, for parts with much motion."""
        total = sum(part.stop - part.start for part in self.parts)
        found = []
        for part in self.parts:
            rows = part.stop - part.start
            most = max(1, int(RULES.begin.pieces * rows / max(total, 1)))
            most = max(1, min(most, (rows - 1) // RULES.begin.shortest))
            found += self._closer(part, most) or [np.linspace(part.start, part.stop - 1, most + 1).astype(int)]
        return found

    def _closer(self, part: slice, most: int) -> list[np.ndarray]:
        """The same number of pieces, each shorter, in parts of a run that is long beside its motions; none where it is not."""
        rules, rows = RULES.begin, (part.stop - part.start) // most
        least = rules.shortest
        if rows < 2 * least or most < 2 * rules.closer:
            return []
        moving = []  # what goes on over some rows, as a motion does; of noise four times as many leave a quarter of the power
        for x in self.values.values():
            here = x[part] if np.isfinite(x[part]).all() else np.zeros(0)
            few, more = (float(np.var(means(here, count))) for count in (least, 4 * least))
            power = few - 4.0 / 3.0 * (few - more)
            if power > rules.motion * few > 0.0:
                moving.append((here, float(np.sqrt(power))))
        if not moving:
            return []
        whole, kept = rows, lambda: float(np.median([np.std(means(x, rows)) / size for x, size in moving]))
        while rows >= 2 * least and kept() < rules.moves_on:
            rows //= 2
        if rows == whole:
            return []
        length = rows * (most // rules.closer)
        chosen = liveliest(moving, np.arange(0, part.stop - part.start - length, length), length, rules.closer)
        return [part.start + np.arange(start, start + length + 1, rows) for start in chosen]

    def change(self, name: str) -> np.ndarray:
        """By how much a column goes on over each piece."""
        return self._kept("change", name, lambda x, e: np.diff(x[e]))

    def way(self, name: str) -> np.ndarray:
        """A column's integral over each piece."""

        def over(x: np.ndarray, edges: np.ndarray) -> np.ndarray:
            here = slice(edges[0], edges[-1] + 1)
            steps = 0.5 * (x[here][1:] + x[here][:-1]) * np.diff(self.time[here])
            return np.diff(np.concatenate([[0.0], np.cumsum(steps)])[edges - edges[0]])

        return self._kept("way", name, over)

    def mean(self, name: str) -> np.ndarray:
        """A column's mean over each piece."""
        return self.way(name) / self.lasting

    @cached_property
    def lasting(self) -> np.ndarray:
        """How long each piece lasts."""
        return np.concatenate([np.diff(self.time[edges]) for edges in self.edges])

    def slope(self, name: str) -> np.ndarray:
        """Derivative of a column's means, over the pieces beside each; nan at the ends of runs."""
        means, found, first = self.mean(name), [], 0
        for edges in self.edges:
            count = len(edges) - 1
            middle = (self.time[edges[1:]] + self.time[edges[:-1]]) / 2.0
            here = np.full(count, np.nan)
            if count > 2:
                x = means[first : first + count]
                with np.errstate(all="ignore"):
                    here[1:-1] = (x[2:] - x[:-2]) / (middle[2:] - middle[:-2])
            found.append(here)
            first += count
        return np.concatenate(found)

    def _kept(self, what: str, name: str, make) -> np.ndarray:
        if (what, name) not in self._memory:
            x = self.values[name]
            self._memory[what, name] = np.concatenate([make(x, edges) for edges in self.edges if len(edges) > 1] or [np.zeros(0)])
        return self._memory[what, name]


@dataclass(frozen=True)
class Tie:
    """y = factor · x, and how well: r is the correlation through zero, centred that about the means (nan where x is steady)."""

    factor: float
    r: float
    centred: float
    pieces: int
    spread: float  # of the factor, relative, as its error of estimate

    def holds(self, least: float) -> bool:
        """Whether the two go together this well, in what varies, too."""
        return self.pieces >= RULES.begin.fewest and abs(self.r) >= least and not self.centred < least * 2.0 - 1.0

    @property
    def told(self) -> str:
        """How well, in brackets, or that too little of them is there to say."""
        few = f" of {self.pieces} pieces, which are too few to tell" if self.pieces < RULES.begin.fewest else ""
        return f"(r = {self.r:.2f}{few})"


NONE = Tie(float("nan"), 0.0, float("nan"), 0, float("inf"))


def tie(y: np.ndarray, x: np.ndarray) -> Tie:
    """How y follows x through zero, of pieces in which both are numbers."""
    both = np.isfinite(x) & np.isfinite(y)
    x, y = x[both], y[both]
    x, y = _agreeing(x, y)
    xx, yy, xy = float(x @ x), float(y @ y), float(x @ y)
    if len(x) < 3 or xx <= 0.0 or yy <= 0.0:
        return NONE
    factor = xy / xx
    left = y - factor * x
    spread = float(np.sqrt(left @ left / max(len(x) - 1, 1) / xx)) / abs(factor) if factor else float("inf")
    deviation = float(np.std(x)), float(np.std(y))
    steady = deviation[0] < 0.02 * np.sqrt(xx / len(x))
    centred = float("nan") if steady or 0.0 in deviation else abs(float(np.corrcoef(x, y)[0, 1]))
    return Tie(factor, xy / np.sqrt(xx * yy), centred, len(x), spread)


def _agreeing(x: np.ndarray, y: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Without the few pieces that are far from what most say: an encoder that was set anew, runs that were joined."""
    large = abs(x) > np.median(abs(x))
    if large.sum() < RULES.begin.fewest:
        return x, y
    left = abs(y - np.median(y[large] / x[large]) * x)
    keep = left <= RULES.begin.astray * np.median(left)
    return (x[keep], y[keep]) if np.mean(keep) > 1.0 - RULES.begin.few_astray else (x, y)


def integral(columns: Columns, angle: str, speed: str) -> Tie:
    """Whether one column is the integral of another."""
    return tie(columns.change(angle), columns.way(speed))


def proportional(columns: Columns, second: str, first: str, changes: bool) -> Tie:
    """Whether one column is another times a factor: by their changes (angles, whose zeros are anywhere) or their means."""
    of = columns.change if changes else columns.mean
    return tie(of(second), of(first))


def lead(columns: Columns, first: str, second: str) -> float:
    """By how many rows `first` comes before `second`, which goes as it does; 0 where that is not told."""
    part = max(columns.parts, key=lambda p: p.stop - p.start)
    rows = slice(part.start, min(part.stop, part.start + RULES.begin.looked_at))
    x, y = (np.diff(columns.values[name][rows]) for name in (first, second))
    x, y = (np.nan_to_num(z - np.nanmean(z)) for z in (x, y))
    if len(x) < 32 or not x.any() or not y.any():
        return 0.0
    size = 1 << int(np.ceil(np.log2(2 * len(x))))
    both = np.fft.irfft(np.fft.rfft(y, size) * np.conj(np.fft.rfft(x, size)), size)
    reach = max(2, min(len(x) // 4, size // 2 - 1))
    near = np.concatenate([both[-reach:], both[: reach + 1]])
    best = int(np.argmax(abs(near)))
    return float(best - reach)


def roughness(x: np.ndarray) -> float:
    """Size of the second differences over that of the first: noise is rough, what somebody made up is not."""
    x = x[np.isfinite(x)][: RULES.begin.looked_at]
    first = np.diff(x)
    size = float(np.mean(abs(first))) if len(first) else 0.0
    return float(np.mean(abs(np.diff(first)))) / size if size else 0.0


def grain(x: np.ndarray) -> float:
    """The step in which a column is told; 0 where it has none."""
    x = x[np.isfinite(x)][: RULES.begin.looked_at]
    values = np.unique(x)
    if len(values) < 3 or len(values) > 0.5 * len(x):
        return 0.0
    steps = np.diff(values)
    size = float(np.ptp(values))
    steps = steps[steps > 1e-9 * size]
    if not len(steps):
        return 0.0
    least = float(np.quantile(steps, 0.05))
    multiples = steps / least
    even = np.mean(abs(multiples - np.round(multiples)) < 0.1)
    if even < 0.9:
        return 0.0
    near = steps[np.round(multiples) == 1.0]
    return float(np.mean(near))


def fitted(y: np.ndarray, *parts: np.ndarray) -> tuple[list[float], float]:
    """y as a sum of parts: their factors, and the share of y (its root mean square about 0) that is left."""
    matrix = np.column_stack(parts)
    sound = np.isfinite(matrix).all(axis=1) & np.isfinite(y)
    matrix, y = matrix[sound], y[sound]
    if len(y) < RULES.begin.fewest + len(parts) or not y.any():
        return [float("nan")] * len(parts), 1.0
    scale = np.sqrt(np.mean(matrix**2, axis=0))
    scale[scale == 0.0] = 1.0
    found, *_ = np.linalg.lstsq(matrix / scale, y, rcond=None)
    left = float(np.sqrt(np.mean((y - matrix / scale @ found) ** 2) / np.mean(y**2)))
    return [float(value) for value in found / scale], left
