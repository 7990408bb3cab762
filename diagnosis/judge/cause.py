"""One named cause, as an answer tells it."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import asdict, dataclass, field

from selflock.view.page import probability

from ..rules import RULES
from ..search.candidate import amount, holds_nothing, pressed
from ..search.hypotheses import Free

AT_END = "lies at the end of its range"


@dataclass
class Cause:
    """One named cause."""

    component: str
    effect: str
    parameters: dict[str, dict]  # name: {value, low, high, unit, determined, doubt}
    confidence: float
    indistinguishable_from: list[str] = field(default_factory=list)
    separate_by: str = ""
    channel: str = ""  # of a sensor
    doubts: list[str] = field(default_factory=list)  # about its numbers, that make it weak
    closest: str = ""  # the likeliest of what is not named with it; none where chance is likelier
    together: float | None = None  # confidence that it, or one of what it cannot be told from, is there; None: its own

    @property
    def label(self) -> str:
        """The cause's name in reports: component and effect, with the parameter or channel that it is about."""
        return label(self.component, self.effect, self.parameters, self.channel)

    @property
    def weak(self) -> list[str]:
        """Why it is not certain, as sentences; of a certain one none."""
        found, level = [], RULES.search.chance_quantile
        if self.indistinguishable_from:
            found.append("this log cannot tell it from another")
        if (sure := self.confidence if self.together is None else self.together) < level:
            whose = "the confidence of all these" if self.indistinguishable_from else "its confidence"
            found.append(f"{whose} is {probability(sure)}, below {level:g}: {self.closest or 'chance'} may do as well")
        return found + self.doubts

    @property
    def sure(self) -> str:
        """Its confidence as it is told."""
        return probability(self.confidence)

    @property
    def mark(self) -> str:
        """In a word."""
        return "weak" if self.weak else "certain"

    def row(self) -> dict:
        """As diagnosis.json has it; a channel is a sensor's."""
        told = {
            key: value for key, value in asdict(self).items() if key not in ("doubts", "together") and (key != "channel" or value)
        }
        return told | {"weak": self.weak}


def label(component: str, effect: str, parameters: Iterable[str], channel: str) -> str:
    """A cause's name in reports."""
    if effect == "parameter":
        return f"parameter {next(iter(parameters))}"
    return f"{component} {effect}" + (f" ({channel})" if channel else "")


def doubts(free: Sequence[Free], values: dict[str, float], intervals: dict[str, tuple[float, float]]) -> dict[str, str]:
    """What is doubtful about numbers of a cause, by name: at the end of their range, or as good as what they are without it.

    What shapes an effect, or is freed beside it, may keep its usual value.
    """
    found = {}
    for p in free:
        low, high = intervals[p.name]
        if at_end(p, values[p.name], low, high):
            found[p.name] = AT_END
        elif amount(p) and holds_nothing(p, low, high):
            found[p.name] = "may as well be what it is without this cause: its 95 % interval holds that"
    return found


def at_end(p: Free, value: float, low: float, high: float) -> bool:
    """Whether a number is pressed against the end of its range; low, high: its interval, no wider than the range.

    A small value of a wide range is near its end and may yet be well determined: then its interval does not reach it.
    """
    return pressed(p, value) and (low <= p.low or high >= p.high)


def weakening(free: Sequence[Free], doubted: dict[str, str]) -> list[str]:
    """Of these doubts those that make the cause weak: a number at its end, or no amount of it that is told from none."""
    amounts = [p.name for p in free if amount(p)]
    all_doubted = all(name in doubted for name in amounts)
    ends = [name for name, doubt in doubted.items() if doubt == AT_END]
    return [f"{name} {doubted[name]}" for name in dict.fromkeys([*ends, *(amounts if all_doubted else [])])]
