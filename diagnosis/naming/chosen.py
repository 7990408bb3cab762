"""Which guesses are fitted, of all that were looked at."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from typing import TYPE_CHECKING

import numpy as np

from ..rules import RULES
from . import guesses as g
from .guesses import CURVE, Guess
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


def again(
    found: Sequence[Rivalled],
    takes: Callable[[Rivalled], float],
    unseen: Callable[[Rivalled], float],
    most: float,
    far: Callable[[Guess], tuple[bool, bool]],
    gains: Mapping[str, float],
) -> set[str]:
    """Labels of what is fitted again with slopes of its own: what predicts or fits most.

    found: best first; takes, unseen: what a rival takes off the base's loss, and off that of unseen blocks; most: what any that has a
    name takes; gains: what each guess gains where it looks best.
    """
    rules, by_fit = RULES.naming, sorted(found, key=lambda r: r.end.loss)
    near = [r for r in by_fit[: rules.by_fit] if takes(r) >= rules.in_reach * most] + list(found[: rules.polished])
    # a fit that ended beyond where it could have had nothing of it is none, where its unseen blocks say that there is one
    lost = [r for r in found if takes(r) < 0.0 and unseen(r) >= rules.in_reach * unseen(found[0])]
    near += lost[: rules.polished]
    # before what moves its own FMU's variables are believed first, and many places that act alike may stand before them
    for kind in (g.LAW, CURVE):
        lead = next((r.guess for r in by_fit if r.guess.kind == kind), None)
        at_once = [r for r in by_fit if lead and r.guess.law == lead.law and not any(far(r.guess))]
        near += [r for r in at_once if takes(r) >= rules.in_reach * most][: rules.polished]
    # of times, as of what is bent, slopes that were learnt say little: events that look best have their own in any case
    events = [rival for rival in found if rival.guess.kind == g.EVENT]
    near += sorted(events, key=lambda r: -gains.get(r.guess.label, -np.inf))[: rules.events]
    return {rival.guess.label for rival in near}


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
