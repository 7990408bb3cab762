"""A sweep from its description to its folder of results."""

from __future__ import annotations

import json
import re
from collections import Counter
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

import pandas as pd

from selflock import master
from selflock.fmus.shown import visible

from .check import check
from .engine import map_runs
from .runs import Bench, run_one
from .store import digest
from .study import Study, read
from .work import RUNS, fingerprint

HOW = ("allow_code", "unlimited", "isolate")  # a system is run, which changes no number


@dataclass
class SweepResult:
    """A finished sweep."""

    folder: Path
    study: Study
    table: pd.DataFrame  # a row for each run: parameters, status, reason, figures

    @property
    def failed(self) -> pd.DataFrame:
        return self.table[self.table["status"] == "failed"]

    def summary(self) -> str:
        lines = [f"{self.study.name}: {len(self.table)} runs, {len(self.failed)} failed; {self.folder / 'runs.parquet'}"]
        for reason, count in Counter(cause(reason) for reason in self.failed["reason"]).most_common():
            lines.append(f"  {count} failed: {reason}")
        good = self.table[self.table["status"] == "ok"]
        for one in self.study.record:
            if len(good):
                unit = f" {one.unit}" if one.unit else ""
                lines.append(f"  {one.name}: {good[one.name].min():.6g} to {good[one.name].max():.6g}{unit}")
        lines.append(f"  plots: selflock sweep-report {self.folder}")
        return "\n".join(lines)


def sweep(
    study: str | Path | Study,
    out: str | Path,
    workers: int | None = None,
    scheduler: str | None = None,
    progress: bool = False,
    allow_code: bool = False,
    unlimited: bool = False,
    isolate: bool = False,
) -> SweepResult:
    """Run a study into the folder `out`, or go on with it there.

    workers: processes on this machine; all cores when not given, 0 for none but this one.
    scheduler: address of an existing Dask scheduler, whose workers are used instead.
    allow_code: parts of other packages may be loaded, here and by the workers (docs/security.md).
    unlimited: FMUs and SSPs may be of any size.
    isolate: every FMU runs in a process of its own with limits and without rights.
    """
    if not isinstance(study, Study):
        study = read(study)
    system = master.load(study.system, allow_code, unlimited, isolate)
    check(study, system)
    bench = Bench(system, study.record, study.stop, study.table)
    about = {
        "study": study.about,
        "notes": {"name": study.name, "description": study.data.get("description", ""), "data": study.data},
        "system": digest(json.loads(json.dumps({**asdict(bench.system), **dict.fromkeys(HOW)}, default=str))),
        "fmus": bench.versions,
        "versions": fingerprint(*RUNS),
    }
    version = digest(about["system"], bench.versions, about["versions"])[:16]
    rows = map_runs(
        run_one,
        study.items,
        context=bench,
        folder=out,
        about=about,
        columns=lambda item: {**item["parameters"], "version": version},
        workers=workers,
        scheduler=scheduler,
        progress=progress,
        title=visible(study.name),
    )
    return SweepResult(Path(out), study, pd.DataFrame(rows))


def cause(reason: Any) -> str:
    """A failed run's reason without what is different from run to run."""
    head, _, rest = str(reason).partition("\n")
    said = re.search(r"(?:Error|Fatal): (.*)", rest)
    text = f"{head.split(' at t =')[0]}: {said[1]}" if said else head.split(" at t =")[0]
    return re.sub(r"-?\d+\.?\d*(?:e[-+]?\d+)?", "…", text)
