"""Memory of a long run that writes its results to a file: it must not grow with the log.

    python benchmarks/memory.py [seconds of simulated time]

The robot on belt tracks, with its two holder drives, every output recorded every millisecond. Resident memory of the
process is looked at all along; the peaks of both halves of the run stand beside what was written. (Looked at on two
shared cores, 600 s: 246 MB of Parquet, 626 MB of CSV, some 300 MB resident, which is Python, numba and the robot.)
"""

from __future__ import annotations

import sys
from pathlib import Path
from tempfile import TemporaryDirectory

import psutil
from rich.console import Console
from rich.table import Table

from selflock.master import run
from selflock.study import runs

LOOKS = 60


def watched(path: Path, stop: float) -> list[tuple[float, float, float]]:
    """(time in s, resident memory in MB, file in MB), `LOOKS` times during a run to `path`."""
    system = runs.system("dynamic")
    system.components["robot"].start["track"] = "belt"
    process, seen = psutil.Process(), []

    def observe(time: float, parts) -> None:
        if time >= stop * (len(seen) + 1) / LOOKS - 1e-9:
            seen.append((time, process.memory_info().rss / 1e6, path.stat().st_size / 1e6))

    run(system, stop=stop, out=path, observe=observe)
    return seen


def main(stop: float) -> None:
    table = Table(title=f"{stop:g} s of the robot, written to a file")
    for heading in ("file", "written, MB", "memory at most, first half, MB", "second half", "grown by, MB"):
        table.add_column(heading, justify="left" if heading == "file" else "right")
    with TemporaryDirectory() as folder:
        for ending in ("parquet", "csv"):
            seen = watched(Path(folder) / f"run.{ending}", stop)
            first, second = (max(row[1] for row in half) for half in (seen[: LOOKS // 2], seen[LOOKS // 2 :]))
            table.add_row(f".{ending}", f"{seen[-1][2]:.0f}", f"{first:.0f}", f"{second:.0f}", f"{second - first:+.1f}")
    Console().print(table)


if __name__ == "__main__":
    main(float(sys.argv[1]) if len(sys.argv) > 1 else 600.0)
