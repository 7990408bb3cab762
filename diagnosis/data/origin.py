"""Where a diagnosis comes from: which unit of a fleet, when its logs were recorded and who says so, which bytes they are."""

from __future__ import annotations

from collections.abc import Sequence
from datetime import datetime
from importlib.metadata import version
from pathlib import Path
from typing import Any

from selflock.fmus.cache import sha256

from .log import MeasuredRun
from .rig import Rig


def about(rig: Rig, runs: Sequence[MeasuredRun], held: Sequence[bool]) -> dict[str, Any]:
    """What diagnosis.json says under `about`: {rig, unit, recorded, told_by, version, logs: [{log, sha256, test}]}.

    recorded: ISO 8601 of the first log; told_by: who says that, "rig", "name" (of a file or folder of a fleet), "log" (its own
    time stamps) or "file" (when it was last changed).
    """
    logs: dict[str, dict[str, Any]] = {}
    for run, is_held in zip(runs, held):
        if run.source and run.source not in logs and Path(run.source).is_file():
            logs[run.source] = {"log": run.log, "sha256": sha256(Path(run.source)), "test": is_held}
    recorded, told_by = _recorded(rig, runs)
    return {
        "rig": rig.name,
        "unit": rig.unit,
        "recorded": recorded,
        "told_by": told_by,
        "version": version("selflock"),
        "logs": list(logs.values()),
    }


def _recorded(rig: Rig, runs: Sequence[MeasuredRun]) -> tuple[str, str]:
    if rig.recorded:
        return rig.recorded, rig.recorded_by
    if stamps := [run.began for run in runs if run.began]:
        return min(stamps), "log"
    times = [Path(run.source).stat().st_mtime for run in runs if run.source and Path(run.source).is_file()]
    return (datetime.fromtimestamp(min(times)).isoformat(timespec="seconds"), "file") if times else ("", "")
