"""What is fitted beside that which fits best, whatever the look says of it: what the best must be held against."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from typing import TYPE_CHECKING

import numpy as np

from ..rules import RULES
from ..search.screen import Direction
from ..systems.parts import Parts
from .guesses import CURVE, LAW, PARAMETER, PATH, Guess, words
from .order import foreign
from .places import origin

if TYPE_CHECKING:
    from .contest import Rivalled

Way = tuple[Direction, Guess]


def beside_best(found: Sequence[Rivalled], ways: Sequence[Way], parts: Parts) -> list[Way]:
    """All that follows, each once, from as many places as it is fitted from."""
    asked: dict[str, list[Way]] = {}
    others = numbers(found, ways), alike(found, ways, parts), natural(found, ways, parts)
    for part in (curve(found, ways), simpler(found, ways), *others):
        mine: dict[str, list[Way]] = {}
        for pair in part:
            mine.setdefault(pair[1].label, []).append(pair)
        asked = mine | asked
    return [pair for pairs in asked.values() for pair in pairs]


def starts(guess: Guess) -> int:
    """From how many places it is fitted.

    A fit hardly crosses a limit; and of two widths of one law either may be the narrow one, with a valley for each.
    """
    limited = any(n.name.endswith(".l") for n in guess.numbers) or guess.law == "Stribeck"
    return RULES.naming.starts_limit if limited else RULES.naming.starts


def _best(found: Sequence[Rivalled], kind: str) -> Guess | None:
    return next((rival.guess for rival in found if rival.guess.kind == kind and len(rival.guess.inserts) == 1), None)


def curve(found: Sequence[Rivalled], ways: Sequence[Way]) -> Iterator[Way]:
    """The free curve that the best law goes along with, where it was not fitted: what the law says must be held against it."""
    best = next((rival.guess for rival in found if rival.guess.kind == LAW), None)
    if best is None or not best.inserts:
        return
    label = words("curve", best.inserts[0])
    mine = [pair for pair in ways if pair[1].label == label]
    if mine and not any(rival.guess.label == label for rival in found):
        yield max(mine, key=lambda pair: pair[0].gain)


def simpler(found: Sequence[Rivalled], ways: Sequence[Way]) -> Iterator[Way]:
    """Laws of fewer numbers than the best one's that go with its variable at its place: a look may see more in more numbers."""
    best = _best(found, LAW)
    if best is None:
        return
    where = lambda guess: (guess.kind, guess.place, guess.over, [one.multiplies for one in guess.inserts])
    fitted = {rival.guess.label for rival in found}
    few = [pair for pair in ways if where(pair[1]) == where(best) and len(pair[1].numbers) < len(best.numbers)]
    for way, guess in sorted(few, key=lambda pair: -pair[0].gain):
        if guess.label not in fitted:
            fitted.add(guess.label)
            yield way, guess


def alike(found: Sequence[Rivalled], ways: Sequence[Way], parts: Parts) -> Iterator[Way]:
    """The best law, curve and path, of the same quantity at other places, where the look sees as much of it there.

    What passes through an FMU that only computes acts alike before and behind it: that must be told, and which is nearer.
    """
    fitted = {rival.guess.label for rival in found}
    for kind in (LAW, CURVE, PATH):
        best = _best(found, kind)
        if best is None:
            continue
        what = lambda guess: (guess.law, _quantity(guess, parts), guess.inserts[0].multiplies)
        mine = sorted((pair for pair in ways if pair[1].kind == kind), key=lambda pair: -pair[0].gain)
        most = max((way.gain for way, guess in mine if guess.label == best.label), default=np.inf)
        others: dict[str, list[Way]] = {}
        for way, guess in mine:
            if way.gain >= RULES.naming.as_much * most and guess.label not in fitted and what(guess) == what(best):
                others.setdefault(guess.label, []).append((way, guess))
        for pairs in list(others.values())[: RULES.naming.of_path]:
            yield from pairs[: starts(best)]


def numbers(found: Sequence[Rivalled], ways: Sequence[Way]) -> Iterator[Way]:
    """Numbers of FMUs that look nearly as good as the best that has a name did: a gain that is off is a scale of what it acts on."""
    best = next((rival.guess for rival in found if rival.guess.kind != CURVE), None)
    if best is None:
        return
    fitted = {rival.guess.label for rival in found}
    most = max((way.gain for way, guess in ways if guess.label == best.label), default=np.inf)
    mine = [(way, guess) for way, guess in ways if guess.kind == PARAMETER and guess.label not in fitted]
    alike = [pair for pair in mine if pair[0].gain >= RULES.naming.as_much * most > 0.0]
    yield from sorted(alike, key=lambda pair: -pair[0].gain)[: RULES.naming.of_path]


def natural(found: Sequence[Rivalled], ways: Sequence[Way], parts: Parts) -> Iterator[Way]:
    """The best law of variables that its FMU has, where the look sees nearly as much: what would be believed if it did as well.

    A look is right to some percent, and which of these stands first there says little.
    """
    best = _best(found, LAW)
    if best is None:
        return
    fitted = {rival.guess.label for rival in found}
    mine = sorted((pair for pair in ways if pair[1].kind == LAW), key=lambda pair: -pair[0].gain)
    most = max((way.gain for way, guess in mine if guess.label == best.label), default=np.inf)
    what = lambda guess: (guess.law, guess.stage, guess.inserts[0].multiplies)
    others: dict[str, Way] = {}
    for way, guess in mine:
        if way.gain >= RULES.naming.as_much * most and what(guess) == what(best) and not foreign(guess, parts):
            others.setdefault(guess.label, (way, guess))
    yield from [pair for label, pair in others.items() if label not in fitted][: RULES.naming.likely]


def _quantity(guess: Guess, parts: Parts) -> tuple[str, int, str]:
    """What a law goes with, whichever of two linked variables it is called by."""
    over, what, beside = guess.over
    return origin(parts, over), what, origin(parts, beside)


def refined(found: Sequence[Rivalled], parts: Parts, far: Callable[[Guess], tuple[bool, bool]]) -> list[Rivalled]:
    """The free curve that predicts most, where it is the best of all, and the same at the nearest place: they are asked for more finely."""
    if not found or found[0].guess.kind != CURVE:
        return []
    what = lambda rival: (rival.guess.kind, _quantity(rival.guess, parts), rival.guess.inserts[0].multiplies)
    same = [rival for rival in found if rival.guess.inserts and what(rival) == what(found[0])]
    nearest = min(same, key=lambda rival: (far(rival.guess), rival.candidate.errors.mean()))
    return list({id(rival): rival for rival in (found[0], nearest)}.values())
