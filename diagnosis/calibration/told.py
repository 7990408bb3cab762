"""What the logs tell of each fitted number: its interval, and whether they tell anything of it at all."""

from __future__ import annotations

import numpy as np
from scipy.special import stdtrit

from ..residuals.mending import rms
from ..rules import RULES
from ..search.fit import Fit, weight
from ..search.hypotheses import Free
from ..search.starts import collinear
from ..systems.sanity import held
from .fit import Calibrating, End, Rows


def silent(problem: Calibrating, origin: np.ndarray) -> set[str]:
    """Numbers with which nothing that is compared changes, wherever they are put, about the origin and about another place.

    About another too, which no default is: beside a gain of 0 much is silent. A simulation that breaks off tells nothing.
    """
    found, bases = set(), (origin, np.full(len(origin), RULES.calibrate.elsewhere))
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


def misread(problem: Calibrating, given: dict[str, float], fitted: dict[str, float]) -> list[str]:
    """Of outputs that numbers as given simulate but for a unit, and which the fitted ones miss by about as much as they vary, what is wrong.

    What fits to a column in mV is no more like it than what was given, which is: a factor that no part has, or the zero of another
    scale of temperature. A sign, or a tenth, may be what is missing.
    """
    played, after, found = problem.played, problem.errors(fitted), list[str]()
    if after is None:
        return found
    far = [n for n in played.outputs if _missed(problem, after, n) > RULES.data.unlike * float(np.std(problem.measured(n)))]
    before = problem.errors(given) if far else None
    if before is None:
        return found
    for name in far:
        measured = problem.measured(name)
        simulated = measured - np.concatenate([e[t] for e, t in zip(before[name], problem.trusted[name])])
        if not np.ptp(measured) or not np.ptp(simulated):
            continue
        unit, makers = played.parts.variables[name].unit, [played.parts.owner(name)]
        reads = [feed.channel for feed in played.group.feeds]
        _, findings = held(name, unit, makers, reads, simulated, measured, problem.rig, RULES.data.gross_beside)
        if findings and np.cov(simulated, measured)[0, 1] > 0.0:
            found.append(findings[0].sentence.rstrip("."))
    return found


def _missed(problem: Calibrating, errors: Rows, name: str) -> float:
    return rms([e[t] for e, t in zip(errors[name], problem.trusted[name])])


def errors(problem: Calibrating, end: End, labels: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Standard errors of the places, their correlations, and which take part in a direction that nothing determines.

    An error is the larger of two: of white noise, and the sandwich over blocks (White 1980, Econometrica 48, 817), in which
    errors that go together count; of few blocks the latter is often too small. Correlations are those of white noise: what
    of one the logs may as well put into the other. Directions without any slope are left out of all.
    """
    assert end.misfit is not None and end.jacobian is not None
    weights = weight(end.misfit, RULES.search.loss_scale)
    weighted, left = end.jacobian * weights[:, None], end.misfit * weights
    lengths = np.sqrt((weighted**2).sum(0))
    felt = lengths > 0.0
    scale = np.where(felt, lengths, 1.0)
    columns, count = weighted / scale, weighted.shape[1]
    _, sizes, ways = np.linalg.svd(columns, full_matrices=False)
    lost = sizes <= RULES.calibrate.lost * max(float(sizes.max(initial=0.0)), 1e-300)
    loose = ~felt | (abs(ways[lost]) > np.sqrt(RULES.calibrate.lost)).any(0)
    bread = (ways.T * np.where(lost, 0.0, 1.0 / np.where(lost, 1.0, sizes) ** 2)) @ ways
    names, places = np.unique(labels, return_inverse=True)
    scores = np.zeros((len(names), count))
    np.add.at(scores, places, columns * left[:, None])
    meat = scores.T @ scores * len(names) / max(1, len(names) - count)
    white = bread * (left @ left) / max(1, len(left) - count)
    larger = np.maximum(np.diag(white), np.diag(bread @ meat @ bread))
    return np.sqrt(np.maximum(larger, 0.0)) / scale, _correlations(np.where(np.outer(loose, loose), 0.0, bread)), loose


def _correlations(spread: np.ndarray) -> np.ndarray:
    sizes = np.sqrt(np.maximum(np.diag(spread), 0.0))
    return np.divide(spread, np.outer(sizes, sizes), out=np.zeros_like(spread), where=np.outer(sizes, sizes) > 0.0)


def reach(labels: np.ndarray, numbers: int) -> float:
    """Standard errors to either side of a 95 % interval: Student's, of as many blocks as there are beyond the numbers."""
    degrees = max(1, len(np.unique(labels)) - numbers)
    return float(stdtrit(degrees, 0.975))


def together(problem: Calibrating, end: End) -> dict[str, list[str]]:
    """Of each number the others with which it can be changed so that what is compared hardly moves (search.starts)."""
    assert end.misfit is not None and end.jacobian is not None
    free = tuple(Free(n.name, n.start, n.low, n.high, n.unit) for n in problem.free)
    values = problem.values(end.places)
    fitted = Fit(free, values, end.misfit, end.jacobian, weight(end.misfit, RULES.search.loss_scale))
    return collinear(fitted, np.ones(len(end.misfit), bool))
