"""What can go wrong while coupling. The tree of all errors stands in `selflock/errors.py`."""

from __future__ import annotations

import logging
from functools import lru_cache
from typing import Any

from ..fmus.errors import SelflockError


@lru_cache(maxsize=1000)
def warn(sentence: str) -> None:
    """Log what does not end a run but bears on its numbers; each sentence once in a process, however many runs have it."""
    logging.getLogger("selflock").warning("%s", sentence)


class DescriptionError(SelflockError):
    """A system description is wrong: an unknown name, a missing connection, a unit or a type that does not fit."""


class ResultError(SelflockError):
    """A result file cannot be read or written."""


class SessionError(SelflockError):
    """A session cannot do what it was asked for: write what a connection feeds, go back where a part cannot, go beyond its stop."""


class RunInterrupted(KeyboardInterrupt):
    """Somebody ended a run. `result` is the Result of what was computed until then; the message says where that is."""

    def __init__(self, result: Any, message: str):
        self.result = result
        super().__init__(message)

    def __reduce__(self):  # across processes, without the results
        return KeyboardInterrupt, self.args


class TimeUp(SelflockError):
    """Work took longer than the time that it was given. Of a run, what was computed is kept."""

    result: Any = None  # of a run, the Result of what was computed until then


class PartFailed(SelflockError):
    """A part failed. Carries what a person needs to find out why; the run keeps its results so far."""

    result: Any = None  # the Result of what was computed until then (master.results, which stands above)

    def __init__(self, part: str, time: float, size: float, status: str, inputs: dict, log: list, hint: str = ""):
        self.part, self.time, self.size, self.status = part, time, size, status
        self.inputs, self.log, self.hint = inputs, log, hint
        said = "\n".join(f"    {line}" for line in log[-5:]) or "    (it said nothing)"
        numbers = ((name, f"{value:.6g}" if isinstance(value, float) else value) for name, value in inputs.items())
        given = ", ".join(f"{name} = {value}" for name, value in numbers)
        message = f"{part} answered {status} at t = {time:.9g} s (step {size:.3g} s).\n  its last words:\n{said}"
        if given:
            message += f"\n  its inputs: {given}"
        if hint:
            message += f"\n  try: {hint}"
        super().__init__(message)

    def __reduce__(self):  # across processes, without the results
        given = self.part, self.time, self.size, self.status, self.inputs, self.log, self.hint
        return PartFailed, given, {"args": self.args}
