"""What a page of curves carries for its script, and what it says in its own words.

D = {
    "runs": [{"label", "time": base64 of float64 in s, "columns": [{"name", "unit", "steps", "values": base64 of float32, or "same"}]}],
    "stages": [{"label", "of": [{"run", ...a drawing of selflock.master.about, its columns named in full}]}],
    "picked": [names],            # drawn at first; others by the reader's choice
    "choices": [{"label", "curves": [{"run", "name", "label", "colour"}]}],   # instead of a choice by name
    "dates": the times are dates, in s since 1970, and nothing is played; then columns may have "low" and "high", intervals,
    and curves a "panel" of that name and "quiet", without an entry in the legend,
    "windows": [[from, to]], "phases": [[from, to, words]], "plays": begins by itself, "again": and again,
}
"""

from __future__ import annotations

from collections.abc import Iterable
from fnmatch import fnmatchcase
from typing import Any

import numpy as np

from selflock.master.about import seen_of
from selflock.master.errors import ResultError
from selflock.master.seen import Peak, Seen

from . import thin
from .sheet import Sheet

BUDGET = 6_000_000  # bytes of numbers on a page; with all that is around them it stays below 7 MB
LEAST = 600  # points of a curve: fewer are not worth it
FLOAT = 16 / 3  # bytes of a float32 in base64
PICKED = 7  # curves shown at first
ALIKE = 20.0  # ratio of the peaks of two curves that are seen on one axis


def runs_of(tables: list[Sheet], points: int | None = None) -> tuple[list[dict[str, Any]], list[str]]:
    """The runs as the script has them, within the budget; and what was left out, a sentence each."""
    notes: list[str] = []
    share = BUDGET / len(tables)
    data = []
    for one in tables:
        moving = [name for name, x in one.columns.items() if not _same(x)]
        fits = int(share / (FLOAT * LEAST)) - 2  # the time takes two columns' room
        if len(moving) > fits:
            notes.append(f"{one.label} has {len(moving)} columns that vary; the first {max(fits, 1)} are on the page, which is not to grow beyond {BUDGET / 1e6:g} MB.")  # fmt: skip
        kept = set(moving[: max(fits, 1)])
        every = thin.stride(len(one.time), points or max(LEAST, int(share / (FLOAT * (len(kept) + 2)))))
        if every > 1:
            notes.append(f"{one.label} has {len(one.time)} rows: of each {every} rows the least and the greatest value are drawn. The peaks in the table are of all rows.")  # fmt: skip
        columns = []
        for name, x in one.columns.items():
            told = {"name": name, "unit": one.units[name], "steps": name in one.steps and every == 1}
            if name in kept:
                columns.append(told | {"values": thin.packed(thin.values(x, every), "<f4")})
            elif _same(x):
                columns.append(told | {"same": float(x[0])})
        data.append({"label": one.label, "time": thin.packed(thin.times(one.time, every), "<f8"), "columns": columns})
    return data, notes


def _same(x: np.ndarray) -> bool:
    return bool((x == x[0]).all())


def picked(tables: list[Sheet], seen: Seen, wanted: Iterable[str]) -> list[str]:
    """Names of the curves drawn at first: those asked for, by patterns; else the largest torques, currents and powers."""
    first = tables[0]
    known = list(dict.fromkeys(name for one in tables for name in one.columns))
    chosen: list[str] = []
    for pattern in wanted:
        fits = [name for name in known if name == pattern or fnmatchcase(name, pattern)]
        if not fits:
            raise ResultError(f"--show {pattern}: no column is called so. There are {', '.join(known[:12])}{' …' if len(known) > 12 else ''}")  # fmt: skip
        chosen += fits
    if chosen:
        return list(dict.fromkeys(chosen))
    vary = {name for name, x in first.columns.items() if not _same(x)}
    ranked = sorted((p for p in seen.peaks() if seen.columns[p.place].name in vary), key=lambda p: not _electric(seen, p))
    for unit in ("N.m", "A", "W"):
        of = [p for p in ranked if p.kind == unit]
        alike = [p for p in of if of[0].weight / ALIKE < p.weight < of[0].weight * ALIKE]  # on one axis both are to be seen
        chosen += [seen.columns[p.place].name for p in alike[:2]]
    if len(chosen) < PICKED:
        free = [
            name for name in first.columns if name in vary and name not in chosen and name.rpartition(".")[0] not in seen.sources
        ]
        units = {first.units[name] for name in chosen}
        fresh = [name for name in free if first.units[name] not in units]
        chosen += fresh[: max(2, 4 - len(chosen))] if chosen else free[:4]
    return chosen[:PICKED]


def _electric(seen: Seen, peak: Peak) -> bool:
    """Whether a peak is a motor's: of a component that has a current, too."""
    return any(c.name == f"{peak.owner}.current" for c in seen.columns)


def peaks(tables: list[Sheet]) -> tuple[list[dict[str, Any]], list[tuple[str, list[str]]], Seen]:
    """Rows of the table of peaks; by run the limits reached, a sentence each; and what was seen of the first run."""
    rows: dict[str, list[dict[str, Any]]] = {}
    reached, first = [], None
    for one in tables:
        seen = one.look(seen_of(one.variables(), one.about))
        first = first or seen
        limits = {seen.columns[w.place].name: w for w in seen.watches}
        told = {seen.columns[peak.place].name: peak.energy for peak in seen.peaks()}
        for name, energy in (told | {name: None for name in limits if name not in told}).items():
            watch, energy = limits.get(name), None if np.isnan(one.columns[name]).any() else energy
            row: dict[str, Any] = {
                "run": one.label,
                "name": name,
                "unit": one.units[name],
                "energy": energy,
                "limit": None,
                "share": None,
            }
            at = int(np.nanargmax(abs(one.columns[name])))
            row |= {"peak": float(one.columns[name][at]), "at": float(one.time[at])}
            if watch:
                most = max((abs(end) for end in watch.range if np.isfinite(end)), default=0.0)
                row |= {
                    "limit": most or None,
                    "share": abs(row["peak"]) / most if most else None,
                    "met": watch.met,
                    "stalls": watch.stalls,
                }
            rows.setdefault(name, []).append(row)
        if said := seen.reached():
            reached.append((one.label, said))
    assert first is not None
    return [row for of in rows.values() for row in of], reached, first
