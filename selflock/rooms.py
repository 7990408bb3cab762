"""A room that is called as its main function: `selflock.study("out")` is `selflock.study.study("out")`.

A package's attribute of a name is its subpackage of that name once that is loaded; so the subpackage answers for both.
"""

from __future__ import annotations

import sys
from types import ModuleType
from typing import Any


class Room(ModuleType):
    """A module whose function of its own name is called with it."""

    def __call__(self, *arguments: Any, **named: Any) -> Any:
        return getattr(self, self.__name__.rpartition(".")[2])(*arguments, **named)


def called_as(name: str) -> None:
    """Make the module `name` one that is called."""
    sys.modules[name].__class__ = Room
