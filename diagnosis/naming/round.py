"""A round of a contest: what was fitted beside a base, and what of it is believed."""

from __future__ import annotations

from dataclasses import dataclass, field, replace

import numpy as np

from ..calibration.fit import End
from ..search.candidate import Candidate
from .extended import Extending
from .guesses import Guess
from .places import Place
from .whole import learnt


@dataclass
class Rivalled:
    """A guess that was fitted, with its judgement."""

    guess: Guess
    problem: Extending
    end: End
    candidate: Candidate
    block: np.ndarray  # of each entry of the misfit
    rough: bool = False  # fitted without slopes of its own

    @property
    def values(self) -> dict[str, float]:
        return self.problem.values(self.end.places)

    @property
    def slopes(self) -> dict[str, np.ndarray] | None:
        """What a fit of it that begins near its end knows of its slopes: its own, where it has such and they go on."""
        known = learnt(self.guess.numbers)
        if self.rough or known is None or self.end.jacobian is None:
            return known
        return dict(zip((n.name for n in self.problem.free), self.end.jacobian.T))

    def moved(self, values: dict[str, float]) -> Rivalled:
        """The same where these are the values of its numbers."""
        places = np.array([np.clip(n.place(values[n.name]), 0.0, 1.0) for n in self.problem.free])
        return replace(self, end=replace(self.end, places=places))


@dataclass
class Round:
    """A round: the base, all that was fitted, best first, and the winner, if any."""

    base: Candidate
    fitted: list[Rivalled]
    winner: Rivalled | None = None
    order: list[Rivalled] = field(default_factory=list)  # named ones that are real, the most believed first
    beside: list[Rivalled] = field(default_factory=list)  # as good as the winner, with no more numbers
    curve: Rivalled | None = None  # the free curve that predicts most
    only: tuple[Place, str] | None = None  # its place and variable, where it leaves noise: something is missing there alone
    chance_level: float = 0.0
    looked: int = 0
    noise: dict[str, float] = field(default_factory=dict)
    off: np.ndarray = field(default_factory=lambda: np.zeros(0, bool))
    ratios: dict[str, float] = field(default_factory=dict)  # error over noise of each output
    still: list[str] = field(default_factory=list)  # variables that no law was asked of

    @property
    def quiet(self) -> bool:
        """Whether its base left no more than noise, so that nothing was held against it."""
        return bool(len(self.off)) and not self.off.any()

    @property
    def told(self) -> bool:
        """Whether what steps still miss is all that is left: its base left no more than noise beside it, or the curve that won does."""
        return self.quiet or (self.only is not None and self.winner is not None and self.winner is self.curve)
