"""Faults in the data: found, named and masked, never dropped silently.

Each check marks samples of one channel as not to be trusted and adds a row to the list of faults. The checks know
nothing of the drive: they look for what no drive does. What a drive may do (rest, saturate, jump on command) passes.
"""

from __future__ import annotations

from dataclasses import asdict, dataclass

import numpy as np
from scipy.ndimage import median_filter

from ..rules import RULES
from .log import VALID, MeasuredRun
from .rig import Rig, split
from .signals import ANGLE_OF, COMMANDS, GIVEN, SIGNALS, SPEED_OF

_MAY_REST = {"reducer.input_angle", "load.angle", "motor.supply_voltage", "motor.temperature"}


@dataclass(frozen=True)
class DataFault:
    """A place in the data not to be trusted. first and last are rows of the log, 0 the first after the header."""

    log: str
    channel: str
    first: int
    last: int
    kind: str  # non-finite | repeated | missing | irregular | frozen | clipped | corrupted | at rest
    run: str = ""
    detail: str = ""

    def row(self) -> dict:
        """As diagnosis.json has it."""
        return asdict(self)


def check(runs: list[MeasuredRun], rig: Rig) -> list[DataFault]:
    """Find the faults of a log's runs and mask them in `run.good`."""
    faults: list[DataFault] = []
    for run in runs:
        run.good = {name: np.isfinite(values) for name, values in run.signals.items()}
        faults += _clock(run, rig)
        for name in run.signals:
            faults += _spans(run, name, ~run.good[name], "non-finite")
            _, bare = split(name, rig.drives)
            if bare in COMMANDS or name == VALID:
                continue
            moves = bare in SIGNALS and bare not in GIVEN  # what else may rest or repeat a value nobody knows
            for kind, test in (("corrupted", _corrupted), ("clipped", _clipped), ("frozen", _frozen)):
                if not (moves or kind == "corrupted"):
                    continue
                bad = test(run, name, bare) & run.good[name]
                faults += _spans(run, name, bad, kind)
                run.good[name] = run.good[name] & ~bad
        if rig.kind == "steady" and rig.run:  # else rows are points already
            faults += _at_rest(run, rig)
        if VALID in run.signals:  # as the rig says, and no fault
            for name in run.good:
                run.good[name] &= run.signals[VALID] > 0.0
    return faults


def _spans(run: MeasuredRun, name: str, bad: np.ndarray, kind: str, detail: str = "") -> list[DataFault]:
    """One fault for each stretch of bad samples."""
    edges = np.flatnonzero(np.diff(np.concatenate([[0], bad.astype(np.int8), [0]])))
    return [
        DataFault(run.log, name, int(run.rows[a]), int(run.rows[b - 1]), kind, run.name, detail)
        for a, b in zip(edges[::2], edges[1::2])
    ]


def _clock(run: MeasuredRun, rig: Rig) -> list[DataFault]:
    """Repeated times, gaps, and steps that vary by more than half."""
    faults = [DataFault(run.log, "time", int(row), int(row), "repeated", run.name) for row in run.repeated]
    if len(run) < 3 or rig.kind == "steady":
        return faults
    steps = np.diff(run.time)
    usual = float(np.median(steps))
    for place in np.flatnonzero(steps > RULES.data.gap * usual):
        detail = f"{steps[place]:.4g} s without a sample, {usual:.4g} s is usual"
        rows = int(run.rows[place]), int(run.rows[place + 1])
        faults.append(DataFault(run.log, "time", *rows, "missing", run.name, detail))
    uneven = np.mean(abs(steps - usual) > RULES.data.uneven * usual)
    if uneven > RULES.data.most_uneven:
        detail = f"{100 * uneven:.0f} % of the steps differ from {usual:.4g} s by more than half"
        faults += _spans(run, "time", np.ones(len(run), bool), "irregular", detail)
    return faults


def _at_rest(run: MeasuredRun, rig: Rig) -> list[DataFault]:
    """A steady-state point whose mean speed may as well be zero: which way friction acts there is not known."""
    faults, parts = [], RULES.data.mean_parts
    for name, x in run.signals.items():
        good = run.good[name]
        if split(name, rig.drives)[1] not in ANGLE_OF or good.sum() < RULES.data.part_samples * parts:
            continue
        means = np.array([part.mean() for part in np.array_split(x[good], parts)])
        if abs(means.mean()) < RULES.data.moves * means.std(ddof=1) / np.sqrt(parts):
            detail = f"a mean of {means.mean():.3g} that may be zero: the direction of friction is not known"
            faults += _spans(run, name, np.ones(len(run), bool), "at rest", detail)
            run.good[name] = np.zeros(len(x), bool)
    return faults


def _corrupted(run: MeasuredRun, name: str, bare: str) -> np.ndarray:
    """Samples far from their neighbours on both sides (Hampel), alone or a few in a row, farther than all but 2 %."""
    x, n, rules = run.signals[name], len(run), RULES.data
    bad = np.zeros(n, bool)
    good = run.good[name]
    if good.sum() < rules.spike_samples:
        return bad
    filled = np.interp(np.arange(n), np.flatnonzero(good), x[good])
    away = abs(filled - median_filter(filled, size=2 * rules.spike + 1, mode="reflect"))
    tail = float(np.quantile(away, rules.spike_tail)) / rules.spike_tail_deviations
    scale = max(rules.deviation * float(np.median(away)), tail, resolution(filled))
    spread = _spread(filled, rules.range_quantiles)
    suspect = (away > rules.corrupted * scale) & (away > rules.spike_range * spread)
    ends = np.ones(n, bool)
    ends[rules.spike : -rules.spike] = False  # there a step looks like a spike: it must be larger than the signal itself
    suspect &= ~ends | (away > rules.spike_range_at_ends * spread)
    starts, lengths = _stretches(suspect)
    short = suspect[starts] & (lengths <= rules.spike)
    return np.repeat(short, lengths)


def _stretches(x: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Starts and lengths of stretches of one value."""
    starts = np.flatnonzero(np.concatenate([[True], np.diff(x) != 0]))
    return starts, np.diff(np.concatenate([starts, [len(x)]]))


def _spread(x: np.ndarray, quantiles: tuple[float, float]) -> float:
    """How far apart these quantiles of x are."""
    return float(np.ptp(np.quantile(x, quantiles)))


def _clipped(run: MeasuredRun, name: str, bare: str) -> np.ndarray:
    """The same extreme value again and again in a finely resolved channel that otherwise hardly repeats a value."""
    x, rules = run.signals[name], RULES.data
    bad = np.zeros(len(x), bool)
    finite = x[np.isfinite(x)]
    levels = len(np.unique(finite))
    if bare in _MAY_REST or levels < rules.clipped_levels:
        return bad
    most = max(rules.clipped_samples, rules.clipped_samples * len(finite) / levels)
    starts, lengths = _stretches(x)
    for extreme in (finite.max(), finite.min()):
        at = x == extreme
        long = (lengths >= rules.clipped_stretch) & at[starts]
        if extreme != 0.0 and long.sum() >= rules.clipped_stretches and at.sum() > most:
            bad |= at
    return bad


def _frozen(run: MeasuredRun, name: str, bare: str) -> np.ndarray:
    """One value for much longer than this channel's own noise allows, while others say that the drive moved."""
    x, rules = run.signals[name], RULES.data
    bad = np.zeros(len(x), bool)
    if len(x) < rules.frozen_samples or bare in {"motor.supply_voltage", "motor.temperature"}:
        return bad
    same = np.diff(x) == 0
    usual = np.clip(np.median([np.mean(part) for part in np.array_split(same, rules.frozen_parts)]), *rules.frozen_shares)
    limit = max(rules.frozen_shortest, np.log(rules.frozen_chance / len(x)) / np.log(usual))
    starts, lengths = _stretches(x)
    for start, length in zip(starts[lengths >= limit], lengths[lengths >= limit]):
        if _others_move(run, name, bare, slice(start, start + length), limit):
            bad[start + 1 : start + length] = True  # the first value was measured
    return bad


def _others_move(run: MeasuredRun, name: str, bare: str, stretch: slice, limit: float) -> bool:
    """Whether another channel shows that this one should have moved: a speed for an angle, anything for a torque.

    For more than `limit` samples: so many equal values are chance, such as the last ones before a rest.
    """
    prefix = name[: len(name) - len(bare)]
    if bare in SPEED_OF:
        witnesses = [SPEED_OF[bare]]
    elif bare in ANGLE_OF:
        witnesses = [ANGLE_OF[bare]]
    else:
        witnesses = ["reducer.input_speed", "load.speed", "motor.voltage", "motor.current", "motor.torque"]
    for witness in witnesses:
        values = run.signals.get(prefix + witness)
        if values is None or prefix + witness == name or not np.all(np.isfinite(values[stretch])):
            continue
        part, spread = values[stretch], _spread(values[np.isfinite(values)], RULES.data.range_quantiles)
        away = abs(part) if bare in SPEED_OF else abs(part - np.median(part))
        moved = np.median(away) if bare in SPEED_OF else _spread(part, RULES.data.witness_quantiles)
        least = RULES.data.witness_share * spread
        if spread > 0 and moved > least and (away > least).sum() > limit:
            return True
    return False


def resolution(values: np.ndarray) -> float:
    """Smallest step between values: the resolution of a quantised channel, tiny for a continuous one."""
    steps = np.diff(np.unique(values[np.isfinite(values)]))
    return float(np.quantile(steps, RULES.data.smallest_step)) if len(steps) else 0.0
