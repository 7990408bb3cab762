"""The search: which hypotheses explain what the base simulation leaves, one after another until chance does as well.

Each step starts from a base (the nominal drive, what is uncertain refitted, the causes found so far). All hypotheses
are looked at linearly; those that may matter are fitted; the best on blocks that their fit did not see is compared
with what the same search finds by chance. Among those that do equally well there, the one with the fewest free
numbers wins, and rivals that cannot be told from it are named with it.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np

from selflock.fmus.effect import LAG

from ..rules import RULES
from .candidate import Candidate, near_best, worse
from .fit import Fit
from .hypotheses import Hypothesis
from .look import Known
from .problem import Problem
from .step import WITHIN, Stage, Step, so_far


@dataclass
class Selection:
    """What became of a search."""

    problem: Problem  # with all samples
    stages: list[Stage]
    causes: list[Candidate]  # in the order found
    kept: list[Stage]  # the stages in which they were found
    final: Fit
    base: Fit
    searched: Problem  # with the samples and the noise of the contests
    standing: Candidate | None = None  # all causes together, as they do there; None without any

    @property
    def late_at_once(self) -> bool:
        """Whether sensors of several channels seem to lag: then it is rather the command that acts late, which they all follow."""
        late = {c.hypothesis.channel for c in self.causes if c.hypothesis.channel and any(p.role == LAG for p in c.free)}
        return len(late) > 1

    @property
    def within_rows(self) -> bool:
        """Whether what explains most of what is left acts late within a sample: that is a matter of what was between the rows."""
        left = [c for c in self.stages[-1].candidates if c.fit] if self.stages else []
        return bool(left) and self.stages[-1].winner is None and left[0].doubt == WITHIN


class ForwardSelection:
    """A search for the causes of a problem, step after step.

    clean: times its noise up to which a residual's error has nothing missing, before any cause is found.
    tell: called with what is being done and how much of it is.
    again: of the problem, of fits with the first cause, and with what cannot be told from it, and of all fits that leave little more,
    the problem with what belongs to a run found anew, and the fit that it was found with; None where that is as it was.
    """

    def __init__(
        self,
        problem: Problem,
        rng: np.random.Generator,
        tell: Callable[[str, float], None] = lambda *_: None,
        clean: float = RULES.search.clean,
        again: Callable[[Problem, list[Fit], list[Fit]], tuple[Problem, Fit] | None] = lambda *_: None,
    ):
        self.problem, self.rng, self.tell, self.clean, self.again = problem, rng, tell, clean, again
        self.chance_level = np.inf
        self.known: Known = {}

    def run(self, most: int = RULES.search.most_steps) -> Selection:
        """Step after step, `most` of them, then the causes held against one another, then the last word on their numbers."""
        self.tell("fit of the nominal drive", 0.0)
        problem = self.problem = self.problem.with_noise()
        first = base = problem.fit(problem.base_free, problem.nominal)
        if longer := problem.longer(base):
            problem = self.problem = longer.with_noise()
            first = base = problem.fit(problem.base_free, problem.nominal)
        causes: list[Candidate] = []
        stages: list[Stage] = []
        kept: list[Stage] = []
        while len(stages) < most:
            stage = self.step(base, [c.hypothesis for c in causes], first)
            rivals = [c.fitted for c in (stage.winner, *stage.tied) if c]
            if rivals and not causes and (anew := self.again(problem, rivals, [c.fitted for c in near_best(stage.candidates)])):
                problem = self.problem = anew[0]
                first = base = problem.fit(first.free, _as_in(anew[1], first))
                stage = self.step(base, [], first)
            if stage.winner and causes and (other := self._deeper(base, stage.winner.fitted)):
                base = other
                if len(causes) == 1:  # what its first fit left is no word on it
                    causes[0] = replace(causes[0], fit=other, losses=together(self.problem, other).losses)
                    tied = [c for c in kept[0].tied if not worse(c, causes[0], self.chance_level)]
                    kept[0] = replace(kept[0], winner=causes[0], tied=tied)
                stage = self.step(base, [c.hypothesis for c in causes], first)
            stages.append(stage)
            if stage.winner is None:
                break
            base = stage.winner.fitted
            again = next((i for i, c in enumerate(causes) if c.hypothesis.same_cause(stage.winner.hypothesis)), None)
            if again is None:
                causes.append(stage.winner)
                kept.append(stage)
            else:  # what hid some of its numbers is found by now
                named = min(causes[again].hypothesis, stage.winner.hypothesis, key=lambda h: not h.takes)  # not by what it takes
                causes[again] = replace(causes[again], hypothesis=named, free=causes[again].free + stage.winner.free)
                kept[again] = replace(kept[again], winner=causes[again])
        standing = (stages[-1].winner or stages[-1].base) if causes else None
        if standing and len(causes) > 1:
            causes, kept, standing = self._exchange(*self._prune(causes, kept, together(self.problem, base)))
            causes, kept, standing = self._other_two(causes, kept, standing, first)
            # what was asked again is among the rivals that are told
            stages[-1:-1] = [one for one in kept if not any(one.candidates is stage.candidates for stage in stages)]
            base = standing.fitted
        searched, whole = problem, problem.experiment.whole()
        if whole is not problem.experiment:  # the last word on the numbers has the whole log
            self.tell("last fit" + so_far([c.hypothesis for c in causes]), 0.0)
            problem = problem.on(whole).with_noise_at(problem.nominal)
            first = problem.fit(first.free, dict(first.values), RULES.search.effort_last)
            base = problem.fit(base.free, dict(base.values), RULES.search.effort_last)
        return Selection(problem, stages, causes, kept, base, first, searched, standing)

    def step(self, base: Fit, found: list[Hypothesis], first: Fit | None = None) -> Stage:
        """One step over a base that holds the causes `found`; `first` is the base fit without any."""
        clean = RULES.search.left if found else self.clean
        stage = Step(self.problem, base, found, clean, self.chance_level, self.tell, first, self.known).play(self.rng)
        self.chance_level = stage.chance_level
        return stage

    def _deeper(self, base: Fit, wider: Fit) -> Fit | None:
        """The causes so far fitted from where they are beside another that was found, where that leaves less than their own fit did.

        Of a play a fit may end in a valley that any other number leads out of: five took 95 % of what it left, and one became a number
        of it. None where the base is as good.
        """
        found = self.problem.fit(base.free, _as_in(wider, base))
        left, before = (self.problem.loss(one.misfit) for one in (found, base))
        return found if left < (1.0 - RULES.search.matters) * before else None

    def _prune(self, causes: list[Candidate], stages: list[Stage], whole: Candidate):
        """Drop causes that later ones have made needless: an early guess may stand for a later, better one."""
        for gone in list(causes[:-1]):
            rest = [c for c in causes if c is not gone]
            without = together(self.problem, self.problem.with_these(rest, whole.fitted))
            if not worse(without, whole, self.chance_level):
                stages = [s for s in stages if s.winner is not gone]
                causes, whole = rest, without
        return causes, stages, whole

    def _exchange(self, causes: list[Candidate], stages: list[Stage], whole: Candidate):
        """Two causes may do with fewer numbers what a first guess and its helpers did."""
        opening, best = stages[0], None
        for rival in strong(opening, causes):
            for cause, stage in zip(causes[1:], stages[1:]):
                pair = in_place(self.problem, rival, [cause], whole, len(whole.free) - 1)
                if not pair:
                    continue
                merit = len(pair.free), pair.errors.mean()
                if not worse(pair, whole, self.chance_level) and (best is None or merit < best[0]):
                    beaten = [c for c in opening.candidates if c.fit and c.errors.mean() <= rival.errors.mean()]
                    begun = replace(opening, winner=rival, tied=[], aside=[*opening.aside, *beaten])
                    best = merit, [rival, cause], [begun, stage], pair
        return best[1:] if best else (causes, stages, whole)

    def _other_two(self, causes: list[Candidate], stages: list[Stage], whole: Candidate, first: Fit):
        """The first of two causes was found alone: with as many numbers another may leave less beside the second.

        As a motor's constant that stood for a mass and an inertia. Where one of those that were passed over does, all are asked again
        beside the second.
        """
        if len(causes) != 2:
            return causes, stages, whole
        cause = causes[1]
        rivals = [rival for stage in stages for rival in strong(stage, causes) if not rival.doubt]
        pairs = (in_place(self.problem, rival, [cause], whole, len(whole.free)) for rival in rivals)
        pair = next((pair for pair in pairs if pair and worse(whole, pair, self.chance_level)), None)
        if not pair:
            return causes, stages, whole
        anew = self.step(self.problem.with_these([cause], pair.fitted), [cause.hypothesis], first)
        if anew.winner is None or anew.winner.hypothesis.same_cause(cause.hypothesis):
            return causes, stages, whole
        other = together(self.problem, anew.winner.fitted)
        if not worse(whole, other, self.chance_level):
            return causes, stages, whole
        return [cause, anew.winner], [stages[1], anew], other


def strong(stage: Stage, causes: list[Candidate]) -> list[Candidate]:
    """Of what was fitted in a stage what gains nearly as much as its winner, and is none of these causes."""
    least = RULES.search.rivals * (stage.winner.gain if stage.winner else 0.0)
    others = lambda rival: not any(rival.hypothesis.same_cause(cause.hypothesis) for cause in causes)
    return [c for c in stage.candidates if c.fit is not None and c.gain >= least and others(c)]


def in_place(problem: Problem, rival: Candidate, others: list[Candidate], whole: Candidate, most: int) -> Candidate | None:
    """A rival beside these of the causes of a whole, in the place of the rest of them; None where that is more than so many numbers."""
    kept = [p for cause in others for p in cause.free]
    free = tuple({p.name: p for p in (*problem.base_free, *rival.free, *kept)}.values())
    if len(free) > most:
        return None
    values = whole.fitted.values
    start = {**values, **rival.fitted.values, **{p.name: values[p.name] for p in kept}}
    return together(problem, problem.fit(free, {p.name: start[p.name] for p in free}))


def together(problem: Problem, fitted: Fit) -> Candidate:
    """How a set of causes does on unseen blocks."""
    return Candidate(Hypothesis("", "set", ()), fitted.free, fitted, problem.block_loss(problem.held_out(fitted)))


def _as_in(other: Fit, fit: Fit) -> dict[str, float]:
    """The values of a fit as another has them, where it does: of a delay's the controller's own is part."""
    return {name: other.values.get(name, value) for name, value in fit.values.items()}
