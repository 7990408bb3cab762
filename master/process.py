"""An FMU in a process of its own: its crash ends that process, not the master and not the results.

Under Jacobi such FMUs step at the same time, on as many cores as there are.
"""

from __future__ import annotations

import json
import logging
import os
import shutil
import signal
import socket
import subprocess
import sys
import tempfile
import time as clock
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any, NoReturn

from . import binary, isolation
from .distant import Distant, Host, answer_all
from .line import Line, called

log = logging.getLogger("selflock")
PATIENCE = 10.0  # s that a process gets to end by itself
SAID = 20_000  # bytes of the end of its error output that are read


class ProcessPart(Distant):
    """An FMU instance living in another Python process, with the face of any part."""

    def __init__(
        self,
        name: str,
        path: Path | str,
        unlimited: bool = False,
        isolate: bool = False,
        step_timeout: float = 0.0,
        tolerance: float | None = None,
        interface: str = "",
        given: Mapping[str, Any] | None = None,
    ):
        """isolate: with limits and without rights (master.isolation). step_timeout: s of wall time for a step; 0: 60 s.

        tolerance, interface, given: as of master.anybody.part_of.
        """
        super().__init__(name)
        self.path = Path(path).absolute()
        self.isolate, self.step_timeout = isolate, step_timeout or isolation.TIMEOUT
        self.lacks: list[str] = []  # what isolation could not take away
        self._errors = tempfile.TemporaryFile()
        self._home = tempfile.mkdtemp(prefix="part_", dir=binary.root())  # for all that it unpacks; gone with it
        ours, theirs = socket.socketpair()
        self._line = Line(ours)
        if not isolate:
            log.info("%s runs in a process of its own", name)
        self._process = start(theirs.fileno(), self._home, self._errors, isolate)
        theirs.close()
        try:
            if isolate:
                self.lacks = [str(lack) for lack in self._call("lacks")]
                if self.lacks:
                    log.warning("%s is isolated only in part: not taken away are %s", name, "; ".join(self.lacks))
            self._open(name, str(self.path), unlimited, tolerance, interface, dict(given or {}))
        except BaseException:
            self.close()
            raise

    def _crashed(self) -> NoReturn:
        """Say how the process ended, with what it wrote to its error output."""
        code = self._end(PATIENCE)
        how = f"a crash ({_signal(-code)})" if code is not None and code < 0 else f"the end of its process (code {code})"
        self._failed(
            how, f"run {self.path.name} alone with these inputs, and report it to whoever made it; other components are unharmed."
        )

    def _words(self) -> list[str]:
        self._errors.seek(max(0, self._errors.seek(0, os.SEEK_END) - SAID))
        return [*self.log, *self._errors.read(SAID).decode("utf-8", "replace").splitlines()]

    def _end(self, seconds: float) -> int | None:
        """The process's code once it has ended by itself within `seconds`, else None; it and what it started are gone then."""
        process, until = self._process, clock.monotonic() + seconds
        if process.returncode is not None:
            return process.returncode
        while not (ended := os.waitid(os.P_PID, process.pid, os.WEXITED | os.WNOHANG | os.WNOWAIT)) and clock.monotonic() < until:
            clock.sleep(0.001)
        if self.isolate:
            os.killpg(process.pid, signal.SIGKILL)
            self._line.drain(PATIENCE)  # its end is that of all that hold the other end
        else:
            process.kill()
        code = process.wait()
        return code if ended else None

    @property
    def ended(self) -> bool:
        """Whether its process is gone."""
        return self._process.returncode is not None

    def close(self) -> None:
        patience = PATIENCE
        try:
            if self._asked:  # and nobody waits for it any more, as after Ctrl-C
                patience = 0.0
            else:
                self._line.send(called("close", ()))
        except OSError:
            pass
        self._end(patience)
        self._line.close()
        self._errors.close()
        for folder, inner, _ in os.walk(self._home):
            for path in (os.path.join(folder, name) for name in inner):
                if not os.path.islink(path):  # it may lead anywhere
                    os.chmod(path, 0o700)  # else what is in it stays
        shutil.rmtree(self._home, ignore_errors=True)


def _signal(number: int) -> str:
    """Its name; those for real time have none."""
    return signal.Signals(number).name if number in list(signal.Signals) else f"signal {number}"


def start(end: int, home: str, errors: Any, isolate: bool, only: str = "") -> subprocess.Popen:
    """The process that answers at the descriptor `end`. home: for all that it unpacks; errors: where it writes them."""
    if isolate:
        given = {"home": home, "limits": isolation.LIMITS, "path": sys.path, "module": __name__, "only": only}
        command = [sys.executable, "-I", str(isolation.__file__), str(end), json.dumps(given)]
        return subprocess.Popen(
            command,
            pass_fds=[end],
            stdin=subprocess.DEVNULL,
            stdout=errors,
            stderr=errors,
            env=isolation.environment(home),
            cwd=home,
            start_new_session=True,
        )
    code = f"import sys; sys.path[:] = {sys.path!r}; from {__name__} import serve; serve({end}, only={only!r})"
    environment = {**os.environ, "TMPDIR": home}
    command = [sys.executable, "-c", code]  # in a session of its own: Ctrl-C is the master's to answer
    return subprocess.Popen(command, pass_fds=[end], stderr=errors, env=environment, start_new_session=True)


def serve(descriptor: int, lacks: Sequence[str] = (), only: str = "") -> None:
    """The life of the process: one FMU, asked through `descriptor`. lacks: what isolation could not take away.

    only: the FMU that it is, where who asks is not to choose.
    """
    isolation.with_parent()
    answer_all(Line(socket.socket(fileno=descriptor)), Host(lacks, Path(only) if only else None))
