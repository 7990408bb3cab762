"""Values that must be what they give: v with G(v) = v, found by few evaluations of G.

Each evaluation tells how G changes along one more direction. The next guess solves the linear problem that all these
differences together describe (Anderson, Iterative procedures for nonlinear integral equations, J. ACM 12, 1965; as
quasi-Newton coupling in Degroote, Bathe, Vierendeels, Comput. Struct. 87, 2009). Of a linear problem with n unknowns that
is exact after n + 1 evaluations, whatever its gain. What was learned serves the next instant, too.

Where this does not come to an end, Newton's method goes on from the best point, with derivatives of G, in steps that are
halved until they get nearer.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import NamedTuple

import numpy as np

REMEMBERED = 30  # directions at most
PLAIN = 12  # evaluations without derivatives, and one more for each unknown up to REMEMBERED
STEPS, HALVINGS = 25, 10  # of Newton's method
WORSE = 3.0  # a step that leads so far away was a wrong one
FLOOR = 1e-6  # no unknown is asked for more exactly than the tolerance times this
RANK = 1e-7  # directions that differ by less are one

Evaluate = Callable[[np.ndarray], "np.ndarray | None"]  # None where it cannot be computed there


class Unsettled(Exception):
    """No values were found. `residual`: how far the best are off, relative."""

    def __init__(self, residual: float):
        self.residual = residual
        super().__init__(f"residual {residual:.2g}")


class Point(NamedTuple):
    """Where G was evaluated."""

    v: np.ndarray
    wrong: np.ndarray | None  # G(v) - v; None where it cannot be computed
    distance: float  # its largest, relative to the largest that the unknown has been


class Secant:
    """The same problem, solved again and again."""

    def __init__(self, size: int, tolerance: float):
        """tolerance: of each unknown, relative to the largest that it has been."""
        self.size, self.tolerance = size, tolerance
        depth = min(size, REMEMBERED)
        self.memory = np.zeros((2 + 2 * depth, size))  # all that decides how the next problem is solved
        self.scale, self.last = self.memory[:2]  # the largest that each unknown has been; the last solution
        self.steps, self.changes = self.memory[2 : 2 + depth], self.memory[2 + depth :]
        self.scale[:] = FLOOR
        self._weight = self.scale
        self.rounds = 0  # evaluations for the last solution
        self.residual = 0.0  # of it, relative

    def solve(self, start: np.ndarray, evaluate: Evaluate, slopes: Callable[[], np.ndarray]) -> None:
        """Evaluate last where the solution is, or what comes nearest. slopes: dG/dv where it was evaluated last. Raises Unsettled.

        Where nothing can be computed at `start`, the last solution is where to begin.
        """
        self.rounds = 0
        here = self._look(np.where(np.isfinite(start), start, self.last), evaluate)
        if here.wrong is None:
            here = self._look(self.last, evaluate)
        best, fresh = here, 0  # how many directions were learned here and now
        for _ in range(PLAIN + min(self.size, REMEMBERED)):
            if here.distance <= self.tolerance:
                return self._settled(here)
            if best.wrong is None:
                break
            if here.distance > WORSE * best.distance:  # what was learned at other instants holds no more
                self.changes[fresh:] = 0.0
                here = best if here.wrong is not None else self._look(0.5 * (here.v + best.v), evaluate)
            if here.wrong is None:
                continue
            following = self._look(here.v + self._step(here.wrong), evaluate)
            if following.wrong is not None:
                fresh += self._learn(following.v - here.v, following.wrong - here.wrong)
            here = following
            if here.distance < best.distance:
                best = here
        self._newton(best, evaluate, slopes)

    def _newton(self, here: Point, evaluate: Evaluate, slopes: Callable[[], np.ndarray]) -> None:
        for _ in range(STEPS):
            if here.wrong is None:
                break
            self._look(here.v, evaluate)  # there slopes are wanted
            rate = slopes() - np.eye(self.size)
            try:
                step = np.linalg.solve(rate, -here.wrong)
            except np.linalg.LinAlgError:
                break
            for halved in range(HALVINGS):
                following = self._look(here.v + step / 2**halved, evaluate)
                if following.distance < here.distance:
                    break
            else:
                break
            here = following
            if here.distance <= self.tolerance:
                if self.size <= REMEMBERED:
                    for direction, change in zip(np.eye(self.size), rate.T):
                        self._learn(direction, change)
                return self._settled(here)
        self._look(here.v, evaluate)
        self._settled(here)
        raise Unsettled(here.distance)

    def _settled(self, point: Point) -> None:
        self.residual = point.distance
        self.last[:] = point.v
        np.maximum(self.scale, np.abs(point.v), out=self.scale)

    def _look(self, v: np.ndarray, evaluate: Evaluate) -> Point:
        self.rounds += 1
        given = evaluate(v)
        if given is None or not np.isfinite(given).all():
            return Point(v, None, math.inf)
        self._weight = np.maximum(self.scale, np.abs(given))
        return Point(v, given - v, float(np.max(np.abs(given - v) / self._weight, initial=0.0)))

    def _learn(self, step: np.ndarray, change: np.ndarray) -> bool:
        """Remember how G(v) - v changed with v, in place of the oldest of what is known."""
        length = float(np.linalg.norm(change / self._weight))
        if news := length > 1e-14:
            self.steps[1:], self.changes[1:] = self.steps[:-1].copy(), self.changes[:-1].copy()
            self.steps[0], self.changes[0] = step / length, change / length
        return news

    def _step(self, wrong: np.ndarray) -> np.ndarray:
        """Where G(v) - v is nought by all that is known; in directions of which nothing is known, on to G(v)."""
        columns, kept = self.changes / self._weight, []
        basis = np.zeros((0, self.size))
        for k, column in enumerate(columns):  # what is newest counts
            rest = column - (basis @ column) @ basis
            length = math.sqrt(rest @ rest)
            if length > RANK * math.sqrt(column @ column) > 0.0:
                basis = np.vstack([basis, rest / length])
                kept.append(k)
        if not kept:
            return wrong
        share = np.linalg.lstsq(columns[kept].T, wrong / self._weight, rcond=None)[0]
        return wrong - (self.steps[kept] + self.changes[kept]).T @ share
