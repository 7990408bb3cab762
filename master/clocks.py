"""Clocks of FMI 3.0 that tick by time: the master knows when, and ticks them.

A constant, fixed or tunable clock ticks at start + shift + k · interval; a changing one says its next interval at each
tick, a countdown one when it will tick, at any event. Triggered clocks tick when somebody else says so: they are Booleans
among the variables (master.described).
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

from lxml import etree

from .described import number_of

PERIODIC, ASKED = ("constant", "fixed", "tunable"), ("changing", "countdown")
CHANGED = 2  # fmi3IntervalQualifier
Ask = Callable[[str, int], "tuple[float, int] | None"]  # (GetIntervalDecimal or GetShiftDecimal, reference)


@dataclass
class Clock:
    name: str
    reference: int
    variability: str
    interval: float | None  # s; None: the FMU says it
    shift: float | None
    priority: int
    first: float = math.inf  # when it ticked first, s
    count: int = 0  # ticks so far
    next: float = math.inf  # s


def clocks_in(folder: Path) -> list[Clock]:
    """The input clocks of an unpacked FMU that tick by time, and those of outputs with the variability "output"."""
    found = []
    for node in etree.parse(str(folder / "modelDescription.xml")).getroot().iterfind("ModelVariables/Clock"):
        kind = node.get("intervalVariability", "triggered")
        if node.get("causality") == "output":
            kind = "output"
        resolution = number_of(node.get("resolution"))

        def length(decimal: str, counter: str) -> float | None:
            told = number_of(node.get(decimal))
            ticks = number_of(node.get(counter))
            return ticks / resolution if told is None and ticks is not None and resolution else told

        interval, shift = length("intervalDecimal", "intervalCounter"), length("shiftDecimal", "shiftCounter")
        priority = int(number_of(node.get("priority")) or 0)
        if kind in (*PERIODIC, *ASKED, "output"):
            found.append(Clock(node.get("name", ""), int(node.get("valueReference")), kind, interval, shift, priority))
    return sorted(found, key=lambda clock: clock.priority)


class Ticks:
    """When the clocks of an instance tick."""

    def __init__(self, clocks: list[Clock], ask: Ask):
        self.clocks, self._ask = clocks, ask

    def begin(self, start: float) -> str:
        """At the start of a run. Returns the name of a clock that has no interval, if one has none."""
        for clock in self.clocks:
            clock.count, clock.next, clock.first = 0, math.inf, math.inf
            if clock.variability == "countdown":
                continue
            told = clock.interval if clock.interval is not None else self._told("GetIntervalDecimal", clock)
            if clock.variability in PERIODIC and (told is None or not told > 0.0):
                return clock.name
            shift = clock.shift or 0.0
            if clock.shift is None and clock.interval is None:
                shift = self._told("GetShiftDecimal", clock) or 0.0
            clock.first = clock.next = start + shift
            if clock.variability in PERIODIC:
                clock.interval = told
        self.look(start)
        return ""

    def _told(self, what: str, clock: Clock) -> float | None:
        told = self._ask(what, clock.reference)
        return told[0] if told is not None and math.isfinite(told[0]) else None

    @property
    def next(self) -> float:
        """When the next one ticks, s."""
        return min((clock.next for clock in self.clocks), default=math.inf)

    def due(self, time: float) -> list[Clock]:
        """Those that tick until `time`, by their priority; they then know their next tick, but for what they are asked."""
        due = [clock for clock in self.clocks if clock.next <= time]
        for clock in due:
            clock.count += 1
            last, clock.next = clock.next, math.inf
            if clock.variability in PERIODIC and clock.interval:
                clock.next = clock.first + clock.count * clock.interval
            clock.first = clock.first if clock.variability in PERIODIC else last
        return due

    def look(self, time: float) -> None:
        """Ask those that change their interval."""
        for clock in self.clocks:
            if clock.variability == "countdown" or (clock.variability == "changing" and clock.count and clock.next == math.inf):
                told = self._ask("GetIntervalDecimal", clock.reference)
                if told is not None and (told[1] == CHANGED or clock.variability == "changing") and told[0] >= 0.0:
                    if told[0] > 0.0 or clock.variability == "countdown":
                        clock.next = time + told[0]

    def save(self) -> list[tuple[float, int, float]]:
        return [(clock.first, clock.count, clock.next) for clock in self.clocks]

    def restore(self, state: list[tuple[float, int, float]]) -> None:
        for clock, known in zip(self.clocks, state):
            clock.first, clock.count, clock.next = known
