"""Which blocks teach and which judge; and which logs cannot carry a diagnosis at all."""

from __future__ import annotations

import numpy as np

from ..data.faults import DataFault
from ..data.log import VALID, MeasuredRun
from ..data.rig import EVERY_SECOND, Rig
from ..data.rig import split as split_name
from ..data.signals import ANGLE_OF, GIVEN, SIGNALS
from ..errors import DataError
from ..residuals.blocks import Blocks
from ..residuals.experiment import Experiment
from ..rules import RULES


def split(experiment: Experiment, runs: list[MeasuredRun], held: list[bool]) -> tuple[np.ndarray, list[str]]:
    """True for blocks to train on, and names of what is held out, which is never nothing."""
    count, rules = experiment.layout.count, RULES.pipeline
    if any(held):
        train = ~np.array(held)[experiment.layout.owner]
        names = sorted({run.log for run, h in zip(runs, held) if h})
    elif experiment.rig.hold_out == EVERY_SECOND:
        train = experiment.layout.owner % 2 == 0
        if experiment.steady:  # every second point of each direction
            speeds = [
                x for name, x in experiment.runs[0].signals.items() if split_name(name, experiment.rig.drives)[1] in ANGLE_OF
            ]
            backward = speeds[0] < 0.0
            for side in (backward, ~backward):
                train[np.flatnonzero(side)] = np.arange(side.sum()) % 2 == 0
        names = [f"run {runs[i].name or i}" for i in np.flatnonzero(~train)] if len(runs) == count else ["every second"]
        if train.all():
            raise DataError(
                f"{experiment.rig.path}: hold_out = {EVERY_SECOND!r} needs two runs, and there is one. Leave it out: blocks are held out then."
            )
    else:
        train = np.arange(count) % rules.every != rules.every - 1
        names = [f"block {i + 1} of {count}" for i in np.flatnonzero(~train)]
    teach = int(train.sum())
    if any(held) and not experiment.steady:  # they are cut into blocks of their own, however long the logs are that judge
        teach = Blocks([run for run, h in zip(runs, held) if not h], False).count
    if teach < rules.fewest_blocks:
        raise DataError(
            f"{experiment.rig.path}: the logs make {teach} blocks to learn from, too few to tell a cause from "
            f"chance. Give a longer log or more runs (at least {rules.fewest_blocks} points or about {rules.fewest_blocks * RULES.residuals.shortest_block * 2} samples)."
        )
    _refuse_rest(experiment, runs, train)
    return train, names


def _refuse_rest(experiment: Experiment, runs: list[MeasuredRun], train: np.ndarray) -> None:
    """Data in which nothing can be compared: friction is told only where a shaft moves one way for sure."""
    compared = experiment.present({}).any(axis=1)
    few = min(RULES.pipeline.fewest_blocks, int(train.sum()))
    for blocks, what, least in ((train, "to learn from", few), (~train, "to judge by", 1)):
        found = int((compared & blocks).sum())
        if found < least:
            logs = ", ".join(sorted({runs[i].log for i in experiment.layout.owner[blocks]}))
            raise DataError(
                f"{logs}: in {found} of {int(blocks.sum())} blocks {what} something can be compared, {least} are needed. "
                "A torque tells of friction only where the shaft moves one way for sure and all channels are sound: record a motion."
            )


def refuse_useless(rig: Rig, runs: list[MeasuredRun], faults: list[DataFault]) -> None:
    """Data that cannot carry a diagnosis: channels that never change, or are mostly faulty. A point at rest is left out."""
    rest = {(fault.log, fault.run) for fault in faults if fault.kind == "at rest"}
    runs = [run for run in runs if (run.log, run.name) not in rest]
    names = {name for run in runs for name in run.signals}
    for name in sorted(names):
        _, bare = split_name(name, rig.drives)
        if bare not in SIGNALS:
            continue
        having = [run for run in runs if name in run.signals]
        values = np.concatenate([run.signals[name][run.usable(name)] for run in having])
        asked = sum(int(run.signals[VALID].sum()) if VALID in run.signals else len(run) for run in having)
        column = next((c.column for c in rig.columns if c.signal == name), name)
        where = having[0].log
        if asked == 0:
            raise DataError(f"{where}: column {rig.valid!r} is 0 in every row, so no sample counts. Is it the right one?")
        if len(values) < (1.0 - RULES.pipeline.most_faulty) * asked:
            raise DataError(
                f"{where}: column {column!r} ({name}) is faulty in {asked - len(values)} of {asked} samples. "
                "Measure again, or leave the column out."
            )
        if values.min() == values.max() and bare not in GIVEN and bare not in {"motor.supply_voltage", "motor.temperature"}:
            raise DataError(
                f"{where}: column {column!r} ({name}) never changes from {values[0]:.6g}. Is it connected? "
                f"Leave it out of {rig.path.name} if not."
            )
