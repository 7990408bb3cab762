"""A log as the diagnosis takes it: read, looked through for faults, and then filtered and made fewer as its rig says."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np

from ..errors import DataError
from ..rules import RULES
from .clamped import refuse_clamped
from .faults import DataFault, check
from .log import VALID, MeasuredRun, read
from .rig import Rig


def several(logs: str | Path | Sequence[str | Path]) -> list[str | Path]:
    """Logs by their paths, where one may be given as itself. Raises DataError."""
    found = [logs] if isinstance(logs, (str, Path)) else list(logs) if isinstance(logs, Iterable) else [logs]
    for log in found:
        if not isinstance(log, (str, Path)):
            raise DataError(f"logs are the paths of files: a {type(log).__name__} is none.")
    return found


def gathered(path: str | Path, rig: Rig) -> tuple[list[MeasuredRun], list[DataFault]]:
    """The runs of a log, their faults masked, and these faults. Rows of faults are the file's, whatever becomes of them."""
    runs = read(path, rig)
    faults = check(runs, rig)
    if rig.system is None:
        refuse_clamped(runs, rig)
    return [fewer(smoothed(run, rig), rig) for run in runs], faults


def smoothed(run: MeasuredRun, rig: Rig) -> MeasuredRun:
    """All channels through one low-pass, forward and backward, so that none is later than another (Butterworth, order 2)."""
    rate = rig.rows.lowpass
    if not rate or len(run) < RULES.data.shortest_log:
        return run
    from scipy.signal import butter, sosfiltfilt

    steps = np.diff(run.time)
    step = float(np.median(steps))
    if np.mean(abs(steps - step) > RULES.data.uneven * step) > RULES.data.most_uneven:
        raise DataError(
            f"{run.log}: its rows are not evenly apart, and lowpass = {rate:g} Hz under [time] in {rig.path.name} needs that they are. "
            "Leave it out, or average rows, every = 5."
        )
    if not rate < 0.5 / step:
        raise DataError(
            f"{run.log}: lowpass = {rate:g} Hz under [time] in {rig.path.name} is beyond what its rows show, {0.5 / step:.4g} Hz. Write less, or leave it out."
        )
    sections = butter(2, rate * step * 2.0, output="sos")
    row, reach = np.arange(len(run)), max(1, int(np.ceil(0.5 / (rate * step))))
    signals, good = dict(run.signals), dict(run.good)
    for name, x in run.signals.items():
        mask = run.good.get(name, np.isfinite(x))
        if name == VALID or mask.sum() < 2:
            continue
        signals[name] = sosfiltfilt(sections, np.interp(row, row[mask], x[mask]), padlen=min(3 * reach, len(run) - 1))
        beside = np.convolve(~mask, np.ones(2 * reach + 1), "same") > 0.5  # what was filled in is felt there
        good[name] = mask & ~beside
    return replace(run, signals=signals, good=good)


def fewer(run: MeasuredRun, rig: Rig) -> MeasuredRun:
    """A row for each `every` of them: their mean, sound where all of them are."""
    every = rig.rows.every
    count = len(run) // every
    if every == 1 or not count:
        return run
    blocks = lambda x: x[: count * every].reshape(count, every)
    signals = {name: blocks(x).mean(axis=1) for name, x in run.signals.items()}
    signals |= {name: np.floor(x) for name, x in signals.items() if name == VALID}
    good = {name: blocks(x).all(axis=1) for name, x in run.good.items()}
    return replace(run, rows=blocks(run.rows)[:, 0], time=blocks(run.time).mean(axis=1), signals=signals, good=good)
