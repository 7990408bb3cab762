"""From a log to a rig to begin with: what the columns are, by their names and, above all, by their numbers."""

from .init import Begun, rig_init

__all__ = ["Begun", "rig_init"]
