"""What is not known behind a gap in a log: inputs moved in it unseen, and what they did goes on until the system forgets it.

A simulation goes through a gap with its inputs held or straight. By how much they may have been elsewhere the rest of the log
tells, where nothing is lost: by how much they are off such a line in the mean over as many rows. The system's own model tells for
how long that is more than noise of what is measured; for so long nothing is compared.
"""

from __future__ import annotations

from collections.abc import Sequence
from contextlib import closing
from dataclasses import replace

import numpy as np

from ..data.faults import DataFault
from ..data.log import MeasuredRun
from ..data.rig import SMOOTH, Rig
from ..data.values import noise_of
from ..rules import RULES
from ..systems.parts import Parts
from .felt import felt
from .numbers import Number, of_run
from .played import Played


def as_fed(
    rig: Rig, parts: Parts, runs: list[MeasuredRun], numbers: Sequence[Number], faults: list[DataFault]
) -> tuple[list[MeasuredRun], list[DataFault], list[str]]:
    """The runs as what feeds a system lets them be compared, the faults that are left, and what is to be told: see felt, and above."""
    runs, faults = felt(rig, parts, runs, numbers, faults)
    runs, notes = behind_gaps(rig, parts, runs, numbers)
    return runs, faults, notes


def behind_gaps(
    rig: Rig, parts: Parts, runs: Sequence[MeasuredRun], numbers: Sequence[Number]
) -> tuple[list[MeasuredRun], list[str]]:
    """The runs with outputs masked behind gaps for as long as these matter, with the numbers as they are given; and what is to be told."""
    found, notes = list(runs), []
    for i, run in enumerate(runs):
        even = run.uneven <= RULES.data.most_uneven  # else rows were written as things happened, and none is lost
        gaps = np.flatnonzero(run.behind_gaps & even)
        own = of_run(numbers, i)
        apart = _apart(rig, parts, run, own, gaps) if len(gaps) else None
        if apart is None:
            continue
        good = dict(run.good)
        for first, last in zip(gaps, [*gaps[1:], len(run)]):
            until = first
            for name, size in apart.items():
                known = run.signals[name][run.usable(name)]
                seen = max(noise_of(known), RULES.calibrate.forgotten * float(np.std(known)))
                felt = first + np.flatnonzero(RULES.calibrate.unseen * size[first:last] > seen)
                if len(felt):
                    good[name] = good.get(name, np.ones(len(run), bool)).copy()
                    good[name][first : felt[-1] + 1] = False
                    until = max(until, felt[-1] + 1)
            if until > first:
                notes.append(_told(run, int(first), int(until), int(last)))
        found[i] = replace(run, good=good)
    return found, notes


def _apart(rig: Rig, parts: Parts, run: MeasuredRun, own: Sequence[Number], gaps: np.ndarray) -> dict[str, np.ndarray] | None:
    """By how much each output, at each row, may be off for what inputs did in gaps; None where nothing tells."""
    with closing(Played(rig, parts, [run], own)) as played:
        fed = [feed.channel for feed in played.group.feeds if parts.variables[feed.target].type == "Real"]
    off = {name: [_off(run, name, first, rig.inputs == SMOOTH) for first in gaps] for name in dict.fromkeys(fed)}
    if not any(map(any, off.values())):
        return None
    given, found = {n.variable: n.start for n in own}, []
    for sign in (1.0, -1.0):
        one, kept = _moved(run, gaps, off, sign, rig.inputs == SMOOTH)
        played = Played(rig, parts, [one], own)
        played.reusable = False  # nobody knows as yet whether its FMUs can be reset
        with closing(played):
            simulated = played.simulate(0, given)
        if simulated is None:
            return None
        found.append({name: values[kept] for name, values in simulated.items()})
    return {name: 0.5 * abs(found[0][name] - found[1][name]) for name in found[0]}


def _off(run: MeasuredRun, name: str, first: int, smooth: bool) -> float:
    """By how much an input is off what it is taken for in a gap, in the mean over as many rows elsewhere (root mean square)."""
    x, usual = run.signals[name], float(np.median(np.diff(run.time)))
    rows = max(1, round((run.time[first] - run.time[first - 1]) / usual))
    sums, lost = np.append(0.0, np.cumsum(x)), np.cumsum(run.behind_gaps)
    begins = np.arange(len(x) - rows)
    begins = begins[lost[begins + rows] == lost[begins]]
    if len(begins) < rows:  # so long a gap is beside none
        return float(np.std(x))
    mean = (sums[begins + rows] - sums[begins]) / rows
    taken = 0.5 * (x[begins] + x[begins + rows]) if smooth else x[begins]
    return float(np.sqrt(np.mean((mean - taken) ** 2)))


def _moved(
    run: MeasuredRun, gaps: np.ndarray, off: dict[str, list[float]], sign: float, smooth: bool
) -> tuple[MeasuredRun, np.ndarray]:
    """The run with a row at either end of each gap, in which inputs are off to one side; and where its own rows are in that."""
    usual = float(np.median(np.diff(run.time)))
    ends = np.concatenate([[run.time[first - 1] + usual, run.time[first] - usual] for first in gaps])
    time = np.concatenate([run.time, ends])
    order = np.argsort(time, kind="stable")
    signals, good = {}, {}
    for name, x in run.signals.items():
        straight = np.interp(ends, run.time, x) if smooth else np.repeat(x[gaps - 1], 2)
        signals[name] = np.concatenate([x, straight + sign * np.repeat(off.get(name, np.zeros(len(gaps))), 2)])[order]
    for name, mask in run.good.items():
        good[name] = np.concatenate([mask, np.repeat(mask[gaps - 1] & mask[gaps], 2)])[order]
    rows = np.concatenate([run.rows, np.repeat(run.rows[gaps], 2)])[order]
    return replace(run, rows=rows, time=time[order], signals=signals, good=good), np.argsort(order)[: len(run)]


def _told(run: MeasuredRun, first: int, until: int, last: int) -> str:
    """What is left out behind a gap, as a sentence."""
    begin, end = run.time[first - 1], run.time[first]
    gap = f"{run.log}: nothing was recorded between {begin:.6g} s and {end:.6g} s, and what inputs did there matters"
    if until < last:
        return f"{gap} until {run.time[until]:.6g} s: outputs that feel it are not compared before"
    whole = "the next gap" if last < len(run) else "its end"
    return f"{gap} to {whole}: outputs that feel it are not compared there. A log that begins behind the gap would tell more"
