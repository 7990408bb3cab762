"""How a command ends before its end: by Ctrl-C, SIGTERM or SIGHUP, also while an FMU does not come back from its step.

Python hears a signal between two of its own instructions, so never while a C function of an FMU is stuck. Another thread
waits for that, and ends the process; but first it keeps what can be kept, and says what that is.
"""

from __future__ import annotations

import gc
import os
import signal
import socket
import sys
import threading
from types import FrameType
from typing import Any

from rich.console import Console

from selflock.fmus import temporary
from selflock.fmus.shown import visible

GRACE = 5.0  # s that the command has to hear a signal by itself
ENDING = ("SIGINT", "SIGTERM", "SIGHUP")


class Watched:
    """Watches over a command while it is entered. `code`: the exit code by the signal that came last.

    last: the process is at its end behind it (`leave`).
    """

    code = 130
    asked = False  # whether any signal was heard, whatever became of the exception

    def __init__(self, errors: Console, last: bool = False):
        self._errors, self._last = errors, last
        self._heard = threading.Event()

    def __enter__(self) -> Watched:
        self._before: dict[int, Any] = {}
        if threading.current_thread() is not threading.main_thread() or sys.platform == "win32":
            return self
        for number in (getattr(signal, name) for name in ENDING):
            if signal.getsignal(number) in (signal.SIG_DFL, signal.default_int_handler):  # else someone wants it otherwise
                self._before[number] = signal.signal(number, self._hear)
        self._ours, self._theirs = socket.socketpair()  # its thread closes ours
        self._theirs.setblocking(False)
        self._wakeup = signal.set_wakeup_fd(self._theirs.fileno(), warn_on_full_buffer=False)
        self._thread = threading.Thread(target=self._wait, name="ending", daemon=True)
        self._thread.start()
        return self

    def _hear(self, number: int, frame: FrameType | None) -> None:
        self.code, self.asked = 128 + number, True
        self._heard.set()
        raise KeyboardInterrupt

    def _wait(self) -> None:
        with self._ours:
            while got := self._ours.recv(1):
                while got[0] in self._before and not self._heard.wait(GRACE):
                    stops = sys.modules.get("selflock.master.stops")  # else nothing of it was loaded, and nothing runs
                    if not (stops and stops.deferred()):
                        self._end(128 + got[0])
                self._heard.clear()

    def _end(self, code: int) -> None:
        """End the process while its main thread does not answer."""
        kept = []
        stops = sys.modules.get("selflock.master.stops")
        for one in list(stops.rescues) if stops else []:
            try:
                kept.append(one.rescue())
            except Exception as error:  # the process ends anyway
                kept.append(str(error))
        self._errors.print(visible("\n".join(kept) or "Stopped."), highlight=False)
        temporary.clear()
        os._exit(code)

    def __exit__(self, *_: object) -> None:
        if self._last:
            leave()
        else:
            for number, before in self._before.items():
                signal.signal(number, before)
        if hasattr(self, "_ours"):
            signal.set_wakeup_fd(self._wakeup)
            self._theirs.close()
            self._thread.join()


def leave() -> None:
    """The process is at its end, which takes a while: its temporary folders go, and a signal ends it without a word from now on.

    What Python does at its end hears no signal as it should: it would leave the folders, or a traceback. And it would look for
    what cannot be reached any more among all modules: a fifth of what a replay takes, for memory that goes with the process.
    """
    if threading.current_thread() is not threading.main_thread():
        return
    numbers = [getattr(signal, name) for name in ENDING if hasattr(signal, name)]
    for number in numbers:
        signal.signal(number, signal.SIG_IGN)
    temporary.clear()
    gc.freeze()
    for number in numbers:
        signal.signal(number, signal.SIG_DFL)
