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
    """The answer first, then what does as well.

    doubted: of each cause whether it is weak; the same answer without such a one is a model, too.
    """
    problem, final = outcome.problem, outcome.final.values
    found = [_model(problem, _label(outcome.causes), final, outcome.causes)]
    for candidate, stage, weak in zip(outcome.causes, outcome.kept, doubted):
        others = [c for c in outcome.causes if c is not candidate]
        mine = {p.name for p in candidate.free}
        rest = {name: value for name, value in final.items() if name not in mine}
        alone = weak and not stage.tied
        likeliest = shares(candidate, stage, outcome.searched)[1:2] if alone else []
        for rival in stage.tied or [rival for rival, _ in likeliest]:
            own = rival.fitted.values
            if any(p.name not in own for c in others for p in c.free):  # it was not fitted beside them: they are as in the answer
                own = {p.name: own[p.name] for p in rival.free}
            found.append(_model(problem, _label([rival, *others]), rest | own, [rival, *others]))
        if alone:
            found.append(_model(problem, _label(others), rest, others))
    return found


def nearest(outcome: Selection, searched: list[Candidate], best: Selection | None) -> list[OpenModel]:
    """Where there is no answer what came nearest, and nothing at all; none where nothing was fitted.

    searched: the causes with which the search ended: its last round stood beside them. best: the model that is told beside the answer.
    """
    problem = outcome.problem
    contest = outcome.stages[-1] if outcome.stages else None
    fitted = [c for c in contest.candidates if c.fit is not None] if contest else []
    found = {_label(best.causes): _model(problem, _label(best.causes), best.final.values, best.causes)} if best else {}
    for candidate in sorted(fitted, key=lambda c: c.errors.mean()):
        # what it was exchanged for is not in its fit
        beside = [c for c in searched if all(p.name in candidate.fitted.values for p in c.free)]
        others = [c for c in beside if not c.hypothesis.same_cause(candidate.hypothesis)]  # else it is more numbers of that one
        label = _label([*others, candidate])
        found.setdefault(label, _model(problem, label, candidate.fitted.values, [*beside, candidate]))
    return [*list(found.values())[: RULES.judge.open_models], _model(problem, PLAIN, outcome.final.values, [])] if found else []


def _label(causes: list[Candidate]) -> str:
    return " and ".join(c.hypothesis.label for c in causes) or PLAIN


def _model(problem: Problem, label: str, values: dict[str, float], causes: list[Candidate]) -> OpenModel:
    """Without what says how a log was recorded, and what belongs to one run of it: the next run has its own."""
    free: list[Free] = [p for c in causes for p in c.free]
    free += [p for p in problem.base_free if not (p.of_recorder or p.part or p.of_run)]
    own = {p.name for p in free}
    told = {name: float(value) for name, value in problem.absolute(values).items() if name in own}
    return OpenModel(label, told, {p.name: (float(p.low), float(p.high)) for p in free if not p.above})
