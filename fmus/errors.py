"""The root of every error that selflock raises for a user's mistake.

    SelflockError
    ├── BuildError            an FMU cannot be packed                 (selflock.fmus.build)
    ├── DescriptionError      a system description is wrong           (selflock.master.errors)
    ├── PartFailed            a coupled part failed while it ran      (selflock.master.errors)
    ├── ResultError           a result file cannot be read or written (selflock.master.errors)
    ├── DataError             a rig or a log cannot be used           (selflock.diagnosis.errors)
    └── SweepError            a sweep cannot be run or gone on with   (selflock.sweep.errors)

The command line prints the message of a SelflockError alone, without a traceback, and exits with 2.
"""


class SelflockError(Exception):
    """A mistake in what the user gave, told in one message that names the thing and says what to do."""


class BuildError(SelflockError):
    """An FMU cannot be packed."""
