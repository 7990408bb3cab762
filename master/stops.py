"""What ends work before its end: Ctrl-C, SIGTERM, a time limit.

Whoever sends a signal means the run, not the FMU that happens to be at work: one written in Python meets the exception
inside its step and answers Error, which would then be told of it. And what must not be torn, such as a piece of a result
file, is done first.
"""

from __future__ import annotations

import signal
import sys
import threading
import weakref
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from types import FrameType
from typing import Any

from .errors import DescriptionError, TimeUp

HEARD = (signal.SIGINT, signal.SIGTERM)

rescues: weakref.WeakSet[Any] = weakref.WeakSet()
"""Whose `rescue()` keeps what it has and says where, from any thread, in a process that is about to be ended."""

_depth = 0  # of `held`, in the main thread, which alone hears signals
_late: list[Callable[[], Any]] = []  # what was asked for meanwhile


class Stops:
    """Hears what stops some work while it is entered, and knows it from then on, whatever became of the exception.

    A signal does what it did before: one that ends the process at once still does. After `seconds` of wall time the work is
    interrupted as by Ctrl-C, in the main thread, also of a process that ignores Ctrl-C, such as a script starts in the
    background; elsewhere it is up to `obey`.
    """

    def __init__(self, seconds: float | None = None):
        if seconds is not None and (isinstance(seconds, bool) or not isinstance(seconds, (int, float))):
            raise DescriptionError(f"A time limit of {seconds!r} is no number of seconds.")
        if seconds is not None and not seconds > 0.0:
            raise DescriptionError(f"A time limit of {seconds:g} s is none: give seconds above zero.")
        self.seconds = seconds
        self.asked = self.time_up = False
        self._timer: threading.Timer | None = None
        self._over, self._calm, self._lock = False, False, threading.Lock()

    def __enter__(self) -> Stops:
        self._before: dict[int, Any] = {}
        if threading.current_thread() is threading.main_thread():
            for number in HEARD:
                before = signal.getsignal(number)
                rings = number == signal.SIGINT and self.seconds is not None
                if callable(before) or (before == signal.SIG_IGN and rings):
                    self._before[number] = before
                    signal.signal(number, self._hear)
            self._lost, sys.unraisablehook = sys.unraisablehook, self._lose
        if self.seconds is not None:
            self._timer = threading.Timer(min(self.seconds, threading.TIMEOUT_MAX), self._ring)
            self._timer.daemon = True
            self._timer.start()
        return self

    def _ring(self) -> None:
        with self._lock:
            ident = threading.main_thread().ident
            if self._over or self._calm or ident is None:
                return
            self.time_up = self.asked = True
            if signal.SIGINT in self._before and hasattr(signal, "pthread_kill"):
                signal.pthread_kill(ident, signal.SIGINT)

    def _hear(self, number: int, frame: FrameType | None) -> None:
        before = self._before[number]
        if before == signal.SIG_IGN:
            if not self.time_up:
                return
            before = signal.default_int_handler
        self.asked = True
        if _depth:
            _late.append(lambda: before(number, None))
        else:
            before(number, frame)

    def _lose(self, lost: Any) -> None:
        """An exception that cannot go on, as through C that called Python, such as a compiler's: the user's comes from `obey`.

        What a compiler was torn from is asked for once more by its C, and is gone: that is the user's, too.
        """
        if not (self.asked and issubclass(lost.exc_type, (KeyboardInterrupt, ReferenceError))):
            self._lost(lost)

    def __exit__(self, *_: object) -> None:
        if sys.unraisablehook == self._lose:
            sys.unraisablehook = self._lost
        with self._lock:
            self._over = True
        if self._timer is not None:
            self._timer.cancel()
        for number, before in self._before.items():
            signal.signal(number, before)

    @contextmanager
    def calm(self) -> Iterator[None]:
        """What is done in here the time limit does not interrupt, nor anything behind it where it passes meanwhile; Ctrl-C does."""
        before, self._calm = self._calm, True
        try:
            yield
        finally:
            self._calm = before

    def obey(self) -> None:
        """End the work where an exception that should have ended it got lost on its way, or none comes here."""
        if self.asked:
            raise KeyboardInterrupt

    def error(self, what: str, kept: str) -> BaseException:
        """What is raised for it: `what` was stopped, and what was `kept`."""
        if self.time_up:
            return TimeUp(f"{what} took more than its time limit, {self.seconds:g} s of wall time, and was stopped; {kept}.")
        return KeyboardInterrupt(f"{what} was stopped; {kept}.")


def deferred() -> bool:
    """Whether somebody is heard, once what must not be torn is done."""
    return bool(_late)


@contextmanager
def held() -> Iterator[None]:
    """What is done in here is done whole: signals wait for its end."""
    global _depth
    if threading.current_thread() is not threading.main_thread():
        yield
        return
    _depth += 1
    try:
        yield
    finally:
        _depth -= 1
        if not _depth and _late:
            late = _late[-1]
            _late.clear()
            late()
