"""The line between the master and an FMU that lives elsewhere, and what may come over it.

The process may hold a stranger's code, so that what it answers is data and no more: numbers as bytes, all else as JSON,
bounded in size, every field of the type that it should have. Nothing of it is run, or made into an object that it names.
"""

from __future__ import annotations

import json
import socket
import struct
import time as clock
from collections.abc import Mapping, Sequence
from dataclasses import asdict, fields
from typing import Any

from ..fmus.errors import SelflockError
from ..fmus.units import BASES, Unit
from ..fmus.variable import CAUSALITIES, TYPES, Variable
from .errors import DescriptionError, PartFailed

DESCRIPTION = 256 << 20  # bytes of the largest answer: a description of some 10⁶ variables
VALUE = 4 << 20  # bytes of any other: a value, a log, an error
WORDS = 20_000  # characters of a line or an error that are kept
ABLE = "can_roll_back", "variable_step", "frozen", "instant", "interpolates"  # what a part says of itself, yes or no
_LENGTH = struct.Struct("!I")


class Garbled(Exception):
    """An answer that is none."""


class Line:
    """Messages of bytes over a socket, each after its length; one at a time, each way."""

    def __init__(self, end: socket.socket):
        self.end, self.patience = end, 0.0

    def wait(self, seconds: float) -> None:
        """From now on raise TimeoutError where an answer takes longer; 0: wait for ever."""
        if seconds != self.patience:
            self.patience = seconds
            whole = struct.pack("@ll", int(seconds), int(seconds % 1 * 1e6))
            for option in (socket.SO_RCVTIMEO, socket.SO_SNDTIMEO):
                self.end.setsockopt(socket.SOL_SOCKET, option, whole)

    def send(self, message: bytes) -> None:
        try:
            self.end.sendall(_LENGTH.pack(len(message)) + message)
        except BlockingIOError:
            raise TimeoutError from None

    def receive(self, most: int) -> bytes:
        """The next message. Raises Garbled, EOFError, TimeoutError, OSError."""
        got = self._some(65536)
        if len(got) >= 4 and len(got) == 4 + _LENGTH.unpack_from(got)[0] <= 4 + most:  # all at once, as a rule
            return got[4:]
        until, whole = clock.monotonic() + self.patience, bytearray(got)
        while len(whole) < 4 or len(whole) < 4 + (size := _size(whole, most)):
            if self.patience and clock.monotonic() > until:
                raise TimeoutError
            whole += self._some(1 << 20)
        if len(whole) > 4 + size:
            raise Garbled("more than was asked for")
        return bytes(whole[4:])

    def _some(self, most: int) -> bytes:
        try:
            got = self.end.recv(most)
        except BlockingIOError:
            raise TimeoutError from None
        if not got:
            raise EOFError
        return got

    def drain(self, seconds: float) -> None:
        """Wait until nobody holds the other end any more, or `seconds` are over."""
        until = clock.monotonic() + seconds
        self.wait(seconds)
        try:
            while clock.monotonic() < until:
                self._some(1 << 20)
        except (EOFError, OSError):
            pass

    def close(self) -> None:
        self.end.close()


def _size(message: bytearray, most: int) -> int:
    size = _LENGTH.unpack_from(message)[0]
    if size > most:
        raise Garbled(f"{size} bytes, where at most {most} are read")
    return size


# --- questions ----------------------------------------------------------------------------------------------------


def called(method: str, arguments: Sequence[Any]) -> bytes:
    return _json({"call": method, "arguments": list(arguments)})


def asked(message: bytes) -> tuple[str, list[Any]]:
    """The call in a message, and its arguments. Raises Garbled."""
    try:
        told = json.loads(message)
        method, arguments = told["call"], told["arguments"]
    except (ValueError, TypeError, KeyError, RecursionError) as error:
        raise Garbled(f"what is no question ({type(error).__name__})") from None
    if not isinstance(method, str) or not isinstance(arguments, list):
        raise Garbled("what is no question")
    return method, arguments


# --- answers -----------------------------------------------------------------------------------------------------


def answer(value: Any, log: list[str]) -> bytes:
    return _json({"value": value, "log": log})


def complaint(error: SelflockError, log: list[str]) -> bytes:
    told: dict[str, Any] = {"message": str(error), "description": isinstance(error, DescriptionError)}
    if isinstance(error, PartFailed):
        told["failed"] = [error.time, error.size, error.status, error.inputs, error.log, error.hint]
    return _json({"error": told, "log": log})


def understood(message: bytes, name: str) -> tuple[Any, list[str], SelflockError | None]:
    """Value, log and error in an answer from the part `name`. Raises Garbled."""
    try:
        told = json.loads(message)
        log = [_text(line) for line in told["log"][-50:]]
        return told.get("value"), log, _error(told["error"], name) if "error" in told else None
    except (ValueError, TypeError, KeyError, AttributeError, OverflowError, RecursionError) as error:
        raise Garbled(f"what is no answer ({type(error).__name__})") from None


def _error(told: dict[str, Any], name: str) -> SelflockError:
    if "failed" not in told:
        return (DescriptionError if told["description"] is True else SelflockError)(_text(told["message"]))
    time, size, status, inputs, log, hint = told["failed"]
    given = {_text(key): value if isinstance(value, (int, float)) else _text(value) for key, value in inputs.items()}
    return PartFailed(name, float(time), float(size), _text(status), given, [_text(line) for line in log[-50:]], _text(hint))


def described(part: Any) -> dict[str, Any]:
    """What a part says of itself."""
    return {
        "variables": [asdict(v) for v in part.variables.values()],
        "units": {name: list(unit) for name, unit in part.units.items()},
    } | {what: bool(getattr(part, what)) for what in ABLE}


def description(told: Any) -> dict[str, Any]:
    """The same on the other side: attributes of a part by their names. Raises Garbled."""
    try:
        variables = [_variable(v) for v in told["variables"]]
        units = {_text(name): _unit(*unit) for name, unit in told["units"].items()}
        return {"variables": {v.name: v for v in variables}, "units": units} | {what: bool(told[what]) for what in ABLE}
    except (ValueError, TypeError, KeyError, AttributeError, OverflowError) as error:
        raise Garbled(f"a description that is none ({type(error).__name__})") from None


def _variable(told: dict[str, Any]) -> Variable:
    kinds = {f.name: str(f.type) for f in fields(Variable)}
    given: dict[str, Any] = {}
    for name, value in told.items():
        kind = kinds[name]
        if kind == "str":
            given[name] = _text(value)
        elif value is None:
            given[name] = None
        elif kind.startswith("float"):
            given[name] = float(value)
        elif kind.startswith("tuple"):
            given[name] = tuple(_text(v) for v in value)
        else:
            given[name] = value if isinstance(value, (bool, int, float)) else _text(value)
    if given["type"] not in [kind for _, kind in TYPES] or given["causality"] not in CAUSALITIES:
        raise ValueError("an unknown type or causality")
    return Variable(**given)


def _unit(powers: Any, factor: Any, offset: Any) -> Unit:
    if len(powers) != len(BASES):
        raise ValueError("powers of other bases")
    return Unit(tuple(int(p) for p in powers), float(factor), float(offset))


def value_of(variable: Variable | None, told: Any) -> Any:
    """A value as its variable's type wants it. Raises Garbled."""
    wanted = {"Real": float, "Integer": int, "Boolean": bool, "String": str}[variable.type if variable else "Real"]
    if type(told) is not wanted:
        raise Garbled(f"a {type(told).__name__} as the value of {variable.name if variable else 'nothing'}")
    return told


def values(variables: Mapping[str, Variable], told: Any) -> dict[str, Any]:
    """Values by the names of variables, None where there is none. Raises Garbled."""
    if not isinstance(told, dict) or any(name not in variables for name in told):
        raise Garbled("no values of variables")
    return {name: None if value is None else value_of(variables[name], value) for name, value in told.items()}


def numbers(told: Any, count: int) -> list[float]:
    """`count` numbers. Raises Garbled."""
    if not isinstance(told, list) or len(told) != count or any(type(number) is not float for number in told):
        raise Garbled(f"no {count} numbers")
    return told


def _text(told: Any) -> str:
    if not isinstance(told, str):
        raise TypeError("text is wanted")
    return told[:WORDS]


def _json(told: Any) -> bytes:
    return json.dumps(told, default=_plain).encode()


def _plain(value: Any) -> Any:
    """A number of numpy as one of Python."""
    return value.item()
