"""Many runs in one process, and one long run of many FMUs: what a process takes must not grow with what it has done.

    python -m benchmarks.soak [--runs 100000] [--seconds 3600] [--only native] [--docs]

`native`: runs of ten steps of a small FMU in C, opened, run and closed each time. `ours`: the same of our motor, a tenth as
many. `robot`: the robot on belt tracks with all four drives, twelve FMUs, `--seconds` of simulated time in its steps of
0.5 ms, a row kept of every twentieth. Resident memory, open descriptors, threads and entries of the temporary folder are
looked at all along. Grown is what the second half has more than the first at most; exit code 1 where that is more than
ALLOWED. --docs keeps what was seen in docs/reliability/soak.json, in place of the soak of that name before it, and makes of all
that is there docs/reliability/soak.svg and the table in docs/reliability.md, each as it ends. Needs gcc.
"""

from __future__ import annotations

import argparse
import gc
import json
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
from selflock.master import load, run

sys.path.append(str(Path(__file__).parents[1] / "tests" / "native"))
from pack import pack

FOUR_DRIVES = Path(__file__).parents[1] / "study" / "four_drives.toml"
LOOKS = 60
KEPT = tally.PAGE.parent / "reliability" / "soak.json"
NAMES = ("native", "ours", "robot")
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
    system = load(FOUR_DRIVES)
    system.components["robot"].start["track"] = "belt"
    system.run.interval = 0.01
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


def told(name: str, unit: str, seen: Seen, minutes: float) -> list[str]:
    """The soak's row in the table."""
    cells = [f"{max(row[k + 1] for row in seen):.0f} ({grew:+.1f})" for k, grew in enumerate(grown(seen))]
    return [name, f"{seen[-1][0]:.0f} {unit}", f"{minutes:.1f}", *cells]


def document(name: str, unit: str, seen: Seen, minutes: float) -> None:
    """Keep a soak, and make the table and the figure of all that are kept."""
    whole = json.loads(KEPT.read_text()) if KEPT.exists() else {}
    whole[name] = {"unit": unit, "minutes": minutes, "seen": seen}
    kept = {each: whole[each] for each in NAMES if each in whole}
    KEPT.write_text("{\n" + ",\n".join(f'"{each}": {json.dumps(known)}' for each, known in kept.items()) + "\n}\n")
    rows = [told(each, **known) for each, known in kept.items()]
    heads = ("soak", "of", "minutes of processor", *(f"{word}: most (grown)" for word in WORDS))
    tally.put("soak", tally.table(heads, rows))
    draw({each: (known["unit"], known["seen"]) for each, known in kept.items()}, KEPT.with_suffix(".svg"))


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
    figure.savefig(path, metadata={"Date": None})


def main() -> None:
    options = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    options.add_argument("--runs", type=int, default=100_000)
    options.add_argument("--seconds", type=float, default=3600.0)
    options.add_argument("--only", nargs="*", default=list(NAMES))
    options.add_argument("--docs", action="store_true")
    chosen = options.parse_args()
    bad = False
    with tempfile.TemporaryDirectory() as room:
        scratch = Path(room) / "tmp"
        scratch.mkdir()
        os.environ["TMPDIR"] = tempfile.tempdir = str(scratch)
        for name, unit, soak in soaks(max(LOOKS, chosen.runs), chosen.seconds, scratch):
            if name not in chosen.only:
                continue
            began = time.process_time()
            seen = soak()
            minutes = (time.process_time() - began) / 60.0
            bad |= any(grew > most for grew, most in zip(grown(seen), ALLOWED))
            print(*told(name, unit, seen, minutes), sep=" | ", flush=True)
            if chosen.docs:
                document(name, unit, seen, minutes)
    sys.exit(bad)


if __name__ == "__main__":
    main()
