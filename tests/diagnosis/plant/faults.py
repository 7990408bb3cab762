"""What can be wrong with a recording, and in which rows it was put (0 is the first after the header)."""

from __future__ import annotations

import numpy as np
import pandas as pd

KINDS = ("frozen", "spike", "nan", "gap")  # the gap last: it moves the rows behind it


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
