"""The root of every error that selflock raises for a user's mistake; the tree of them stands in `selflock/errors.py`.

The command line prints the message of a SelflockError alone, without a traceback, and exits with 2.
"""


class SelflockError(Exception):
    """A mistake in what the user gave, told in one message that names the thing and says what to do."""


class Interrupted(SelflockError):
    """Somebody stopped the work; the message says what is kept."""


class BuildError(SelflockError):
    """An FMU cannot be packed."""


class EffectError(SelflockError):
    """An effect file of a user's own cannot be used."""
