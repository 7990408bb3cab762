"""Many runs in one process, and one long run of many FMUs: what a process takes must not grow with what it has done.

    python -m benchmarks.soak [--runs 100000] [--seconds 3600] [--only native] [--docs]

`native`: runs of ten steps of a small FMU in C, opened, run and closed each time. `ours`: the same of our motor, a tenth as
many. `robot`: the robot on belt tracks with its two holder drives, `--seconds` of simulated time in steps of 1 ms. Resident
memory, open descriptors, threads and entries of the temporary folder are looked at all along. Grown is what the second half
has more than the first at most; exit code 1 where that is more than ALLOWED. --docs draws docs/reliability/soak.svg, and puts
the table into docs/reliability.md. Needs gcc.
"""

from __future__ import annotations

import argparse
import gc
import os
import sys
import tempfile
import time
from collections.abc import Callable, Iterator
from pathlib import Path

import matplotlib

matplotlib.use("svg")
import matplotlib.pyplot as plt
import psutil

from benchmarks import tally
from selflock.fmus.build import built
from selflock.master import run
from selflock.study import runs

sys.path.append(str(Path(__file__).parents[1] / "tests" / "native"))
from pack import pack

LOOKS = 60
WORDS = ("resident memory, MB", "descriptors", "threads", "temporary entries")
ALLOWED = (5.0, 0, 0, 0)
Seen = list[tuple[float, ...]]  # how far, and the four numbers


def taken(scratch: Path) -> tuple[float, ...]:
    """What this process takes now."""
    process = psutil.Process()
    return process.memory_info().rss / 1e6, process.num_fds(), process.num_threads(), len(list(scratch.iterdir()))


def many(fmu: Path, inputs: dict[str, float], count: int, scratch: Path) -> Seen:
    """Runs of an FMU, one after the other."""
    seen: Seen = []
    for k in range(count):
        run(fmu, inputs, stop=0.01, step=0.001)
        if (k + 1) * LOOKS >= (len(seen) + 1) * count:
            gc.collect()
            seen.append((k + 1.0, *taken(scratch)))
    return seen


def long(stop: float, scratch: Path) -> Seen:
    """One run of the robot, its rows on disk."""
    system = runs.system("dynamic")
    system.components["robot"].start["track"] = "belt"
    seen: Seen = []

    def observe(time: float, parts) -> None:
        if time * LOOKS >= (len(seen) + 1) * stop * (1.0 - 1e-9):
            seen.append((time, *taken(scratch)))

    with tempfile.TemporaryDirectory(dir=scratch.parent) as folder:
        run(system, stop=stop, out=Path(folder) / "run.parquet", observe=observe)
    return seen


def soaks(count: int, seconds: float, scratch: Path) -> Iterator[tuple[str, str, Callable[[], Seen]]]:
    """Name, what is counted, and the soak."""
    yield "native", "runs", lambda: many(pack("relaxation", scratch.parent), {"u": 1.0}, count, scratch)
    yield "ours", "runs", lambda: many(built("Motor"), {"voltage": 12.0}, max(LOOKS, count // 10), scratch)
    yield "robot", "s simulated", lambda: long(seconds, scratch)


def grown(seen: Seen) -> list[float]:
    """Most of the second half over most of the first, of each number."""
    half = len(seen) // 2
    return [max(row[k] for row in seen[half:]) - max(row[k] for row in seen[:half]) for k in range(1, 5)]


def draw(found: dict[str, tuple[str, Seen]], path: Path) -> None:
    figure, axes = plt.subplots(len(WORDS), len(found), figsize=(3.2 * len(found), 6.4), sharex="col", squeeze=False)
    for column, (name, (unit, seen)) in enumerate(found.items()):
        for k, word in enumerate(WORDS):
            axis = axes[k][column]
            axis.plot([row[0] for row in seen], [row[k + 1] for row in seen], lw=1.2)
            axis.set_ylim(0.0, 1.15 * max(1.0, *(row[k + 1] for row in seen)))
            if not column:
                axis.set_ylabel(word.replace(", ", "\n").replace("temporary ", "temporary\n"))
        axes[0][column].set_title(name)
        axes[-1][column].set_xlabel(unit)
    figure.tight_layout()
    path.parent.mkdir(exist_ok=True)
    figure.savefig(path, metadata={"Date": None})


def main() -> None:
    options = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    options.add_argument("--runs", type=int, default=100_000)
    options.add_argument("--seconds", type=float, default=3600.0)
    options.add_argument("--only", nargs="*", default=["native", "ours", "robot"])
    options.add_argument("--docs", action="store_true")
    chosen = options.parse_args()
    found: dict[str, tuple[str, Seen]] = {}
    rows, bad = [], False
    with tempfile.TemporaryDirectory() as room:
        scratch = Path(room) / "tmp"
        scratch.mkdir()
        os.environ["TMPDIR"] = tempfile.tempdir = str(scratch)
        for name, unit, soak in soaks(max(LOOKS, chosen.runs), chosen.seconds, scratch):
            if name not in chosen.only:
                continue
            began = time.monotonic()
            seen = soak()
            more = grown(seen)
            bad |= any(grew > most for grew, most in zip(more, ALLOWED))
            found[name] = unit, seen
            cells = [f"{max(row[k + 1] for row in seen):.0f} ({grew:+.1f})" for k, grew in enumerate(more)]
            rows.append((name, f"{seen[-1][0]:.0f} {unit}", f"{(time.monotonic() - began) / 60.0:.1f}", *cells))
            print(*rows[-1], sep=" | ", flush=True)
    if chosen.docs:
        tally.put("soak", tally.table(("soak", "of", "minutes", *(f"{word}: most (grown)" for word in WORDS)), rows))
        draw(found, tally.PAGE.parent / "reliability" / "soak.svg")
    sys.exit(bad)


if __name__ == "__main__":
    main()
