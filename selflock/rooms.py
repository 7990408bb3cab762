"""How rooms offer what they have: loaded when it is first asked for, and a room called as its main function.

`selflock.study("out")` is `selflock.study.study("out")`: a package's attribute of a name is its subpackage of that name
once that is loaded; so the subpackage answers for both.
"""

from __future__ import annotations

import ast
import sys
from collections.abc import Callable
from importlib import import_module
from importlib.util import resolve_name
from pathlib import Path
from types import ModuleType
from typing import Any


class Room(ModuleType):
    """A module whose function of its own name is called with it."""

    def __call__(self, *arguments: Any, **named: Any) -> Any:
        return getattr(self, self.__name__.rpartition(".")[2])(*arguments, **named)


def called_as(name: str) -> None:
    """Make the module `name` one that is called."""
    sys.modules[name].__class__ = Room


def offered(name: str) -> tuple[Callable[[str], Any], Callable[[], list[str]]]:
    """`__getattr__` and `__dir__` of the module `name`: what it imports under `if TYPE_CHECKING:` is loaded when asked for.

    What is of the name of a room is that room.
    """
    module = sys.modules[name]
    package = module.__spec__.parent if module.__spec__ else None
    where = {}
    for block in ast.parse(Path(str(module.__file__)).read_text("utf-8")).body:
        if isinstance(block, ast.If) and ast.unparse(block.test) == "TYPE_CHECKING":
            for line in block.body:
                if isinstance(line, ast.ImportFrom):
                    source = resolve_name("." * line.level + (line.module or ""), package)
                    where.update({alias.asname or alias.name: (source, alias.name) for alias in line.names})

    def get(attribute: str) -> Any:
        if attribute not in where:
            raise AttributeError(f"module {name!r} has no attribute {attribute!r}")
        source, there = where[attribute]
        if f"{name}.{there}" == source or name == source:
            return import_module(f"{name}.{there}")
        return getattr(import_module(source), there)

    return get, lambda: sorted({*vars(module), *where})
