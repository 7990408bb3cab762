"""What became of many drives, or of one over months: the changes in words, what to know of them, the exit code."""

from __future__ import annotations

from dataclasses import dataclass
from datetime import date, timedelta
from functools import cached_property
from pathlib import Path

import numpy as np

from selflock.view.page import number, pretty

from ..rules import RULES
from .changes import GROWTH, AllUnits, Change, Found
from .series import Diagnoses

EXIT = 5
TOLD = 5  # of alike things in a sentence


@dataclass
class Track:
    """What `track` returns: `diagnoses` as tables, `found` by statistics, the `page` that was written."""

    diagnoses: Diagnoses
    found: Found
    page: Path | None = None

    @property
    def changes(self) -> list[Change]:
        """Those beyond chance, the surest first."""
        return self.found.changes

    @property
    def exit_code(self) -> int:
        """Of `selflock track`: 0 nothing has changed beyond chance, 5 something has."""
        return EXIT if self.changes else 0

    @property
    def head(self) -> str:
        """The answer in a sentence."""
        table = self.diagnoses.table
        units, changed = table["unit"].nunique(), len({one.unit for one in self.changes})
        of = f"{units} units" if units > 1 else f"unit {table['unit'].iloc[0]}"
        said = f"{changed} of {of} changed" if units > 1 and changed else f"{of} changed" if changed else f"no change of {of}"
        return f"{said} beyond chance"

    @cached_property
    def notes(self) -> list[str]:
        """What a reader of the numbers should know, a sentence each."""
        found, fewest = list(self.diagnoses.notes), RULES.tracking.fewest
        every = [(one, watched) for watched in self.found.numbers for one in watched.series]
        if few := {one.unit for one, _ in every} - {one.unit for one, _ in every if len(one) >= fewest}:
            found.append(f"{some(sorted(few), 'unit')} with fewer than {fewest} values: of such nothing is said yet.")
        least, usual = self.found.beyond
        if least > RULES.tracking.little * usual:
            found.append(
                f"So few logs tell little: beyond chance is a change of {least:.0f} times its standard error here, and of {usual:.0f} among many."
            )
        alone = [
            f"{one.parameter} of unit {one.unit} on {day(when)}"
            for one, watched in every
            for when in one.time[watched.aside[one.unit]]
        ]
        if alone:
            found.append(f"{some(alone, 'value')} that no log beside it bears out: set aside, look at these logs.")
        shared = [
            f"{watched.parameter} {' to '.join(amount(watched, x) for x in (watched.shared[1].min(), watched.shared[1].max()))}"
            for watched in self.found.numbers
            if len(watched.shared[1])
        ]
        if shared:
            found.append(f"What all units did at once is taken out: {', '.join(shared)}.")
        return found

    def summary(self) -> str:
        """The answer in a few lines of text."""
        table = self.diagnoses.table
        lines = [f"{len(table)} diagnoses, {table['time'].min():%Y-%m-%d} to {table['time'].max():%Y-%m-%d}: {self.head}"]
        lines += [f"  {sentence(one)}" for one in self.changes]
        lines += [f"  {note}" for note in self.notes]
        if self.page:
            lines.append(f"  open {self.page}")
        return "\n".join(lines)

    def __str__(self) -> str:
        return self.summary()


def sentence(change: Change) -> str:
    """A change in words: unit 7: reducer.viscous_damping +40 % since 2026-05-12, growing, …"""
    unit = pretty(change.measure)
    ends = f"{number(change.before)} to {number(change.after)} {unit}".rstrip()
    how = "growing" if change.shape == GROWTH else "in one step"
    return f"unit {change.unit}: {change.parameter} {size(change)} since {day(change.since)}, {how} ({ends}; chance {chance(change)})"


def size(change: Change) -> str:
    """How much, as a share of what it was where that is away from 0."""
    if abs(change.before) > change.high - change.low:
        return f"{100.0 * change.amount / abs(change.before):+.3g} %".replace("-", "−")
    return f"{'+' if change.amount > 0.0 else ''}{number(change.amount)} {pretty(change.measure)}".rstrip()


def chance(change: Change) -> str:
    """As few digits as tell it."""
    least = 1e-12
    return number(change.chance, 1) if change.chance > least else f"below {number(least)}"


def amount(watched: AllUnits, x: float) -> str:
    """A number in the units of a watched."""
    return f"{100.0 * x:+.2g} %".replace("-", "−") if watched.relative else f"{number(x)} {pretty(watched.measure)}".rstrip()


def day(when: float) -> str:
    """Days since 1970 as a date."""
    return (date(1970, 1, 1) + timedelta(days=int(np.floor(when)))).isoformat()


def some(things: list[str], word: str) -> str:
    """How many, and the first of them."""
    more = ", …" if len(things) > TOLD else ""
    return f"{len(things)} {word}{'s' * (len(things) > 1)} ({', '.join(things[:TOLD])}{more})"
