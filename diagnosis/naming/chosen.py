"""Which guesses are fitted, of all that were looked at."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import TYPE_CHECKING

from ..rules import RULES
from . import guesses as g
from .guesses import CURVE
from .near import Way

if TYPE_CHECKING:
    from .round import Rivalled


def chosen(looked: Sequence[Way], stage: int) -> list[list[Way]]:
    """The guesses of a stage that look best, each with its ways, those first that look best; curves last.

    Where time is up soon, a name says more than a curve.
    """
    of: dict[str, list[Way]] = {}
    for way, guess in sorted(looked, key=lambda pair: -pair[0].gain):
        if way.gain > 0.0:
            of.setdefault(guess.label, []).append((way, guess))
    ordered = [ways for ways in of.values() if ways[0][1].stage == stage]
    plain, rules = stage == g.PLAIN, RULES.naming
    curves = [ways for ways in ordered if ways[0][1].kind == CURVE][: rules.curves]
    least = rules.promising * max((way.gain for way, _ in looked), default=0.0)
    others = [
        ways
        for ways in ordered
        if ways[0][1].kind != CURVE and (ways[0][0].gain >= least or (plain and ways[0][1].law in ("limit", "overflow")))
    ]
    taken = others[: rules.fits if plain else rules.fits_derived]
    if curves:
        best = curves[0][0][1]  # what a curve says may have a name
        near = [w for w in others if w[0][1].place == best.place and w[0][1].over == best.over and w[0][1].kind == g.LAW]
        taken += [ways for ways in near[: rules.of_place if plain else rules.of_place // 2] if ways not in taken]
    if taken and not plain:
        best = taken[0][0][1]  # what has fewer numbers than it, and looks as it does, is no worse a name for it
        near = [w for w in others if w[0][1].place == best.place and w[0][1].over == best.over]
        near.sort(key=lambda ways: ways[0][1].count)
        taken += [ways for ways in near[: rules.of_place // 2] if ways not in taken]
    for name in dict.fromkeys(ways[0][1].law for ways in others if plain):
        mine = [ways for ways in others if ways[0][1].law == name]
        most = rules.of_path if mine[0][0][1].kind in (g.PATH, g.PARAMETER) else rules.of_law
        most = rules.overflows if name == "overflow" else most  # of which the look sees little
        taken += [ways for ways in mine[:most] if ways not in taken]
    return taken + curves


def fewest_first(
    rivals: Sequence[Rivalled], fits: Callable[[Rivalled], list[Rivalled]], more: Callable[[Rivalled], bool]
) -> list[Rivalled]:
    """Rivals fitted again, those of fewest numbers first; not where fewer leave no more than noise: they would be believed.

    A limit of a house's radiator was all that was missing, and nine overflows of it were fitted from four heights each.
    """
    found: list[Rivalled] = []
    for rival in sorted(rivals, key=lambda one: one.guess.count):
        if any(one.guess.count < rival.guess.count and not more(one) for one in found):
            break
        found += fits(rival)
    return found
