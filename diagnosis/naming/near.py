"""What is fitted beside that which fits best, whatever the look says of it: what the best must be held against."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from typing import TYPE_CHECKING

from selflock.fmus.correction.law import BY_NAME

from ..rules import RULES
from ..search.screen import Direction
from ..systems.parts import Parts
from .guesses import CURVE, LAW, PARAMETER, PATH, Guess, begins, words
from .places import origin

if TYPE_CHECKING:
    from .looks import Looks
    from .round import Rivalled
    from .scene import Scene

Way = tuple[Direction, Guess]
Start = tuple[Guess, dict[str, float]]
Far = Callable[[Guess], tuple[bool, bool]]


def beside_best(found: Sequence[Rivalled], first: Guess | None, looks: Looks, far: Far) -> list[Way]:
    """All that follows, each once, from as many places as it is fitted from. first: what would be believed by now; far: order.far.

    The free curve that the best law goes along with: what the law says must be held against it. Laws of fewer numbers than the
    best one's that go with its variable at its place: a look may see more in more numbers. Then what looks nearly as good as the
    best, for a look is right to some percent, and which stands first there says little: numbers of FMUs, as a gain that is off is
    a scale of what it acts on; the best law, curve and path, of the same quantity at other places, for what is not fitted cannot
    be told beside it, and nobody could say which is nearer; the best law of variables that its FMU has, what would be believed if
    it did as well, and before what moves at first. Last what the look cannot tell from the first, whatever gain it has.
    """
    ways, parts = looks.ways, looks.scene.parts
    law = _best(found, LAW)
    asked: list[list[Way]] = _curve(found, ways) + ([] if law is None else _simpler(law, found, ways))
    if first is not None:
        asked += _nearly(first, found, ways, lambda guess: guess.kind == PARAMETER)[: RULES.naming.of_path]
    leading = [first if first is not None and len(first.inserts) == 1 else None, *(_best(found, k) for k in (LAW, CURVE, PATH))]
    for best in {best.label: best for best in leading if best is not None}.values():
        what = lambda guess: (guess.kind, guess.law, _quantity(guess, parts), guess.inserts[0].multiplies)
        same = lambda guess, best=best, what=what: bool(guess.inserts) and what(guess) == what(best)
        asked += _nearly(best, found, ways, same)[: RULES.naming.of_path]
        if best.kind == LAW:
            how = lambda guess: (guess.kind, guess.law, guess.stage, guess.inserts[0].multiplies)
            own = lambda guess, best=best, how=how: bool(guess.inserts) and how(guess) == how(best) and not far(guess)[0]
            mine = sorted(_nearly(best, found, ways, own), key=lambda pairs: far(pairs[0][1]))
            asked += mine[: RULES.naming.likely]
    if first is not None:
        asked += _turned(first, found, looks)[: RULES.naming.likely]
    once = {pairs[0][1].label: pairs for pairs in reversed(asked)}
    return [pair for pairs in once.values() for pair in pairs[: starts(pairs[0][1])]]


def starts(guess: Guess) -> int:
    """From how many places it is fitted.

    A fit hardly crosses a limit; and of two widths of one law either may be the narrow one, with a valley for each.
    """
    limited = any(n.name.endswith(".l") for n in guess.numbers) or guess.law == "Stribeck"
    return RULES.naming.starts_limit if limited else RULES.naming.starts


def _best(found: Sequence[Rivalled], kind: str) -> Guess | None:
    return next((rival.guess for rival in found if rival.guess.kind == kind and len(rival.guess.inserts) == 1), None)


def _by_label(found: Sequence[Rivalled], ways: Sequence[Way], wanted: Callable[[Direction, Guess], bool]) -> list[list[Way]]:
    """The ways that are wanted of guesses that were not fitted, of each guess together, those first that look best."""
    fitted = {rival.guess.label for rival in found}
    of: dict[str, list[Way]] = {}
    for way, guess in sorted(ways, key=lambda pair: -pair[0].gain):
        if guess.label not in fitted and wanted(way, guess):
            of.setdefault(guess.label, []).append((way, guess))
    return list(of.values())


def _looks(best: Guess, ways: Sequence[Way]) -> Direction | None:
    """How the look saw a guess at its best."""
    return max((way for way, guess in ways if guess.label == best.label), key=lambda way: way.gain, default=None)


def _nearly(best: Guess, found: Sequence[Rivalled], ways: Sequence[Way], like: Callable[[Guess], bool]) -> list[list[Way]]:
    """What is like the best in some way and looks nearly as good."""
    seen = _looks(best, ways)
    if seen is None:
        return []
    least = RULES.naming.as_much * seen.gain
    return _by_label(found, ways, lambda way, guess: way.gain >= least and way.gain > 0.0 and like(guess))


def _curve(found: Sequence[Rivalled], ways: Sequence[Way]) -> list[list[Way]]:
    best = next((rival.guess for rival in found if rival.guess.kind == LAW), None)
    label = words("curve", best.inserts[0]) if best is not None else ""
    return [pairs[:1] for pairs in _by_label(found, ways, lambda _, guess: guess.label == label)]


def _simpler(best: Guess, found: Sequence[Rivalled], ways: Sequence[Way]) -> list[list[Way]]:
    where = lambda guess: (guess.kind, guess.place, guess.over, [one.multiplies for one in guess.inserts])
    return _by_label(found, ways, lambda _, guess: where(guess) == where(best) and guess.count < best.count)


def _turned(best: Guess, found: Sequence[Rivalled], looks: Looks) -> list[list[Way]]:
    """What changes all that is compared as the best does, as far as the base's numbers cannot make up for it: the same again.

    A number of an FMU far from what it is may end at its range in a linear look, and the same scale of its input does not. Laws of
    one number are simulated where the look errs: a leak of a tank, but for a larger outlet, is a lower gain of the next.
    """
    seen = _looks(best, looks.ways)
    if seen is None:
        return []
    unit, least = looks.alone(looks.simulated(seen, best) or seen), RULES.naming.same_variable
    same = lambda way: abs(looks.alone(way) @ unit) > least
    few = [(way, guess) for way, guess in looks.ways if guess.kind != CURVE and guess.count <= best.count]
    turned = [(way, guess) for way, guess in few if same(way)]
    known = {one.label for one in (*(rival.guess for rival in found), *(guess for _, guess in turned))}
    for way, guess in few:
        if guess.kind == LAW and guess.count == 1 and guess.label not in known and (as_is := looks.simulated(way, guess)):
            turned += [(as_is, guess)] if same(as_is) else []
    return _by_label(found, turned, lambda *_: True)


def carried(found: Sequence[Rivalled], looks: Looks) -> list[Way]:
    """Laws of a shape that fitted better at another place, with the shape that it has there: what it is of is the same.

    A fit of four numbers may end in any valley; that of one quantity is no other where it acts.
    """
    parts, best = looks.scene.parts, dict[tuple, "Rivalled"]()
    laws = [rival for rival in found if rival.guess.kind == LAW and len(rival.guess.inserts) == 1]
    what = lambda guess: (guess.law, _quantity(guess, parts), guess.inserts[0].multiplies)
    for rival in sorted(laws, key=lambda rival: rival.end.loss):
        best.setdefault(what(rival.guess), rival)
    made = []
    for rival in laws:
        first, acting = best[what(rival.guess)], ("a", "b") if rival.guess.law == "Stribeck" else ("a",)
        if (1.0 - RULES.search.matters) * rival.end.loss > first.end.loss:
            words = {n.name: n.name.rpartition(".")[2] for n in rival.guess.numbers if not begins(n)}
            shape = {name: first.values[name] for name, word in words.items() if word not in acting}
            made.append((rival.guess, shape, tuple(name for name, word in words.items() if word in acting)))
    ways = [looks.shaped(*one) for one in made[: RULES.naming.likely] if one[1]]
    return [way for way in ways if way is not None]


def _quantity(guess: Guess, parts: Parts) -> tuple[str, int, str]:
    """What a law goes with, whichever of two linked variables it is called by."""
    over, what, beside = guess.over
    return origin(parts, over), what, origin(parts, beside)


def refined(found: Sequence[Rivalled], scene: Scene, far: Far) -> list[Rivalled]:
    """The free curve that predicts most, where it is the best of all: it is asked for more finely, and what could do as well is as well.

    That is the same at the nearest place and wherever it does nearly as well, and there what goes with what tells its variable.
    """
    if not found or found[0].guess.kind != CURVE:
        return []
    what = lambda guess: (guess.kind, _quantity(guess, scene.parts), guess.inserts[0].multiplies)
    best = found[0].guess
    same = [rival for rival in found if rival.guess.inserts and what(rival.guess) == what(best)]
    nearest = min(same, key=lambda rival: (far(rival.guess), rival.candidate.errors.mean()))
    at = lambda guess: (guess.kind, guess.place, guess.inserts[0].multiplies)
    there = [rival for rival in found if rival.guess.inserts and at(rival.guess) == at(nearest.guess)]
    telling = [rival for rival in there if scene.one_thing(rival.guess.over, best.over)]
    left = lambda rival: rival.candidate.errors.mean()
    alike = [rival for rival in same if left(rival) <= (1.0 + RULES.search.matters) * left(found[0])]
    return list({id(rival): rival for rival in (found[0], nearest, *telling, *alike)}.values())


def as_curve(found: Sequence[Rivalled], looks: Looks, more: Callable[[Rivalled], bool]) -> Iterator[Start]:
    """The free curve that the best law is as well, where that leaves more than noise and less than the curve, which it began elsewhere.

    A bump of a temperature was a limit, and a second one that takes it off again: the curve had ended at three times what one left.
    """
    best = found[0] if found else None
    if best is None or best.guess.kind != LAW or len(best.guess.inserts) > 1 or BY_NAME[best.guess.inserts[0].law].remembers:
        return
    what = lambda guess: (guess.place, guess.over, [one.multiplies for one in guess.inserts])
    curves = [rival for rival in found if rival.guess.kind == CURVE and what(rival.guess) == what(best.guess)]
    if all(rival.end.loss > best.end.loss for rival in curves) and more(best):
        if (made := looks.as_curve(best.guess, best.values, best.end)) is not None:
            yield made


def finer(found: Sequence[Rivalled], looks: Looks, far: Far) -> Iterator[Start]:
    """Free curves that are asked for more finely, each once, with where their fits start."""
    known = {rival.guess.label for rival in found}
    for curve in refined(found, looks.scene, far):
        if words("fine curve", curve.guess.inserts[0]) in known:
            continue
        if (made := looks.finer(curve.guess, curve.values, curve.end)) is not None:
            yield made


def told_over(found: Sequence[Rivalled], looks: Looks, far: Far) -> Iterator[Start]:
    """The free curve that predicts most over what tells its variable, with the same points: where those lie says nothing of which it is.

    Five over a tank's flow left 2 % less of unseen blocks than five over its level, which lay elsewhere, and the flow's stood alone.
    """
    if not found or found[0].guess.kind != CURVE:
        return
    best, made = found[0], set()
    for rival in refined(found, looks.scene, far):
        if rival.guess.place == best.guess.place and rival.guess.over != best.guess.over and rival.guess.over not in made:
            made.add(rival.guess.over)
            if (other := looks.told_over(best.guess, best.values, best.end, rival.guess.inserts[0])) is not None:
                yield other
