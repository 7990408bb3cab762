"""The ways in which each hypothesis may act, as columns: how a misfit moves with its amplitudes, its shapes fixed.

Misfits are arranged in blocks of equal length, an array (blocks, samples). Around the base fit the simulation is
taken as linear: the misfit under a hypothesis is r + X d, X the base fit's columns and the hypothesis's own.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass, field
from itertools import product
from typing import Any

import numpy as np

from selflock.fmus.effect import AMPLITUDE, ORDER, PHASE, SHAPES, VALUE

from ..rules import RULES
from .fit import change, scale, slope
from .hypotheses import Free, Hypothesis


@dataclass
class Direction:
    """One way in which a hypothesis may act: its shape parameters fixed, its amplitudes as columns."""

    hypothesis: Hypothesis
    shape: dict[str, float]
    amplitudes: tuple[Free, ...]
    columns: np.ndarray  # (blocks, samples, amplitudes), d misfit / d amplitude
    gain: float = 0.0
    amounts: np.ndarray = field(default_factory=lambda: np.zeros(0))
    phase: str = ""  # name of a phase; then the columns are the amplitude's at phase 0 and a quarter later
    of_run: bool = False  # that phase is another in each run: so are then both amounts
    jump: float = 0.0  # where not 0 the only amount that is looked at
    part: slice = field(default_factory=lambda: slice(None))  # of the samples: only there are columns not 0, and kept
    squared: tuple[Any, Any] | None = None  # what was computed of these columns beside a base, and for which (Linear)

    def __post_init__(self):
        touched = np.flatnonzero(np.any(self.columns != 0.0, axis=(0, 2)))
        if len(touched):
            self.part = slice(int(touched[0]), int(touched[-1]) + 1)
            self.columns = np.clip(self.columns[:, self.part], -1e18, 1e18).astype(np.float32)

    @property
    def free(self) -> tuple[Free, ...]:
        """What a fit of this way of acting sets free: amplitudes and shapes."""
        names = {p.name for p in self.amplitudes} | set(self.shape) | ({self.phase} if self.phase else set())
        return tuple(p for p in self.hypothesis.free if p.name in names)

    def sets(self, known: dict) -> tuple[tuple[Free, ...], ...]:
        """What a fit may free beside what is known: the usual, every, and the fewest of its numbers.

        Usual are all but shapes that have a usual value, as no number of waves has; fewest those that the law cannot do without.
        """
        every = tuple(p for p in self.free if p.name not in known)
        usual = tuple(p for p in every if p.role == ORDER or not (p.name in self.shape and 0.0 < p.low < p.nominal < p.high))
        return usual, every, tuple(p for p in usual if not (p.name in self.shape and p.nominal in (p.low, p.high)))

    def little(self) -> dict[str, float]:
        """Values with which it acts, as little as its columns were found with."""
        return {**self.shape, **{p.name: p.nominal + (self.jump or _step(p)) for p in self.amplitudes}}

    def start(self) -> dict[str, float]:
        """Where to start a fit from."""
        values = dict(self.shape)
        if self.phase:
            amplitude = self.amplitudes[0]
            pairs = self.amounts.reshape(-1, 2)  # of each run, where each has a phase: the first has the wave's own name
            values[self.phase] = float(np.arctan2(pairs[0, 1], pairs[0, 0]))
            values[amplitude.name] = amplitude.nominal + float(np.mean(np.hypot(*pairs.T)))
        else:
            for free, amount in zip(self.amplitudes, self.amounts):
                values[free.name] = free.nominal + float(amount)
        return {p.name: float(np.clip(values.get(p.name, p.nominal), p.low, p.high)) for p in self.free}


def directions(
    misfit: Callable[[dict], np.ndarray], base: dict, at: np.ndarray, hypothesis: Hypothesis, dear: bool = False
) -> list[Direction]:
    """All ways of acting that change the misfit at all.

    A parameter whose change alone changes the misfit, and in proportion, is an amplitude; one that matters only
    while an amplitude is on is a shape. An effect none of whose parameters matters alone is looked at with its
    other parameters in the middle of their range, then wherever its shapes say that it should be tried. dear: each simulation is, so that fewer are tried, and nominal values
    that act in proportion not at large amounts, too.
    """
    starts, jumps = (
        (RULES.search.starts_by_channel, RULES.search.jumps_by_channel)
        if dear
        else (RULES.search.most_starts, RULES.search.jumps)
    )
    misfit = _remembering(misfit)
    inside = [p for p in hypothesis.free if p.high > p.low]
    off = {p.name: p.nominal for p in inside}
    waves = any(p.role == PHASE for p in inside)
    felt = lambda p: np.any(misfit({**base, **off, p.name: p.nominal + _step(p)}) != at)
    # a wave's law has a sine times its amplitude, whatever a drive makes of it: behind a play little of it does otherwise than more
    wave = lambda p: waves and p.role == AMPLITUDE and felt(p)
    amplitudes = [p for p in inside if wave(p) or _proportional(misfit, base, off, p, at)]
    switched = dict(off)
    if not [p for p in amplitudes if not p.companion]:
        for switched in _settings(inside, amplitudes):
            acting = [
                p for p in inside if p not in amplitudes and _proportional(misfit, base, {**switched, p.name: p.nominal}, p, at)
            ]
            if acting:
                amplitudes += acting
                break
    leading = [p for p in amplitudes if not p.companion]
    companions = tuple(p for p in amplitudes if p.companion)
    found: list[Direction] = []
    for leader in leading:
        on = {**switched, **{p.name: p.nominal for p in amplitudes}}
        much = RULES.search.leading * _step(leader)
        on[leader.name] = leader.nominal + (much if leader.nominal + much <= leader.high else _step(leader))
        there = misfit({**base, **on})
        shapes = [p for p in inside if p not in amplitudes and _shapes(misfit, base, on, p, there)]
        found += _ways(misfit, base, off, at, hypothesis, (leader, *companions), shapes, starts)
    if len(leading) > 1 and all(not way.shape and not way.phase for way in found):
        found += _ways(misfit, base, off, at, hypothesis, (*leading, *companions), [], starts)
    for p in inside:
        if p.companion or (p.told and not p.trials) or p.above or p.role in (PHASE, ORDER):
            continue
        if p in amplitudes and (p.role == VALUE and dear or p.role == AMPLITUDE and waves):
            continue  # a wave acts from the least of it on, and tells nothing at a phase that nobody looked for
        if p not in amplitudes or _bends(misfit, base, off, at, p):
            found += _jumps(
                misfit, base, off, at, hypothesis, p, [q for q in inside if q is not p and q not in amplitudes], jumps
            )
    return found


def _remembering(misfit: Callable[[dict], np.ndarray]) -> Callable[[dict], np.ndarray]:
    """The same function, which computes what it is asked for once: a quarter of a look asks again."""
    known: dict[tuple, np.ndarray] = {}

    def remembered(values: dict) -> np.ndarray:
        key = tuple(sorted(values.items()))
        if key not in known:
            known[key] = misfit(values)
        return known[key]

    return remembered


def _settings(inside: list[Free], amplitudes: list[Free]) -> Iterator[dict[str, float]]:
    """Values of a hypothesis with which its amplitudes may be felt: the middle of all ranges, then the trials of its shapes."""
    yield {p.name: p.nominal if p in amplitudes else _grid(p)[len(_grid(p)) // 2] for p in inside}
    tried = [p for p in inside if p.places and p.role in SHAPES]
    for values in product(*(p.places for p in tried)) if tried else ():
        yield {**{p.name: p.nominal for p in inside}, **{p.name: value for p, value in zip(tried, values)}}


def _jumps(misfit, base, off, at, hypothesis, leader: Free, others: list[Free], jumps: int) -> list[Direction]:
    """Directions of a parameter that acts only from a finite amount on (a limit, a dead zone, a step)."""
    found: list[Direction] = []
    rules = RULES.search
    amounts = leader.trials or leader.places or sorted({*_grid(leader), *np.linspace(leader.low, leader.high, jumps + 2)[1:-1]})
    if not any(
        np.any(misfit({**base, **off, leader.name: value}) != at)
        for value in {amounts[0], amounts[len(amounts) // 2], amounts[-1]}
    ):
        return found

    def tried(value: float, shape: dict) -> None:
        column = slope(misfit({**base, **off, leader.name: value, **shape}), at, value - leader.nominal)
        if np.all(np.isfinite(column)) and np.any(column):
            found.append(Direction(hypothesis, shape, (leader,), column[..., None], jump=value - leader.nominal))

    acting = [v for v in amounts if v != leader.nominal and np.any(misfit({**base, **off, leader.name: v}) != at)]
    shapes: list[Free] = []
    for value in dict.fromkeys(acting[:1] + acting[-1:]):  # what shapes it at neither end does not between them
        on = {**off, leader.name: value}
        there = misfit({**base, **on})
        shapes += [p for p in others if p not in shapes and _shapes(misfit, base, on, p, there)]
    for value in acting:
        for values in product(*(p.places or sorted({p.nominal, p.low, 0.5 * (p.low + p.high)}) for p in shapes)):
            tried(value, {p.name: v for p, v in zip(shapes, values)})
    step = (leader.high - leader.low) / (jumps + 1)
    leaves: list[float] = []  # what each leaves of the misfit
    for _ in range(rules.closer if found and not leader.trials else 0):  # a fit cannot cross a threshold: closer around the best
        step /= rules.closer_by
        for way in found[len(leaves) :]:
            here = at[:, way.part]
            leaves.append(float((np.abs(here + way.columns[..., 0] * way.jump) - np.abs(here)).sum()))
        best = found[int(np.argmin(leaves))]
        for value in (leader.nominal + best.jump + n * step for n in (-1, 1)):
            if leader.low <= value <= leader.high and value != leader.nominal:
                tried(value, best.shape)
    return found


def _ways(misfit, base, off, at, hypothesis, amplitudes, shapes, starts: int) -> list[Direction]:
    """One direction for each combination of shape values; a phase becomes two columns."""
    phase = next((p for p in shapes if p.role == PHASE), None) if len(amplitudes) == 1 else None
    shapes = [p for p in shapes if p is not phase]
    axes = [_grid(p) for p in shapes]
    thin = [i for i, p in enumerate(shapes) if p.role != ORDER and not p.places]
    while thin and np.prod([len(axes[i]) for i in thin]) > starts:
        longest = max(thin, key=lambda i: len(axes[i]))
        axes[longest] = axes[longest][::2]
    found = []
    for values in product(*axes):
        shape = {p.name: v for p, v in zip(shapes, values)}
        here = {**off, **shape}
        if phase is not None:
            columns = [_column(misfit, base, {**here, phase.name: angle}, amplitudes[0], at) for angle in (0.0, 0.5 * np.pi)]
        else:
            columns = [_column(misfit, base, here, p, at) for p in amplitudes]
        stacked = np.stack(columns, -1)
        if np.all(np.isfinite(stacked)) and np.any(stacked):
            wave = {"phase": phase.name, "of_run": phase.of_run} if phase else {}
            found.append(Direction(hypothesis, shape, amplitudes, stacked, **wave))
    return found


def _step(p: Free) -> float:
    step = RULES.search.difference * scale(p, p.nominal)
    return -step if p.nominal + 2.0 * step > p.high else step


def _column(misfit, base: dict, here: dict, p: Free, at: np.ndarray) -> np.ndarray:
    """d misfit / d p at p's nominal value, where an amplitude is off, the shapes as in `here`."""
    step = _step(p)
    return slope(misfit({**base, **here, p.name: p.nominal + step}), at, step)


def _proportional(misfit, base: dict, here: dict, p: Free, at: np.ndarray) -> bool:
    """Whether p acts by itself from its nominal value on, and twice as much gives twice the change."""
    step, rules = _step(p), RULES.search
    zero = misfit({**base, **here, p.name: p.nominal})
    if not p.companion and np.abs(zero - at).max() > rules.alone * (1.0 + np.abs(at).max()):
        return False
    once = change(misfit({**base, **here, p.name: p.nominal + step}), zero)
    size = np.sqrt((once**2).sum())
    if not np.isfinite(size) or size <= rules.unfelt * np.sqrt((at**2).sum()):
        return False
    twice = change(misfit({**base, **here, p.name: p.nominal + 2.0 * step}), zero)
    return bool(np.sqrt(((twice - 2.0 * once) ** 2)[(once != 0.0) & (twice != 0.0)].sum()) < rules.proportional * size)


def _bends(misfit, base: dict, off: dict, at: np.ndarray, p: Free) -> bool:
    """Whether a large amount of p acts otherwise than a small one would make expect: limits and dead zones do."""
    share, most = RULES.search.bend_at, RULES.search.bend
    column = _column(misfit, base, off, p, at)
    for value in ((1.0 - share) * p.nominal + share * p.low, (1.0 - share) * p.nominal + share * p.high):
        moved = change(misfit({**base, **off, p.name: value}), at)
        if value != p.nominal and np.sum((moved - column * (value - p.nominal)) ** 2) > most * np.sum(moved**2) > 0.0:
            return True
    return False


def _shapes(misfit, base: dict, on: dict, p: Free, there: np.ndarray) -> bool:
    """Whether p matters while its amplitude is on; too narrow a range, or a value told by the rig, is no question."""
    rules = RULES.search
    if p.told or (p.low > 0.0 and p.high < rules.narrow * p.low):
        return False
    values = [0.5 * np.pi] if p.role == PHASE else _grid(p)[:: max(1, len(_grid(p)) // rules.probes)]
    return any(np.any(misfit({**base, **on, p.name: value}) != there) for value in values)


def _grid(p: Free) -> list[float]:
    """Values to start from: those to be tried, orders one by one, wide ranges by decades, others at a few places."""
    rules = RULES.search
    if p.places:
        return list(p.places)
    if p.role == ORDER and p.trials:
        return list(p.trials)
    if p.role == ORDER:
        return [float(n) for n in range(max(1, int(np.ceil(p.low))), int(min(p.high, rules.highest_order)) + 1)]
    if p.role == PHASE:
        return [0.0]
    if p.low >= 0.0 and (p.low == 0.0 or p.high / p.low > rules.decades_from):
        lowest = max(p.low, rules.lowest * p.high)
        count = int(np.ceil(rules.per_decade * np.log10(p.high / lowest)))
        return [*np.geomspace(lowest, p.high, count + 1)[:-1]]
    if p.low > 0.0:
        return [*np.geomspace(p.low, p.high, rules.places)[1:-1]]
    return [*np.linspace(p.low, p.high, rules.places)[1:-1]]
