"""The last word on what was found one after another: whether one of its rivals, or a curve, says it alone."""

from __future__ import annotations

from typing import TYPE_CHECKING

from ..rules import RULES
from .asked import beyond_steps, leaves_less
from .order import as_good, beside, curves_beside, names_of
from .shape import one_shape
from .whole import fitted, helps

if TYPE_CHECKING:
    from .run import Search


def one_alone(found: Search) -> None:
    """Where one of what did as well as the first cause leaves no more of what judges than all that was found, it is named alone.

    What is taken for the first cause decides what is left: a second one may only make up for what another name of the first would
    not leave.
    """
    first, named = found.outcomes[0], found.named
    if len(named) < 2 or named[0] is not first or first.winner is None:
        return
    count = sum(outcome.winner.guess.count for outcome in named if outcome.winner is not None)
    near = as_good(first.winner, first.order, first.chance_level, first.base.errors.mean(), count)
    for rival in near[: RULES.naming.vetoed]:
        wider = found.begins.with_also(rival.guess)
        alone = fitted(wider, rival.values, rival.problem.fixed)
        if not leaves_less((found.work, found.best), (wider, alone), rival.guess.kind):
            first.winner, first.beside = rival, [r for r in first.beside if r is not rival]
            found.outcomes, found.work, found.best = [first], wider, alone
            return


def curve_instead(found: Search) -> None:
    """Where a free curve leaves less of the data that judge than all that has a name together, it is the answer.

    So it is where it leaves less than a law does once that would have to be there twice, or with one that takes it off again. But
    what has a name, goes with what the curve does and leaves no more of either data is its name: one of fewer numbers, which unseen
    blocks could not tell from it, had gone before it.
    """
    first, named = found.outcomes[0], [outcome.winner for outcome in found.named if outcome.winner is not None]
    if first.curve is None or (named and _noise_alone(found)):
        return
    tried = lambda one: (wider := found.begins.with_also(one.guess), fitted(wider, one.values, first.curve.problem.fixed))
    wider, after = tried(first.curve)
    left = tried(named[0]) if one_shape(found, named) else (found.work, found.best) if named else (found.begins, found.base)
    if not helps(after, left[1]) or (named and not beyond_steps((wider, after), left)):
        return
    level, base = first.chance_level, first.base.errors.mean()
    instead, around = first.curve, curves_beside(first.curve, first.fitted, level, base)
    for law in [r for r in names_of(first.curve, first.order, level) if r not in named][: RULES.naming.vetoed]:
        other = tried(law)
        if not leaves_less((wider, after), other):
            instead, (wider, after) = law, other
            around = beside(law, [r for r in first.order if r not in named], level, base)
            break
    for outcome in found.outcomes:
        outcome.winner, outcome.beside = None, []
    first.winner, first.beside, found.outcomes = instead, around, [first]
    found.work, found.best = wider, after


def _noise_alone(found: Search) -> bool:
    """Whether what judges is left so near its noise that nothing could leave enough less of it."""
    noise, held = found.outcomes[-1].noise, found.best.held
    return held is not None and all(size * (1.0 - RULES.judge.help) <= noise.get(name, 0.0) for name, size in held.items())
