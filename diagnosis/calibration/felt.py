"""Spikes of inputs that were there: what a system answers to is no corrupted sample, however short.

A hammer's blow, or a command of one row, lies alone between its neighbours as a sample that a recorder spoilt does. Which of the
two it is the system's own model tells: beside the one its outputs are nearer with the spike, beside the other without.
"""

from __future__ import annotations

from collections.abc import Sequence
from contextlib import closing
from dataclasses import replace

import numpy as np

from ..data.faults import DataFault
from ..data.log import MeasuredRun
from ..data.rig import Rig
from ..rules import RULES
from ..systems.parts import Parts
from .numbers import Number, of_run
from .played import Played, Settings


def felt(
    rig: Rig, parts: Parts, runs: list[MeasuredRun], numbers: Sequence[Number], faults: list[DataFault]
) -> tuple[list[MeasuredRun], list[DataFault]]:
    """The runs with spikes of inputs that their outputs feel, and what answers them at once, no longer masked; the faults that are left.

    Told with the numbers as they are given, before anything is fitted: without its blows a log may have nothing to fit.
    """
    spikes = [fault for fault in faults if fault.kind == "corrupted"]
    if not spikes:
        return runs, faults
    with closing(Played(rig, parts, runs, numbers)) as played:
        inputs, outputs = {feed.channel for feed in played.group.feeds}, played.outputs
    found, real = list(runs), set[DataFault]()
    for i, run in enumerate(runs):
        mine = [spike for spike in spikes if (spike.log, spike.run) == (run.log, run.name)]
        blows = [spike for spike in mine if spike.channel in inputs]
        if not blows:
            continue
        about = np.any([_rows(run, blow, RULES.calibrate.felt_rows) for blow in blows], axis=0)
        struck_at = [int(np.argmax(_rows(run, blow))) for blow in blows]
        answers = [spike for spike in mine if spike.channel in outputs and (_rows(run, spike) & about).any()]
        struck, own = _unmasked(run, [*blows, *answers]), of_run(numbers, i)
        given = {n.variable: n.start for n in own}
        without, with_them = (_missed(Played(rig, parts, [one], own), given, struck_at) for one in (run, struck))
        if with_them < RULES.calibrate.felt * without:
            found[i] = struck
            real |= {*blows, *answers}
    return found, [fault for fault in faults if fault not in real]


def _rows(run: MeasuredRun, fault: DataFault, behind: int = 0) -> np.ndarray:
    """Samples of a run that a fault has, and so many behind them."""
    return (run.rows >= fault.first) & (run.rows <= fault.last + behind)


def _unmasked(run: MeasuredRun, faults: Sequence[DataFault]) -> MeasuredRun:
    good = dict(run.good)
    for fault in faults:
        good[fault.channel] = good[fault.channel] | _rows(run, fault)
    return replace(run, good=good)


def _missed(played: Played, given: Settings, struck_at: Sequence[int]) -> float:
    """Mean square of what outputs do behind spikes beyond what is simulated, each over its spread; inf where the run breaks off.

    What was missed before goes on as it went, straight: numbers that are off miss more of what rings than of one answer.
    """
    played.reusable = False  # nobody knows as yet whether its FMUs can be reset
    with closing(played):
        errors = played.errors([given], [0])
        if errors is None:
            return np.inf
        found, reach = [], RULES.calibrate.felt_rows
        for name in played.outputs:
            e = errors[name][0] / (played.spread(name) or 1.0)
            for k in struck_at:
                before, behind = np.arange(max(0, k - reach), k + 1), np.arange(k, min(k + reach + 1, len(e)))
                before, behind = before[np.isfinite(e[before])], behind[np.isfinite(e[behind])]
                if len(before):
                    line = np.polyfit(before - k, e[before], 1 if len(before) > 2 else 0)
                    found.append(e[behind] - np.polyval(line, behind - k))
        return float(np.mean(np.square(np.concatenate([*found, np.zeros(1)]))))
