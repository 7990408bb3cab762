"""What `selflock -v` tells of the work while it goes on: the library's log, on stderr."""

from __future__ import annotations

import logging
import sys
from typing import Any

import typer.core

from selflock.fmus.shown import visible

LEVELS = (logging.WARNING, logging.INFO, logging.DEBUG)
FLAGS = ("-v", "-vv", "--verbose")


class Anywhere(typer.core.TyperGroup):
    """The commands, whose -v may stand behind their names as well."""

    def parse_args(self, ctx: Any, args: list[str]) -> list[str]:
        end = args.index("--") if "--" in args else len(args)
        flags = [word for word in args[:end] if word in FLAGS]
        return super().parse_args(ctx, flags + [word for word in args[:end] if word not in FLAGS] + args[end:])


class Lines(logging.Handler):
    """A line to stderr as it is now (a progress bar takes its place), with nothing in it that moves the cursor."""

    def emit(self, record: logging.LogRecord) -> None:
        try:
            print(visible(self.format(record)), file=sys.stderr)
        except (OSError, ValueError):  # nobody reads any more
            pass


def listen(verbose: int) -> None:
    """Tell the library's log from this level on: 0 warnings, as sentences; 1 what is done, 2 all."""
    log = logging.getLogger("selflock")
    for handler in [handler for handler in log.handlers if isinstance(handler, Lines)]:
        log.removeHandler(handler)
    lines = Lines()
    log.addHandler(lines)
    if not verbose:
        return
    lines.setFormatter(logging.Formatter("{asctime} {levelname} {name}: {message}", "%H:%M:%S", "{"))
    log.setLevel(LEVELS[min(verbose, len(LEVELS) - 1)])
    log.propagate = False
