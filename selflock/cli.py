"""The command line. It knows all and holds no logic: every command is one Python call, in `commands`."""

from __future__ import annotations

import errno
import gc
import sys
from typing import Annotated, Any

import typer

from selflock.ending import Watched
from selflock.fmus import blas
from selflock.fmus.errors import Interrupted, SelflockError
from selflock.fmus.shown import one_line, visible
from selflock.verbose import Anywhere, listen

from .commands import drives, files, models, sweeps, systems
from .commands.terminal import errors, say

GROUPS = {
    "Systems and FMUs": systems.app,
    "Many runs": sweeps.app,
    "Measured drives": drives.app,
    "Any system beside logs": models.app,
    "To begin with": files.app,
}


MADE = 50_000
"""Objects made before the collector looks for what cannot be reached. By Python's own 700 it goes through all modules again and
again while they are loaded: an eighth of what a replay takes."""


class Commands(Anywhere):
    """The commands; one that was stopped says what is kept, where click would say "Aborted!"."""

    def invoke(self, ctx: typer.Context) -> Any:  # type: ignore[override]
        try:
            return super().invoke(ctx)
        except KeyboardInterrupt as stopped:
            raise Interrupted(str(stopped) or "Stopped.") from None

    def format_commands(self, ctx: Any, formatter: Any) -> None:
        """The commands by what they are for."""
        panels: dict[str, list[tuple[str, str]]] = {}
        for name in self.list_commands(ctx):
            if (command := self.get_command(ctx, name)) is not None:
                panel = getattr(command, "rich_help_panel", None) or "Commands"
                panels.setdefault(panel, []).append((name, command.get_short_help_str(limit=1000)))
        for panel, rows in panels.items():
            with formatter.section(panel):
                formatter.write_dl(rows)


app = typer.Typer(
    name="selflock",
    cls=Commands,
    no_args_is_help=True,
    add_completion=False,
    pretty_exceptions_enable=False,
    rich_markup_mode=None,  # what draws boxes about a help is half of what it costs
    context_settings={"help_option_names": ["-h", "--help"]},
)
for panel, group in GROUPS.items():
    for command in group.registered_commands:
        command.rich_help_panel = panel
    for more in group.registered_groups:
        more.rich_help_panel = panel
    app.add_typer(group)


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


def main() -> None:
    """Entry of the `selflock` command, and all that its process does."""
    gc.set_threshold(MADE)
    blas.one_thread()
    carry_out(last=True)


def carry_out(last: bool = False) -> None:
    """A command: what a user can mend is one message and exit code 2; 130 after Ctrl-C, 143 after SIGTERM. last: as of Watched."""
    watched = Watched(errors, last)
    try:
        with watched:
            _words(sys.argv[1:])
            app()
    except (Interrupted, KeyboardInterrupt) as stopped:
        errors.print(visible(str(stopped) or "Stopped."), highlight=False)
        sys.exit(watched.code)
    except Exception as error:
        if not watched.asked or _is_time_up(error):
            _failed(error)
            sys.exit(watched.code if watched.asked else 2)
        said = str(error).partition("\n")[0]  # a reader in C makes an error of its own of the user's Ctrl-C
        errors.print(visible(f"Stopped; what was under way ended with: {said}"), highlight=False)
        sys.exit(watched.code)


def _words(given: list[str]) -> None:
    """Raise SelflockError where a word has two lines: the second of a stranger's file name would pass for a line of ours."""
    for word in given:
        if "\n" in word:
            raise SelflockError(f"{one_line(word)}: it has a line break. Give the file a name of one line.")


def _is_time_up(error: Exception) -> bool:
    """Whether it was no user's Ctrl-C but `--max-time`, which comes by the same signal."""
    told = sys.modules.get("selflock.master.errors")  # else nothing of it was loaded, and nothing ran
    return told is not None and isinstance(error, told.TimeUp)


def _failed(error: Exception) -> None:
    """Tell what a user can mend. Raises whatever else it is."""
    from selflock import extras

    missing = extras.told(error)
    if not isinstance(error, (SelflockError, OSError, MemoryError)) and not missing or isinstance(error, BrokenPipeError):
        raise error
    text = missing or str(error)
    if isinstance(error, MemoryError):
        text = f"The memory does not suffice. {text}".strip()
    if isinstance(error, OSError) and error.filename:
        text = f"{error.filename}: {error.strerror}; choose another place, or make this one usable."
    elif isinstance(error, OSError) and error.errno in (errno.ENOSPC, errno.EDQUOT, errno.EFBIG):
        text = f"A file cannot be written on: {error.strerror}. Make room, or choose another place."
    errors.print("error: ", style="bold red", end="")
    errors.print(visible(text), highlight=False)


if __name__ == "__main__":
    main()
