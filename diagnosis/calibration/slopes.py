"""Slopes of a simulation that may jump or fail: differences to both sides, widened where jumps hide them.

A difference is first as small as doubles allow. It is widened while nothing changes, or while the two sides do not agree
on the slope, as where an event falls to this side of a sample or to that; of these the one whose sides
agree best is taken. Where a side fails, or lies outside, the other does alone; where both fail it is made narrower.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence

import numpy as np

from ..rules import RULES
from .numbers import Number

Misfit = Callable[[np.ndarray], np.ndarray | None]
"""Of places in the ranges of all numbers; None where the simulation broke off."""


class Slopes:
    """d misfit / d place, with what was learnt of each number's width from point to point."""

    def __init__(self, misfit: Misfit, numbers: Sequence[Number]):
        self.misfit, self.numbers = misfit, numbers
        self.widths = np.ones(len(numbers))  # times the first difference

    def __call__(self, places: np.ndarray, at: np.ndarray) -> np.ndarray:
        """A column for each number."""
        columns = [self._column(j, places, at) for j in range(len(self.numbers))]
        return np.stack(columns, axis=1) if columns else np.zeros((len(at), 0))

    def _column(self, j: int, places: np.ndarray, at: np.ndarray) -> np.ndarray:
        rules, number = RULES.calibrate, self.numbers[j]
        width = number.difference(places[j]) * self.widths[j]
        first, best, least = width / self.widths[j], np.zeros(len(at)), np.inf
        narrowed = 0
        while True:
            column, jump = self._over(j, places, at, min(width, rules.widest))
            if column is None:
                narrowed += 1
                if narrowed > rules.narrower:
                    return best
                width /= rules.wider**2
                continue
            if jump < least:
                best, least, self.widths[j] = column, jump, width / first
            if narrowed or jump <= rules.jumps or width >= rules.widest or jump > rules.worse * least < np.inf:
                return best
            width *= rules.wider

    def _over(self, j: int, places: np.ndarray, at: np.ndarray, width: float) -> tuple[np.ndarray | None, float]:
        """The slope over this width, and how much of it is a jump: 0 none, inf where nothing changes; None where it fails."""
        sides = []
        for sign in (1.0, -1.0):
            moved = places.copy()
            moved[j] += sign * width
            found = self.misfit(moved) if 0.0 <= moved[j] <= 1.0 else None
            if found is not None:
                sides.append((sign, found - at))
        if not sides:
            return None, np.inf
        if len(sides) == 1:
            ((sign, change),) = sides
            return sign * change / width, 0.0 if np.any(change) else np.inf
        (_, up), (_, down) = sides
        size = float(np.linalg.norm(up - down))
        if size == 0.0:
            return np.zeros(len(at)), np.inf
        return (up - down) / (2.0 * width), float(np.linalg.norm(up + down)) / size


class Forward:
    """The same by differences to one side, for fits of which there are many: widened only where nothing changes, or where it fails."""

    def __init__(self, misfit: Misfit, numbers: Sequence[Number]):
        self.misfit, self.numbers = misfit, numbers

    def __call__(self, places: np.ndarray, at: np.ndarray) -> np.ndarray:
        """A column for each number."""
        columns = [self._column(j, places, at) for j in range(len(self.numbers))]
        return np.stack(columns, axis=1) if columns else np.zeros((len(at), 0))

    def _column(self, j: int, places: np.ndarray, at: np.ndarray) -> np.ndarray:
        rules = RULES.calibrate
        width = rules.wider * self.numbers[j].difference(places[j])
        while True:
            moved = places.copy()
            moved[j] += width if moved[j] + width <= 1.0 else -width
            found = self.misfit(moved)
            if (found is not None and np.any(found != at)) or width >= rules.widest:
                return np.zeros(len(at)) if found is None else (found - at) / (moved[j] - places[j])
            width = min(rules.widest, width * rules.wider**2)


def beside(other: Misfit) -> type[Forward]:
    """Differences to one side of a misfit that moves alike and takes less time, as in longer steps; of the fit's own where that breaks off."""

    class Beside(Forward):
        def __init__(self, misfit: Misfit, numbers: Sequence[Number]):
            super().__init__(misfit, numbers)
            self.others: tuple[bytes, np.ndarray | None] = b"", None

        def _column(self, j: int, places: np.ndarray, at: np.ndarray) -> np.ndarray:
            if self.others[0] != (key := places.tobytes()):
                self.others = key, other(places)
            there = self.others[1]
            return super()._column(j, places, at) if there is None else Forward(other, self.numbers)._column(j, places, there)

    return Beside


class Learnt:
    """Slopes that are known where a fit begins, and learnt from its own steps from there on: no simulation for them.

    known: of numbers by name, d misfit / d place; of others they are the differences of `sides`. After each step the slopes
    along it are those that were seen (C. G. Broyden, Math. Comp. 19 (1965) 577). Good enough to see whether a rival is worth
    slopes of its own.
    """

    def __init__(self, sides: Slopes | Forward, known: Mapping[str, np.ndarray]):
        self.known, self.numbers, self.sides = known, sides.numbers, sides
        self.last: tuple[np.ndarray, np.ndarray, np.ndarray] | None = None

    def __call__(self, places: np.ndarray, at: np.ndarray) -> np.ndarray:
        """A column for each number."""
        if self.last is None:
            columns = [
                self.known[n.name] if n.name in self.known else self.sides._column(j, places, at)
                for j, n in enumerate(self.numbers)
            ]
            slopes = np.stack(columns, axis=1) if columns else np.zeros((len(at), 0))
        else:
            before, misfit, slopes = self.last
            step = places - before
            length = float(step @ step)
            if length > 0.0 and np.isfinite(at).all():
                slopes = slopes + np.outer(at - misfit - slopes @ step, step) / length
        self.last = places.copy(), at.copy(), slopes
        return slopes
