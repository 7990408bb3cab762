"""Faults in the data: found, named and masked, never dropped silently.

Each check marks samples of one channel as not to be trusted and adds a row to the list of faults. The checks know no
laws of the drive, only which channels tell of one motion: they look for what no drive does. What a drive may do (rest,
saturate, jump on command, hit a stop) passes.
"""

from __future__ import annotations

from dataclasses import asdict, dataclass

import numpy as np
from numpy.lib.stride_tricks import sliding_window_view
from scipy.ndimage import maximum_filter1d, median_filter

from ..rules import RULES
from .differenced import lost
from .log import VALID, MeasuredRun
from .rig import Rig, split
from .signals import ANGLE_OF, COMMANDS, MOVES, SPEED_OF, TORQUES
from .stuck import Stills, clipped, frozen
from .values import resolution, spread, stretches

_FEELS = {*MOVES, *TORQUES, "controller.voltage", "motor.duty", "motor.voltage", "motor.supply_voltage"}
"""Signals in which an impact shows, in a voltage by the controller's answer."""


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
        for name, bad in _corrupted(run, rig).items():
            faults += _masked(run, name, bad, "corrupted")
        faults += _stuck(run, rig)
        if rig.kind == "steady" and rig.run:  # else rows are points already
            faults += _at_rest(run, rig)
        if VALID in run.signals:  # as the rig says, and no fault
            for name in run.good:
                run.good[name] &= run.signals[VALID] > 0.0
    return faults


def _masked(run: MeasuredRun, name: str, bad: np.ndarray, kind: str) -> list[DataFault]:
    """These samples are not to be trusted."""
    bad = bad & run.good[name]
    run.good[name] = run.good[name] & ~bad
    return _spans(run, name, bad, kind)


def _stuck(run: MeasuredRun, rig: Rig) -> list[DataFault]:
    """Clipped and frozen channels; clipped ones first, for at its limit a channel stands still as well."""
    faults: list[DataFault] = []
    stills = Stills(run, rig.drives)
    names = [name for name in stills.asked() if name not in rig.commanded]
    for name in names:
        stills.clipped[name] = clipped(stills, name)
        faults += _masked(run, name, stills.clipped[name], "clipped")
    for name, bad in frozen(stills, names).items():
        faults += _masked(run, name, bad, "frozen")
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
    if irregular := run.uneven > RULES.data.most_uneven:
        detail = f"{100 * run.uneven:.0f} % of the steps differ from {usual:.4g} s by more than half"
        faults += _spans(run, "time", np.ones(len(run), bool), "irregular", detail)
    for place in np.flatnonzero(run.behind_gaps[1:] if irregular else lost(run.time)):
        detail = f"{steps[place]:.4g} s without a sample, {usual:.4g} s is usual"
        rows = int(run.rows[place]), int(run.rows[place + 1])
        faults.append(DataFault(run.log, "time", *rows, "missing", run.name, detail))
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


def _corrupted(run: MeasuredRun, rig: Rig) -> dict[str, np.ndarray]:
    """Samples of each channel that are wrong alone. A spike of a torque that others feel is an impact.

    An angle has no such: nothing is elsewhere for a few samples and back. Nor has a speed, but where no angle was measured that
    would tell and a torque feels it: a drive that jerks from row to row of a slow log.
    """
    bares = {name: split(name, rig.drives)[1] for name in run.signals if name != VALID}
    spikes = {name: _spikes(run, name) for name, bare in bares.items() if bare not in COMMANDS and name not in rig.commanded}
    spikes |= {name: spikes[name] | _off_its_way(run, name) for name in spikes if bares[name] in SPEED_OF}
    spikes |= {name: _beyond(run, name, rig) for name, bare in bares.items() if bare == "controller.voltage"}
    speeds = {name: name.removesuffix(bares[name]) + ANGLE_OF[bares[name]] for name in spikes if bares[name] in ANGLE_OF}
    spikes |= {name: spikes[name] & ~_of_a_count(run, name, angle) | _over_lost_rows(run, name) for name, angle in speeds.items()}
    spikes |= {name: _outside(run, name, spikes[name]) for name in spikes if bares[name] == "motor.supply_voltage"}
    places: dict[str, list[np.ndarray]] = {}
    for name, bare in bares.items():
        if bare in _FEELS:
            place = SPEED_OF.get(bare, bare)  # angle and speed may come from one encoder
            places.setdefault(name.removesuffix(bare) + place, []).append(_filled(run, name, spikes.get(name)))
    for name, bad in spikes.items():
        if bares[name] in TORQUES and bad.any():
            spikes[name] = bad & ~_impacts(bad, [there for place, there in places.items() if place != name])
        elif bad.any() and name in speeds and speeds[name] not in bares:
            torques = [there for place, there in places.items() if split(place, rig.drives)[1] in TORQUES]
            spikes[name] = bad & ~_impacts(bad, torques, 1)
    return spikes


def _impacts(bad: np.ndarray, places: list[list[np.ndarray]], witnesses: int = RULES.data.impact_witnesses) -> np.ndarray:
    """Those of the bad stretches that are felt in so many other places."""
    starts, lengths = stretches(bad)
    impact = np.zeros(len(starts), bool)
    for length in np.unique(lengths[bad[starts]]):
        here = bad[starts] & (lengths == length)
        impact[here] = _felt(places, int(length), len(bad))[starts[here] + length // 2] >= witnesses
    return np.repeat(impact, lengths)


def _filled(run: MeasuredRun, name: str, bad: np.ndarray | None = None) -> np.ndarray:
    """A channel with a line across what is no number, or bad."""
    good = run.good[name] if bad is None else run.good[name] & ~bad
    return np.interp(np.arange(len(run)), np.flatnonzero(good), run.signals[name][good]) if good.any() else np.zeros(len(run))


def _felt(places: list[list[np.ndarray]], length: int, samples: int) -> np.ndarray:
    """In how many places channels bend about each row, over a spike of this length, as they rarely do, and there alone."""
    rules, span = RULES.data, length + 2
    count = np.zeros(samples, int)
    for there in places:
        bent = np.zeros(samples, bool)
        for x in there:
            bend = np.zeros(samples)
            bend[span:-span] = abs(x[2 * span :] - 2.0 * x[span:-span] + x[: -2 * span])
            about = median_filter(bend, size=2 * rules.impact_about * span + 1, mode="reflect")
            bent |= bend > np.maximum(np.quantile(bend, rules.spike_tail), rules.impact_sharp * about)
        count += maximum_filter1d(bent.astype(int), 2 * rules.impact_reach + 1)
    return count


def _beyond(run: MeasuredRun, name: str, rig: Rig) -> np.ndarray:
    """Samples of a command far beyond the limits that the rig gives its controller, which commands no more; else it may jump."""
    owner = name.rpartition(".")[0]
    low, high = (rig.parameters.get(f"{owner}.voltage_{end}") for end in ("min", "max"))
    if low is None or high is None:
        return np.zeros(len(run), bool)
    x = run.signals[name]
    away = abs(x - 0.5 * (low + high)) > RULES.data.beyond_limits * 0.5 * (high - low)
    return away & np.isfinite(x)


def _outside(run: MeasuredRun, name: str, bad: np.ndarray) -> np.ndarray:
    """Those of the bad samples that are beyond all others: a supply goes to and fro between its levels with what hangs on it."""
    x, rest = run.signals[name], run.signals[name][run.good[name] & ~bad]
    return bad & ((x < rest.min()) | (x > rest.max())) if bad.any() and len(rest) else bad


def _of_a_count(run: MeasuredRun, name: str, angle: str) -> np.ndarray:
    """First rows of a speed in which it is no more than a count of its angle makes: a difference has as many rows as there are yet."""
    told = np.zeros(len(run), bool)
    if angle in run.signals:
        rows = min(RULES.search.differenced, len(run) - 1)
        since = run.time[np.maximum(np.arange(rows), 1)] - run.time[0]
        told[:rows] = abs(run.signals[name][:rows]) * since < 1.5 * resolution(run.signals[angle])  # of one, and not of two
    return told


def _over_lost_rows(run: MeasuredRun, name: str) -> np.ndarray:
    """Rows in which a speed is too much by what its difference goes over lost rows: it was divided by the time of as many as usual.

    It is far from what is before and behind, and divided by what really passed it fits them.
    """
    x, beside, bad = _filled(run, name), RULES.data.spike, np.zeros(len(run), bool)
    steps = np.diff(run.time)
    usual = RULES.data.deviation * float(np.median(abs(np.diff(x)))) if len(x) > 1 else 0.0
    least = max(RULES.data.corrupted * usual, RULES.data.spike_range * spread(x, RULES.data.range_quantiles))
    for row in (np.flatnonzero(lost(run.time)) + 1).tolist():
        gone, most, found = steps[row - 1] / np.median(steps) - 1.0, 0.0, 0
        for rows in range(1, min(RULES.search.differenced, len(x) - row - beside) + 1 if row >= beside else 1):
            ends = np.median(x[row - beside : row]), np.median(x[row + rows : row + rows + beside])
            here, line = x[row : row + rows], np.linspace(*ends, rows + 2)[1:-1]
            off, mended = min(np.min(abs(here - end)) for end in ends), np.max(abs(here / (1.0 + gone / rows) - line))
            if off > least and mended < RULES.data.spike_beside * off and rows * off > most:
                most, found = rows * off, rows
        bad[row : row + found] = True
    return bad


def _off_its_way(run: MeasuredRun, name: str) -> np.ndarray:
    """Samples of an angle, a few in a row, far from the parabola through those before and behind, which lie on it.

    Far beside how far all are from theirs, and by a fast step of it, however near by that is: no shaft goes there and back. Nor are
    they on the line of either side, as where one is struck.
    """
    rules, x, bad = RULES.data, _filled(run, name), np.zeros(len(run), bool)
    step = float(np.quantile(abs(np.diff(x)), rules.spike_tail)) if len(x) > 1 else 0.0
    for length in range(1, rules.spike + 1):
        width = 2 * rules.spike + length
        if len(x) < max(width, rules.spike_samples):
            break
        powers = np.vander(np.arange(width) - 0.5 * (width - 1), 3, increasing=True)
        inside = np.zeros(width, bool)
        inside[rules.spike : -rules.spike] = True
        left, seen = np.arange(width) < rules.spike, sliding_window_view(x, width)
        sides = ((3, ~inside), (2, left), (2, left[::-1]))
        apart = [abs(seen - seen[:, of] @ (powers[:, :n] @ np.linalg.pinv(powers[of, :n])).T) for n, of in sides]
        off = np.min([one[:, inside] for one in apart], axis=(0, 2))
        least = max(rules.corrupted * _usual(off, x), step)
        alone = np.max(apart[0][:, ~inside], 1) < rules.spike_beside * off
        for begin in np.flatnonzero((off > least) & alone) + rules.spike:
            bad[begin : begin + length] = True
    return bad & run.good[name]


def _spikes(run: MeasuredRun, name: str) -> np.ndarray:
    """Samples far from their neighbours on both sides (Hampel), alone or a few in a row, farther than all but 2 %.

    Among many neighbours first, then among few, until there are no more: of those close together one hides another.
    """
    bad, good = np.zeros(len(run), bool), run.good[name]
    if good.sum() < RULES.data.spike_samples:
        return bad
    for reach in (2 * RULES.data.spike + 1, RULES.data.spike):
        more = good
        while more.any():
            more = _farthest(_filled(run, name, bad), reach) & good & ~bad
            bad |= more
    return bad


def _farthest(x: np.ndarray, reach: int) -> np.ndarray:
    """Samples of a channel without gaps that are far from so many neighbours on each side, which have nothing of them."""
    rules = RULES.data
    away = abs(x - median_filter(x, size=2 * reach + 1, mode="reflect"))
    width = spread(x, rules.range_quantiles)
    suspect = (away > rules.corrupted * _usual(away, x)) & (away > rules.spike_range * width)
    ends = np.ones(len(x), bool)
    ends[reach:-reach] = False  # there a step looks like a spike: it must be larger than the signal itself
    suspect &= ~ends | (away > rules.spike_range_at_ends * width)
    starts, lengths = stretches(suspect)
    long = suspect[starts] & (lengths > rules.spike)
    suspect[np.repeat(long, lengths)] = False
    places = [(a, a + n) for a, n in zip(starts, lengths) if suspect[a]]
    while places:  # what is none of them is a neighbour of others
        real = [(a, b) for a, b in places if not _alone(x, suspect, a, b)]
        if not real:
            break
        for a, b in real:
            suspect[a:b] = False
        places = [place for place in places if suspect[place[0]]]
    return suspect


def _usual(away: np.ndarray, x: np.ndarray) -> float:
    """The deviation of distances of a channel's samples from where others have them: robust, of all but 2 %, or its resolution's."""
    rules = RULES.data
    tail = float(np.quantile(away, rules.spike_tail)) / rules.spike_tail_deviations
    return max(rules.deviation * float(np.median(away)), tail, resolution(x) / np.sqrt(12.0))


def _alone(x: np.ndarray, suspect: np.ndarray, first: int, end: int) -> bool:
    """Whether the nearest samples on both sides have nothing of what is between them: an impact builds up, lasts or rings down."""
    rules, reach = RULES.data, 4 * RULES.data.spike
    before, after = np.arange(max(first - reach, 0), first), np.arange(end, min(end + reach, len(x)))
    beside = x[np.append(before[~suspect[before]][-rules.spike :], after[~suspect[after]][: rules.spike])]
    if not len(beside):
        return False
    usual = np.median(beside)
    height = float(np.min(abs(x[first:end] - usual)))
    return bool(np.max(abs(beside - usual)) < rules.spike_beside * height)
