"""An FMU that lives elsewhere, in another process or on another machine, with the face of any part.

The numbers of a step are one short message each way; everything else is a call by name. What is said is data alone
(master.line): numbers as bytes, all else as JSON.
"""

from __future__ import annotations

import base64
import struct
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import Any, NoReturn

import numpy as np

from ..fmus.errors import SelflockError
from . import isolation
from .errors import DescriptionError, PartFailed
from .face import Part
from .line import (
    DESCRIPTION,
    VALUE,
    Garbled,
    Line,
    answer,
    asked,
    called,
    complaint,
    described,
    description,
    numbers,
    understood,
    value_of,
    values,
)

_STEP, _WRITE, _READ, _PROBE, _FAILED = b"s", b"w", b"r", b"p", b"!"  # no call begins with one of these
_TIMES = struct.Struct("<dd")
_ENDED = struct.Struct("<d")  # follows the numbers of a step in which the FMU ended the run
_FLOATS = np.dtype("<f8")
MOST = 1 << 28  # bytes of the largest question: a state given back
CALLS = """open lacks bind set get enter_initialization exit_initialization step save restore freeze thaw reset suits terminate
failure on_trial slopes tilt rate""".split()


class Distant(Part):
    """An FMU instance at the other end of a line."""

    parallel = True
    path: Path  # of the FMU, or what it is called there
    step_timeout: float  # s
    _line: Line

    def __init__(self, name: str):
        super().__init__(name)
        self._time = self._size = 0.0
        self._begun = False  # a step is under way
        self._gone: list[int] = []  # states that nobody will come back to
        self._asked = False  # an answer is due

    def _open(self, *given: Any) -> None:
        """given: arguments of "open"."""
        told = self._call("open", *given, most=DESCRIPTION)
        self.__dict__ |= self._sound(lambda: description(told))

    # --- talking -------------------------------------------------------------------------------------------------

    def _call(self, method: str, *arguments, most: int = VALUE) -> Any:
        self._line.wait(max(self.step_timeout, isolation.TIMEOUT))
        self._asked = True
        self._tell(called(method, arguments))
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
        """Say how the other end was lost."""
        raise NotImplementedError

    def _end(self, seconds: float) -> int | None:
        """Give the other end so long to end by itself, then be rid of it."""
        raise NotImplementedError

    def _words(self) -> list[str]:
        """What it said last."""
        return list(self.log)

    def _failed(self, how: str, hint: str) -> NoReturn:
        inputs = dict(zip(self.inputs, self.u.tolist()))
        raise PartFailed(self.name, self._time, self._size, how, inputs, self._words()[-10:], hint) from None

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
        self._sound(lambda: self._line.send(what + times + (b"" if what == _READ else self.u.astype(_FLOATS).tobytes())))

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
            self.y[:] = np.frombuffer(answered, _FLOATS)

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
        self._call("thaw", base64.b64encode(frozen).decode())

    def reset(self) -> None:
        self._call("reset")
        self.untaken = {}

    def suits(self, given: Mapping[str, Any]) -> bool:
        return self._call("suits", dict(given)) is True

    def terminate(self) -> None:
        self._call("terminate")

    def on_trial(self, begins: bool) -> None:
        self._call("on_trial", begins)

    def probe(self) -> None:
        self._short(_PROBE)

    def slopes(self, place: int) -> np.ndarray | None:
        told = self._call("slopes", place)
        return None if told is None else np.array(self._sound(lambda: numbers(told, len(self.y))))

    def tilt(self, rates: Mapping[int, float]) -> None:
        self._call("tilt", list(rates.items()))

    def rate(self, place: int) -> float:
        told = self._call("rate", place)
        return self._sound(lambda: numbers([told], 1))[0]


class _Saved:
    """A state that the process keeps, by its number, until nobody here does."""

    def __init__(self, number: int, gone: list[int]):
        self.number, self.gone = number, gone

    def __del__(self):
        self.gone.append(self.number)  # told with the next state that is saved


# --- the other side ----------------------------------------------------------------------------------------------


def answer_all(line: Line, host: Host) -> None:
    """Answer what is asked over a line until it ends."""
    while True:
        try:
            message = line.receive(MOST)
        except (EOFError, OSError, Garbled):
            break
        if message[:1] in (_STEP, _WRITE, _READ, _PROBE):
            line.send(host.short(message))
            continue
        try:
            method, arguments = asked(message)
            if method == "close":
                break
            line.send(answer(host.call(method, arguments), host.log()))
        except Garbled:
            break
        except SelflockError as error:
            line.send(complaint(error, host.log()))
    host.close()


class Host:
    """The FMU in this process, with its states and its last failure."""

    part: Part  # from "open" on, which is asked first

    def __init__(self, lacks: Sequence[str] = (), only: Path | None = None):
        """lacks: what isolation could not take away. only: the one FMU that may be asked for, whatever is."""
        self.only = only
        self.lacks, self.opened = list(lacks), False
        self.states: dict[int, Any] = {}
        self.saved = 0
        self.error: SelflockError | None = None

    def log(self) -> list[str]:
        return list(self.part.log) if self.opened else []

    def call(self, method: str, arguments: list[Any]) -> Any:
        if method not in CALLS or not (self.opened or method in ("open", "lacks")):
            raise SelflockError(f"{method[:50]!r} is nothing that can be asked here.")
        if method == "open":
            from .anybody import part_of
            from .binary import open_fmu

            name, path, unlimited, tolerance, interface, given = arguments
            if self.only is not None:
                if path and Path(path).name != self.only.name:
                    raise DescriptionError(f"{name}: {Path(path).name} is asked for, and {self.only.name} is served there.")
                path, unlimited = str(self.only), False
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
        if method == "thaw":
            return self.part.thaw(base64.b64decode(arguments[0]))
        if method == "tilt":
            return self.part.tilt(dict(arguments[0]))
        if method == "slopes":
            return None if (found := self.part.slopes(*arguments)) is None else found.tolist()
        return getattr(self.part, method)(*arguments)

    def bind(self, inputs: list[str], outputs: list[str]) -> list[float]:
        self.part.bind(inputs, outputs)
        self.cycle = self.part.stepper()
        return self.part.u.tolist()

    def short(self, message: bytes) -> bytes:
        part, what, numbers = self.part, message[:1], message[1:]
        try:
            if what == _STEP:
                part.u[:] = np.frombuffer(numbers[_TIMES.size :], _FLOATS)
                self.cycle(*_TIMES.unpack_from(numbers))
                if part.ends:
                    return part.y.astype(_FLOATS).tobytes() + _ENDED.pack(part.ends[-1][1])
            elif what == _WRITE:
                part.u[:] = np.frombuffer(numbers, _FLOATS)
                part.write()
            elif what == _PROBE:
                part.u[:] = np.frombuffer(numbers, _FLOATS)
                part.probe()
            else:
                part.read()
            return b"" if what == _WRITE else part.y.astype(_FLOATS).tobytes()
        except SelflockError as error:
            self.error = error
            return _FAILED

    def close(self) -> None:
        if self.opened:
            self.part.close()
