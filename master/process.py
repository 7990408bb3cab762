"""An FMU in a process of its own: its crash ends that process, not the master and not the results.

The numbers of a step are one short message each way; everything else is a call by name, pickled on the way there, as plain
data on the way back (master.line). Under Jacobi such FMUs step at the same time, on as many cores as there are.
"""

from __future__ import annotations

import base64
import json
import logging
import os
import pickle
import shutil
import signal
import socket
import struct
import subprocess
import sys
import tempfile
import time as clock
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import Any, NoReturn

import numpy as np

from selflock.fmus.errors import SelflockError

from . import binary, isolation
from .errors import PartFailed
from .face import Part
from .line import (
    DESCRIPTION,
    VALUE,
    Garbled,
    Line,
    answer,
    complaint,
    described,
    description,
    numbers,
    understood,
    value_of,
    values,
)

log = logging.getLogger("selflock")
PATIENCE = 10.0  # s that a process gets to end by itself
SAID = 20_000  # bytes of the end of its error output that are read
_STEP, _WRITE, _READ, _FAILED = b"s", b"w", b"r", b"!"  # no pickle begins with one of these
_TIMES = struct.Struct("dd")
_ENDED = struct.Struct("d")  # follows the numbers of a step in which the FMU ended the run


class ProcessPart(Part):
    """An FMU instance living in another Python process, with the face of any part."""

    parallel = True

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
        self._time = self._size = 0.0
        self._begun = False  # a step is under way
        self._gone: list[int] = []  # states that nobody will come back to
        self._asked = False  # an answer is due
        self._errors = tempfile.TemporaryFile()
        self._home = tempfile.mkdtemp(prefix="part_", dir=binary.root())  # for all that it unpacks; gone with it
        ours, theirs = socket.socketpair()
        self._line = Line(ours)
        self._process = self._started(theirs.fileno())
        theirs.close()
        try:
            if isolate:
                self.lacks = [str(lack) for lack in self._call("lacks")]
                if self.lacks:
                    log.warning("%s is isolated only in part: not taken away are %s", name, "; ".join(self.lacks))
            told = self._call("open", name, str(self.path), unlimited, tolerance, interface, dict(given or {}), most=DESCRIPTION)
            self.variables, self.units, self.can_roll_back, self.variable_step, self.frozen = self._sound(
                lambda: description(told)
            )
        except BaseException:
            self.close()
            raise

    def _started(self, end: int) -> subprocess.Popen:
        if self.isolate:
            given = {"home": self._home, "limits": isolation.LIMITS, "path": sys.path, "module": __name__}
            command = [sys.executable, "-I", str(isolation.__file__), str(end), json.dumps(given)]
            environment = isolation.environment(self._home)
            return subprocess.Popen(
                command,
                pass_fds=[end],
                stdin=subprocess.DEVNULL,
                stdout=self._errors,
                stderr=self._errors,
                env=environment,
                cwd=self._home,
                start_new_session=True,
            )
        log.info("%s runs in a process of its own", self.name)
        code = f"import sys; sys.path[:] = {sys.path!r}; from {__name__} import serve; serve({end})"
        environment = {**os.environ, "TMPDIR": self._home}
        command = [sys.executable, "-c", code]  # in a session of its own: Ctrl-C is the master's to answer
        return subprocess.Popen(command, pass_fds=[end], stderr=self._errors, env=environment, start_new_session=True)

    # --- talking -------------------------------------------------------------------------------------------------

    def _call(self, method: str, *arguments, most: int = VALUE) -> Any:
        self._line.wait(max(self.step_timeout, isolation.TIMEOUT))
        self._asked = True
        self._tell(pickle.dumps((method, arguments)))
        value, said, error = self._sound(lambda: understood(self._line.receive(most), self.name))
        self._asked = False
        self.log = said or self.log
        if error is not None:
            raise error
        return value

    def _tell(self, message: bytes) -> None:
        self._sound(lambda: self._line.send(message))

    def _sound(self, act: Callable[[], Any]) -> Any:
        """What `act` gives; where the process did not answer, or not as it should, its end and a PartFailed."""
        try:
            return act()
        except TimeoutError:
            waited = self._line.patience
            self._end(0.0)
            self._failed(f"nothing within {waited:g} s, and was ended,", "a longer `step_timeout` for this component.")
        except Garbled as error:
            self._garbled(str(error))
        except (EOFError, OSError):
            self._crashed()

    def _garbled(self, what: str) -> NoReturn:
        self._end(0.0)
        self._failed(
            f"{what}, and was ended,", f"{self.path.name} only where you trust it: it does not answer as our own process does."
        )

    def _crashed(self) -> NoReturn:
        """Say how the process ended, with what it wrote to its error output."""
        code = self._end(PATIENCE)
        how = f"a crash ({_signal(-code)})" if code is not None and code < 0 else f"the end of its process (code {code})"
        self._failed(
            how, f"run {self.path.name} alone with these inputs, and report it to whoever made it; other components are unharmed."
        )

    def _failed(self, how: str, hint: str) -> NoReturn:
        self._errors.seek(max(0, self._errors.seek(0, os.SEEK_END) - SAID))
        written = self._errors.read(SAID).decode("utf-8", "replace").splitlines()
        inputs = dict(zip(self.inputs, self.u.tolist()))
        raise PartFailed(self.name, self._time, self._size, how, inputs, [*self.log, *written][-10:], hint) from None

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

    # --- the face ------------------------------------------------------------------------------------------------

    def bind(self, inputs: Sequence[str], outputs: Sequence[str]) -> None:
        self.inputs, self.outputs = tuple(inputs), tuple(outputs)
        self.u = np.zeros(len(inputs))
        told = self._call("bind", list(inputs), list(outputs), most=DESCRIPTION)
        self.u[:] = self._sound(lambda: numbers(told, len(inputs)))
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
        self._line.wait(self.step_timeout)
        self._asked = True
        self._sound(lambda: self._line.send(what + times + (b"" if what == _READ else self.u.tobytes())))

    def _receive(self, what: bytes) -> None:
        """The numbers of a step: as many as were asked for, or a failure that is then asked for."""
        wanted = 0 if what == _WRITE else self.y.nbytes
        answered = self._sound(lambda: self._line.receive(max(wanted, 1) + _ENDED.size))
        self._asked = False
        if answered == _FAILED:
            self._call("failure")
        if what == _STEP and len(answered) == wanted + _ENDED.size:
            (ended,) = _ENDED.unpack_from(answered, wanted)
            if not self._time <= ended <= self._time + self._size:
                self._garbled(f"an end at t = {ended} s")
            self.end(ended)
            answered = answered[:wanted]
        if len(answered) != wanted:
            self._garbled(f"{len(answered)} bytes where {wanted} are due")
        if wanted:
            self.y[:] = np.frombuffer(answered)

    def set(self, name: str, value: Any) -> None:
        self._call("set", name, value)

    def get(self, name: str) -> Any:
        told = self._call("get", name)
        return self._sound(lambda: value_of(self.variables.get(name), told))

    def enter_initialization(self, start: float, stop: float | None) -> None:
        self._time = start
        self._call("enter_initialization", start, stop)

    def exit_initialization(self) -> None:
        told = self._call("exit_initialization")
        self.untaken = self._sound(lambda: values(self.variables, told))

    def save(self) -> _Saved:
        gone = self._gone.copy()
        del self._gone[: len(gone)]
        told = self._call("save", gone)
        if type(told) is not int:
            self._garbled("no number of a state")
        return _Saved(told, self._gone)

    def restore(self, state: _Saved) -> None:
        self._call("restore", state.number)

    def freeze(self) -> bytes:
        told = self._call("freeze", most=DESCRIPTION)
        try:
            return base64.b64decode(told, validate=True)
        except (TypeError, ValueError):
            self._garbled("no bytes of a state")

    def thaw(self, frozen: bytes) -> None:
        self._call("thaw", frozen)

    def reset(self) -> None:
        self._call("reset")
        self.untaken = {}

    def suits(self, given: Mapping[str, Any]) -> bool:
        return self._call("suits", dict(given)) is True

    def terminate(self) -> None:
        self._call("terminate")

    def close(self) -> None:
        patience = PATIENCE
        try:
            if self._asked:  # and nobody waits for it any more, as after Ctrl-C
                patience = 0.0
            else:
                self._line.send(pickle.dumps(("close", ())))
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


class _Saved:
    """A state that the process keeps, by its number, until nobody here does."""

    def __init__(self, number: int, gone: list[int]):
        self.number, self.gone = number, gone

    def __del__(self):
        self.gone.append(self.number)  # told with the next state that is saved


# --- the other side ----------------------------------------------------------------------------------------------


def serve(descriptor: int, lacks: Sequence[str] = ()) -> None:
    """The life of the process: one FMU, asked through `descriptor`. lacks: what isolation could not take away."""
    isolation.with_parent()
    line = Line(socket.socket(fileno=descriptor))
    host = _Host(lacks)
    while True:
        try:
            message = line.receive(1 << 31)
        except (EOFError, OSError):
            return
        if message[:1] in (_STEP, _WRITE, _READ):
            line.send(host.short(message))
            continue
        method, arguments = pickle.loads(message)
        if method == "close":
            host.close()
            return
        try:
            line.send(answer(host.call(method, arguments), host.log()))
        except SelflockError as error:
            line.send(complaint(error, host.log()))


class _Host:
    """The FMU in this process, with its states and its last failure."""

    part: Part  # from "open" on, which is asked first

    def __init__(self, lacks: Sequence[str]):
        self.lacks, self.opened = list(lacks), False
        self.states: dict[int, Any] = {}
        self.saved = 0
        self.error: SelflockError | None = None

    def log(self) -> list[str]:
        return list(self.part.log) if self.opened else []

    def call(self, method: str, arguments: tuple) -> Any:
        if method == "open":
            from .anybody import part_of
            from .binary import open_fmu

            name, path, unlimited, tolerance, interface, given = arguments
            open_fmu(path, unlimited)
            self.part, self.opened = part_of(name, path, tolerance, interface, given), True
            return described(self.part)
        if method == "lacks":
            return self.lacks
        if method == "bind":
            return self.bind(*arguments)
        if method == "exit_initialization":
            self.part.exit_initialization()
            return self.part.untaken
        if method == "failure":
            raise self.error or SelflockError("nothing failed")
        if method == "freeze":
            return base64.b64encode(self.part.freeze()).decode()
        if method == "save":
            for gone in arguments[0]:
                self.states.pop(gone, None)
            self.saved += 1
            self.states[self.saved] = self.part.save()
            return self.saved
        if method == "restore":
            return self.part.restore(self.states[arguments[0]])
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
                if part.ends:
                    return part.y.tobytes() + _ENDED.pack(part.ends[-1][1])
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
