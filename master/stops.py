"""Ctrl-C and SIGTERM while a run goes on.

Whoever sends them means the run, not the FMU that happens to be at work: one written in Python meets the exception inside
its step and answers Error, which would then be told of it. And what must not be torn, such as a piece of a result file, is
done first.
"""

from __future__ import annotations

import signal
import threading
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from types import FrameType
from typing import Any

HEARD = (signal.SIGINT, signal.SIGTERM)

_depth = 0  # of `held`, in the main thread, which alone hears signals
_late: list[Callable[[], Any]] = []  # what was asked for meanwhile


class Stops:
    """Hears what stops a run while it is entered; `asked` from then on, whatever became of the exception that it raised.

    What a signal does otherwise, it does here: one that ends the process at once still does.
    """

    asked = False

    def __enter__(self) -> Stops:
        self._before: dict[int, Callable[[int, FrameType | None], Any]] = {}
        if threading.current_thread() is threading.main_thread():
            for number in HEARD:
                before = signal.getsignal(number)
                if callable(before):
                    self._before[number] = before
                    signal.signal(number, self._hear)
        return self

    def _hear(self, number: int, frame: FrameType | None) -> None:
        self.asked = True
        if _depth:
            _late.append(lambda: self._before[number](number, None))
        else:
            self._before[number](number, frame)

    def __exit__(self, *_: object) -> None:
        for number, before in self._before.items():
            signal.signal(number, before)

    def obey(self) -> None:
        """End the run where an exception that should have ended it got lost on its way."""
        if self.asked:
            raise KeyboardInterrupt


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
