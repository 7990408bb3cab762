"""How likely a cause is there, of all that may stand in its place: by what each predicts of blocks that its fit did not see.

Pseudo-BMA+ weights (Yao, Vehtari, Simpson and Gelman 2018, Bayesian Analysis 13, 917, section 3.4): a model has a share in
proportion to the exponential of its log predictive density, a mean over draws of how much each block counts (the Bayesian
bootstrap, Rubin 1981, Annals of Statistics 9, 130). Models that predict the same share equally, however surely one is a trifle
better; of those that predict otherwise the blocks tell how sure that is.
"""

from __future__ import annotations

import numpy as np

from ..rules import RULES
from ..search.candidate import Candidate
from ..search.problem import Problem
from ..search.step import Stage


def density(problem: Problem, losses: np.ndarray) -> np.ndarray:
    """Log predictive density of each training block, of its losses (blocks, residuals): means over its entries."""
    return -0.5 * (losses * problem.new).sum(1) * problem.entries.sum(1)


def confidence(winner: Candidate, stage: Stage, problem: Problem) -> tuple[float, float, str]:
    """That a cause is there; that it or one that is named with it is; and the likeliest of all others.

    Its share among its rivals, times 1 - chance. No name where chance is likelier.
    """
    (_, own), *rivals = shares(winner, stage, problem)
    real = 1.0 - winner.chance
    together = own + sum(share for rival, share in rivals if rival in stage.tied)
    others = [(rival, share) for rival, share in rivals if rival not in stage.tied]
    closest = others[0][0].hypothesis.label if others and others[0][1] > winner.chance else ""
    return round(real * own, 4), round(real * together, 4), closest


def shares(winner: Candidate, stage: Stage, problem: Problem) -> list[tuple[Candidate, float]]:
    """What a cause and its rivals have of 1, the cause first, then the likeliest.

    Rivals are what was named with it, and what was fitted with no more numbers. None are: what the rules refuse for what it is (its
    doubt: a number at its end, a lag within a sample), the same law by another name, and of a pair that took the place of others
    what made no such pair. Asked of the residuals that the cause mends: what mends another may be there beside it.
    """
    rivals = [c for c in stage.candidates if _may_stand_for(c, winner, stage)]
    models = [winner, *rivals]
    losses = np.stack([model.losses for model in models])  # (models, blocks, residuals)
    mended = (stage.base.losses - winner.losses).mean(0) > RULES.search.matters * winner.losses.mean(0)
    if mended.any():
        losses = losses * mended
    predicted = np.stack([density(problem, one) for one in losses], 1)  # (blocks, models)
    blocks = len(predicted)
    counts = blocks * np.random.default_rng(0).dirichlet(np.ones(blocks), RULES.judge.draws_of_blocks)  # the same for all logs
    sums = counts @ predicted
    odds = np.exp(sums - sums.max(1, keepdims=True))
    found = (odds / odds.sum(1, keepdims=True)).mean(0)
    return [(winner, float(found[0])), *sorted(zip(rivals, map(float, found[1:])), key=lambda pair: -pair[1])]


def _may_stand_for(rival: Candidate, winner: Candidate, stage: Stage) -> bool:
    """Whether it could be there instead. The winner may have got further numbers since: it is known by its hypothesis."""
    if rival.fit is None or rival.hypothesis is winner.hypothesis:
        return False
    return rival in stage.tied or (len(rival.free) <= len(winner.free) and rival not in stage.aside)
