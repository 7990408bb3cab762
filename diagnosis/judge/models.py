"""The models between which a search did not decide, as plain numbers: what the next run is to tell apart."""

from __future__ import annotations

from dataclasses import asdict, dataclass

from ..rules import RULES
from ..search.candidate import Candidate
from ..search.hypotheses import Free
from ..search.problem import Problem
from ..search.selection import Selection
from .likely import shares

PLAIN = "nothing more"


@dataclass(frozen=True)
class OpenModel:
    """A drive as one answer has it: values of "component.parameter", and those of them that are its own, with their ranges."""

    label: str
    values: dict[str, float]
    free: dict[str, tuple[float, float]]

    def row(self) -> dict:
        """As diagnosis.json has it."""
        return asdict(self)


def models(outcome: Selection, doubted: list[bool]) -> list[OpenModel]:
    """The answer first, then what does as well; where there is no answer what came nearest, and nothing at all.

    doubted: of each cause whether it is weak; the same answer without such a one is a model, too.
    """
    problem, final = outcome.problem, outcome.final.values
    if not outcome.causes:
        contest = outcome.stages[-1] if outcome.stages else None
        fitted = [c for c in contest.candidates if c.fit is not None] if contest else []
        close = sorted(fitted, key=lambda c: c.errors.mean())[: RULES.judge.open_models]
        if not close:
            return []
        return [_model(problem, c.hypothesis.label, c.fitted.values, [c]) for c in close] + [_model(problem, PLAIN, final, [])]
    answer = " and ".join(c.hypothesis.label for c in outcome.causes)
    found = [_model(problem, answer, final, outcome.causes)]
    for candidate, stage, weak in zip(outcome.causes, outcome.kept, doubted):
        others = [c for c in outcome.causes if c is not candidate]
        mine = {p.name for p in candidate.free}
        rest = {name: value for name, value in final.items() if name not in mine}
        beside = [c.hypothesis.label for c in others]
        alone = weak and not stage.tied
        likeliest = shares(candidate, stage, outcome.searched)[1:2] if alone else []
        for rival in stage.tied or [rival for rival, _ in likeliest]:
            own = {p.name: rival.fitted.values[p.name] for p in rival.free}
            found.append(_model(problem, " and ".join([rival.hypothesis.label, *beside]), rest | own, [rival, *others]))
        if alone:
            found.append(_model(problem, " and ".join(beside) or PLAIN, rest, others))
    return found


def _model(problem: Problem, label: str, values: dict[str, float], causes: list[Candidate]) -> OpenModel:
    """Without what says how a log was recorded, and what belongs to one run of it: the next run has its own."""
    free: list[Free] = [p for c in causes for p in c.free]
    free += [p for p in problem.base_free if not (p.of_recorder or p.part or p.of_run)]
    own = {p.name for p in free}
    told = {name: float(value) for name, value in problem.absolute(values).items() if name in own}
    return OpenModel(label, told, {p.name: (float(p.low), float(p.high)) for p in free if not p.above})
