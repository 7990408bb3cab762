"""All errors that selflock raises for a user's mistake.

    SelflockError
    ├── BuildError            an FMU cannot be packed                 (selflock.fmus.errors)
    ├── Interrupted           somebody stopped the work               (selflock.fmus.errors)
    ├── EffectError           an effect file cannot be used           (selflock.fmus.errors)
    ├── DescriptionError      a system description is wrong           (selflock.master.errors)
    ├── PartFailed            a coupled part failed while it ran      (selflock.master.errors)
    ├── ResultError           a result file cannot be read or written (selflock.master.errors)
    ├── SessionError          a session cannot do what it is asked    (selflock.master.errors)
    ├── TimeUp                work took longer than it was given      (selflock.master.errors)
    ├── DataError             a rig or a log cannot be used           (selflock.diagnosis.errors)
    └── SweepError            a sweep cannot be run or gone on with   (selflock.sweep.errors)

A run that a person ends by Ctrl-C raises selflock.master.RunInterrupted, a KeyboardInterrupt and no SelflockError, with the result so far.

Each names the thing and says what to do, in one message.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from selflock.fmus.errors import BuildError, EffectError, Interrupted, SelflockError
from selflock.rooms import offered

if TYPE_CHECKING:
    from selflock.diagnosis.errors import DataError
    from selflock.master.errors import DescriptionError, PartFailed, ResultError, SessionError, TimeUp
    from selflock.sweep.errors import SweepError

__all__ = [
    "BuildError",
    "DataError",
    "DescriptionError",
    "EffectError",
    "Interrupted",
    "PartFailed",
    "ResultError",
    "SelflockError",
    "SessionError",
    "SweepError",
    "TimeUp",
]

__getattr__, __dir__ = offered(__name__)
