"""Faults of recordings, row by row: of what was put into logs of sound drives, what is told; and of what is told, what was put.

    python -m benchmarks.fault_rows [--first 11000] [--cases 150] [--longest 15]

No contest is run: logs are read and checked, half a second of processor a case. "usual" are the faults of the study of
recordings, one of each kind; "anyhow" any number, in any channels, at rest and in motion (tests/diagnosis/plant/faults.py).
"told in sound logs" are rows that are said to be faulty before any fault was put.
"""

from __future__ import annotations

import argparse
import tempfile
from pathlib import Path

import numpy as np
import pandas as pd

from selflock.diagnosis.data.faults import check
from selflock.diagnosis.data.log import read
from selflock.diagnosis.data.rig import load
from tests.diagnosis.plant import recordings, score


def told(rig: str, table: pd.DataFrame) -> list[dict]:
    """The faults of a log."""
    with tempfile.TemporaryDirectory() as folder:
        paths = Path(folder) / "rig.toml", Path(folder) / "log.csv"
        paths[0].write_text(rig)
        table.to_csv(paths[1], index=False, float_format="%.9g")
        known = load(paths[0])
        return [fault.row() for fault in check(read(paths[1], known), known)]


def counted(seeds: range, anyhow: bool, longest: float) -> dict[str, np.ndarray]:
    """By kind: rows put, of these told, rows told, of these put, rows told in sound logs."""
    sums: dict[str, np.ndarray] = {}
    for seed in seeds:
        rig, sound, log, placed = recordings.misread(seed, anyhow, longest)
        for kind, counts in score.fault_rows({"faults": told(rig, log)}, placed, "log").items():
            sums.setdefault(kind, np.zeros(5, int))[:4] += counts
        for kind, counts in score.fault_rows({"faults": told(rig, sound)}, [], "log").items():
            sums.setdefault(kind, np.zeros(5, int))[4] += counts[2]
    return dict(sorted(sums.items()))


def lines(sums: dict[str, np.ndarray], name: str) -> list[str]:
    """Rows of the table."""
    share = lambda hits, of: f"{100.0 * hits / of:.1f} %" if of else "–"
    return [
        f"| {name} | {kind} | {put} | {share(hit, put)} | {said} | {share(true, said)} | {alarms} |"
        for kind, (put, hit, said, true, alarms) in sums.items()
    ]


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--first", type=int, default=11_000, help="the first seed; those below 10 000 judge the study")
    parser.add_argument("--cases", type=int, default=150)
    parser.add_argument("--longest", type=float, default=15.0, help="s at which logs end")
    chosen = parser.parse_args()
    if chosen.first < recordings.DEVELOPMENT:
        parser.error(f"seeds below {recordings.DEVELOPMENT} judge the study of recordings: no rule may be tried on them")
    print(
        "| faults | kind | rows put | of these told | rows told | of these put | told in sound logs |\n|---|---|---|---|---|---|---|"
    )
    for name, anyhow in (("usual", False), ("anyhow", True)):
        seeds = range(chosen.first, chosen.first + chosen.cases)
        print(*lines(counted(seeds, anyhow, chosen.longest), name), sep="\n", flush=True)


if __name__ == "__main__":
    main()
