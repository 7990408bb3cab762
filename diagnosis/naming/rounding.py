"""Roundings: what of a recorded signal tells that it was rounded, and where the fit of one starts.

What is rounded jumps where a step of it does, and no slope leads from one to the next.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from ..data.log import MeasuredRun
from ..data.values import arrivals, resolution
from ..rules import RULES

if TYPE_CHECKING:
    from ..calibration.fit import End
    from .extended import Extending
    from .guesses import Guess


@dataclass(frozen=True)
class Rounded:
    """A signal that was rounded before noise was added: its step, and the deviation that it has about whole numbers of it."""

    step: float
    noise: float


def beside_step(y: np.ndarray, x: np.ndarray, step: float) -> np.ndarray:
    """What a model that has x before it is rounded leaves of recorded values y: their noise, and how far x is beyond their step.

    A rounding that is off by less than the noise is elsewhere by a whole step in some rows: of these alone a fit would see that it is,
    and no slope would lead on. In which step a value was the log tells.
    """
    if step <= 0.0:
        return y - x
    middle = step * np.floor(y / step + 0.5)
    return y - middle - (x - np.clip(x, middle - 0.5 * step, middle + 0.5 * step))


def steps_of(size: float, spread: float) -> np.ndarray:
    """Steps that a signal of this largest value and spread may be rounded to, so close that none counts otherwise than one of them."""
    rules = RULES.naming
    least, most = rules.counts
    return size / np.arange(size / (most * spread), size / (least * spread), rules.counted)


def gathers(y: np.ndarray, steps: np.ndarray) -> np.ndarray:
    """How much values lie at whole numbers of each of these steps: the mean of cos(2 pi y / q), 1 where all do, of others about 0.

    steps: as `steps_of` gives them, 1 / q at equal distances. Their waves are then those of every n-th times those of the n
    distances: of a thousand steps the cosines of sixty are computed, and a product of matrices is the rest.
    """
    first, further = 1.0 / steps[0], 1.0 / steps[min(1, len(steps) - 1)] - 1.0 / steps[0]
    n = int(np.ceil(np.sqrt(len(steps))))
    waves = np.exp(2j * np.pi * np.outer(first + n * further * np.arange(n), y))
    return np.real(waves @ np.exp(2j * np.pi * further * np.outer(y, np.arange(n)))).ravel()[: len(steps)] / len(y)


def thinned(y: np.ndarray) -> np.ndarray:
    """Of values those that are numbers, some of many."""
    y = y[np.isfinite(y)]
    return y[:: max(1, len(y) // RULES.naming.glance)]


def rounded(runs: Sequence[MeasuredRun], names: Iterable[str]) -> dict[str, Rounded]:
    """Of these signals those that were rounded before noise was added, by what was recorded alone."""
    found = {}
    for name in names:
        parts = [run.signals[name][run.usable(name) & np.isfinite(run.signals[name])] for run in runs]
        if (one := _gathered([part for part in parts if len(part)])) is not None:
            found[name] = one
    return found


def _nearest(y: np.ndarray, step: float) -> float:
    """The step near this one whose whole numbers leave least of values."""
    counts = np.round(y / step)
    return float(counts @ y / (counts @ counts))


def _gathered(parts: Sequence[np.ndarray]) -> Rounded | None:
    """The step that recorded values were rounded to; None where they were to none.

    Told by rows that come from another step: there a rounded value lies at a whole number at once, and one that goes on slowly
    close to the border that it passed, whatever the step. One that rests lies at a whole number of many steps, and says nothing.
    Values that lie exactly at steps are a recorder's resolution, no noise beside a rounding.
    """
    y = np.concatenate([np.zeros(0), *parts])
    spread, size = (float(np.std(y)), float(abs(y).max())) if len(y) else (0.0, 0.0)
    if spread <= RULES.judge.constant * size or not spread:
        return None
    steps = steps_of(size, spread)
    most = [_nearest(y, step) for step in steps[np.argsort(-gathers(thinned(y), steps))[: RULES.naming.gathered]]]
    step = max(most, key=lambda one: float(np.cos(2.0 * np.pi / one * y).mean()))
    passed = np.concatenate([arrivals(part, step) for part in parts])
    there = float(passed.mean()) if len(passed) else 0.0
    chance = RULES.naming.no_chance / np.sqrt(2.0 * max(len(passed), 1))  # cos of any phase varies by 1/2
    noise = float(np.median(abs(y - step * np.round(y / step)))) / RULES.residuals.normal_median
    return Rounded(step, noise) if there > max(RULES.naming.on_steps, chance) and noise > resolution(y) else None


def between(
    problem: Extending, guess: Guess, values: dict[str, float], size: float, reach: float = RULES.naming.counted
) -> dict[str, float]:
    """These values with that step, of those up to the next that is looked at, with which the model leaves least.

    size: of the signal's largest value; reach: how many steps more or fewer it may have. Levels of a command that are held for rows
    count otherwise on one side of such a step: of a fortieth of them a third of the error is left, and a fit goes after that. In
    units of a step of that value those that are looked at lie `counted` apart.
    """
    rules, (step,) = RULES.naming, guess.numbers
    if values[step.name] <= 0.0:
        return values
    counts = size / values[step.name] + np.linspace(-reach, reach, 2 * rules.roundings + 1)
    tried = [values | {step.name: float(np.clip(size / count, step.low, step.high))} for count in counts[counts > 0.0]]
    losses = [problem.loss(problem.misfit(np.array([n.place(one[n.name]) for n in problem.free]))) for one in tried]
    return tried[int(np.argmin(losses))] if np.isfinite(losses).any() else values


def stepped(problem: Extending, guess: Guess, end: End, size: float, fitted: Callable[[np.ndarray], End]) -> End:
    """A fit of a rounding, made again from a step near by that leaves less, as long as there is one: it ends where levels count otherwise.

    First as far as to the next step that is looked at, then nearer: levels that count otherwise may be as near on both sides.
    """
    rules = RULES.naming
    for reach in (rules.counted, rules.counted / rules.roundings):
        for _ in range(rules.roundings):
            near = between(problem, guess, {n.name: n.at(x) for n, x in zip(problem.free, end.places)}, size, reach)
            places = np.array([n.place(near[n.name]) for n in problem.free])
            if not problem.loss(problem.misfit(places)) < end.loss:  # most often: and a fit is many simulations
                break
            end = fitted(places)
    return end
