"""Which numbers change beyond chance: a step or a growth from some moment on, against the scatter of the whole fleet.

Of every unit's values y_i at times t_i, with the errors s_i of their diagnoses:

1. What all units do at once (a winter, another oil) is taken out: a two-way table of units and periods, by Tukey's median
   polish (Exploratory Data Analysis, 1977, ch. 11).
2. Intervals of single logs know nothing of what differs from log to log. The scatter beyond them, tau, is found from how far
   each value is from the line through its neighbours (Gasser, Sroka and Jennen-Steinmetz, Biometrika 73 (1986) 625), over all
   units of a parameter, so that the squares over s^2 + tau^2 are what they should be (Paule and Mandel 1982). Neither a slow
   change nor a few units with a step move it.
3. A value that no neighbour bears out is set aside; the last one until the next log comes, unless it goes on as those before it.
4. For each moment a step, and a growth at an even rate since then, are fitted by least squares. z is the amount over its
   standard error, which is widened where a unit scatters more about its own fit (Birge's ratio, never below 1). Under no
   change |z| is at most Student's t with the freedom of the scatter, or with that of the unit alone: whichever is more. The
   best of them is fitted again without each value in turn, and the least z counts: no single log decides.
5. The chance of the largest is multiplied by the number of all that was tried: units, parameters, moments, shapes.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field, replace

import numpy as np
from scipy.optimize import brentq
from scipy.special import ndtr, ndtri, stdtr, stdtrit

from ..rules import RULES
from .series import Series

STEP, GROWTH = "step", "growth"
NORMAL = ndtri(0.975)


@dataclass(frozen=True)
class Change:
    """What became of a number of a unit, up to its last value."""

    unit: str
    parameter: str
    measure: str
    shape: str  # STEP | GROWTH
    since: float  # days since 1970: the first value after the step, or the last before the growth
    before: float
    after: float
    low: float  # 95 % interval of after - before
    high: float
    chance: float  # that a fleet without changes would show one like it anywhere: over all that was tried

    @property
    def amount(self) -> float:
        return self.after - self.before


@dataclass
class AllUnits:
    """A parameter over all units."""

    parameter: str
    measure: str
    series: list[Series]
    scatter: float = 0.0  # tau, in units of `size`
    freedom: float = 0.0
    relative: bool = False  # whether scatter and shared are shares of each unit's usual value
    size: dict[str, float] = field(default_factory=dict)  # of each unit: its usual value where relative, else 1
    shared: tuple[np.ndarray, np.ndarray] = (np.zeros(0), np.zeros(0))  # what all units do at once: days, amount over `size`
    aside: dict[str, np.ndarray] = field(default_factory=dict)  # of each unit the values that were set aside, bool


@dataclass
class Found:
    """What became of a fleet."""

    numbers: list[AllUnits]
    changes: list[Change]  # those beyond chance, the surest first
    tried: int  # steps and growths that were fitted

    @property
    def beyond(self) -> tuple[float, float]:
        """From how many standard errors on a change is beyond chance, at least; and among as many that many logs tell the scatter of."""
        level = 0.5 * RULES.tracking.false_names / max(self.tried, 1)
        freedom = [max(w.freedom, len(s) - 3.0) for w in self.numbers for s in w.series if len(s) >= RULES.tracking.fewest]
        return (-float(stdtrit(max(freedom), level)) if freedom else 0.0), -float(ndtri(level))


def changes(series: Sequence[Series]) -> Found:
    """Changes beyond chance in any of these series."""
    by_parameter: dict[str, list[Series]] = {}
    for one in series:
        by_parameter.setdefault(one.parameter, []).append(one)
    numbers = [_watched(group) for group in by_parameter.values()]
    best = [_best(one, watched) for watched in numbers for one in watched.series]
    tried = sum(count for _, count in best)
    found = []
    for change, _ in best:
        if change is not None and change.chance * tried < RULES.tracking.false_names:
            found.append(replace(change, chance=change.chance * tried))
    return Found(numbers, sorted(found, key=lambda c: (c.chance, -abs(c.amount / (abs(c.before) or 1.0)))), tried)


def _watched(group: list[Series]) -> AllUnits:
    """What all units share: size, watched, scatter; and what is set aside of each."""
    rules = RULES.tracking
    usual = {one.unit: float(np.median(one.value)) for one in group}
    relative = all(abs(usual[one.unit]) > rules.away * float(np.median(one.error)) for one in group)
    relative = relative and len({value > 0.0 for value in usual.values()}) == 1
    size = {unit: abs(value) if relative else 1.0 for unit, value in usual.items()}
    watched = AllUnits(group[0].parameter, group[0].measure, group, relative=relative, size=size)
    watched.shared = _together([(one.time, one.value / size[one.unit]) for one in group])
    parts = [_beside(one.time, *_scaled(one, watched)) for one in group]
    watched.scatter, watched.freedom = _scatter(*(np.concatenate(x) for x in zip(*parts)))
    count = sum(map(len, group))
    for one in group:
        watched.aside[one.unit] = _alone(one.time, *_scaled(one, watched), watched, count)
    return watched


def _scaled(one: Series, watched: AllUnits) -> tuple[np.ndarray, np.ndarray]:
    """Values and errors over the unit's size, without what all units do at once."""
    size = watched.size[one.unit]
    shared = np.interp(one.time, *watched.shared) if len(watched.shared[0]) else 0.0
    return one.value / size - shared, one.error / size


def _together(group: list[tuple[np.ndarray, np.ndarray]]) -> tuple[np.ndarray, np.ndarray]:
    """What all units do at once: days and amounts, from periods in which enough units have values; none of a small fleet."""
    rules, none = RULES.tracking, (np.zeros(0), np.zeros(0))
    spacings = [float(np.median(np.diff(time))) for time, _ in group if len(time) > 1]
    width = float(np.median(spacings)) if spacings else 0.0
    if len(group) < rules.together or width <= 0.0:
        return none
    begin = min(time[0] for time, _ in group) - 0.5 * width
    periods = [((time - begin) / width).astype(int) for time, _ in group]
    every, place = np.unique(np.concatenate(periods), return_inverse=True)
    row = np.repeat(np.arange(len(group)), [len(p) for p in periods])
    cells = np.zeros((3, len(group), len(every)))  # sums of values and times, counts
    value, time = (np.concatenate(x) for x in zip(*((v, t) for t, v in group)))
    for sums, x in zip(cells, (value, time, np.ones(len(value)))):
        np.add.at(sums, (row, place), x)
    enough = (cells[2] > 0).sum(0) >= rules.together
    if enough.sum() < rules.beside:
        return none
    cells = cells[:, :, enough]
    table = np.where(cells[2] > 0, cells[0] / np.maximum(cells[2], 1.0), np.nan)
    table = table[np.isfinite(table).any(axis=1)]
    shared = np.zeros(table.shape[1])
    for _ in range(rules.polished):
        table = table - np.nanmedian(table, axis=1, keepdims=True)
        more = np.nanmedian(table, axis=0)
        table, shared = table - more, shared + more
        if not np.any(abs(more) > 1e-9 * np.nanmax(abs(table), initial=0.0)):
            break
    return cells[1].sum(0) / cells[2].sum(0), shared - np.median(shared)


def _beside(time: np.ndarray, value: np.ndarray, error: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """How far each inner value is from the line through its neighbours; its variance by the errors, and for each tau^2 of 1."""
    span = time[2:] - time[:-2]
    later = np.divide(time[1:-1] - time[:-2], span, out=np.full(len(span), 0.5), where=span > 0.0)
    off = value[1:-1] - (1.0 - later) * value[:-2] - later * value[2:]
    s = error**2
    return off, s[1:-1] + (1.0 - later) ** 2 * s[:-2] + later**2 * s[2:], 1.0 + (1.0 - later) ** 2 + later**2


def _scatter(off: np.ndarray, told: np.ndarray, beyond: np.ndarray) -> tuple[float, float]:
    """The scatter beyond the errors, and its degrees of freedom; wild values do not tell it."""
    rules, kept, tau = RULES.tracking, np.ones(len(off), bool), 0.0
    density = np.exp(-0.5 * rules.wild**2) / np.sqrt(2.0 * np.pi)
    share = 1.0 - 2.0 * rules.wild * density / (2.0 * ndtr(rules.wild) - 1.0)  # of the variance, within the limit
    while kept.any():
        square, s, c = off[kept] ** 2, told[kept], beyond[kept]

        def excess(tau2: float, square=square, s=s, c=c) -> float:
            return float(np.sum(square / (s + tau2 * c))) - share * len(s)

        most = 2.0 * float(np.sum(square / c))
        tau = float(np.sqrt(brentq(excess, 0.0, most))) if most > 0.0 and excess(0.0) > 0.0 else 0.0
        inside = kept & (abs(off) <= rules.wild * np.sqrt(told + tau**2 * beyond))
        if inside.sum() == kept.sum():
            break
        kept = inside
    return tau, rules.freedom * float(kept.sum())


def _alone(time: np.ndarray, value: np.ndarray, error: np.ndarray, watched: AllUnits, count: int) -> np.ndarray:
    """Values that no neighbour bears out: off them all to one side, farther than chance among so many.

    The first and the last have one neighbour, and the line through the two next to them.
    """
    if watched.freedom < 1.0 or len(value) < RULES.tracking.fewest:
        return np.zeros(len(value), bool)
    far = -float(stdtrit(watched.freedom, 0.5 * RULES.tracking.false_names / count))
    s = error**2 + watched.scatter**2
    step = np.diff(value) / np.sqrt(s[1:] + s[:-1])
    first, last = (_beyond(*(x[::way][:3] for x in (time, value, s))) for way in (1, -1))
    before, behind = np.append(first, step), np.append(-step, last)  # of each value, above what is on either side
    return (np.minimum(before, behind) > far) | (np.maximum(before, behind) < -far)


def _beyond(time: np.ndarray, value: np.ndarray, variance: np.ndarray) -> float:
    """How far the first of three values is above the line through the others, in its deviations."""
    span = time[2] - time[1]
    share = (time[0] - time[1]) / span if span else 0.0
    off = value[0] - value[1] - share * (value[2] - value[1])
    return float(off / np.sqrt(variance[0] + (1.0 - share) ** 2 * variance[1] + share**2 * variance[2]))


def _best(one: Series, watched: AllUnits) -> tuple[Change | None, int]:
    """The step or growth that says most of a unit, with its chance beside itself alone; and how many were fitted."""
    rules, used = RULES.tracking, ~watched.aside[one.unit]
    if used.sum() < rules.fewest:
        return None, 0
    time = one.time[used]
    value, error = (x[used] for x in _scaled(one, watched))
    moments = np.unique(time)
    moments = moments[np.unique(np.linspace(0, len(moments) - 1, min(len(moments), rules.places)).astype(int))]
    shapes, told = [], []
    for moment in moments:
        before, after = (time < moment).sum(), (time > moment).sum()
        if min(before, len(time) - before) >= rules.beside:
            shapes.append((time >= moment).astype(float))
            told.append((STEP, moment))
        if after >= rules.beside:
            shapes.append(np.maximum(time - moment, 0.0) / (time[-1] - moment))
            told.append((GROWTH, moment))
    if not shapes:
        return None, 0
    x, w = np.array(shapes), 1.0 / (error**2 + watched.scatter**2)
    amount, before, sigma = _fitted(x, value, w)
    k = int(np.argmax(abs(amount) / sigma))
    without = np.array([_fitted(x[[k]][:, rest], value[rest], w[rest]) for rest in ~np.eye(len(time), dtype=bool)])[:, :, 0]
    least = float(np.min(np.append(without[:, 0] / without[:, 2], amount[k] / sigma[k]) * np.sign(amount[k])))
    chance = 2.0 * float(stdtr(max(watched.freedom, len(time) - 3.0), -max(least, 0.0)))
    size, reach = watched.size[one.unit], NORMAL * float(sigma[k])
    first, last = size * float(before[k]), size * float(before[k] + amount[k])
    ends = size * float(amount[k] - reach), size * float(amount[k] + reach)
    return Change(one.unit, one.parameter, one.measure, told[k][0], float(told[k][1]), first, last, *ends, chance), len(told)


def _fitted(x: np.ndarray, value: np.ndarray, w: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Of each shape (a row of x) its amount, the level before it, and the amount's standard error, widened by Birge's ratio."""
    middle = (x * w).sum(1) / w.sum()
    centred = x - middle[:, None]
    spread = np.maximum((w * centred**2).sum(1), 1e-300)
    mean = (w * value).sum() / w.sum()
    amount = (w * centred * value).sum(1) / spread
    left = value - mean - amount[:, None] * centred
    ratio = np.sqrt(np.maximum(1.0, (w * left**2).sum(1) / (len(value) - 2)))
    return amount, mean - amount * middle, ratio / np.sqrt(spread)
