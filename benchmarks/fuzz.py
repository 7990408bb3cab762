"""Strangers' files and calls by the thousand: an answer or one message each, or it is told here.

    python -m benchmarks.fuzz --minutes 20 [--kinds system rig] [--seed 1] [--out out/fuzz] [--docs]

What is drawn, and what is held against it, is in tests/fuzz; quick kinds (tests/fuzz/quick.py) come to thousands a second.
Each kind has its share of the processor's time, which is what bounds a campaign: --inputs ends a quick kind sooner. --docs adds what was
counted to docs/reliability.json, and puts the table of all campaigns into docs/reliability.md. Findings are told once for
each place in the sources, with the seed that draws them again, and kept in the folder.
"""

from __future__ import annotations

import argparse
import logging
import os
import secrets
import sys
import tempfile
import traceback
import warnings
from collections import Counter
from pathlib import Path

from hypothesis import HealthCheck, Phase, given, seed, settings
from hypothesis import strategies as st
from rich.console import Console
from rich.table import Table

ROOT = Path(__file__).parents[1]
sys.path[:0] = [str(ROOT / "tests" / "fuzz"), str(ROOT / "tests" / "hosts")]
import inputs
import quick
import sequences

from benchmarks import tally

BATCH = 200  # draws of one seed
COLUMNS = ("inputs", "answered", "refused", "found", "places")


class Over(KeyboardInterrupt):
    """The time is up; hypothesis lets it pass."""


def spent() -> float:
    """Processor time of this process, and of those that it waited for, s: a busy machine changes nothing of a campaign."""
    return sum(os.times()[:4])


def place(error: BaseException) -> str:
    """Where in our sources an exception came from, and what it is."""
    frames = traceback.extract_tb(error.__traceback__)
    ours = [
        frame
        for frame in frames
        if str(ROOT) in frame.filename and "/tests/" not in frame.filename and ".venv" not in frame.filename
    ]
    frame = (ours or frames)[-1]
    text = str(error).splitlines()[0][:80] if isinstance(error, AssertionError) and str(error) else ""
    return f"{type(error).__name__} {text} {Path(frame.filename).relative_to(ROOT) if ours else Path(frame.filename).name}:{frame.lineno}"


def campaign(ask, number: int, until: float, room: Path, told: Counter, found: dict[str, str]) -> None:
    """Draws of one kind until it is time."""
    while spent() < until:
        number += 1
        now = number  # for the draws of this batch

        @seed(number)
        @settings(
            max_examples=BATCH, deadline=None, database=None, phases=[Phase.generate], suppress_health_check=list(HealthCheck)
        )
        @given(st.data())
        def batch(data):
            if spent() >= until:
                raise Over
            try:
                told[ask(data, room)] += 1
            except (Exception, inputs.Hung) as error:
                told["found"] += 1
                text = f"seed {now}\n" + "".join(traceback.format_exception(error))
                found.setdefault(place(error), text)
                for path in room.iterdir():  # what a failure left
                    os.system(f"rm -rf '{path}'")

        try:
            batch()
        except Over:
            return


def quickly(kind: str, first: int, most: int, until: float, room: Path, told: Counter, found: dict[str, str]) -> None:
    """Inputs of a quick kind until it is time, or so many."""
    for number in range(most):
        if spent() >= until:
            return
        try:
            told[quick.ask(kind, f"{first} {number}", room)] += 1
        except (Exception, inputs.Hung) as error:
            told["found"] += 1
            found.setdefault(place(error), f"quick, {first} {number}\n" + "".join(traceback.format_exception(error)))


def main() -> None:
    kinds = {kind: lambda data, room, kind=kind: inputs.ask(kind, data, room) for kind in inputs.KINDS} | sequences.kinds()
    options = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    options.add_argument("--minutes", type=float, default=1.0)
    options.add_argument("--kinds", nargs="*", default=[*quick.KINDS, *kinds])
    options.add_argument("--inputs", type=int, default=10**9, help="of each quick kind, at most")
    options.add_argument("--seed", type=int)
    options.add_argument("--docs", action="store_true")
    options.add_argument("--out", type=Path, default=Path("out/fuzz"))
    chosen = options.parse_args()
    chosen.out.mkdir(parents=True, exist_ok=True)
    first = secrets.randbits(31) if chosen.seed is None else chosen.seed
    logging.disable(logging.CRITICAL)
    warnings.simplefilter("ignore")
    table = Table("kind", *COLUMNS, title=f"seed {first}")
    counts: dict[str, dict[str, int]] = {}
    for kind in chosen.kinds:
        told: Counter = Counter()
        found: dict[str, str] = {}
        with tempfile.TemporaryDirectory() as room:
            until = spent() + 60.0 * chosen.minutes / len(chosen.kinds)
            if kind in quick.KINDS:
                quickly(kind, first, chosen.inputs, until, Path(room), told, found)
            else:
                campaign(kinds[kind], first, until, Path(room), told, found)
        counts[kind] = {"inputs": sum(told.values()), **told, "places": len(found)}
        table.add_row(kind, *(str(counts[kind].get(word, 0)) for word in COLUMNS))
        for number, (where, text) in enumerate(found.items()):
            print(f"{kind}: {where}", flush=True)
            (chosen.out / f"{kind}_{number}.txt").write_text(f"{where}\n{text}")
    Console().print(table)
    if chosen.docs:
        whole = tally.add("fuzz", counts)
        rows = [(kind, *(words.get(word, 0) for word in COLUMNS)) for kind, words in whole.items()]
        total = [sum(words.get(word, 0) for words in whole.values()) for word in COLUMNS]
        tally.put("fuzz", tally.table(("kind", *COLUMNS), [*rows, ("all", *total)]))


if __name__ == "__main__":
    main()
