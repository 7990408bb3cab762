"""The answer of a diagnosis, of a drive or of a system of FMUs."""

from __future__ import annotations

from pathlib import Path

from .data.rig import Rig
from .data.sanity import box
from .judge.result import Diagnosis
from .pipeline.run import diagnose_runs, gather
from .progress import Tell
from .residuals.laws import check_names
from .search.kept import Kept


def answer(
    rig: Rig, logs, test, out: Path | None, tell: Tell, seed: int, anyway: bool, kept: Kept | None, search: bool = True
) -> Diagnosis:
    """The diagnosis of a rig, under its `laws`; the arguments are those of `diagnose`."""
    if rig.system is not None:
        from .systems.system import diagnose_system  # with all that runs a system, which a drive does not need

        return diagnose_system(rig, logs, test, out, tell, seed, kept, search, anyway)
    check_names(rig)
    tell("reading", 0.0)
    runs, faults, held = gather(rig, logs, test)
    sanity = box(rig, runs)
    sanity.refuse(rig, anyway)
    if rig.effects is not None:  # which takes longer than reading did, where a file has changed
        tell("the rig's effects, compiled with ours", 0.0)
    return diagnose_runs(rig, runs, faults, held, out, tell, seed, sanity=sanity, kept=kept, search=search)
