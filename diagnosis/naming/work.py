"""What one naming goes on with: its rig, runs and numbers, what was found so far, and the problems that are made of them."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from contextlib import ExitStack
from copy import copy
from dataclasses import dataclass, field, replace
from functools import cached_property

import numpy as np

from selflock.master.wiring import Link

from ..calibration.fit import spreads
from ..calibration.heard import as_measured
from ..calibration.numbers import Number, label
from ..data.log import MeasuredRun
from ..data.rig import Rig
from ..residuals.blocks import Blocks
from ..residuals.mending import rms
from ..rules import RULES
from ..search.kept import Kept
from ..systems.parts import Parts
from .extended import Extended, Extending
from .guesses import Guess, begins
from .places import Insert
from .rounding import Rounded, rounded


@dataclass
class Work:
    """All that one naming goes on with."""

    rig: Rig
    parts: Parts
    runs: list[MeasuredRun]
    numbers: tuple[Number, ...]
    judges: set[int]
    rows: list[np.ndarray]
    words: str
    layout: Blocks
    played: Extended
    given_step: float  # of the system as the rig has it, s
    kept: Kept | None = None  # where fits are kept
    inserts: tuple[Insert, ...] = ()
    found: list[tuple[Number, ...]] = field(default_factory=list)  # numbers of what was found
    acts: dict[str, dict[str, float]] = field(default_factory=dict)
    sampled: frozenset[str] = frozenset()  # components that act once a step
    keep: frozenset[str] = frozenset()  # such as keep the rig's step where the others take finer ones
    opened: ExitStack = field(default_factory=ExitStack)  # systems that run, to be closed whatever happens

    def played_on(
        self, parts: Parts, runs: list[MeasuredRun], numbers: tuple[Number, ...], logged: list[MeasuredRun] | None = None
    ) -> Extended:
        """A system of one's own on these runs. logged: as they were recorded, where that is something else."""
        played = Extended(self.rig, parts, runs, numbers)
        played.effort, played.reusable = self.played.effort, self.played.reusable  # of all together
        played.rounded, played.logged = self.rounded, logged or runs
        played.early, played.late = self.played.early, self.played.late
        self.opened.callback(played.close)
        return played

    def hearing(self, links: dict[str, Link]) -> Work:
        """The same where these inputs are given what was measured of what gives them (calibration.heard)."""
        runs = as_measured(self.runs, links)
        return replace(self, runs=runs, played=self.played_on(self.parts, runs, self.numbers))

    def read_early(self, names: Iterable[str]) -> None:
        """From now on these outputs are compared a step later (rows.followed)."""
        self.played.early = frozenset(names)
        self.played.forget()

    def read_late(self, late: dict[str, float]) -> None:
        """From now on outputs are compared so much later than their rows say, s (rows.read_late)."""
        self.played.late = late
        self.played.forget()

    @property
    def which(self) -> list[int]:
        return [i for i in range(len(self.runs)) if i not in self.judges]

    def problem(self) -> Extending:
        """The fit to all that teaches, with what was found so far."""
        self.played.extend(self.inserts)
        more = [n for numbers in self.found for n in numbers]
        found = Extending(self.rig, self.runs, (*self.numbers, *more), self.which, self.rows, kept=self.kept, acts=self.acts)
        found.fixed = {n.name: n.start for n in found.numbers if n.run in self.judges}
        vars(found)["played"] = self.played
        found.units = spreads(self.played)
        return found

    @cached_property
    def rounded(self) -> dict[str, Rounded]:
        """Outputs that were rounded, by what was recorded in the runs that teach."""
        return rounded([self.runs[i] for i in self.which], self.played.outputs)

    @property
    def step(self) -> float:
        """The system's step, s."""
        return self.parts.system.run.step

    @property
    def finest(self) -> float:
        """The shortest step that may be taken, s."""
        return self.given_step / 2.0**RULES.naming.halved

    @property
    def others(self) -> frozenset[str]:
        """Components that are others in other steps."""
        return self.sampled - self.keep

    def keeping(self) -> Work:
        """The same where what acts once a step keeps the rig's, unless it has one of its own."""
        return replace(self, keep=frozenset(n for n in self.sampled if not self.parts.system.components[n].step))

    def in_steps(self, factor: float) -> Work:
        """The same in steps of another size; what keeps the rig's acts as those begin, for others that take finer ones."""
        parts, step = copy(self.parts), self.step * factor
        finer = step < 0.75 * self.given_step
        acts = lambda component: replace(component, step=self.given_step if finer else 0.0, samples=finer)
        components = {name: acts(c) if name in self.keep else c for name, c in parts.system.components.items()}
        parts.system = replace(parts.system, components=components, run=replace(parts.system.run, step=step))
        return replace(self, parts=parts, played=self.played_on(parts, self.runs, self.numbers))

    def with_also(self, guess: Guess) -> Work:
        """The same with one more that was found; a run is counted among all, not among those that teach."""
        numbers = tuple(n if n.run is None else replace(n, run=self.which[n.run]) for n in guess.numbers)
        first = next((n for n in numbers if begins(n)), None)
        if first is not None:  # where its state begins in runs that judge is as much their own
            own = lambda i: replace(first, name=f"{first.variable} of {label(self.runs[i])}", run=i)
            numbers += tuple(own(i) for i in sorted(self.judges))
        return replace(self, inserts=(*self.inserts, *guess.inserts), found=[*self.found, numbers], acts=self.acts | guess.acts)

    def but_for(self, guess: Guess) -> Work:
        """The same without one that was found."""
        gone = {n.name for n in guess.numbers}
        found = [numbers for numbers in self.found if not gone & {n.name for n in numbers}]
        acts = {name: what for name, what in self.acts.items() if name not in gone}
        return replace(self, inserts=tuple(one for one in self.inserts if one not in guess.inserts), found=found, acts=acts)


def heads(work: Work, most: int = RULES.naming.glance) -> Extending:
    """The heads of all runs that teach, of so many samples, on which guesses are looked at and compared."""
    total = sum(len(work.runs[i]) for i in work.which)
    share = min(1.0, most / total)
    runs = [work.runs[i].head(max(2, int(np.ceil(share * len(work.runs[i]))))) for i in work.which]
    place = {i: k for k, i in enumerate(work.which)}
    numbers = tuple(n if n.run is None else replace(n, run=place[n.run]) for n in work.numbers if n.run is None or n.run in place)
    played = work.played_on(work.parts, runs, numbers)
    rows = [work.rows[i][: len(run)] for i, run in zip(work.which, runs)]
    problem = Extending(work.rig, runs, numbers, list(range(len(runs))), rows, kept=work.kept)
    vars(problem)["played"] = played
    problem.units = spreads(played)
    return problem


def without(near: Extending, numbers: Sequence[Number], inserts: Sequence[Insert] = ()) -> Extending:
    """A problem with these numbers and corrections alone."""
    names = {n.name for n in numbers}
    found = replace(near, numbers=tuple(numbers), acts={name: what for name, what in near.acts.items() if name in names})
    vars(found)["played"] = near.played
    assert isinstance(near.played, Extended)
    near.played.extend(inserts)
    return found


def later(work: Work, near: Extending, values: dict[str, float]) -> bool:
    """Whether what lies behind the heads of the runs leaves more than they do: something happens there."""
    if all(len(run) == len(work.runs[i]) for i, run in zip(work.which, near.runs)):
        return False
    problem = work.problem()
    errors = problem.errors(values)
    if errors is None:
        return False
    for name, parts in errors.items():
        sizes_of = []
        for behind in (False, True):
            part = lambda x, run, behind=behind: x[len(run) :] if behind else x[: len(run)]
            chosen = [part(e, run)[part(t, run)] for e, t, run in zip(parts, problem.trusted[name], near.runs)]
            sizes_of.append(rms(chosen) if any(len(e) for e in chosen) else 0.0)
        if sizes_of[1] > RULES.naming.later * sizes_of[0]:
            return True
    return False
