"""What is kept from run to run, in a folder that nobody else can write to; checked before it is used, mended where it is off.

Only the standard library, for Python 3.9: Robot.fmu carries this file.
"""

from __future__ import annotations

import atexit
import hashlib
import logging
import os
import shutil
import stat
import tempfile
from functools import cache
from pathlib import Path
from typing import Any, Callable

COMPILED = "__pycache__"  # what Python and numba keep beside sources


def folder() -> Path:
    """SELFLOCK_CACHE, else the user's cache folder; else, where that is not the user's alone to write to, one for this process."""
    caches = os.environ.get("XDG_CACHE_HOME") or os.path.expanduser("~/.cache")
    home = Path(os.environ.get("SELFLOCK_CACHE") or os.path.join(caches, "selflock"))
    try:
        home.mkdir(mode=0o700, parents=True, exist_ok=True)
        if os.access(home, os.W_OK | os.X_OK) and not (why := _objection(home)):
            return home
    except OSError as error:
        why = error.strerror or str(error)
    return _own(str(home), why or "it cannot be written to")


def _objection(path: Path) -> str:
    """Why a file or folder may hold what others put there."""
    if not hasattr(os, "geteuid"):
        return ""
    link, real = path.lstat(), path.stat()
    if link.st_uid != os.geteuid() or real.st_uid != os.geteuid():
        return "it belongs to another user"
    if real.st_mode & (stat.S_IWGRP | stat.S_IWOTH):
        return f"others can write to it; chmod 700 {path} after a look at what is in it"
    return ""


@cache
def _own(home: str, why: str) -> Path:
    """A folder that lives as long as the process, with a name that nobody can know before."""
    logging.getLogger("selflock").warning("the cache %s is not used: %s", home, why)
    made = tempfile.mkdtemp(prefix="selflock_cache_")
    atexit.register(shutil.rmtree, made, ignore_errors=True)
    return Path(made)


def write(path: Path, content: bytes, mode: int = 0o644) -> None:
    """Write at once or not at all: nobody ever sees half a file."""
    path.parent.mkdir(parents=True, exist_ok=True)
    handle, unfinished = tempfile.mkstemp(dir=str(path.parent), prefix=path.stem, suffix=".part")
    try:
        with os.fdopen(handle, "wb") as file:
            file.write(content)
        os.chmod(unfinished, mode)
        os.replace(unfinished, path)
    except BaseException:
        Path(unfinished).unlink(missing_ok=True)
        raise


def sha256(path: Path) -> str:
    """Of a file's bytes, in hexadecimal digits."""
    digest = hashlib.sha256()
    with path.open("rb") as file:
        while part := file.read(1 << 20):
            digest.update(part)
    return digest.hexdigest()


def kept(name: str, make: Callable[[Path], Any]) -> Path:
    """The file `name` in the cache, made by make(path) where it is not there, or not as it was made."""
    path = folder() / name
    seal = path.with_name(path.name + ".sha256")
    try:
        if not _objection(path) and sha256(path) == seal.read_text():
            return path
    except (OSError, ValueError):
        pass
    if path.is_dir() and not path.is_symlink():
        shutil.rmtree(path)
    make(path)
    write(seal, sha256(path).encode())
    return path


def copied(name: str, files: dict[str, bytes]) -> Path:
    """The folder `name` in the cache that holds these files (by their paths in it) and nothing but what was compiled of them."""
    target = folder() / name
    if _same(target, files):
        return target
    target.parent.mkdir(parents=True, exist_ok=True)
    draft = Path(tempfile.mkdtemp(dir=str(target.parent), prefix="draft_"))
    try:
        for path, content in files.items():
            (draft / path).parent.mkdir(parents=True, exist_ok=True)
            (draft / path).write_bytes(content)
        for _ in range(3):  # another process may be as far: its copy is as good, once it is looked at
            try:
                os.replace(draft, target)
                return target
            except OSError:
                if _same(target, files):
                    return target
                _away(target)
        raise OSError(f"{target} cannot be mended; remove it")
    finally:
        shutil.rmtree(draft, ignore_errors=True)


def _away(target: Path) -> None:
    """Take what is not as it should be out of the way, at once."""
    aside = tempfile.mkdtemp(dir=str(target.parent), prefix="broken_")
    try:
        os.replace(target, os.path.join(aside, "it"))
    except OSError:  # another process was faster
        pass
    shutil.rmtree(aside, ignore_errors=True)


def _same(target: Path, files: dict[str, bytes]) -> bool:
    try:
        if target.is_symlink() or _objection(target):
            return False
        there = {
            path.relative_to(target).as_posix(): path
            for path in target.rglob("*")
            if COMPILED not in path.parts and (path.is_symlink() or not path.is_dir())
        }
        return there.keys() == files.keys() and all(
            not path.is_symlink() and path.read_bytes() == files[name] for name, path in there.items()
        )
    except OSError:
        return False


def sealed(function: Any) -> Any:
    """A function compiled by numba, of which what is on disk is checked before it is loaded; compiled again where it is off."""
    file = getattr(getattr(function, "_cache", None), "_cache_file", None)
    if file is not None:
        file.__class__ = _sealed(file.__class__)
    return function


@cache
def _sealed(kind: Any) -> type:
    class Sealed(kind):
        def _load_index(self) -> Any:
            try:
                return super()._load_index()
            except Exception:  # whatever a torn file makes of pickle
                return {}

        def _load_data(self, name: str) -> Any:
            path = Path(self._data_path(name))
            if sha256(path) != Path(f"{path}.sha256").read_text():
                raise OSError(name)  # numba then compiles it
            try:
                return super()._load_data(name)
            except Exception as error:  # whole, and of another numba
                raise OSError(name) from error

        def _save_data(self, name: str, data: Any) -> None:
            super()._save_data(name, data)
            path = Path(self._data_path(name))
            write(Path(f"{path}.sha256"), sha256(path).encode())

    return Sealed
