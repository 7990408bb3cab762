"""Many runs, and the published study, which is eight."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from .options import AllowCode, Isolate, Out, Unlimited
from .terminal import console, say

app = typer.Typer()


@app.command()
def sweep(
    study_file: Annotated[Path, typer.Argument(metavar="STUDY", help="A sweep description (.toml).")],
    out: Out = Path("out/sweep"),
    workers: Annotated[int | None, typer.Option(help="Processes on this machine; all cores when not given.")] = None,
    scheduler: Annotated[str | None, typer.Option(help="Address of an existing Dask scheduler.")] = None,
    allow_code: AllowCode = False,
    unlimited: Unlimited = False,
    isolate: Isolate = False,
) -> None:
    """Run a system over many parameter values; go on where an interrupted sweep stopped.

    Exit code: 0, or 2 for bad input or where every run failed.
    """
    from selflock.sweep import sweep as run_sweep

    result = run_sweep(
        study_file,
        out,
        workers=workers,
        scheduler=scheduler,
        progress=True,
        allow_code=allow_code,
        unlimited=unlimited,
        isolate=isolate,
    )
    say(result.summary())
    if len(result.failed) == len(result.table):  # whoever goes on with its figures has none
        raise typer.Exit(2)


@app.command("sweep-report")
def sweep_report(folder: Annotated[Path, typer.Argument(metavar="DIR", help="The folder of a sweep.")]) -> None:
    """Draw the plots a designer looks at."""
    from selflock.sweep import report

    say(f"Open {report(folder)}")


@app.command()
def study(out: Out = Path("out/study")) -> None:
    """Reproduce the published study: eight runs, its figures, its claims, one report."""
    from selflock.study import study as run_study

    result = run_study(out, progress=True)
    console.print(result.table())
    say(f"Open {result.report}")
