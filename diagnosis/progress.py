"""Progress of a diagnosis: a bar where a terminal shows it, else a plain line to stderr now and then.

A log file or a batch system keeps every line for ever, and no cursor goes back there. So lines are few, come at equal
times whatever the work does, and hold no codes for colours.
"""

from __future__ import annotations

import logging
import sys
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from threading import Event, Thread
from time import monotonic
from typing import IO, TYPE_CHECKING

from selflock.fmus.shown import visible

from .rules import RULES

if TYPE_CHECKING:
    from rich.console import Console

log = logging.getLogger(__name__)

Tell = Callable[[str, float], None]
"""Called with what is being done, what is known so far in brackets behind it, and how much of it is done, 0 to 1."""


@contextmanager
def shown(progress: bool | Tell) -> Iterator[Tell]:
    """What tells progress: nothing, a function of the caller's, a bar, or lines. Each stage is logged as it begins."""
    with _shown(progress) as tell:
        stage = ""

        def told(what: str, share: float) -> None:
            nonlocal stage
            if (name := what.partition(" (")[0]) != stage:
                stage = name
                log.info("%s", what)
            tell(what, share)

        yield told


@contextmanager
def _shown(progress: bool | Tell) -> Iterator[Tell]:
    if callable(progress):
        yield progress
    elif not progress:
        yield lambda *_: None
    elif (console := _screen()) is not None:
        from rich.progress import BarColumn, Progress, TextColumn, TimeElapsedColumn

        columns = TextColumn("{task.description:32}", markup=False), BarColumn(), TimeElapsedColumn()
        with Progress(*columns, console=console, transient=True) as bar:
            task = bar.add_task("", total=1.0)
            yield lambda what, share: bar.update(task, description=visible(what), completed=share)
    else:
        with spoken(sys.stderr) as tell:
            yield tell


def _screen() -> Console | None:
    """Where a bar can be drawn: what the answer is printed to, else where errors go; None where neither is a screen.

    Asked of the stream itself: rich takes a file for a terminal where FORCE_COLOR is set.
    """
    from rich.console import Console

    for console in (Console(), Console(stderr=True)):
        if console.is_jupyter or (console.is_interactive and _is_terminal(console.file)):
            return console
    return None


def _is_terminal(stream: IO[str] | None) -> bool:
    return stream is not None and not stream.closed and stream.isatty()


@dataclass(frozen=True)
class Doing:
    """What is being done: told last at `told` s, with this share; begun at `began` s, with the share `first`."""

    what: str
    share: float
    told: float
    began: float
    first: float

    @property
    def name(self) -> str:
        """Without what is known so far."""
        return self.what.partition(" (")[0]

    def next(self, what: str, share: float, now: float) -> Doing:
        """As it is told now: the same stage further on, or another one."""
        other = Doing(what, share, now, now, share)
        return Doing(what, share, now, self.began, self.first) if other.name == self.name else other

    def left(self, now: float) -> float | None:
        """A guess at the seconds to its end, at the pace of what is done of it; None where that says nothing.

        How many stages follow nobody knows before they are begun, so of the whole nothing is guessed.
        """
        spent, done = self.told - self.began, self.share - self.first
        if done <= 0.0 or self.share >= 1.0 or spent < RULES.pipeline.told_every:
            return None
        left = spent * (1.0 - self.share) / done - (now - self.told)
        return left if left > 0.0 else None  # it takes longer than guessed

    def line(self, since: float, now: float) -> str:
        """The stage in a line, `since`: when all began."""
        text = f"{lasting(now - since)}: {self.what}"
        if self.share > self.first:  # else nothing counts it
            text += f", {100 * self.share:.0f} % done"
        left = self.left(now)
        return text if left is None else f"{text}, about {lasting(left)} left of this"


def lasting(seconds: float) -> str:
    """A duration in words."""
    minutes, rest = divmod(round(seconds), 60)
    return f"{minutes} min {rest} s" if minutes else f"{rest} s"


@contextmanager
def spoken(
    stream: IO[str] | None, clock: Callable[[], float] = monotonic, every: float = RULES.pipeline.told_every
) -> Iterator[Tell]:
    """Lines to a stream, one every so many seconds, also while what is done tells nothing."""
    since = clock()
    now = [Doing("begin", 0.0, since, since, 0.0)]
    over = Event()

    def tell(what: str, share: float) -> None:
        now[0] = now[0].next(what, share, clock())

    def speak() -> None:
        while stream is not None and not over.wait(every):
            try:
                print(visible(now[0].line(since, clock())), file=stream, flush=True)
            except (OSError, ValueError):  # nobody reads any more
                return

    thread = Thread(target=speak, name="progress", daemon=True)
    thread.start()
    try:
        yield tell
    finally:
        over.set()
        thread.join()  # no line comes behind the answer
