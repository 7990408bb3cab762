"""One diagnosis for each log of a fleet: on many processes, resumable, each answer a file of its own (docs/track.md)."""

from __future__ import annotations

import json
from collections import Counter
from collections.abc import Callable
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

from threadpoolctl import threadpool_limits

from selflock.fmus.cache import sha256

from .answered import answer
from .asked import asked, files, laws
from .data.rig import Rig
from .tracking.logs import logs_of
from .tracking.series import NAME

SOURCES = ("selflock.diagnosis", "selflock.fmus", "selflock.master")
"""The packages that decide an answer."""


@dataclass(frozen=True)
class Fleet:
    """What `diagnose_fleet` returns: a row for each log, with its answer or why there is none. Answers are below `folder`/logs."""

    folder: Path
    rows: list[dict[str, Any]]

    @property
    def failed(self) -> list[dict[str, Any]]:
        """Logs without an answer."""
        return [row for row in self.rows if row["status"] != "ok"]

    @property
    def exit_code(self) -> int:
        """Of `selflock diagnose --fleet`: 0 each log has its answer, 2 some have none."""
        return 2 if self.failed else 0

    def summary(self) -> str:
        """The answers in a few lines of text."""
        good = [row for row in self.rows if row["status"] == "ok"]
        units = len({row["unit"] for row in self.rows})
        verdicts = ", ".join(f"{count} {verdict}" for verdict, count in Counter(row["verdict"] for row in good).most_common())
        lines = [f"{len(good)} of {len(self.rows)} logs of {units} unit{'s' * (units > 1)} diagnosed: {verdicts or 'none'}"]
        for causes, count in Counter(row["causes"] for row in good if row["causes"]).most_common(8):
            lines.append(f"  {count} times {causes}")
        reasons = Counter(str(row["reason"]).replace(row["log"], "…") for row in self.failed)
        lines += [f"  {count} without an answer: {reason}" for reason, count in reasons.most_common(5)]
        return "\n".join([*lines, f"  see changes: selflock track {self.folder}"])

    def __str__(self) -> str:
        return self.summary()


@dataclass(frozen=True)
class _Work:
    """What every log of a fleet needs."""

    rig: Rig
    root: Path
    anyway: bool
    search: bool


@threadpool_limits.wrap(limits=1)
def _one(work: _Work, item: dict[str, str]) -> tuple[dict[str, Any], dict[str, bytes]]:
    """The diagnosis of a log: its row, and its file. Its draws follow from its bytes, so that it is the same anywhere."""
    rig = replace(work.rig, unit=item["unit"])
    if item["recorded"]:
        rig = replace(rig, recorded=item["recorded"], recorded_by="name")
    with laws(rig):
        seed = int(item["sha256"][:8], 16)
        found = answer(rig, [work.root / item["log"]], (), None, lambda *_: None, seed, work.anyway, None, work.search)
    row = {"verdict": found.verdict, "causes": ", ".join(cause.label for cause in found.causes)}
    return row, {f"logs/{item['log']}/{NAME}": (json.dumps(found.data(), indent=2) + "\n").encode()}


def diagnose_fleet(
    rig: str | Path,
    folder: str | Path,
    out: str | Path,
    spread: Callable[..., list[dict[str, Any]]],
    allow_code: bool = False,
    anyway: bool = False,
    search: bool = True,
    isolate: bool = False,
) -> Fleet:
    """Diagnose every log of a folder by itself; what has its answer in `out` already is not made again.

    folder: the logs, in a folder for each unit, or as the rig's [fleet] logs says (docs/track.md).
    out: gets a diagnosis.json for each log, logs/<path of the log>/diagnosis.json, and a row for each, runs.parquet.
    spread: selflock.sweep.map_runs, or it with workers, scheduler or progress given by functools.partial.
    allow_code, anyway, isolate: as of `diagnose`.
    search: for causes, where what the rig calls uncertain does not explain a log; else that is fitted alone, and the answer is "none"
    or "unknown".

    Raises DataError where no log is found; what is wrong with single logs is in the rows.
    """
    root, given = Path(folder).resolve(), asked(rig, allow_code, isolate)
    logs = logs_of(root, given.pattern)
    items = [{"log": one.path, "unit": one.unit, "recorded": one.recorded, "sha256": sha256(root / one.path)} for one in logs]
    decides = [sha256(path) for path in files(given, [rig], [])]
    rows = spread(
        _one,
        items,
        context=_Work(given, root, anyway, search),
        folder=out,
        about={"rig": decides, "anyway": anyway, "search": search},
        columns=lambda item: {"log": item["log"], "unit": item["unit"]},
        sources=SOURCES,
        growing=True,
        title="logs",
    )
    return Fleet(Path(out), rows)
