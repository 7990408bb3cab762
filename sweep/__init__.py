"""Many runs of a system over many parameter values, on one machine or a cluster, resumable.

    from sweep import sweep, report
    sweep("examples/friction_chart.toml", "out/chart", progress=True)
    report("out/chart")

`map_runs` is the engine below, for any function.
"""

from .campaign import SweepResult, sweep
from .engine import map_runs
from .errors import Interrupted, SweepError
from .report import report

__all__ = ["Interrupted", "SweepError", "SweepResult", "map_runs", "report", "sweep"]
