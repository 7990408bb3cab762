"""What the data that judge say of rivals that what taught cannot tell from each other."""

from __future__ import annotations

from collections.abc import Callable, Sequence

from ..rules import RULES
from .guesses import EVENT
from .round import Rivalled, Round
from .whole import Whole, falls, fitted, helps, missed
from .work import Work

Model = tuple[Work, Whole]
Tried = Callable[[Rivalled], Model]


def told_apart(
    first: tuple[Rivalled, Work, Whole], near: Sequence[Rivalled], tried: Tried, enough: bool
) -> tuple[Rivalled, Work, Whole, list[Rivalled]]:
    """Of one that is believed and what does as well with no more numbers that which the data that judge ask for; and what they refuse.

    A dead band is a limit in a log that goes beyond it to one side alone, and a limit of a flow one of the level that it comes of:
    which it is data tell that go elsewhere. An event's own run knows it alone, so that other data say nothing of it.
    """
    refuted: list[Rivalled] = []
    for other in near[: RULES.naming.vetoed]:
        if enough or EVENT in (first[0].guess.kind, other.guess.kind):
            break
        model = tried(other)
        more, less = leaves_less(model, first[1:]), leaves_less(first[1:], model)
        if more and not less:
            refuted.append(first[0])
            first = other, *model
        elif less and not more:
            refuted.append(other)
    return *first, refuted


def confirmed(outcome: Round, work: Work, whole_of: Callable[[Rivalled], Whole]) -> list[Rivalled]:
    """Where an event is believed most, what comes near it and is confirmed by data that an event of another run cannot touch.

    What lies in such data as well was no event: it leaves less of them than the event does, beside which the base is free of
    what happened and may be all that they ask for.
    """
    order, base = outcome.order, outcome.base.errors.mean()
    if not order or order[0].guess.kind != EVENT or not work.judges:
        return []
    takes = lambda rival: base - rival.candidate.errors.mean()
    near = [r for r in order if r.guess.kind != EVENT and takes(r) >= RULES.naming.in_reach * takes(order[0])]
    event = whole_of(order[0]) if near else None
    return [r for r in near[: RULES.naming.vetoed] if event is not None and helps(whole_of(r), event)]


def leaves_less(one: Model, other: Model, kind: str = "") -> bool:
    """Whether one model leaves less of what judges, and does so where no steps miss anything, too; of an event its own run is asked.

    What steps miss is seen of each otherwise: of a house's room with one more thermal mass they left a sensor 1.27 times its noise,
    and 1.16 beside another's name for it, which was believed; without what they miss the room's leaves less.
    """
    return helps(one[1], other[1], kind) and (kind == EVENT or beyond_steps(one, other))


def beyond_steps(curve: Model, left: Model) -> bool:
    """Whether a curve, or what has a name, leaves less also where no steps miss anything, where they were halved as often as they may be.

    What they still miss of a law a curve makes up for: beside a limit of a house's radiator they left 1.25 times the noise.
    """
    if curve[0].step > 1.5 * curve[0].finest or _by_far(curve, left):
        return True
    after, before = (fitted(one, whole.values, whole.problem.fixed, vanishing=True) for one, whole in (curve, left))
    return helps(after, before)


def _by_far(curve: Model, left: Model) -> bool:
    """Whether it does so though steps missed all that steps twice as long move, for it and against what is left: no fit is asked."""
    (most, least), (after, before) = (missed(*one) for one in (curve, left)), (curve[1].held, left[1].held)
    if most is None or least is None or after is None or before is None:
        return False
    return falls({name: after[name] + most[name] for name in after}, {name: before[name] - least[name] for name in before})
