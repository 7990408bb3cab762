"""What can be wrong with a measurement or its description. The tree stands in fmus.errors."""

from selflock.fmus.errors import SelflockError


class DataError(SelflockError):
    """A rig or a log cannot be used; the message names file, line or column, and what to do."""
