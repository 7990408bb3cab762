"""How the parts are stepped together. An algorithm knows the order of stepping, and with it who is ahead of whom.

Communication points are t_n = start + n·H, from the index, so that no time drifts. In a macro step from t_n to
t_n+1 = t_n + H every part gets its inputs and steps:

- **Jacobi**: all inputs are outputs at t_n. First order, independent of any order. Parts that only pass on what they are
  given, such as sums, do so at t_n+1 with the outputs that are there then.
- **Gauss-Seidel**: one part after the other; inputs from parts stepped before are at t_n+1, all others at t_n.
- **Iterated**: as Gauss-Seidel, in an order in which only circles are left, and these are solved (master.coupling).
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Callable, Iterable, Sequence
from math import inf
from typing import Protocol, TypeVar


class Stepped(Protocol):
    """What an algorithm steps: a part's seat, or several that go as one."""

    passes: bool  # what it gives follows from what it is given alone, at once

    def stroke(self, index: int, time: float, step: float) -> None: ...  # take inputs and step
    def collect(self, index: int, time: float, step: float) -> None: ...  # take inputs
    def move(self, index: int, time: float, step: float) -> None: ...  # step with them


Advance = Callable[[Sequence[Stepped], int, float, float], None]  # a macro step of these: its index, time and size, s

Place = TypeVar("Place", contravariant=True)


class Plan(Protocol[Place]):
    """What writes down the two halves of a macro step, place by place, instead of making them."""

    def gather(self, place: Place) -> None: ...  # take inputs
    def cycle(self, place: Place) -> None: ...  # step with them


class Algorithm(ABC):
    """A way of stepping parts together. `order`: the names of the parts that are stepped, in the order of stepping."""

    def __init__(self, order: Iterable[str]):
        self.rank = {name: place for place, name in enumerate(order)}

    @abstractmethod
    def ahead(self, source: str, target: str) -> bool:
        """Whether `target` is given the output of `source` at the end of its macro step, not at the start."""

    @abstractmethod
    def step(self, stepped: Sequence[Stepped], index: int, time: float, step: float) -> None:
        """Macro step `index`, from `time` by `step` s."""

    @abstractmethod
    def lay_out(self, plan: Plan[Place], places: Sequence[Place]) -> None:
        """Write down what a macro step of `places` consists of."""


class GaussSeidel(Algorithm):
    def ahead(self, source: str, target: str) -> bool:
        return self.rank.get(source, inf) < self.rank.get(target, -1)  # who is not stepped is ahead of nobody

    def step(self, stepped: Sequence[Stepped], index: int, time: float, step: float) -> None:
        for one in stepped:
            one.stroke(index, time, step)

    def lay_out(self, plan: Plan[Place], places: Sequence[Place]) -> None:
        for place in places:
            plan.gather(place)
            plan.cycle(place)


class Jacobi(Algorithm):
    def ahead(self, source: str, target: str) -> bool:
        return False

    def step(self, stepped: Sequence[Stepped], index: int, time: float, step: float) -> None:
        moved = [one for one in stepped if not one.passes]
        for one in moved:
            one.collect(index, time, step)
        for one in moved:
            one.move(index, time, step)
        for one in stepped:
            if one.passes:
                one.stroke(index, time, step)

    def lay_out(self, plan: Plan[Place], places: Sequence[Place]) -> None:
        for place in places:
            plan.gather(place)
        for place in places:
            plan.cycle(place)


class Iterated(GaussSeidel):
    """Its steps are made by master.coupling, which knows the circles."""


ALGORITHMS: dict[str, type[Algorithm]] = {"gauss-seidel": GaussSeidel, "jacobi": Jacobi, "iterated": Iterated}
"""By the name that a system gives."""
