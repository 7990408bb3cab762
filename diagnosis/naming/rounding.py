"""Where the fit of a rounding starts: what is rounded jumps where a step of it does, and no slope leads from one to the next."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from ..rules import RULES

if TYPE_CHECKING:
    from .extended import Extending
    from .guesses import Guess


def between(problem: Extending, guess: Guess, values: dict[str, float], size: float) -> dict[str, float]:
    """These values with that step, of those up to the next that is looked at, with which the model leaves least.

    size: of the signal's largest value. Levels of a command that are held for rows count otherwise on one side of such a step: of a
    fortieth of them a third of the error is left, and a fit goes after that. In units of a step of that value those that are looked
    at lie `counted` apart.
    """
    rules, (step,) = RULES.naming, guess.numbers
    if values[step.name] <= 0.0:
        return values
    counts = size / values[step.name] + np.linspace(-rules.counted, rules.counted, 2 * rules.roundings + 1)
    tried = [values | {step.name: float(np.clip(size / count, step.low, step.high))} for count in counts[counts > 0.0]]
    losses = [problem.loss(problem.misfit(np.array([n.place(one[n.name]) for n in problem.free]))) for one in tried]
    return tried[int(np.argmin(losses))] if np.isfinite(losses).any() else values
