"""What may stand for one of several causes beside the others: a search that found one after another never asked it there.

Mass, arm and inertia of a load are such: of any two of them the weight's moment and the whole inertia make the numbers, so
that no log tells which two there are, and each alone does much worse than all that came before it.
"""

from __future__ import annotations

from dataclasses import replace

from .candidate import Candidate, may_be_nothing, reaches_an_end, stands_beside
from .hypotheses import Hypothesis
from .selection import Selection, in_place, strong
from .step import Stage


def beside_one_another(outcome: Selection) -> Selection:
    """The outcome, with a stage for each cause that something passed over does as well as: it alone is asked there, beside the others."""
    problem, whole = outcome.searched, outcome.standing
    if whole is None or len(outcome.causes) < 2:
        return outcome
    passed = {c.hypothesis.label: c for stage in outcome.stages for c in strong(stage, outcome.causes) if not c.doubt}
    causes, kept, asked = [], [], []
    for cause, stage in zip(outcome.causes, outcome.kept):
        others = [c for c in outcome.causes if c is not cause]
        winner = replace(cause, fit=whole.fit, losses=whole.losses)
        tied = [one for rival in passed.values() if (one := _as_good(outcome, rival, winner, others, stage.chance_level))]
        if tied:
            without = problem.with_these(others, whole.fitted)
            unseen = problem.held_out(without)
            base = Candidate(Hypothesis("", "none", ()), without.free, without, problem.block_loss(unseen))
            cause = winner
            stage = Stage(base, [winner, *tied], winner, tied=tied, chance_level=stage.chance_level, unseen=unseen)
            asked.append(stage)
        causes.append(cause)
        kept.append(stage)
    stages = [*outcome.stages[:-1], *asked, *outcome.stages[-1:]]
    return replace(outcome, causes=causes, kept=kept, stages=stages)


def _as_good(
    outcome: Selection, rival: Candidate, winner: Candidate, others: list[Candidate], chance_level: float
) -> Candidate | None:
    """The rival as it is in the winner's place beside the others, where nothing there tells it from the winner."""
    problem = outcome.searched
    found = in_place(problem, rival, others, winner, len(winner.fitted.free))
    if found is None:
        return None
    one = replace(rival, fit=found.fit, losses=found.losses)
    intervals = found.fitted.intervals(problem.rows, problem.blocks)
    if reaches_an_end(one, intervals) or may_be_nothing(one, intervals):
        return None
    return one if stands_beside(one, winner, chance_level, problem.alike) else None
