"""What can go wrong with a sweep as a whole. A run that fails is no such error: it is a row with its reason."""

from selflock.fmus.errors import Interrupted as Interrupted
from selflock.fmus.errors import SelflockError


class SweepError(SelflockError):
    """A sweep cannot start or cannot go on. Whatever was finished is on disk and is not run again."""
