"""Many runs of a system over many parameter values, on one machine or a cluster, resumable.

    from selflock.sweep import sweep, report
    sweep("examples/friction_chart.toml", "out/chart", progress=True)
    report("out/chart")

`map_runs` is the engine below, for any function.
"""

from pathlib import Path

from selflock.rooms import called_as

from .campaign import SweepResult, sweep
from .engine import map_runs
from .errors import Interrupted, SweepError

__all__ = ["Interrupted", "SweepError", "SweepResult", "map_runs", "report", "sweep"]


def report(folder: str | Path) -> Path:
    """Draw what the runs in a sweep's folder say; gives the path of report.html."""
    from .page import report  # workers draw nothing

    return report(folder)


called_as(__name__)
