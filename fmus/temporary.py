"""Folders for what is needed for a while: gone with the process, however it ends; what a killed one left, the next takes away.

Each holds a lock as long as its process lives. Only the standard library.
"""

from __future__ import annotations

import atexit
import os
import secrets
import shutil
import stat
import tempfile
import time
from functools import cache
from importlib import import_module
from pathlib import Path
from types import ModuleType

fcntl: ModuleType | None
try:
    fcntl = import_module("fcntl")
except ImportError:  # Windows, where nothing is swept up
    fcntl = None

PREFIX = "selflock_"
LOCK = ".lives"

_made: list[Path] = []
_locks: list[int] = []  # kept open; a process that was forked holds them, too


def folder(kind: str = "", base: str | None = None) -> Path:
    """A new folder below `base`, the user's temporary folder where none is given; gone at the end of the process."""
    base = base or tempfile.gettempdir()
    _sweep(base)
    made = Path(base) / f"{PREFIX}{kind}{secrets.token_hex(8)}"
    if not _made:
        atexit.register(_clear_own, os.getpid())
    _made.append(made)  # before it is there: Ctrl-C may come between any two lines
    made.mkdir(mode=0o700)
    if fcntl is not None:
        lock = os.open(made / LOCK, os.O_CREAT | os.O_RDWR, 0o600)
        fcntl.flock(lock, fcntl.LOCK_EX)
        _locks.append(lock)
    return made


def remove(path: Path) -> None:
    """Take a folder away before the end of the process."""
    shutil.rmtree(path, ignore_errors=True)


def clear() -> None:
    """Take all folders of this process away."""
    for made in _made:
        remove(made)
    _made.clear()


def _clear_own(process: int) -> None:
    if os.getpid() == process:  # else it was forked, and they are not its own
        clear()


@cache
def _sweep(base: str) -> None:
    """Take away what processes of this user have left that were killed: once in a process."""
    if fcntl is None:
        return
    try:
        found = [entry for entry in os.scandir(base) if entry.name.startswith(PREFIX) and entry.is_dir(follow_symlinks=False)]
    except OSError:
        return
    for entry in found:
        try:
            if entry.stat(follow_symlinks=False).st_uid == os.geteuid() and _left(os.path.join(entry.path, LOCK)):
                shutil.rmtree(entry.path, ignore_errors=True)
        except OSError:  # another process was faster
            pass


def _left(path: str) -> bool:
    """Whether a lock is there and nobody holds it."""
    assert fcntl is not None
    lock = os.open(path, os.O_RDWR | os.O_NOFOLLOW)
    try:
        status = os.fstat(lock)
        if not stat.S_ISREG(status.st_mode) or time.time() - status.st_mtime < 1.0:  # it may be made at this very instant
            return False
        fcntl.flock(lock, fcntl.LOCK_EX | fcntl.LOCK_NB)
        return True
    except OSError:
        return False
    finally:
        os.close(lock)
