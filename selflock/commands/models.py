"""Any FMU system beside logs: its numbers fitted, what it lacks named."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from .options import AllowCode, Isolate, MaxTime, Out
from .terminal import say

app = typer.Typer()


@app.command()
def calibrate(
    rig: Annotated[
        Path, typer.Argument(help="Rig file (.toml): the system, what the columns are, and under [calibrate] what is fitted.")
    ],
    logs: Annotated[list[Path], typer.Argument(help="Measured logs; docs/rig.md has the forms.")],
    test: Annotated[
        list[Path] | None, typer.Option("--test", help="A log to hold out for telling the error; may be repeated.")
    ] = None,
    out: Out = Path("out/calibrate"),
    starts: Annotated[int | None, typer.Option(help="Fits from so many places.")] = None,
    seed: Annotated[int, typer.Option(help="Of the places from which fits start.")] = 0,
    workers: Annotated[int, typer.Option(help="Processes for the fits from the starts; 0: all in this one.")] = 0,
    scheduler: Annotated[str | None, typer.Option(help="Address of an existing Dask scheduler.")] = None,
    allow_code: AllowCode = False,
    max_time: MaxTime = None,
    isolate: Isolate = False,
) -> None:
    """Fit parameters and start values of any FMU system to logs, and tell what the logs say of each."""
    from selflock.diagnosis import calibrate as run_calibration

    spread = {}
    if workers or scheduler:
        from selflock.sweep import map_runs

        def on_workers(function, items, context):
            return map_runs(function, items, context=context, workers=workers, scheduler=scheduler)

        spread = {"spread": on_workers}
    result = run_calibration(
        rig,
        logs,
        test=test or [],
        out=out,
        progress=True,
        starts=starts,
        seed=seed,
        allow_code=allow_code,
        max_time=max_time,
        isolate=isolate,
        **spread,
    )
    say(result.summary(), highlight=False)


@app.command()
def name(
    rig: Annotated[
        Path,
        typer.Argument(help="Rig file (.toml): the system, what the columns are, and under [calibrate] what is fitted anyway."),
    ],
    logs: Annotated[list[Path], typer.Argument(help="Measured logs; docs/rig.md has the forms.")],
    test: Annotated[list[Path] | None, typer.Option("--test", help="A log to hold out; may be repeated.")] = None,
    out: Out = Path("out/naming"),
    starts: Annotated[int, typer.Option(help="Fits of the base from so many places.")] = 2,
    seed: Annotated[int, typer.Option(help="Of these places, and of the draws that measure chance.")] = 0,
    kind: Annotated[
        list[str] | None, typer.Option("--kind", help="parameter, path, event or law; may be repeated; all when not given.")
    ] = None,
    allow_code: AllowCode = False,
    max_time: MaxTime = None,
    isolate: Isolate = False,
) -> None:
    """Name what any FMU system lacks beside logs: a number, a path, an event, a law or a curve, and extend the system by it.

    Exit code: 0 it has a name, 3 nothing is missing, 4 something is missing but has none, 2 bad input.
    """
    from selflock.diagnosis import name as run_naming

    more = {"kinds": kind} if kind else {}
    result = run_naming(
        rig,
        logs,
        test=test or [],
        out=out,
        progress=True,
        starts=starts,
        seed=seed,
        allow_code=allow_code,
        max_time=max_time,
        isolate=isolate,
        **more,
    )
    say(result.summary(), highlight=False)
    raise typer.Exit(result.exit_code)
