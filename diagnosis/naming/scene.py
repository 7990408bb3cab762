"""What guesses are made of: the system as it runs with the base's numbers, how large everything is, and what a law may go with."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from functools import cached_property
from itertools import combinations

import numpy as np
from scipy.stats import rankdata

from selflock.fmus.correction import law

from ..rules import RULES
from ..systems.parts import Parts
from .extended import Extended, gone_through, taken
from .places import Place, of_system, quantities


@dataclass
class Scene:
    """What guesses are made of: the system as it runs with the base's numbers, and how large everything is."""

    parts: Parts
    played: Extended
    series: dict[str, list[np.ndarray]]
    prefix: str  # of the names of new corrections
    smooth: bool = False
    only: tuple[Place, str] | None = None  # where corrections are looked for, and of what, if not everywhere and of all

    @cached_property
    def span(self) -> float:
        return max(float(t[-1] - t[0]) for t in self.series["time"])

    @property
    def step(self) -> float:
        return self.parts.system.run.step

    def joined(self, name: str, what: int = law.VALUE, beside: str = "") -> np.ndarray:
        """What of a variable, or of two, a law goes with, at all steps of all runs."""
        return gone_through(self.series, name, what, beside)

    def firsts(self, name: str, what: int = law.VALUE) -> list[float]:
        """What of a variable a law goes with where each run begins."""
        return [float(taken(x, time, what, x)[0]) for x, time in zip(self.series[name], self.series["time"])]

    def signal(self, place: Place) -> np.ndarray:
        return self.joined(place.variable)

    def spread(self, place: Place) -> float:
        """How large a correction of a place may be expected to be."""
        s = self.signal(place)
        return float(max(np.std(s), RULES.naming.least_spread * abs(s).max())) or 1.0

    @cached_property
    def places(self) -> list[Place]:
        """Where corrections may sit; only what varies, or is not zero, is worth one."""
        if self.only is not None:
            return [self.only[0]]
        fed = [feed.target for feed in self.played.group.feeds]
        known = self.parts.rig.known
        places = of_system(self.parts, self.played.group.members, fed, self.played.outputs)
        return [p for p in places if p.variable in self.series and p.variable not in known]

    @property
    def still(self) -> list[str]:
        """Variables that stand still in all runs: of them no law can be told."""
        return [name for name in self.series if name != "time" and not moves(self.joined(name))]

    def variables(self, place: Place) -> Iterator[tuple[str, int]]:
        """What a law there may go with: what its component is given and gives, then all else; nothing twice."""
        mine, others = quantities(self.parts, self.parts.owner(place.variable), [n for n in self.series if n != "time"])
        wanted = [(n, law.VALUE) for n in mine + others]
        wanted += [(n, what) for what in (law.RATE, law.INTEGRAL, law.SINCE_TURN) for n in mine]
        if self.only is not None:
            told = self.only[1], law.VALUE, ""
            wanted = [(n, what) for n, what in wanted if what == law.VALUE and self.one_thing((n, what, ""), told)]
        kept: list[np.ndarray] = []
        for name, what in wanted:
            x = self.joined(name, what)
            if not moves(x):
                continue
            unit = self._even(x)
            if any(abs(float(np.mean(unit * other))) > RULES.naming.same_variable for other in kept):
                continue
            kept.append(unit)
            yield name, what
            if len(kept) >= RULES.naming.variables:
                return

    def pairs(self, place: Place) -> list[tuple[str, int, str]]:
        """What a law there may go with of two variables as they are: a difference of what has one unit, products."""
        known, found = self.parts.variables, []
        singles = [name for name, what in self.variables(place) if what == law.VALUE]
        unit = lambda name: known[name].unit if name in known else None
        for a, b in combinations(singles, 2):
            if unit(a) == unit(b):
                found.append((a, law.DIFFERENCE, b))
            if place.variable not in (a, b):  # a law that multiplies it is that already
                found.append((a, law.PRODUCT, b))
            found += [(one, law.ROOTED, other) for one, other in ((a, b), (b, a))]
        kept = [self._even(self.joined(name)) for name in singles]
        orders = [order(self.joined(name)) for name in singles]
        distinct = []
        for one in found:
            x = self.joined(*one)
            if not moves(x) or any(one_to_one(order(x), other) for other in orders):
                continue  # what goes with it goes with one of them alone
            unit_of_it = self._even(x)
            if not any(abs(float(np.mean(unit_of_it * other))) > RULES.naming.same_variable for other in kept):
                kept.append(unit_of_it)
                distinct.append(one)
        return distinct[: RULES.naming.pairs]

    def one_thing(self, a: tuple[str, int, str], b: tuple[str, int, str]) -> bool:
        """Whether each tells the other, as a tank's flow and its level: a free curve over one is a free curve over the other."""
        return a == b or one_to_one(order(self.joined(*a)), order(self.joined(*b)))

    def differences(self, place: Place) -> list[tuple[str, int, str]]:
        """Of its component's own variables of one unit, those first that are most alike in size: where an FMU tells no units
        heat and temperature could be taken from one another, too."""
        known, component = self.parts.variables, self.parts.owner(place.variable)
        mine = [n for n, what in self.variables(place) if what == law.VALUE and n in known and self.parts.owner(n) == component]
        size = {name: max(float(abs(self.joined(name)).max()), 1e-300) for name in mine}
        found = [(a, law.DIFFERENCE, b) for a, b in combinations(mine, 2) if known[a].unit == known[b].unit]
        found = [one for one in found if moves(self.joined(*one))]
        return sorted(found, key=lambda one: abs(np.log(size[one[0]] / size[one[2]])))

    @staticmethod
    def _even(x: np.ndarray) -> np.ndarray:
        return (x - x.mean()) / x.std()


def moves(x: np.ndarray) -> bool:
    """Whether a variable does not stand still."""
    return bool(np.isfinite(x).all() and np.ptp(x) > RULES.judge.constant * max(1.0, float(abs(x).max())))


def order(x: np.ndarray) -> np.ndarray:
    """Ranks, evened."""
    ranks = rankdata(x)
    return (ranks - ranks.mean()) / max(ranks.std(), 1e-300)


def one_to_one(a: np.ndarray, b: np.ndarray) -> bool:
    """Whether variables of these orders rise with each other, or one falls as the other rises."""
    return abs(float(np.mean(a * b))) > RULES.naming.same
