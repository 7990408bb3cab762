"""What is installed of the optional dependencies, and what to say where something is missing."""

from __future__ import annotations

import re
from importlib.metadata import requires
from traceback import walk_tb

NEEDED = re.compile(r"""([\w.-]+)[^;]*;\s*extra == ['"](\w+)['"]""")
GATHERED = {"all", "test", "dev", "docs", "masters"}


def holding(distribution: str) -> list[str]:
    """The extras that bring a distribution, in the order of pyproject.toml."""
    found = [match.groups() for line in requires("selflock") or [] if (match := NEEDED.match(line))]
    return [extra for name, extra in found if name.lower() == distribution.lower() and extra not in GATHERED]


def told(error: BaseException) -> str | None:
    """One sentence about the extra that is missing; None where the error is another, or no extra brings the module.

    Where several extras do, it is that of the room that asked for it.
    """
    absent = next((e for e in (error, error.__cause__) if isinstance(e, ModuleNotFoundError)), None)
    if absent is None:
        return None
    missing = (absent.name or "").partition(".")[0]  # each optional distribution is named as the module that it brings
    extras = holding(missing)
    if not extras:
        return None
    modules = [frame.f_globals.get("__name__", "") for frame, _ in walk_tb(absent.__traceback__)]
    rooms = [name.split(".")[1] for name in modules if name.startswith("selflock.")]
    extra = next((room for room in reversed(rooms) if room in extras), extras[0])
    return f"This needs {missing}, which is not installed: pip install 'selflock[{extra}]'"
