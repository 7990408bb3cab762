"""Where a command writes to: a folder of its own, or none at all; files that are there whole. Only the standard library."""

from __future__ import annotations

import errno
import os
import stat
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from pathlib import Path

from .errors import SelflockError
from .shown import one_line

MARK = ".selflock"  # holds the name of the command whose folder it is
DOCUMENT = 256 << 20  # bytes of an answer that is read again


def claim(folder: Path, command: str, known: str) -> Path:
    """Make the folder, or refuse one with others' content before anything is written. known: a file that only this command makes."""
    mark, owner = folder / MARK, ""
    try:
        content = sorted(name for name in os.listdir(folder) if name != MARK)
        owner = mark.read_text("utf-8").strip()[:100]
    except FileNotFoundError:
        content = sorted(os.listdir(folder)) if folder.is_dir() else []
    except ValueError:
        pass
    if content and known not in content and owner != command:
        what = f"it is that of a {owner}" if owner else f"it holds {content[0]}"
        raise SelflockError(
            f"{folder} is not the folder of a {command}: {what}. Nothing in it was touched. Give an empty folder or a new one."
        )
    folder.mkdir(parents=True, exist_ok=True)
    if owner != command:
        mark.write_text(command + "\n", "utf-8")
    return folder


@contextmanager
def claimed(folder: str | Path | None, command: str, known: str) -> Iterator[Path | None]:
    """A folder as `claim` makes it, for work that leaves nothing of it where it is refused; None of none."""
    path = Path(folder) if folder else None
    with tidied(path):
        yield claim(path, command, known) if path else None


@contextmanager
def tidied(folder: Path | None) -> Iterator[None]:
    """Where work ends with an error before it wrote anything, the folders that it made are taken away again: `folder` and those above it."""
    made = [one for one in (folder, *folder.parents) if not one.exists()] if folder else []
    marked = folder is not None and (folder / MARK).exists()
    try:
        yield
    except BaseException:
        with suppress(OSError):
            if folder and not marked and os.listdir(folder) == [MARK]:
                (folder / MARK).unlink()
            for one in made:
                one.rmdir()  # which refuses one that holds anything
        raise


def ending(path: Path, most: int | None = None) -> Path:
    """The path, where what is there has an end: no device and no pipe, which are read for ever. most: bytes. Raises OSError."""
    try:
        status = named(path).stat()
    except ValueError:  # a zero byte
        raise OSError(errno.EINVAL, f"{str(path)!r} is no path of a file", str(path)) from None
    if not stat.S_ISREG(status.st_mode) and not stat.S_ISDIR(status.st_mode):  # a folder is told when it is read
        raise OSError(errno.EINVAL, "it is a device or a pipe, and no file", str(path))
    if most is not None and status.st_size > most:
        raise OSError(errno.EFBIG, f"it has {status.st_size >> 20} MiB, and {most >> 20} MiB at most are read", str(path))
    return path


def named(path: Path) -> Path:
    """The path, where it is one line: the second of two would pass for a line of ours in all that tells of the file. Raises OSError."""
    if "\n" in str(path):
        raise OSError(errno.EINVAL, "its name has a line break, rename it", one_line(path))
    return path


@contextmanager
def whole(path: Path) -> Iterator[Path]:
    """Where to write what is to be at `path`, whole or not at all: beside it, until it is moved there. An OSError names `path`."""
    new = path.with_name(path.name + ".new")
    try:
        yield new
        os.replace(new, path)
    except OSError as error:
        why = os.strerror(error.errno) if error.errno else str(error)
        raise OSError(error.errno or 0, why, str(path)) from None
    finally:
        new.unlink(missing_ok=True)
