"""What can be wrong with a recording, and in which rows it was put (0 is the first after the header)."""

from __future__ import annotations

import numpy as np
import pandas as pd

KINDS = ("frozen", "spike", "nan", "gap")  # the gap last: it moves the rows behind it
BEYOND = 50.0  # V, of a spike in a command, which may jump within its limits


def spoil_with_all(table: pd.DataFrame, rng: np.random.Generator) -> tuple[pd.DataFrame, list[dict]]:
    """The log with every kind of fault, one after another, and where each was put."""
    placed = []
    for number, kind in enumerate(KINDS):
        table, where = spoil(table, kind, rng, 0.1 + 0.2 * number, 0.2 + 0.2 * number)
        placed.append(where)
    return table, placed


def spoil(table: pd.DataFrame, kind: str, rng: np.random.Generator, after: float, before: float) -> tuple[pd.DataFrame, dict]:
    """The log with one fault between these shares of its length, and {channel, first, last, kind} as the product says it."""
    table = table.copy()
    channel = str(rng.choice(("current", "motor_speed", "angle")))
    n = len(table)
    first = int(rng.integers(int(after * n), int(before * n)))
    if kind == "frozen":
        # where something moves: a sensor that stands still beside a resting drive shows nothing
        moving = np.abs(table["motor_speed"].to_numpy()) > 10.0
        starts = [k for k in range(first, int((before + 0.08) * n)) if moving[k : k + 300].mean() > 0.9]
        first = starts[0] if starts else first
        last = first + 300
        table.loc[first:last, channel] = table.loc[first, channel]
    elif kind == "spike":
        last = first
        table.loc[first, channel] += 40.0 * table[channel].std() * rng.choice((-1.0, 1.0))
    elif kind == "nan":
        last = first + int(rng.integers(0, 20))
        table.loc[first:last, channel] = np.nan
    elif kind == "gap":
        channel = "time"
        last = first + 1
        table = table.drop(index=range(first + 1, first + 250)).reset_index(drop=True)
    else:
        raise ValueError(kind)
    names = {"frozen": "frozen", "spike": "corrupted", "nan": "non-finite", "gap": "missing"}
    return table, {"channel": channel, "first": first, "last": last, "kind": names[kind]}


def spoil_recording(table: pd.DataFrame, rng: np.random.Generator, channels: tuple[str, ...]) -> tuple[pd.DataFrame, list[dict]]:
    """A recording with every kind of fault and one clipped channel; each stretch of faulty rows has its own entry.

    A channel is frozen for 0.3 s in which it moves, single rows and a few in a row are corrupted or lost, a quarter of a
    second is missing, and an amplifier's range ends at 0.7 of what the last channel reached.
    """
    table, n = table.copy(), len(table)
    step = float(np.median(np.diff(table["time"])))
    placed: list[dict] = []

    def note(channel, first, last, kind):
        placed.append({"channel": channel, "first": int(first), "last": int(last), "kind": kind})

    def place(after: float) -> int:
        return int(rng.integers(int(after * n), int((after + 0.1) * n)))

    *others, clipped = rng.permutation([name for name in channels if name != "angle"])
    x = table[clipped].to_numpy(copy=True)
    limit = 0.7 * np.quantile(abs(x), 0.999)
    at_limit = abs(x) >= limit  # of a value just there, as counts have, nobody can tell that it was not cut
    table[clipped] = np.clip(x, -limit, limit)
    for first, last in _edges(at_limit):
        note(clipped, first, last, "clipped")

    others = [*others, "angle"]
    channel = str(rng.choice(others))
    x, length = table[channel].to_numpy(copy=True), max(20, int(0.3 / step))
    starts = np.arange(int(0.15 * n), int(0.3 * n), 5)
    moved = np.array([np.ptp(x[k : k + length]) for k in starts])
    first = int(rng.choice(starts[moved >= 0.8 * moved.max()]))
    x[first : first + length] = x[first]
    table[channel] = x
    note(channel, first + 1, first + length - 1, "frozen")  # the first value was measured

    channel = str(rng.choice(others))
    spread = float(np.ptp(table[channel].quantile([0.02, 0.98])))
    for k, length in ((place(0.4), 1), (place(0.5), 2)):
        table.loc[k : k + length - 1, channel] += 5.0 * spread * rng.choice((-1.0, 1.0))
        note(channel, k, k + length - 1, "corrupted")

    channel, k = str(rng.choice(others)), place(0.6)
    table.loc[k : k + 6, channel] = np.nan
    note(channel, k, k + 6, "non-finite")

    k, lost = place(0.75), max(5, int(0.25 / step))
    table = table.drop(index=range(k + 1, k + 1 + lost)).reset_index(drop=True)
    for fault in placed:  # rows behind the gap move up; those in it are gone
        first, last = fault["first"], fault["last"]
        fault["first"] = first if first <= k else max(first - lost, k + 1)
        fault["last"] = last if last <= k else max(last - lost, k)
    placed = [fault for fault in placed if fault["first"] <= fault["last"]]
    note("time", k, k + 1, "missing")
    return table, placed


def spoil_anyhow(table: pd.DataFrame, rng: np.random.Generator, channels: tuple[str, ...]) -> tuple[pd.DataFrame, list[dict]]:
    """A recording with faults of any number and length in any channels, at rest and in motion, some beside each other.

    Noted are the rows that are wrong: a value that stands where it would have stood anyway is none, nor a limit that
    nothing reached. One channel is clipped at one end or both, up to two freeze for 0.1 to 1 s, spikes of 2 to 20 times a
    channel's range come alone or in bursts, values are lost, and rows: singly, or up to half a second of them.
    """
    table, n = table.copy(), len(table)
    step = float(np.median(np.diff(table["time"])))
    wrong: dict[tuple[str, str], np.ndarray] = {}

    def note(channel, kind):
        return wrong.setdefault((channel, kind), np.zeros(n, bool))

    names = list(rng.permutation(channels))
    sound = {name: table[name].to_numpy(copy=True) for name in names}
    spread = {name: float(np.ptp(np.quantile(x, (0.02, 0.98)))) for name, x in sound.items()} | {"voltage": BEYOND}
    if rng.random() < 0.7:
        name = str(names.pop(int(np.argmax([each != "voltage" for each in names]))))  # a command saturates honestly
        x, side = table[name].to_numpy(copy=True), rng.integers(3)
        middle = 0.5 * (x.max() + x.min()) if name.endswith("angle") else 0.0
        limit = rng.uniform(0.5, 0.9) * np.quantile(abs(x - middle), 0.999)
        high, low = (limit if side != 1 else np.inf), (-limit if side != 0 else -np.inf)
        x = np.clip(x, middle + low, middle + high)
        note(name, "clipped")[:] = x != sound[name]
        table[name] = x
    for name in map(str, names[: rng.integers(3)]):
        x, length = table[name].to_numpy(copy=True), int(rng.uniform(0.1, 1.0) / step)
        first = int(rng.integers(0, n - length - 1))
        x[first : first + length] = x[first]
        changed = np.mean(x[first + 1 : first + length] != sound[name][first + 1 : first + length])
        note(name, "frozen")[first + 1 : first + length] = changed > 0.5
        table[name] = x
    for name in map(str, rng.permutation(names)[: rng.integers(1, 4)]):
        x, first = table[name].to_numpy(copy=True), int(rng.integers(0, n - 100))
        for _ in range(rng.integers(1, 7)):
            length = int(rng.integers(1, 4))
            x[first : first + length] += rng.uniform(2.0, 20.0) * max(spread[name], 1e-3) * rng.choice((-1.0, 1.0))
            note(name, "corrupted")[first : first + length] = True
            first = first + length + int(rng.integers(1, 8)) if rng.random() < 0.5 else int(rng.integers(0, n - 100))
        table[name] = x
    for name in map(str, rng.permutation(names)[: rng.integers(3)]):
        x, first = table[name].to_numpy(copy=True), int(rng.integers(0, n - 20))
        x[first : first + rng.integers(1, 20)] = rng.choice((np.nan, np.inf))
        note(name, "non-finite")[:] |= ~np.isfinite(x)
        table[name] = x
    keep = np.ones(n, bool)
    for _ in range(rng.integers(4)):
        first = int(rng.integers(10, n - 10))
        lost = int(rng.integers(1, 4)) if rng.random() < 0.5 else int(rng.uniform(0.02, 0.5) / step)
        keep[first : first + lost] = False
    for name, lost in ((name, rows) for (name, kind), rows in wrong.items() if kind in ("corrupted", "non-finite")):
        for kind in ("clipped", "frozen", "corrupted"):  # a row has one fault, the last that befell it
            if (name, kind) in wrong and wrong[name, kind] is not lost:
                wrong[name, kind] &= ~lost
    table, row = table[keep].reset_index(drop=True), np.cumsum(keep) - 1
    placed = [
        {"channel": name, "first": int(row[a]), "last": int(row[b]), "kind": kind}
        for (name, kind), rows in wrong.items()
        for a, b in _edges(rows & keep)
    ]
    gaps = [(row[a], row[a] + 1) for a, _ in _edges(~keep)]
    return table, placed + [{"channel": "time", "first": int(a), "last": int(b), "kind": "missing"} for a, b in gaps]


def _edges(rows: np.ndarray) -> list[tuple[int, int]]:
    """First and last of each stretch of rows."""
    edges = np.flatnonzero(np.diff(np.concatenate([[0], rows.astype(int), [0]])))
    return list(zip(edges[::2], edges[1::2] - 1))
