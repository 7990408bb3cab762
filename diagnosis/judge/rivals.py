"""What competed in each step of a search, in one table: what each predicts of data that its fit did not see.

The expected log predictive density (Vehtari, Gelman and Gabry 2017, Statistics and Computing 27, 1413), by cross-validation
(Stone 1974, J. R. Stat. Soc. B 36, 111) over blocks, which keep together what follows one another in time: the sum over
unseen entries of -rho / 2, the logarithm of the density that the robust loss stands for, up to what is the same for all.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from ..search.candidate import Candidate
from ..search.problem import Problem
from ..search.selection import Selection
from ..search.step import Stage
from .depends import depends, without
from .likely import density

BASE = "nothing more"
BENDS = "it is no law: it bends as the log asks"


@dataclass
class Rival:
    """One row: a model of a step, and its log predictive density of each training block."""

    label: str
    density: np.ndarray  # of each training block
    free: int  # numbers beside those that every model of the step has
    role: str
    chance: float | None = None
    drop: float | None = None
    doubt: str = ""

    def row(self, best: Rival) -> dict:
        """As diagnosis.json has it, beside the best of its step."""
        apart = self.density - best.density
        blocks = len(apart)
        error = float(np.sqrt(blocks) * apart.std(ddof=1)) if blocks > 1 and self is not best else 0.0
        told = {"label": self.label, "elpd": float(self.density.sum()), "elpd_diff": float(apart.sum()), "dse": error}
        return told | {"free": self.free, "chance": self.chance, "drop": self.drop, "doubt": self.doubt, "role": self.role}


def rivals(outcome: Selection, rng: np.random.Generator, free: Sequence[Candidate] = ()) -> list[dict]:
    """Each step of a search: how many entries told it, and its models, best first; those only looked at by their names.

    rng: of the draws that tell whether a free curve predicts more than chance. free: free laws of a whole drive, of the first step.
    """
    found, problem = [], outcome.searched
    for stage in outcome.stages:
        rows = _competed(outcome, stage)
        if free and stage is outcome.stages[0]:
            rows += [_of_law(problem, law) for law in free]
        elif rows[1:] and (curve := _free_curve(outcome, stage, rng)):
            rows.append(curve)
        best = max(rows, key=lambda rival: rival.density.sum())
        told = [rival.row(best) for rival in rows]
        found.append(
            {
                "winner": stage.winner.hypothesis.label if stage.winner else "",
                "blocks": len(problem.entries),
                "entries": int(problem.entries.sum()),
                "effective": float((problem.entries * problem.new).sum()),
                "free": len(stage.base.free),
                "rows": sorted(told, key=lambda row: -row["elpd"]),
                "looked_at": [c.hypothesis.label for c in stage.candidates if not c.fit],
            }
        )
    return found


def role(outcome: Selection, stage: Stage, candidate: Candidate) -> str:
    """What became of a candidate of a step, one word for each: a later step may drop or exchange the best."""
    label = candidate.hypothesis.label
    named = {cause.hypothesis.label for cause in outcome.causes}
    chosen = [kept.winner.hypothesis.label for kept in outcome.kept if kept.winner and kept.candidates is stage.candidates]
    if label in chosen or (candidate is stage.winner and label in named):
        return "named"
    if candidate is stage.winner:
        return "best, dropped later"
    return "not to be told from it" if candidate in stage.tied else "considered"


def _competed(outcome: Selection, stage: Stage) -> list[Rival]:
    """The base of a step, and all that was fitted over it."""
    problem = outcome.searched
    rows = [Rival(BASE, density(problem, stage.base.losses), 0, "base")]
    for c in stage.candidates:
        if c.fit is not None:
            told, part = density(problem, c.losses), role(outcome, stage, c)
            rows.append(Rival(c.hypothesis.label, told, len(c.free), part, c.chance, c.drop, c.doubt))
    return rows


def _of_law(problem: Problem, law: Candidate) -> Rival:
    """A free law as a row."""
    return Rival(law.hypothesis.effect, density(problem, law.losses), len(law.free), "curve", doubt=BENDS)


def _free_curve(outcome: Selection, stage: Stage, rng: np.random.Generator) -> Rival | None:
    """The free function of one variable that predicts most of what the base leaves, where one predicts more than chance.

    Variables are means of all samples of a bin, also where of a long log a part was simulated.
    """
    problem, experiment = outcome.searched, outcome.problem.experiment
    unseen, rows = stage.unseen.reshape(problem.shape), problem.rows.reshape(problem.shape)
    values = problem.absolute(stage.base.fitted.values)
    found: list[Rival] = []
    for one in depends(experiment, unseen, rows, values, rng):
        bent = without(experiment, unseen, rows, values, one)
        if bent is not None:
            left, knots = bent
            label, told = f"free curve of {one.variable} ({one.residual})", density(problem, problem.block_loss(left.ravel()))
            found.append(Rival(label, told, knots, "curve", one.chance, doubt=BENDS))
    return max(found, key=lambda rival: rival.density.sum(), default=None)
