"""What the logs tell of each fitted number: its interval, and whether they tell anything of it at all."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from scipy.stats import t as student

from ..rules import RULES
from ..search.fit import Fit, weight
from ..search.hypotheses import Free
from ..search.starts import collinear
from .fit import Calibrating, End


def silent(problem: Calibrating, bases: Sequence[np.ndarray]) -> set[str]:
    """Numbers with which nothing that is compared changes, wherever they are put, about each of the bases.

    A base whose simulation breaks off tells nothing; so does a place.
    """
    found = set()
    for j, number in enumerate(problem.free):
        answers = []
        for base in bases:
            if (at := problem.misfit(base)) is None:
                continue
            for place in (0.0, 0.5, 1.0):
                moved = base.copy()
                moved[j] = place
                if (other := problem.misfit(moved)) is not None:
                    answers.append(float(abs(other - at).max(initial=0.0)))
        if answers and max(answers) <= RULES.calibrate.unmoved:
            found.add(number.name)
    return found


def covariance(problem: Calibrating, end: End, labels: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Of the places, by the sandwich over blocks; and which places take part in a direction that nothing determines.

    White (1980), Econometrica 48, 817, over blocks, so that errors that go together do not make it too small. Directions
    without any slope are left out of it.
    """
    assert end.misfit is not None and end.jacobian is not None
    weights = weight(end.misfit, RULES.search.loss_scale)
    weighted, errors = end.jacobian * weights[:, None], end.misfit * weights
    lengths = np.sqrt((weighted**2).sum(0))
    felt = lengths > 0.0
    columns = weighted / np.where(felt, lengths, 1.0)
    _, sizes, ways = np.linalg.svd(columns, full_matrices=False)
    lost = sizes <= RULES.calibrate.lost * max(float(sizes.max(initial=0.0)), 1e-300)
    inverse = np.where(lost, 0.0, 1.0 / np.where(lost, 1.0, sizes) ** 2)
    bread = (ways.T * inverse) @ ways
    names, places = np.unique(labels, return_inverse=True)
    scores = np.zeros((len(names), columns.shape[1]))
    np.add.at(scores, places, columns * errors[:, None])
    meat = scores.T @ scores * len(names) / max(1, len(names) - columns.shape[1])
    scale = np.where(felt, lengths, 1.0)
    loose = ~felt | (abs(ways[lost]) > np.sqrt(RULES.calibrate.lost)).any(0) if lost.any() else ~felt
    return bread @ meat @ bread / np.outer(scale, scale), loose


def reach(labels: np.ndarray, numbers: int) -> float:
    """Standard errors to either side of a 95 % interval: Student's, of as many blocks as there are beyond the numbers."""
    degrees = max(1, len(np.unique(labels)) - numbers)
    return float(student.ppf(0.975, degrees))


def together(problem: Calibrating, end: End) -> dict[str, list[str]]:
    """Of each number the others with which it can be changed so that what is compared hardly moves (search.starts)."""
    assert end.misfit is not None and end.jacobian is not None
    free = tuple(Free(n.name, n.start, n.low, n.high, n.unit) for n in problem.free)
    values = problem.values(end.places)
    fitted = Fit(free, values, end.misfit, end.jacobian, weight(end.misfit, RULES.search.loss_scale))
    return collinear(fitted, np.ones(len(end.misfit), bool))


def correlations(spread: np.ndarray) -> np.ndarray:
    """Of each two numbers, from their covariance; 0 of what has none."""
    sizes = np.sqrt(np.maximum(np.diag(spread), 0.0))
    return np.divide(spread, np.outer(sizes, sizes), out=np.zeros_like(spread), where=np.outer(sizes, sizes) > 0.0)
