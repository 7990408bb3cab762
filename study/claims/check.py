"""A claim is a list of checks; a check is one measured number against one bound."""

from __future__ import annotations

import math
import operator
from collections.abc import Callable
from dataclasses import dataclass, field

from selflock.master.errors import SelflockError
from selflock.view.page import number, pretty

RELATIONS = {"<=": operator.le, "<": operator.lt, ">=": operator.ge, ">": operator.gt}


@dataclass(frozen=True)
class Check:
    """`value relation bound`. Without a relation it is a number that is told and not judged."""

    what: str
    value: float
    relation: str = ""
    bound: float = math.nan
    unit: str = ""

    @property
    def holds(self) -> bool:
        """Whether the value keeps to its bound; NaN never does."""
        return not self.relation or bool(RELATIONS[self.relation](self.value, self.bound))  # false for NaN

    @property
    def margin(self) -> float:
        """How far inside the bound, in parts of the bound; negative when it does not hold."""
        if not self.relation:
            return math.inf
        if math.isnan(self.value):
            return -math.inf
        room = self.bound - self.value if self.relation[0] == "<" else self.value - self.bound
        return room / (abs(self.bound) or abs(self.value) or 1.0)

    def __str__(self) -> str:
        unit = f" {pretty(self.unit)}" if self.unit else ""
        told = f"{self.what}: {number(self.value)}{unit}"
        return (
            f"{told} ({self.relation.replace('<=', '≤').replace('>=', '≥')} {number(self.bound)}{unit})"
            if self.relation
            else told
        )


@dataclass(frozen=True)
class Claim:
    """A row of the table of claims, evaluated."""

    number: int
    text: str
    figures: tuple[int, ...]
    checks: list[Check] = field(default_factory=list)
    error: str = ""  # why it could not be evaluated

    @property
    def holds(self) -> bool:
        """Whether it could be evaluated and all its checks hold."""
        return not self.error and bool(self.checks) and all(check.holds for check in self.checks)

    @property
    def tightest(self) -> Check:
        """The check nearest to its bound."""
        return min(self.checks, key=lambda check: check.margin)

    @property
    def measured(self) -> str:
        """What fails, or the check that came nearest to its bound."""
        if self.error:
            return self.error
        failed = [str(check) for check in self.checks if not check.holds]
        return "; ".join(failed) if failed else str(self.tightest)

    def as_dict(self) -> dict:
        """As the study's claims.json has it."""
        return {
            "number": self.number,
            "claim": self.text,
            "holds": self.holds,
            "measured": self.measured,
            "figures": list(self.figures),
            "checks": [
                {
                    "what": check.what,
                    "value": None if math.isnan(check.value) else check.value,
                    "relation": check.relation or None,
                    "bound": check.bound if check.relation else None,
                    "unit": check.unit or None,
                    "holds": check.holds,
                }
                for check in self.checks
            ],
        }


@dataclass(frozen=True)
class Row:
    """A row not evaluated yet: `function` gives its checks from the runs."""

    number: int
    text: str
    figures: tuple[int, ...]
    function: Callable[..., list[Check]]

    def evaluate(self, runs) -> Claim:
        """The claim with its checks; an error of the runs makes it fail with that error's text."""
        try:
            return Claim(self.number, self.text, self.figures, self.function(runs))
        except SelflockError as error:
            return Claim(self.number, self.text, self.figures, error=str(error))


ROWS: dict[int, Row] = {}


def row(number: int, text: str, figures: tuple[int, ...]):
    """Decorator: the function evaluates this row, whose text is its documentation."""

    def add(function):
        ROWS[number] = Row(number, text, figures, function)
        function.__doc__ = text
        return function

    return add
