"""Tables that hold what was last sent: how old each row's value is.

On a bus every channel is sent in a period of its own, and a recorder writes into each row what came last. Where a period is several
rows, values stand in as many, and no row between brings another; where rows are uneven, what they hold is not: it was sent at even
times, and the motion is the smoother for it. What is left, the time from a sending to the row that has it first, is the same in all
rows of a run, and another in each run (whole.lateness).
"""

from __future__ import annotations

import numpy as np
from scipy.ndimage import maximum_filter1d, minimum_filter1d

from ..data.signals import SIGNALS, VOLTAGES
from ..data.values import resolution
from ..rules import RULES
from .channels import Channels
from .recorder import commanded

WANTED = ("controller.angle_setpoint", "controller.speed_setpoint")


def age(name: str, ch: Channels) -> np.ndarray:
    """By how much the value in each row is older than the row, s, but for a constant: about 0 in rows that bring a new one."""
    key = "age", ch.prefix + name
    if key not in ch.run.memory:
        time, (rows, phase) = ch.run.time, period(name, ch)
        even = evenly_sent(ch)
        if even:
            straight, place = _even(time)
            row = np.arange(float(len(time)))
            found = time - straight(row if phase is None else rows * _numbers(place, rows, phase) + phase)
        elif phase is not None:
            n = _numbers(_places(time), rows, phase)
            found = time - time[np.searchsorted(n, n)]  # the row that had it first
        else:
            found = np.zeros(len(time))
        ch.run.memory[key] = found
    return ch.run.memory[key]


def told(name: str, ch: Channels) -> np.ndarray:
    """In which rows it is certain which message they have: all, but those that came just as one did."""
    key = "told", ch.prefix + name
    if key not in ch.run.memory:
        rows, phase = period(name, ch)
        found = np.ones(len(ch.run), bool)
        if phase is not None and evenly_sent(ch):
            place, near = _even(ch.run.time)[1], 0.5 / RULES.residuals.message_parts
            found = _numbers(place, rows, phase - near) == _numbers(place, rows, phase + near)
        ch.run.memory[key] = found
    return ch.run.memory[key]


def period(name: str, ch: Channels) -> tuple[int, float | None]:
    """In how many rows a message of a channel stands, and where in the row the first was sent; 1 and None where nothing says so.

    A command stands as long as its controller's period. Where that is what it stands for, or is not given and no other channel
    stands in several rows, it was no message.
    """
    found = standing(name, ch)
    if found[0] == 1 or name != commanded(ch) or not any(ch.has(wanted) for wanted in WANTED):
        return found
    own = ch.setting.value(ch.prefix + "controller.sample_period", {}) / float(np.median(np.diff(ch.run.time)))
    others = [other for other in SIGNALS if ch.has(other) and other not in (name, *WANTED)]
    by_controller = abs(found[0] - own) < 0.5 if own > 0.0 else all(standing(other, ch)[0] == 1 for other in others)
    return (1, None) if by_controller else found


def standing(name: str, ch: Channels) -> tuple[int, float | None]:
    """In how many rows a value stands, and where in the row the first came; 1 and None where it may change in any.

    Rows that have the message of the row before are equal to it, all of them, and where a channel has noise few others are. By the
    likelihood of equal rows against that of as many anywhere.
    """
    key = "message", ch.prefix + name
    if key not in ch.run.memory:
        x, good, rules = ch.raw(name), ch.good(name), RULES.residuals
        reach = 2 * rules.message_rows + 1
        changes = maximum_filter1d(x, reach) > minimum_filter1d(x, reach)
        asked = changes[1:] & good[1:] & good[:-1]
        equal = (x[1:] == x[:-1])[asked]
        even = evenly_sent(ch)
        place = _even(ch.run.time)[1] if even else _places(ch.run.time)
        parts = rules.message_parts if even else 1
        pairs = np.stack([place[:-1], place[1:]])[:, asked]
        tried = [
            (sure, rows, k / parts)
            for rows in (range(1, rules.message_rows + 1) if equal.any() else ())
            for k, sure in enumerate(_surest(equal, pairs, rows, parts))
        ]
        most, rows, phase = max(tried, default=(0.0, 1, 0.0))
        if even:  # no row lies between the ends of what does as well
            closer = phase + np.arange(-parts, parts + 1) / parts**2
            likely = np.array([_surest(equal, pairs - near, rows, 1)[0] for near in closer])
            phase = float(np.mean(closer[likely == likely.max()]))
        ch.run.memory[key] = (rows, phase) if most > rules.message_sure else (1, None)
    return ch.run.memory[key]


def _surest(equal: np.ndarray, pairs: np.ndarray, rows: int, parts: int) -> list[float]:
    """How much likelier rows are equal where a message stands again than anywhere, as a logarithm: wherever in its rows the first came.

    equal: whether a row is as the one before; pairs: places of that one and of itself, (2, n). The first is tried to come at
    every of so many parts of a row; all at once: between two rows a message came where the first came from one place to another.
    """
    every = rows * parts
    sent = np.floor(pairs * parts).astype(np.int64)
    near = sent[1] - sent[0] < every  # else one came between them, wherever the first did
    counts = []
    for among in (slice(None), equal):
        short = near[among]
        first, last = (sent[:, among][:, short] + 1) % every
        new = np.cumsum(np.bincount(first, minlength=every) - np.bincount(last, minlength=every)) + np.sum(last < first)
        counts.append(np.sum(short) - new)
    return [_surer(len(equal), int(equal.sum()), int(again), int(both)) for again, both in zip(*counts)]


def _surer(n: int, equal: int, again: int, both: int) -> float:
    """How much likelier it is that of n rows so many are equal where a message stands again than anywhere, as a logarithm."""
    total, usual = 0.0, equal / n if n else 0.0
    for alike, of, share in ((both, again, 1.0 - RULES.residuals.message_wrong), (equal - both, n - again, None)):
        own = (alike / of if of else 0.0) if share is None else share
        for count, p, often in ((alike, own, usual), (of - alike, 1.0 - own, 1.0 - usual)):
            total += count * np.log(p / often) if count else 0.0
    return float(total)


def _numbers(place: np.ndarray, rows: int, phase: float) -> np.ndarray:
    """Of the message that each row has, by its place in rows."""
    return np.floor((place - phase) / rows)


def _places(time: np.ndarray) -> np.ndarray:
    """Of each row among all, those that are lost counted."""
    steps = np.diff(time)
    return np.append(0.0, np.cumsum(np.round(steps / np.median(steps))))


def _even(time: np.ndarray) -> tuple[np.polynomial.Polynomial, np.ndarray]:
    """Time over rows that come evenly, and each row's place among these."""
    row = np.arange(len(time))
    straight = np.polynomial.Polynomial.fit(row, time, 1).convert()
    return straight, (time - straight.coef[0]) / straight.coef[1]


def evenly_sent(ch: Channels) -> bool:
    """Whether what stands in uneven rows was sent at even times: then a motion has less that is new in each row so than by its stamps."""
    if "evenly sent" not in ch.run.memory:
        ch.run.memory["evenly sent"] = _evenly_sent(ch)
    return ch.run.memory["evenly sent"]


def _evenly_sent(ch: Channels) -> bool:
    time, rules, votes = ch.run.time, RULES.residuals, 0
    steps = np.diff(time)
    usual = float(np.median(steps))
    if np.median(abs(steps - usual)) <= RULES.pipeline.even * usual or np.any(steps > RULES.data.gap * usual):
        return False
    for name in SIGNALS:
        if ch.has(name) and name not in WANTED:
            x = ch.raw(name)
            new = np.append(True, x[1:] != x[:-1])
            x, good = x[new], ch.good(name)[new]
            rows, messages = np.flatnonzero(new).astype(float), np.arange(float(len(x)))
            stamped, *evenly = (_rough(x, when, good) for when in (time[new], rows, messages))
            even = min(evenly)
            # of a command's ramp in steps each new value is one step on, whenever it came: it is no motion
            a_ramp = name in VOLTAGES and stamped <= resolution(x)
            votes += int(even < rules.evener * stamped and not a_ramp) - int(stamped < rules.evener * even)
    return votes > 0


def _rough(x: np.ndarray, time: np.ndarray, good: np.ndarray) -> float:
    """What is new in a sample: its usual distance from the cubic through two samples before and two behind it."""
    n = len(x) - 4
    if n < 1:
        return 0.0
    at = [slice(k, k + n) for k in range(5)]
    told = np.zeros(n)
    for k in (0, 1, 3, 4):
        weight = np.ones(n)
        for other in (0, 1, 3, 4):
            if other != k:
                weight = weight * (time[at[2]] - time[at[other]]) / (time[at[k]] - time[at[other]])
        told += weight * x[at[k]]
    sound = np.stack([good[part] for part in at]).all(0) & (x[at[4]] != x[at[0]])
    return float(np.median(abs(x[at[2]] - told)[sound])) if sound.any() else 0.0
