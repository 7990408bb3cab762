"""Whether two laws that were named one after the other are one curve, of which neither is the name."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING

import numpy as np

from selflock.fmus.correction import law

from .extended import gone_through
from .guesses import LAW
from .places import Insert
from .scene import one_to_one, order

if TYPE_CHECKING:
    from .round import Rivalled
    from .run import Search


def one_shape(found: Search, named: Sequence[Rivalled]) -> bool:
    """Whether what was named is a law twice, or two that take off each other, of what is one variable at one place.

    Two limits are a bump, but for its roundings, and so are a limit and a cubic that bends back what the limit lifts. Two effects
    at one place, as of dry friction beside a drag, go the same way; and a free curve is any sum of these as well.
    """
    if len(named) < 2 or any(r.guess.kind != LAW for r in named):
        return False
    first, *others = (r.guess.inserts[0] for r in named)
    if any((one.place, one.multiplies) != (first.place, first.multiplies) for one in others):
        return False
    if len({(r.guess.law, r.guess.over) for r in named}) == 1:
        return True
    still = not any(law.BY_NAME[one.law].remembers for one in (first, *others))
    alone = all(len(r.guess.inserts) == 1 for r in named)
    return still and alone and any(_opposed(found, first, one) for one in others)


def _opposed(found: Search, first: Insert, second: Insert) -> bool:
    """Whether two laws of what is one variable vary against each other where the system goes."""
    work, problem = found.work, found.best.problem
    settings = problem.settings(found.best.values)
    work.played.extend(work.inserts)
    series = work.played.series(settings, work.which)
    x, y = (gone_through(series, one.over, one.taken, one.beside) for one in (first, second))
    return one_to_one(order(x), order(y)) and against(
        adds(first, settings[work.which[0]], x), adds(second, settings[work.which[0]], y)
    )


def against(first: np.ndarray, second: np.ndarray) -> bool:
    """Whether one falls, in the mean, where the other rises."""
    return bool(np.mean((first - first.mean()) * (second - second.mean())) < 0.0)


def adds(one: Insert, settings: Mapping[str, float], x: np.ndarray) -> np.ndarray:
    """What a law without a state adds at these values of its variable."""
    p = [0.0] * law.SIZE
    p[law.LAW] = law.BY_NAME[one.law].code
    for k, word in enumerate(law.BY_NAME[one.law].numbers):
        p[law.FIRST + k] = settings.get(f"{one.name}.{word}", 0.0)
    return np.array([law.still(p, float(u)) for u in x])
