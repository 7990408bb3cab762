"""Channels that stand still where the drive does not: frozen at a value, or clipped at the end of their range.

A channel repeats a value honestly where the drive rests, where it moves by less than the channel resolves, and where a
command holds it. So what stands still is held against what tells of the same motion: all angles and speeds of a drive
are one motion but for gear, play, lag and rounding, and how far two of them come apart elsewhere in the log says how far
they may. A current or a torque has no such counterpart; its own noise says for how long it may repeat a value.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np
from scipy.ndimage import maximum_filter1d, minimum_filter1d, uniform_filter1d
from scipy.special import pdtrc

from ..rules import RULES
from .differenced import SpeedRows, difference, over_losses
from .log import MeasuredRun
from .rig import split
from .signals import ANGLE_OF, MOVES, SPEED_OF, TORQUES, VOLTAGES
from .values import noise_of, resolution, spread, stretches

_OTHERS = ("controller.voltage", "motor.duty", "motor.voltage", "motor.current", "motor.torque")
"""Where these change a torque does, in a drive that stands still too."""


@dataclass
class Stills:
    """A run's channels where they stand still, and what tells whether they may; made before any of them is masked for it."""

    run: MeasuredRun
    drives: tuple[str, ...]
    clipped: dict[str, np.ndarray] = field(default_factory=dict)  # rows, by channel

    def __post_init__(self) -> None:
        self.run = replace(self.run, signals={name: _felt(x) for name, x in self.run.signals.items()})
        self.gaps = self.run.behind_gaps
        self.sound = {name: good.copy() for name, good in self.run.good.items()}  # neither lost nor corrupted
        self._memory: dict = {}

    def once(self, make: Callable[..., Any], *given: Any) -> Any:
        """What `make` answers, for all who ask. Little is kept: a log may be an hour long."""
        key = (make.__name__, *given)
        if key not in self._memory:
            self._memory[key] = make(*given)
        return self._memory[key]

    def asked(self) -> list[str]:
        """Channels that may not stand still while the drive moves."""
        wanted = TORQUES.union(MOVES, VOLTAGES)
        return [name for name in self.run.signals if split(name, self.drives)[1] in wanted and self.sound[name].any()]

    def measured(self, name: str) -> bool:
        """Whether a channel has noise of its own, as a number that somebody gave has not: it repeats nothing, and fourth
        differences, in which a motion leaves next to nothing, are more than its steps would make."""
        x = self.run.signals[name][self.sound[name]]
        return self.noisy(name) and noise_of(x) > resolution(x) / np.sqrt(12.0)

    def of(self, name: str) -> tuple[np.ndarray, np.ndarray]:
        """Starts and lengths of a channel's stretches; gaps and rows that are not sound end them."""
        ends = ~self.sound[name]
        return stretches(self.run.signals[name], self.gaps | ends | np.append(False, ends[:-1]))

    def turned(self, name: str) -> np.ndarray:
        """The angle that an angle or a speed tells of."""
        return self.once(self._turned, name)

    def _turned(self, name: str) -> np.ndarray:
        x, good, row = self.run.signals[name], self.sound[name], np.arange(len(self.run))
        x = np.interp(row, row[good], x[good])
        speed = split(name, self.drives)[1] in ANGLE_OF
        return np.append(0.0, np.cumsum(0.5 * (x[1:] + x[:-1]) * np.diff(self.run.time))) if speed else x

    def grain(self, name: str) -> float:
        """The smallest angle that an angle or a speed tells of."""
        return self.once(self._grain, name)

    def _grain(self, name: str) -> float:
        step = resolution(self.run.signals[name])
        return step * float(np.median(np.diff(self.run.time))) if split(name, self.drives)[1] in ANGLE_OF else step

    def counted(self, name: str) -> tuple[float, int]:
        """Of a speed within its extremes: the count, rad, and the rows over which it is a difference of such; 0 for none."""
        x, prefix, angle = self.run.signals[name], *split(name, self.drives)
        angle = prefix + ANGLE_OF[angle]
        own = resolution(self.run.signals[angle][self.sound[angle]]) if angle in self.sound else 0.0
        good = self.sound[name] & (x != x[self.sound[name]].max()) & (x != x[self.sound[name]].min())
        row = np.arange(len(x))
        return difference([SpeedRows(np.interp(row, row[good], x[good]) if good.any() else 0.0 * x, good, self.run.time)], own)

    def shafts(self, prefix: str) -> list[str]:
        """Channels of a drive that tell of its motion."""
        return [prefix + name for name in MOVES if prefix + name in self.sound and self.sound[prefix + name].any()]

    def moving(self, prefix: str) -> np.ndarray:
        """For each shaft of a drive, about which rows it moves."""
        return self.once(self._moving, prefix)

    def _moving(self, prefix: str) -> np.ndarray:
        rows = int(_sizes(np.array([RULES.data.frozen_shortest]), len(self.run))[0])
        moving = []
        for name in self.shafts(prefix):
            way = _within(self.turned(name), rows)
            moving.append(way > RULES.data.moving_share * np.quantile(way, RULES.data.range_quantiles[1]))
        return np.array(moving).reshape(-1, len(self.run))

    def width(self, name: str) -> float:
        """How far a channel's usual values lie apart."""
        return self.once(self._width, name)

    def _width(self, name: str) -> float:
        return spread(self.run.signals[name][self.sound[name]], RULES.data.range_quantiles)

    def repeats(self, name: str) -> float:
        """The usual share of rows that repeat the value before: a rest or a fault is in the smaller part of a log."""
        return self.once(self._repeats, name)

    def _repeats(self, name: str) -> float:
        x = self.run.signals[name][self.sound[name]]
        inside = (x[1:] != x.max()) & (x[1:] != x.min())
        parts = np.array_split((np.diff(x) == 0)[inside], RULES.data.frozen_parts)
        return float(np.median([np.mean(part) for part in parts if len(part)] or [1.0]))

    def noisy(self, name: str) -> bool:
        """Whether a channel's noise is coarser than its steps, so that it hardly repeats a value even where nothing changes."""
        return self.repeats(name) <= RULES.data.noisy_repeats

    def jumps(self, name: str) -> np.ndarray:
        """Rows to which a channel changes by more than a single step; beside these the first, and one behind the last."""
        return self.once(self._jumps, name)

    def _jumps(self, name: str) -> np.ndarray:
        x = self.run.signals[name]
        single = abs(np.diff(x)) < 1.5 * resolution(x[self.sound[name]])
        return np.concatenate([[0], 1 + np.flatnonzero(~single), [len(x)]])

    def leap(self, name: str) -> float:
        """A large usual change from row to row."""
        return self.once(self._leap, name)

    def _leap(self, name: str) -> float:
        return float(np.quantile(abs(np.diff(self.run.signals[name][self.sound[name]])), RULES.data.range_quantiles[1]))

    def chance(self, name: str) -> float:
        """Rows for which a channel's own noise may leave its value as it is, once in a thousand million logs."""
        usual = np.clip(self.repeats(name), *RULES.data.frozen_shares)
        return float(np.log(RULES.data.frozen_chance / len(self.run)) / np.log(usual))

    def witnesses(self, name: str) -> list[str]:
        """Channels that tell of the same motion."""
        prefix, bare = split(name, self.drives)
        return [other for other in self.shafts(prefix) if other != name] if bare in MOVES else []

    def apart(self, name: str, witness: str) -> np.ndarray:
        """The angle that a channel tells of less that of a witness, with the gear between them."""
        return self.turned(name) - self.once(self._ratio, name, witness) * self.turned(witness)

    def _ratio(self, name: str, witness: str) -> float:
        """What one angle turns for each of another, of most of the way: faults are in a smaller part.

        Where one is at its extreme it may be clipped, and fast moves are most of the way: told without these where it can be.
        """
        ends = np.linspace(0, len(self.run) - 1, RULES.data.ratio_parts + 1).astype(int)
        turned, way = np.diff(self.turned(name)[ends]), np.diff(self.turned(witness)[ends])
        moved = (way != 0) & (turned != 0)  # where one stands still it may be at fault
        inside = np.add.reduceat(self.extreme(name) | self.extreme(witness), ends[:-1], dtype=int) == 0
        moved = moved & inside if (moved & inside).any() else moved
        if not moved.any():
            return 0.0
        ratio, weight = turned[moved] / way[moved], abs(way[moved])
        order = np.argsort(ratio)
        sums = np.cumsum(weight[order])
        return float(ratio[order][np.searchsorted(sums, 0.5 * sums[-1])])

    def may(self, name: str, witness: str, rows: int) -> float:
        """How far the two may come apart within so many rows.

        All but a few windows keep it in which neither stays at a value for half the time or at its extreme: such a one may
        be at fault. Where too few are left, twice what half as many rows allow, for it is no more; not a number without any.
        """
        return self.once(self._may, name, witness, rows)

    def _may(self, name: str, witness: str, rows: int) -> float:
        unsure = self.gaps.copy()
        for channel in (name, witness):
            starts, lengths = self.of(channel)
            unsure |= self.extreme(channel)
            unsure |= np.repeat(lengths >= max(rows / 2, RULES.data.clipped_stretch), lengths)
        clear = maximum_filter1d(unsure.astype(np.int8), rows) == 0
        clear[:rows] = clear[-rows:] = False
        if clear.sum() < rows:
            return 2.0 * self.may(name, witness, rows // 2) if rows > 1 else float("nan")
        usual = float(np.quantile(_within(self.apart(name, witness), rows)[clear], RULES.data.apart_usual))
        return max(usual, self.grain(name), abs(self.once(self._ratio, name, witness)) * self.grain(witness))

    def extreme(self, name: str) -> np.ndarray:
        """Rows in a stretch at the highest or the lowest value: more than a touch."""
        x, (starts, lengths) = self.run.signals[name], self.of(name)
        ends = (x[self.sound[name]].max(), x[self.sound[name]].min())
        return np.repeat((lengths >= RULES.data.clipped_stretch) & np.isin(x[starts], ends), lengths)

    def asleep(self, name: str, rows: int, at_limit: bool) -> np.ndarray:
        """About which rows a channel does not show the motion: for most of so many it repeats a value or is lost.

        Or it is clipped; at_limit: a clipped speed will do, for it shows that the shaft turns.
        """
        starts, lengths = self.of(name)
        clipped = self.clipped.get(name, np.zeros(len(self.run), bool))
        still = (np.repeat(lengths >= RULES.data.frozen_shortest, lengths) & ~clipped) | ~self.sound[name]
        asleep = uniform_filter1d(still.astype(float), rows) > 0.5
        if not (at_limit and split(name, self.drives)[1] in ANGLE_OF):
            asleep |= maximum_filter1d(clipped, rows)
        return asleep


def _felt(x: np.ndarray) -> np.ndarray:
    """Values, 0 where they are less than the last digit of the largest: a simulated current dies away for ever, and is no noise."""
    size = abs(x)
    return np.where(size < np.finfo(float).eps * np.max(size, initial=0.0, where=np.isfinite(size)), 0.0, x)


def _within(x: np.ndarray, rows: int) -> np.ndarray:
    """How far x goes within so many rows about each."""
    return maximum_filter1d(x, rows) - minimum_filter1d(x, rows)


def _sizes(lengths: np.ndarray, total: int) -> np.ndarray:
    """Rows of the windows in which stretches of these lengths are looked at: powers of two, for there are few of these."""
    longest = max(2.0, min(RULES.data.apart_rows, total * RULES.data.apart_share))
    return 2 ** np.floor(np.log2(np.minimum(lengths, longest))).astype(int)


# --- clipped


def clipped(stills: Stills, name: str) -> np.ndarray:
    """Rows at the highest or the lowest value of a channel, where that is not the drive's but the end of its range.

    A voltage saturates honestly.
    """
    x, sound = stills.run.signals[name], stills.sound[name]
    if split(name, stills.drives)[1] in VOLTAGES:
        return np.zeros(len(x), bool)
    ends = {side: side * float((side * x[sound]).max()) for side in (1.0, -1.0)}
    told = {side for side, end in ends.items() if end != 0.0 and _is_limit(stills, name, side, end)}
    if told and ends[1.0] == -ends[-1.0]:  # a range as far to both sides: the other end is one too
        told = set(ends)
    return sound & np.isin(x, [ends[side] for side in told])


def _is_limit(stills: Stills, name: str, side: float, end: float) -> bool:
    """Whether a channel's extreme value is the end of its range.

    So say a witness that goes on while the channel stays, or a noise that would not let it touch the same value so often.
    """
    rules = RULES.data
    if _between_counts(stills, name, end):
        return True
    starts, lengths = stills.of(name)
    here = (stills.run.signals[name][starts] == end) & (lengths >= rules.clipped_stretch)
    if not here.any() or (here.sum() == 1 and _let_go(stills, name, int((starts + lengths)[here][0]))):
        return False
    witnesses = stills.witnesses(name)
    said = np.array([_beyond(stills, name, witness, side, starts[here], lengths[here]) for witness in witnesses])
    beyond = np.max(np.nan_to_num(said) * _agreed(said)) if witnesses else 0.0
    if beyond > rules.apart:
        return True
    angle = split(name, stills.drives)[1] in SPEED_OF  # which may rest at the end of its travel
    odd = not angle and lengths[here].max() > stills.chance(name) and _crowded(stills, name, side)
    return odd and (beyond > rules.apart_and_odd if witnesses else stills.noisy(name))


def _between_counts(stills: Stills, name: str, end: float) -> bool:
    """Whether a speed that is a difference of counts is no whole number of them where it is highest: no encoder gives that."""
    count, rows = stills.once(stills.counted, name) if split(name, stills.drives)[1] in ANGLE_OF else (0.0, 0)
    if not rows:
        return False
    x, time = stills.run.signals[name], stills.run.time
    here = np.flatnonzero((x == end) & ~over_losses(time, rows))
    off = abs(end) * (time[here] - time[here - rows]) / count
    return len(here) >= RULES.data.clipped_stretch and bool(
        np.mean(abs(off - np.round(off)) > 2.0 * RULES.residuals.on_a_count) > 0.5
    )


def _beyond(stills: Stills, name: str, witness: str, side: float, starts: np.ndarray, lengths: np.ndarray) -> np.ndarray:
    """For each stretch: how many times as far as it may a witness goes on to this side; not a number where it shows nothing."""
    apart, found = side * stills.apart(name, witness), np.full(len(starts), np.nan)
    sizes = _sizes(lengths, len(apart))
    for rows in np.unique(sizes):
        asleep = stills.asleep(witness, int(rows), at_limit=False)
        for place in np.flatnonzero(sizes == rows):
            here = slice(starts[place], starts[place] + lengths[place])
            if asleep[here].mean() <= 0.5:
                found[place] = (apart[here][0] - apart[here].min()) / stills.may(name, witness, int(rows))
    return found


def _agreed(said: np.ndarray) -> np.ndarray:
    """Whether of the witnesses (rows) of each stretch a second says so too, where there are two: one may be at fault."""
    awake = np.isfinite(said).sum(axis=0)
    return (np.nan_to_num(said) > RULES.data.apart_agreed).sum(axis=0) >= np.minimum(awake, 2)


def _let_go(stills: Stills, name: str, row: int) -> bool:
    """Whether a channel jumps to this row, as a frozen one does when it is let go; from its limit it comes back as it went.

    A ramp that is steeper than others goes on as it begins.
    """
    x, sound = stills.run.signals[name], stills.sound[name]
    if row >= len(x) or not sound[row] or stills.gaps[row]:
        return False
    goes_on = abs(x[row + 1] - x[row]) if row + 1 < len(x) and sound[row + 1] and not stills.gaps[row + 1] else 0.0
    return bool(abs(x[row] - x[row - 1]) > RULES.data.let_go * max(stills.leap(name), goes_on))


def _crowded(stills: Stills, name: str, side: float) -> bool:
    """Whether an extreme value is found more often than chance allows, by how often the values beside it are."""
    rules = RULES.data
    x = stills.run.signals[name][stills.sound[name]]
    _, counts = np.unique(side * x, return_counts=True)
    beside = counts[-1 - rules.clipped_beside : -1]
    usual = (beside.sum() + 1.0) / max(len(beside), 1)
    return float(pdtrc(counts[-1] - 1, usual)) < rules.frozen_chance


# --- frozen


@dataclass(frozen=True)
class _Still:
    """A stretch that seems frozen, by this witness; of a torque by whatever moves, which is not named."""

    start: int
    length: int
    name: str
    witness: str = ""


def frozen(stills: Stills, names: list[str]) -> dict[str, np.ndarray]:
    """Rows of each channel that repeat a value while others say that it should have changed.

    The longest stretch first: where a channel is let go it jumps, and of another that rests just then it would seem so too.
    """
    rows = {name: np.zeros(len(stills.run), bool) for name in names}
    if len(stills.run) < RULES.data.frozen_samples:
        return rows
    found = [still for name in names for still in _candidates(stills, name)]
    for still in sorted(found, key=lambda still: -still.length):
        end = still.start + still.length
        if not (still.witness and rows[still.witness][max(still.start - 1, 0) : end + 1].any()):
            rows[still.name][still.start + 1 : end] = True  # the first value was measured
    return rows


def _candidates(stills: Stills, name: str) -> list[_Still]:
    """Stretches of one value that others say are too long."""
    rules = RULES.data
    starts, lengths = stills.of(name)
    prefix, bare = split(name, stills.drives)
    long = (lengths >= rules.frozen_shortest) & ~stills.clipped[name][starts]
    if bare in VOLTAGES:  # at its limits a voltage stays honestly
        long &= ~stills.extreme(name)[starts]
    starts, lengths = starts[long], lengths[long]
    if not len(starts):
        return []
    if bare in VOLTAGES and not stills.measured(name):
        return []  # what is given may stay
    rests = (bare in ANGLE_OF) & (stills.run.signals[name][starts] == 0.0)  # a difference of counts has no noise there
    odd = _longer_than_chance(stills, name, starts, lengths) & ~rests
    found = []
    never = stills.repeats(name) <= rules.frozen_shares[0] and len(lengths) <= rules.usual_stills  # not even at rest
    if bare not in MOVES or never:
        found = [_Still(start, length, name) for start, length in zip(starts[odd], lengths[odd])]
    witnesses = stills.witnesses(name)
    if bare in ANGLE_OF or (bare in SPEED_OF and not witnesses):
        # a speed may stay for as long as its noise lets it, and change in an impact
        jumps = (lengths > stills.chance(name)) & ~rests if bare in ANGLE_OF else np.ones(len(starts), bool)
        jumps[jumps] = [_let_go(stills, name, int(end)) for end in (starts + lengths)[jumps]]
        if jumps.sum() <= rules.usual_stills:  # no shaft jumps; what often does after a rest is how the channel is written
            found += [_Still(start, length, name) for start, length in zip(starts[jumps], lengths[jumps])]
    ways, times, said = (np.full((len(witnesses), len(starts)), np.nan) for _ in range(3))
    for k, witness in enumerate(witnesses):
        ways[k], times[k], said[k] = _moved(stills, name, witness, starts, lengths)
    partner = prefix + {**SPEED_OF, **ANGLE_OF}.get(bare, "")
    for k, witness in enumerate(witnesses):
        told = _agreed(said) & (said[k] > np.where(odd, rules.apart_and_odd, rules.apart))
        if witness != partner:  # a shaft may stand still while the other turns, by the play between them
            told &= ~(times[witnesses.index(partner)] <= 1.0) if partner in witnesses else _unusual(ways[k])
        found += [_Still(start, length, name, witness) for start, length in zip(starts[told], lengths[told])]
    return found


def _unusual(way: np.ndarray) -> np.ndarray:
    """Which of these have few others that are at least half as large."""
    alike = len(way) - np.searchsorted(np.sort(way), 0.5 * way)
    return alike <= RULES.data.usual_stills


def _moved(stills: Stills, name: str, witness: str, starts: np.ndarray, lengths: np.ndarray) -> np.ndarray:
    """For each stretch of one value, three rows: how far a channel and a witness come apart in it; how many times as far as
    they may; and this where the witness shows the motion, not a number where it nowhere does."""
    apart, found = stills.apart(name, witness), np.empty((3, len(starts)))
    sizes = _sizes(lengths, len(apart))
    for rows in map(int, np.unique(sizes)):
        here = sizes == rows
        first = starts[here] + rows // 2  # of the windows that lie inside, about their middles
        edges = np.column_stack([first, first + lengths[here] - 2 * (rows // 2) + 1]).ravel()
        way = _within(apart, rows)
        asleep = stills.asleep(witness, rows, at_limit=split(name, stills.drives)[1] in SPEED_OF)
        shown = np.where(asleep, -np.inf, way)
        farthest = [np.maximum.reduceat(np.append(x, 0.0), edges)[::2] for x in (way, way, shown)]
        found[:, here] = farthest
        with np.errstate(divide="ignore", invalid="ignore"):
            found[1:, here] /= stills.may(name, witness, rows)
    found[2, ~np.isfinite(found[2])] = np.nan
    return found


def _longer_than_chance(stills: Stills, name: str, starts: np.ndarray, lengths: np.ndarray) -> np.ndarray:
    """Stretches in which a channel's own noise would have shown: it repeats a value for too long, while the drive moves.

    An angle seems to have noise as long as it moves, and has none where it rests.
    """
    limit = max(RULES.data.frozen_shortest, stills.chance(name))
    odd = (lengths >= limit) & (split(name, stills.drives)[1] not in SPEED_OF)
    odd[odd] = [not _creeps(stills, name, a, a + n) for a, n in zip(starts[odd], lengths[odd])]
    odd[odd] = [_drive_moves(stills, name, slice(a, a + n), limit) for a, n in zip(starts[odd], lengths[odd])]
    return odd


def _creeps(stills: Stills, name: str, start: int, end: int) -> bool:
    """Whether a stretch is left, or was come to, by single steps for more rows than chance allows.

    So an integrator goes on that a controller's other parts leave alone; what freezes has jumped as its noise does.
    """
    x, jumps = stills.run.signals[name], stills.jumps(name)
    changes = [edge > 0 and edge < len(x) and x[edge] != x[edge - 1] for edge in (start, end)]  # not over a row that is lost
    before = start - jumps[np.searchsorted(jumps, start, side="right") - 1]
    behind = jumps[np.searchsorted(jumps, end)] - end
    rows = int(changes[0] * before + changes[1] * behind)
    usual = 3.0 * max(stills.repeats(name), RULES.data.frozen_shares[0])  # a step up and down are as likely as none
    return usual < 1.0 and usual**rows < RULES.data.creeps


def _noisy_at_rest(stills: Stills, name: str, stretch: slice) -> bool:
    """Whether a channel has noise in the other rests of its drive, so that it repeats no value for so long in this one either.

    At 0 it may be switched off.
    """
    x, rules = stills.run.signals[name], RULES.data
    rests = ~stills.moving(split(name, stills.drives)[0]).any(axis=0) & stills.sound[name]
    rests[stretch] = False
    pairs = rests[1:] & rests[:-1]
    if x[stretch.start] == 0.0 or pairs.sum() < rules.frozen_samples:
        return False
    usual = max(float(np.mean(x[1:][pairs] == x[:-1][pairs])), rules.frozen_shares[0])
    longest = np.log(rules.frozen_chance / len(x)) / np.log(usual) if usual < 1.0 else np.inf
    return usual <= rules.noisy_repeats and stretch.stop - stretch.start > longest


def _drive_moves(stills: Stills, name: str, stretch: slice, limit: float) -> bool:
    """Whether something happens for more rows of a stretch than chance leaves a value equal.

    Where a channel's noise is coarser than its steps it shows in every motion; else others must change, for a torque may
    well be the same all along a steady motion.
    """
    rules, prefix = RULES.data, split(name, stills.drives)[0]
    if stills.noisy(name) and np.any(stills.moving(prefix)[:, stretch].sum(axis=1) > limit):
        return True
    if _noisy_at_rest(stills, name, stretch):
        return True
    for other in (*ANGLE_OF, *_OTHERS):
        x = stills.run.signals.get(prefix + other)
        if x is None or prefix + other == name or not stills.sound[prefix + other][stretch].all():
            continue
        part, least = x[stretch], rules.witness_share * stills.width(prefix + other)
        away = abs(part - np.median(part))
        if least > 0 and spread(part, rules.witness_quantiles) > least and (away > least).sum() > limit:
            return True
    return False
