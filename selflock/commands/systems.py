"""Systems and FMUs: run them, look at them, hand them on."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from selflock.fmus.errors import SelflockError
from selflock.fmus.shown import visible

from .options import AllowCode, Isolate, MaxTime, Out, Unlimited
from .terminal import console, say

app = typer.Typer()


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
    as_fmu: Annotated[
        bool,
        typer.Option("--as-fmu", help="Step FMUs of ours as anybody's, not by their compiled laws; the numbers are the same."),
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
            as_fmu=as_fmu,
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
def info(
    file: Annotated[Path, typer.Argument(help="An FMU, an SSP, a system or a rig (.toml), or a table of results.")],
    everything: Annotated[bool, typer.Option("--all", help="Every variable, however many there are.")] = False,
) -> None:
    """Tell what is in a file: variables, units, start values, what is connected. Nothing of it is run."""
    from selflock.info import info as about

    console.print(visible(about(file, everything)), highlight=False, soft_wrap=True)


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
