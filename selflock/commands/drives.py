"""Measured drives: from a log to its cause, the next run to record, and many drives over time."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated, NoReturn

import typer

from selflock.fmus.errors import SelflockError
from selflock.fmus.shown import visible

from .options import AllowCode, Anyway, Isolate, MaxTime, Out
from .terminal import console, say

app = typer.Typer()


rig_app = typer.Typer(no_args_is_help=True, help="Rig files: what the columns of a log are.")
app.add_typer(rig_app, name="rig")


@rig_app.command("init")
def rig_init(
    logs: Annotated[
        list[Path],
        typer.Argument(help="Raw logs of one drive: text, .parquet, .mat, .h5, .json, .npy, .npz, .xlsx."),
    ],
    out: Annotated[Path, typer.Option("--out", "-o", help="The rig file to write; nothing is overwritten.")] = Path("rig.toml"),
    only: Annotated[str, typer.Option(help="Of a log with several drives: what the names of one's columns hold.")] = "",
    columns: Annotated[
        str,
        typer.Option(
            help="Of a log that does not say it: what its columns are, in their order, as 'time [ms], load angle [deg], -'; - for what does "
            "not matter."
        ),
    ] = "",
) -> None:
    """Guess what a raw log's columns are; write a commented rig."""
    from selflock.diagnosis import rig_init as begin

    console.print(visible(begin(logs, out, only, columns).summary()), highlight=False, soft_wrap=True)


@app.command()
def replay(
    rig: Annotated[Path, typer.Argument(help="Rig file (.toml): what the columns of the log are.")],
    log: Annotated[Path, typer.Argument(help="Measured log; docs/rig.md has the forms.")],
    out: Out = Path("out/replay"),
    allow_code: AllowCode = False,
    anyway: Anyway = False,
    isolate: Isolate = False,
) -> None:
    """Impose a measured motion on the simulation and draw what it computes over what was measured."""
    from selflock.diagnosis import replay as run_replay

    say(run_replay(rig, log, out, allow_code, anyway, isolate).summary())


@app.command()
def diagnose(
    rig: Annotated[
        Path, typer.Argument(help="Rig file (.toml): what the columns of the logs are, and what is known of the drive.")
    ],
    logs: Annotated[list[Path] | None, typer.Argument(help="Measured logs; docs/rig.md has the forms.")] = None,
    test: Annotated[
        list[Path] | None, typer.Option("--test", help="A log to hold out for measuring the gain; may be repeated.")
    ] = None,
    fleet: Annotated[
        Path | None,
        typer.Option(
            "--fleet", help="Folder of many logs, in it a folder for each unit: one diagnosis for each (docs/track.md)."
        ),
    ] = None,
    out: Annotated[
        Path | None, typer.Option("--out", "-o", help="Folder to write to; out/diagnosis or out/fleet when not given.")
    ] = None,
    workers: Annotated[int | None, typer.Option(help="Of --fleet: processes on this machine; all cores when not given.")] = None,
    scheduler: Annotated[str | None, typer.Option(help="Of --fleet: address of an existing Dask scheduler.")] = None,
    search: Annotated[
        bool, typer.Option("--search/--no-search", help="Of --fleet: name causes, or only fit what the rig calls uncertain.")
    ] = True,
    allow_code: AllowCode = False,
    anyway: Anyway = False,
    max_time: MaxTime = None,
    isolate: Isolate = False,
) -> None:
    """Name what the simulation gets wrong, extend the model, measure the gain.

    Exit code: 0 a cause was found, 3 nothing is missing, 4 something is missing but none of the known causes, 2 bad input.
    With --fleet: 0 each log has its answer, 2 some have none; it goes on where it was stopped, and with new logs.
    """
    if fleet is not None:
        if logs or test or max_time is not None:
            raise SelflockError("--fleet finds its logs itself: leave out logs, --test and --max-time.")
        _diagnose_fleet(rig, fleet, out or Path("out/fleet"), workers, scheduler, allow_code, anyway, search, isolate)
    if workers is not None or scheduler is not None or not search:
        raise SelflockError("--workers, --scheduler and --no-search are for many logs: give --fleet FOLDER.")
    from selflock.diagnosis import diagnose as run_diagnosis

    result = run_diagnosis(
        rig,
        logs or [],
        test=test or [],
        out=out or Path("out/diagnosis"),
        progress=True,
        allow_code=allow_code,
        anyway=anyway,
        max_time=max_time,
        isolate=isolate,
    )
    say(result.summary())
    raise typer.Exit(result.exit_code)


def _diagnose_fleet(rig: Path, folder: Path, out: Path, workers: int | None, scheduler: str | None, *how: bool) -> NoReturn:
    from functools import partial

    from selflock.diagnosis import diagnose_fleet
    from selflock.sweep import map_runs

    spread = partial(map_runs, workers=workers, scheduler=scheduler, progress=True)
    result = diagnose_fleet(rig, folder, out, spread, *how)
    say(result.summary(), highlight=False)
    raise typer.Exit(result.exit_code)


@app.command()
def plan(
    diagnosis: Annotated[
        Path, typer.Argument(metavar="DIR", help="The folder that selflock diagnose, or selflock name, wrote to.")
    ],
    limits: Annotated[
        list[str] | None,
        typer.Option(
            "--limits",
            help="angle=LOW:HIGH, speed=…, acceleration=…, voltage=…, current=…, duration=…: of the output side, SI; may be repeated. "
            "Of a naming: COMPONENT.VARIABLE=LOW:HIGH of an input, duration=…. As far as the logs went where not given.",
        ),
    ] = None,
    out: Out = Path("out/plan"),
    rig: Annotated[Path | None, typer.Option(help="The rig of that diagnosis, where it was moved.")] = None,
    seed: Annotated[int, typer.Option(help="Of the runs that are tried.")] = 0,
    allow_code: AllowCode = False,
) -> None:
    """The run to record next: set-points, or inputs, that tell apart what a diagnosis, or a naming, could not."""
    from selflock.diagnosis import plan as run_plan

    given = {}
    for pair in (one for text in limits or [] for one in text.split()):
        key, equals, value = pair.partition("=")
        if not equals:
            raise SelflockError(f"--limits {pair}: write it as name=value, such as speed=2 or angle=-1:1.")
        given[key] = value
    say(run_plan(diagnosis, given, out, rig, progress=True, seed=seed, allow_code=allow_code).summary(), highlight=False)


@app.command()
def track(
    folders: Annotated[
        list[Path], typer.Argument(metavar="DIR...", help="Folders that selflock diagnose wrote to, or above such.")
    ],
    page: Annotated[Path, typer.Option("--out", "-o", help="The page to write; a table of all numbers goes beside it.")] = Path(
        "track.html"
    ),
    since: Annotated[str, typer.Option(help="A date, as after a repair: what was recorded before it is left out.")] = "",
) -> None:
    """Say which numbers of which unit change beyond chance, over all diagnoses of a fleet or of one drive.

    Exit code: 0 none does, 5 some do, 2 bad input.
    """
    from selflock.diagnosis import track as run_track

    result = run_track(folders, page, since)
    console.print(visible(result.summary()), highlight=False, soft_wrap=True)
    raise typer.Exit(result.exit_code)


@app.command()
def chance(
    rig: Annotated[Path, typer.Argument(help="Rig file (.toml), as for diagnose.")],
    logs: Annotated[list[Path], typer.Argument(help="Measured logs; docs/rig.md has the forms.")],
    test: Annotated[list[Path] | None, typer.Option("--test", help="A log that diagnose holds out; may be repeated.")] = None,
    draws: Annotated[int, typer.Option(help="Simulated logs; more may be asked for later.")] = 100,
    seed: Annotated[int, typer.Option(help="Of the draws.")] = 0,
    out: Out = Path("out/chance"),
    workers: Annotated[int | None, typer.Option(help="Processes on this machine; all cores when not given.")] = None,
    scheduler: Annotated[str | None, typer.Option(help="Address of an existing Dask scheduler.")] = None,
) -> None:
    """Measure what the search of diagnose finds in simulated logs without effect; go on where an interrupted one stopped."""
    from functools import partial

    from selflock.diagnosis.pipeline.chance import chance as measure_chance
    from selflock.sweep import map_runs

    spread = partial(
        map_runs,
        sources=("selflock.diagnosis", "selflock.fmus"),
        growing=True,
        workers=workers,
        scheduler=scheduler,
        progress=True,
    )
    say(measure_chance(rig, logs, test or [], draws, seed, out, spread).summary())
