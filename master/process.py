"""An FMU in a process of its own: its crash ends that process, not the master and not the results.

The numbers of a step are one short message each way; everything else is a call by name. Under Jacobi such FMUs step
at the same time, on as many cores as there are.
"""

from __future__ import annotations

import signal
import socket
import struct
import subprocess
import sys
import tempfile
from collections.abc import Sequence
from multiprocessing.connection import Connection
from multiprocessing.reduction import ForkingPickler
from pathlib import Path
from typing import Any

import numpy as np

from selflock.fmus.errors import SelflockError

from .errors import PartFailed
from .face import Part

PATIENCE = 10.0  # s that a process gets to end by itself
_STEP, _WRITE, _READ, _FAILED = b"s", b"w", b"r", b"!"  # no pickle begins with one of these
_TIMES = struct.Struct("dd")


class ProcessPart(Part):
    """An FMU instance living in another Python process, with the face of any part."""

    parallel = True

    def __init__(self, name: str, path: Path | str, unlimited: bool = False):
        super().__init__(name)
        self.path = Path(path)
        self._time = self._size = 0.0
        self._begun = False  # a step is under way
        self._errors = tempfile.TemporaryFile()
        ours, theirs = socket.socketpair()
        code = f"import sys; sys.path[:] = {sys.path!r}; from {__name__} import serve; serve({theirs.fileno()})"
        self._process = subprocess.Popen([sys.executable, "-c", code], pass_fds=[theirs.fileno()], stderr=self._errors)
        theirs.close()
        self._line = Connection(ours.detach())
        try:
            self.variables, self.units, self.can_roll_back, self.variable_step = self._call("open", name, str(path), unlimited)
        except BaseException:
            self.close()
            raise

    # --- talking -------------------------------------------------------------------------------------------------

    def _call(self, method: str, *arguments) -> Any:
        return self._ask((method, arguments))

    def _ask(self, message) -> Any:
        try:
            self._line.send(message)
            kind, value, log = self._line.recv()
        except (EOFError, OSError):
            self._crashed()
        self.log = log or self.log
        if kind == "error":
            raise value
        return value

    def _crashed(self) -> None:
        """Say how the process ended, with what it wrote to its error output."""
        try:
            code = self._process.wait(PATIENCE)
        except subprocess.TimeoutExpired:
            code = None
        how = (
            f"a crash ({signal.Signals(-code).name})"
            if code is not None and code < 0
            else f"the end of its process (code {code})"
        )
        self._errors.seek(0)
        written = self._errors.read().decode("utf-8", "replace").splitlines()
        said = [*self.log, *written][-10:]
        inputs = dict(zip(self.inputs, self.u.tolist()))
        hint = f"run {self.path.name} alone with these inputs, and report it to whoever made it; other components are unharmed."
        raise PartFailed(self.name, self._time, self._size, how, inputs, said, hint) from None

    # --- the face ------------------------------------------------------------------------------------------------

    def bind(self, inputs: Sequence[str], outputs: Sequence[str]) -> None:
        self.inputs, self.outputs = tuple(inputs), tuple(outputs)
        self.u = np.array(self._call("bind", list(inputs), list(outputs)), dtype=float)
        self.y = np.zeros(len(outputs))

    def begin(self, time: float, size: float) -> None:
        """Start write, step and read, so that others can step meanwhile; `cycle` waits for the end."""
        self._time, self._size = time, size
        self._send(_STEP, _TIMES.pack(time, size))
        self._begun = True

    def cycle(self, time: float, size: float) -> None:
        """write, step and read with one message."""
        if not self._begun:
            self.begin(time, size)
        self._begun = False
        self._receive(_STEP)

    def step(self, time: float, size: float) -> None:
        self._time, self._size = time, size
        self._call("step", time, size)

    def write(self) -> None:
        self._short(_WRITE)

    def read(self) -> None:
        self._short(_READ)

    def _short(self, what: bytes) -> None:
        self._send(what)
        self._receive(what)

    def _send(self, what: bytes, times: bytes = b"") -> None:
        try:
            self._line.send_bytes(what + times + (b"" if what == _READ else self.u.tobytes()))
        except OSError:
            self._crashed()

    def _receive(self, what: bytes) -> None:
        try:
            answer = self._line.recv_bytes()
        except (EOFError, OSError):
            self._crashed()
        if answer == _FAILED:
            self._ask(("failure", ()))
        if what != _WRITE:
            self.y[:] = np.frombuffer(answer)

    def set(self, name: str, value: Any) -> None:
        self._call("set", name, value)

    def get(self, name: str) -> Any:
        return self._call("get", name)

    def enter_initialization(self, start: float, stop: float | None) -> None:
        self._time = start
        self._call("enter_initialization", start, stop)

    def exit_initialization(self) -> None:
        self._call("exit_initialization")

    def save(self) -> int:
        return self._call("save")

    def restore(self, state: int) -> None:
        self._call("restore", state)

    def reset(self) -> None:
        self._call("reset")

    def terminate(self) -> None:
        self._call("terminate")

    def close(self) -> None:
        try:
            self._line.send(("close", ()))
            self._process.wait(PATIENCE)
        except (OSError, subprocess.TimeoutExpired):
            self._process.kill()
            self._process.wait()
        self._line.close()
        self._errors.close()


# --- the other side ----------------------------------------------------------------------------------------------


def serve(descriptor: int) -> None:
    """The life of the process: one FMU, asked through `descriptor`."""
    line = Connection(descriptor)
    host = _Host()
    while True:
        try:
            message = line.recv_bytes()
        except (EOFError, OSError):
            return
        if message[:1] in (_STEP, _WRITE, _READ):
            line.send_bytes(host.short(message))
            continue
        method, arguments = ForkingPickler.loads(message)
        if method == "close":
            host.close()
            return
        try:
            line.send(("value", host.call(method, arguments), host.log()))
        except SelflockError as error:
            line.send(("error", error, host.log()))


class _Host:
    """The FMU in this process, with its states and its last failure."""

    part: Part  # from "open" on, which is asked first

    def __init__(self):
        self.opened = False
        self.states: list[Any] = []
        self.saved = 0
        self.error: SelflockError | None = None

    def log(self) -> list[str]:
        return list(self.part.log) if self.opened else []

    def call(self, method: str, arguments: tuple) -> Any:
        if method == "open":
            from .binary import open_fmu
            from .fmu import FmuPart

            name, path, unlimited = arguments
            open_fmu(path, unlimited)
            self.part, self.opened = FmuPart(name, path), True
            return self.part.variables, self.part.units, self.part.can_roll_back, self.part.variable_step
        if method == "bind":
            return self.bind(*arguments)
        if method == "failure":
            raise self.error or SelflockError("nothing failed")
        if method == "save":
            self.states = [*self.states[-7:], self.part.save()]  # the master comes back to a recent one, if at all
            self.saved += 1
            return self.saved
        if method == "restore":
            return self.part.restore(self.states[arguments[0] - self.saved - 1])
        return getattr(self.part, method)(*arguments)

    def bind(self, inputs: list[str], outputs: list[str]) -> list[float]:
        self.part.bind(inputs, outputs)
        self.cycle = self.part.stepper()
        return self.part.u.tolist()

    def short(self, message: bytes) -> bytes:
        part, what, numbers = self.part, message[:1], message[1:]
        try:
            if what == _STEP:
                part.u[:] = np.frombuffer(numbers[_TIMES.size :])
                self.cycle(*_TIMES.unpack_from(numbers))
            elif what == _WRITE:
                part.u[:] = np.frombuffer(numbers)
                part.write()
            else:
                part.read()
            return b"" if what == _WRITE else part.y.tobytes()
        except SelflockError as error:
            self.error = error
            return _FAILED

    def close(self) -> None:
        if self.opened:
            self.part.close()
