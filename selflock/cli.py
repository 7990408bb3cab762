"""The command line. It knows all and holds no logic: every command is one Python call."""

from __future__ import annotations

import sys
from pathlib import Path
from typing import Annotated, Any, NoReturn

import typer
from rich.console import Console

from selflock import extras
from selflock.ending import Watched
from selflock.fmus.errors import Interrupted, SelflockError
from selflock.fmus.shown import visible
from selflock.verbose import Anywhere, listen


class Commands(Anywhere):
    """The commands; one that was stopped says what is kept, where click would say "Aborted!"."""

    def invoke(self, ctx: typer.Context) -> Any:  # type: ignore[override]
        try:
            return super().invoke(ctx)
        except KeyboardInterrupt as stopped:
            raise Interrupted(str(stopped) or "Stopped.") from None


app = typer.Typer(
    name="selflock",
    cls=Commands,
    no_args_is_help=True,
    add_completion=False,
    pretty_exceptions_enable=False,
    context_settings={"help_option_names": ["-h", "--help"]},
)
console = Console(markup=False, emoji=False)
errors = Console(stderr=True, soft_wrap=True, markup=False, emoji=False)

AllowCode = Annotated[
    bool,
    typer.Option("--allow-code", help="Load parts of other packages and effects of a rig: whoever wrote them runs code as you."),
]
Unlimited = Annotated[
    bool, typer.Option("--unlimited", help="Unpack FMUs and SSPs of any number of files and any size (docs/security.md).")
]
Isolate = Annotated[bool, typer.Option("--isolate", help="Run every FMU in a process of its own with limits and without rights.")]
Anyway = Annotated[bool, typer.Option("--anyway", help="Go on where the log and the rig contradict each other.")]
MaxTime = Annotated[
    float | None,
    typer.Option("--max-time", help="Seconds of wall time for all of it; rows or fits that there are by then are kept."),
]
Out = Annotated[Path, typer.Option("--out", "-o", help="Folder to write to; made if it is missing.")]


def say(text: object, highlight: bool | None = None) -> None:
    """Print what may hold names of strangers; a file or a pipe gets its lines as they are."""
    console.print(visible(text), highlight=highlight, soft_wrap=not console.is_terminal)


def _overrides(pairs: list[str]) -> dict[str, str]:
    """component.variable=value pairs as a dictionary; values stay text, the system knows their types."""
    settings = {}
    for pair in pairs:
        name, equals, value = pair.partition("=")
        if not equals or not name.strip():
            raise SelflockError(
                f"--set {pair}: write it as component.variable=value, such as rear_reducer.friction_kinetic=0.02."
            )
        settings[name.strip()] = value.strip()
    return settings


def _version(wanted: bool) -> None:
    if wanted:
        from selflock import __version__

        say(f"selflock {__version__}", highlight=False)
        raise typer.Exit


@app.callback()
def selflock(
    version: Annotated[bool, typer.Option("--version", callback=_version, is_eager=True, help="Print the version.")] = False,
    verbose: Annotated[
        int, typer.Option("--verbose", "-v", count=True, help="Tell what is done, on stderr; -vv: all of it.")
    ] = 0,
) -> None:
    """FMI 2.0 co-simulation of robot drives with self-locking gears, and the diagnosis of measured ones."""
    listen(verbose)


@app.command()
def build(
    out: Out = Path("out/fmus"),
    only: Annotated[
        list[str] | None, typer.Argument(help="Names of FMUs, such as Reducer Motor; all when none is given.")
    ] = None,
) -> None:
    """Pack the components as FMUs that run alone in any FMI 2.0 tool."""
    from selflock.packing import build as build_fmus

    for path in build_fmus(out, only):
        say(path)


@app.command()
def run(
    system: Annotated[
        Path, typer.Argument(help="A system file (.toml), a system structure (.ssp, .ssd or its folder) or one FMU (.fmu).")
    ],
    out: Annotated[
        Path | None, typer.Option("--out", "-o", help="Result file, .csv or .parquet; of X.fmu X_result.csv when not given.")
    ] = None,
    set_: Annotated[
        list[str] | None,
        typer.Option(
            "--set",
            help="component.variable=value, of one FMU variable=value, or a value of the system, ratio=80; may be repeated.",
        ),
    ] = None,
    input_: Annotated[
        Path | None, typer.Option("--input", help="Table (.csv, .parquet) with columns time and those of inputs, by name.")
    ] = None,
    stop: Annotated[float | None, typer.Option(help="Stop time in s.")] = None,
    step: Annotated[float | None, typer.Option(help="Communication step in s; the system's own when not given.")] = None,
    algorithm: Annotated[
        str | None, typer.Option(help="gauss-seidel, jacobi or iterated; the system's own when not given.")
    ] = None,
    tolerance: Annotated[
        float | None, typer.Option(help="Relative, of the FMUs' own solvers; the system's or the FMUs' own when not given.")
    ] = None,
    interface: Annotated[
        str | None, typer.Option(help="Of one FMU: cs (co-simulation), me (model exchange) or se; cs where it has that.")
    ] = None,
    allow_code: AllowCode = False,
    unlimited: Unlimited = False,
    isolate: Isolate = False,
    page: Annotated[Path | None, typer.Option("--view", help="Write a page to look at the run, too, such as run.html.")] = None,
    max_time: MaxTime = None,
    resume: Annotated[
        bool, typer.Option("--resume", help="Save the run's state now and then, and go on from the one that is there.")
    ] = False,
) -> None:
    """Run a coupled system, or one FMU, and write the table of results."""
    from selflock.master import RunInterrupted
    from selflock.master import run as run_system

    if page is not None:
        from selflock.view import checked

        checked(page)
    settings = _overrides(set_ or [])
    try:
        result = run_system(
            system,
            settings,
            stop,
            out or Path(f"{system.stem}_result.csv"),
            progress=True,
            inputs=input_,
            step=step,
            algorithm=algorithm,
            tolerance=tolerance,
            interface=interface,
            allow_code=allow_code,
            unlimited=unlimited,
            isolate=isolate,
            max_time=max_time,
            resume=resume,
        )
    except RunInterrupted as stopped:
        say(stopped.result.summary())
        raise
    say(result.summary())
    if page is not None:
        from selflock.view import view as write_page

        say(f"Open {write_page(result, page)}")
    else:
        of = f" --system {system}" if result.path and result.path.suffix == ".csv" else ""
        say(f"  see it: selflock view {result.path}{of}")


@app.command()
def serve(
    fmu: Annotated[Path, typer.Argument(help="The FMU that others may run here.")],
    port: Annotated[int, typer.Option(min=0, max=65535, help="To listen at; 0: any that is free.")] = 0,
    host: Annotated[str, typer.Option(help="To listen at; 0.0.0.0 for every network of this machine.")] = "127.0.0.1",
    isolate: Annotated[bool, typer.Option("--isolate", help="Instances run with limits and without rights.")] = False,
) -> None:
    """Let runs on this machine or on others step an FMU that lives here; a component says host = "machine:port"."""
    from selflock.master.remote import SECRET, Server

    server = Server(fmu, host, port, isolate=isolate)
    say(f"{fmu} is served at {server.address}, until Ctrl-C, to those with {SECRET}={server.secret}", highlight=False)
    server.run(say)


@app.command()
def view(
    results: Annotated[
        list[Path],
        typer.Argument(metavar="RUN...", help="Results (.csv, .parquet), of ours or others; several are drawn over each other."),
    ],
    out: Annotated[
        Path | None, typer.Option("--out", "-o", help="The page; beside the first result with the ending .html when not given.")
    ] = None,
    system: Annotated[
        Path | None,
        typer.Option("--system", help="The system that was run, for lengths, ground and limits that a .csv does not say."),
    ] = None,
    show: Annotated[
        list[str] | None, typer.Option("--show", help="Columns drawn at first, such as 'rear_motor.*'; may be repeated.")
    ] = None,
) -> None:
    """Write one page to look at results: what moves, any curves, peaks against limits. It needs no network."""
    from selflock.view import view as write_page

    say(f"Open {write_page(results, out, system, show or [])}")


@app.command()
def study(out: Out = Path("out/study")) -> None:
    """Reproduce the published study: eight runs, its figures, its claims, one report."""
    from selflock.study import study as run_study

    result = run_study(out, progress=True)
    console.print(result.table())
    say(f"Open {result.report}")


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
) -> None:
    """Guess what the columns of a raw log are, and write a commented rig to begin with."""
    from selflock.diagnosis import rig_init as begin

    console.print(visible(begin(logs, out, only).summary()), highlight=False, soft_wrap=True)


@app.command()
def plan(
    diagnosis: Annotated[Path, typer.Argument(metavar="DIR", help="The folder that selflock diagnose wrote to.")],
    limits: Annotated[
        list[str] | None,
        typer.Option(
            "--limits",
            help="angle=LOW:HIGH, speed=…, acceleration=…, voltage=…, current=…, duration=…: of the output side, SI; may be repeated. "
            "As far as the logs went where not given.",
        ),
    ] = None,
    out: Out = Path("out/plan"),
    rig: Annotated[Path | None, typer.Option(help="The rig of that diagnosis, where it was moved.")] = None,
    seed: Annotated[int, typer.Option(help="Of the runs that are tried.")] = 0,
    allow_code: AllowCode = False,
) -> None:
    """The run to record next: set-points that tell apart what a diagnosis could not."""
    from selflock.diagnosis import plan as run_plan

    given = {}
    for pair in (one for text in limits or [] for one in text.split()):
        key, equals, value = pair.partition("=")
        if not equals:
            raise SelflockError(f"--limits {pair}: write it as name=value, such as speed=2 or angle=-1:1.")
        given[key] = value
    say(run_plan(diagnosis, given, out, rig, progress=True, seed=seed, allow_code=allow_code).summary(), highlight=False)


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


@app.command()
def example(
    name: Annotated[str | None, typer.Argument(help="Which one, such as bench; all are listed when none is given.")] = None,
    out: Annotated[Path, typer.Option("--out", "-o", help="Folder to copy it to.")] = Path("."),
) -> None:
    """List the examples, or copy one to begin with."""
    from selflock import examples

    if name is None:
        for known, path in examples.files().items():
            say(f"{known:20} {examples.about(path)}", highlight=False)
        return
    for path in examples.copy(name, out):
        say(path)


@app.command()
def info(
    file: Annotated[Path, typer.Argument(help="An FMU, an SSP, a system or a rig (.toml), or a table of results.")],
    everything: Annotated[bool, typer.Option("--all", help="Every variable, however many there are.")] = False,
) -> None:
    """Tell what is in a file: variables, units, start values, what is connected. Nothing of it is run."""
    from selflock.info import info as about

    console.print(visible(about(file, everything)), highlight=False, soft_wrap=True)


@app.command()
def schema(
    of: Annotated[str, typer.Argument(metavar="rig|system|sweep", help="Of which file.")],
    out: Annotated[Path | None, typer.Option("--out", "-o", help="File to write it to; the terminal when not given.")] = None,
) -> None:
    """Write the JSON schema of a file, by which editors complete and check it."""
    from selflock.schemas import text

    if out is None:
        print(text(of))
    else:
        out.write_text(text(of) + "\n", encoding="utf-8")
        say(out)


@app.command()
def export(
    system: Annotated[Path, typer.Argument(help="A system file (.toml).")],
    out: Annotated[Path, typer.Option("--out", "-o", help="The .ssp file to write.")],
    ssp: Annotated[str, typer.Option(help="Version of SSP: 1.0 or 2.0.")] = "1.0",
    allow_code: AllowCode = False,
    unlimited: Unlimited = False,
    isolate: Isolate = False,
) -> None:
    """Write a system as a standard SSP archive with its FMUs inside."""
    from selflock.master import load
    from selflock.master.ssp import export as export_ssp

    say(export_ssp(load(system, allow_code, unlimited, isolate), out, version=ssp))


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
    """Run a system over many parameter values; go on where an interrupted sweep stopped."""
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


@app.command("sweep-report")
def sweep_report(folder: Annotated[Path, typer.Argument(metavar="DIR", help="The folder of a sweep.")]) -> None:
    """Draw the plots a designer looks at."""
    from selflock.sweep import report

    say(f"Open {report(folder)}")


def main() -> None:
    """Entry of the `selflock` command: what a user can mend is one message and exit code 2; 130 after Ctrl-C, 143 after SIGTERM."""
    try:
        with Watched(errors) as watched:
            app()
    except Interrupted as stopped:
        errors.print(visible(str(stopped)), highlight=False)
        sys.exit(watched.code)
    except Exception as error:
        if not watched.asked:
            _failed(error)
            sys.exit(2)
        said = str(error).partition("\n")[0]  # a reader in C makes an error of its own of the user's Ctrl-C
        errors.print(visible(f"Stopped; what was under way ended with: {said}"), highlight=False)
        sys.exit(watched.code)


def _failed(error: Exception) -> None:
    """Tell what a user can mend. Raises whatever else it is."""
    missing = extras.told(error)
    if not isinstance(error, (SelflockError, OSError, MemoryError)) and not missing or isinstance(error, BrokenPipeError):
        raise error
    text = missing or str(error)
    if isinstance(error, MemoryError):
        text = f"The memory does not suffice. {text}".strip()
    if isinstance(error, OSError) and error.filename:
        text = f"{error.filename}: {error.strerror}; choose another place, or make this one usable."
    errors.print("error: ", style="bold red", end="")
    errors.print(visible(text), highlight=False)


if __name__ == "__main__":
    main()
