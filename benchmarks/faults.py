"""Commands killed at random instants: what was finished is there, whole and once; what goes on equals what was not killed.

    python -m benchmarks.faults --kills 200 [--areas run sweep] [--seed 1] [--docs]

Each area's command is run once to its end. Then it is begun, and at a random instant of its work killed by SIGINT, SIGTERM or
SIGKILL, or its disk is full from then on; it is looked at, and given again, perhaps killed again, until it ends: then every
byte, or every number, must be that of the run that nobody killed. Where it has workers, one of them is killed as well, which
the command must bear. Nothing may be left in the temporary folder, or, after SIGKILL, after the next command.

A disk that is full: from then on the kernel lets no file of the process grow (EFBIG), as far as that exists here (Linux).
--docs adds what was counted to docs/reliability.json, and puts the table of all into docs/reliability.md.
"""

from __future__ import annotations

import argparse
import os
import random
import resource
import secrets
import signal
import subprocess
import sys
import tempfile
import time
from collections import Counter
from pathlib import Path

import psutil
from rich.console import Console
from rich.table import Table

from benchmarks import tally
from benchmarks.kills import AREAS, ENDS, FILES, FULL, WORKER, Area, Run

COLUMNS = ("kills", *ENDS, WORKER, "with something kept", "ended", "failed")
AGAIN = 0.4  # share of what goes on that is killed again
PATIENCE = 600.0  # s that a command may take on a busy machine

AROUND = """
import signal
signal.signal(signal.SIGINT, signal.SIG_DFL)  # until somebody listens
import sys
from selflock import cli
from selflock.ending import Watched
from selflock.fmus.errors import SelflockError
with Watched(cli.errors, last=True) as ending:
    print("begun", flush=True)
    try:
{body}
    except (KeyboardInterrupt, SelflockError, OSError) as error:
        sys.exit(str(error))
"""


def begin(area: Area, out: Path, scratch: Path) -> subprocess.Popen:
    """The command's process, which listens: what Python does before is not asked about."""
    lines = area.python.replace("cli.app()", "sys.exit(cli.app(standalone_mode=False))").replace("; ", "\n").splitlines()
    code = AROUND.format(body="\n".join(f"        {line}" for line in lines))
    process = subprocess.Popen(
        [sys.executable, "-c", code, str(out)],
        stdout=subprocess.PIPE,
        stderr=subprocess.STDOUT,
        env={**os.environ, "TMPDIR": str(scratch), "COLUMNS": "200"},
        start_new_session=True,
    )
    assert process.stdout is not None and process.stdout.readline() == b"begun\n", "it did not begin"
    return process


def _worker(process: subprocess.Popen, rng: random.Random) -> bool:
    """Kill one of the command's workers, if it has any by now."""
    nested = []
    for child in psutil.Process(process.pid).children(recursive=True):
        try:
            nested += [child] if "spawn_main" in " ".join(child.cmdline()) else []
        except psutil.Error:  # it has just ended
            pass
    if nested:
        rng.choice(nested).kill()
    return bool(nested)


def killed(area: Area, out: Path, scratch: Path, after: float, end: str, rng: random.Random) -> tuple[bool, str]:
    """The command, and what befalls it after so many seconds: whether it was still at work, and what it said."""
    process = begin(area, out, scratch)
    try:
        said, _ = process.communicate(timeout=after)
        return False, said.decode()
    except subprocess.TimeoutExpired:
        hit = True
        if end == FULL:
            _, most = resource.prlimit(process.pid, resource.RLIMIT_FSIZE)
            resource.prlimit(process.pid, resource.RLIMIT_FSIZE, (0, most))
        elif end == WORKER:
            hit = _worker(process, rng)
        elif end == "SIGINT":
            os.killpg(process.pid, signal.SIGINT)  # as a terminal does
        else:
            process.send_signal(signal.Signals[end])
        said, _ = process.communicate(timeout=PATIENCE)
        return hit and (end != FULL or process.returncode != 0), said.decode()


def campaign(area: Area, kills: int, rng: random.Random, told: Counter, failures: list[str]) -> None:
    scratch, reference = area.room / "tmp", area.room / "reference"
    scratch.mkdir()
    reference.mkdir()
    process = begin(area, reference, scratch)
    began = time.monotonic()
    said, _ = process.communicate(timeout=PATIENCE)
    assert process.returncode == 0, said.decode()
    length = time.monotonic() - began
    case = 0
    while told["kills"] < kills:
        case += 1
        out = area.room / f"case_{case}"
        if isinstance(area, FILES):
            out.mkdir()
        had = times = 0
        while True:
            last = told["kills"] >= kills or (times > 0 and rng.random() > AGAIN)
            end = rng.choice(area.ends)
            began, before = time.monotonic(), set(scratch.iterdir())  # of SIGKILL: the next that needs a folder takes it away
            hit, said = killed(area, out, scratch, PATIENCE if last else rng.uniform(0.0, 1.1 * length), end, rng)
            try:
                told["kills"] += hit
                told[end] += hit
                assert "Traceback" not in said, said[-1500:]
                if not hit or end == WORKER:
                    if not (hit or times):  # the first of all also filled caches
                        length = min(length, time.monotonic() - began)
                    area.compare(out, reference)
                    told["ended"] += 1
                    break
                there = area.look(out, reference)
                assert there >= had or isinstance(area, Run), f"{had} were there, now {there}"
                told["with something kept"] += there > 0
                had, times = there, times + 1
                left = set(scratch.iterdir()) - before
                assert end == "SIGKILL" or not left, f"left: {left}"
            except (AssertionError, OSError) as error:
                told["failed"] += 1
                failures.append(f"{area.name}, {end}: {error}; it said: {said[-1000:]}")
                break
    left = [path.name for path in scratch.iterdir()]
    if left:
        time.sleep(1.5)  # what was made in this very second is not swept up
        (area.room / "sweeps_up").mkdir()
        killed(area, area.room / "sweeps_up", scratch, PATIENCE, "SIGTERM", rng)
        if left := [path.name for path in scratch.iterdir()]:
            failures.append(f"{area.name}: left in the temporary folder: {left}")
            told["failed"] += 1


def main() -> None:
    options = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    options.add_argument("--kills", type=int, default=50)
    options.add_argument("--areas", nargs="*", default=list(AREAS))
    options.add_argument("--seed", type=int)
    options.add_argument("--docs", action="store_true")
    chosen = options.parse_args()
    seed = secrets.randbits(31) if chosen.seed is None else chosen.seed
    table = Table("area", *COLUMNS, title=f"seed {seed}")
    counts: dict[str, Counter] = {}
    failures: list[str] = []
    for name in chosen.areas:
        told: Counter = Counter()
        with tempfile.TemporaryDirectory() as room:
            campaign(
                AREAS[name](Path(room)), -(-chosen.kills // len(chosen.areas)), random.Random(f"{seed} {name}"), told, failures
            )
        counts[name] = told
        table.add_row(name, *(str(told[column]) for column in COLUMNS))
        print(f"{name}: {dict(told)}", flush=True)
    for failure in failures:
        print(failure)
    Console().print(table)
    if chosen.docs:
        whole = tally.add("kills", counts)
        rows = [(f"`{name}`", *(words.get(column, 0) for column in COLUMNS)) for name, words in whole.items()]
        total = [sum(words.get(column, 0) for words in whole.values()) for column in COLUMNS]
        tally.put("kills", tally.table(("command", *COLUMNS), [*rows, ("all", *total)]))
    sys.exit(bool(failures))


if __name__ == "__main__":
    main()
