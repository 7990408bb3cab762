"""FMUs that are not packed as they should be: folders like unpacked ones, names in other letters, a folder around it all."""

from __future__ import annotations

import os
import zipfile
from collections.abc import Iterator
from pathlib import Path

from ..fmus import temporary
from .archive import ENTRIES, LARGEST
from .errors import DescriptionError

DESCRIPTION = "modelDescription.xml"
NAMES = (DESCRIPTION, "binaries", "resources")

_packed: dict[tuple, Path] = {}  # by the folder and what is in it


def is_fmu(path: Path) -> bool:
    """Whether a folder is like an unpacked FMU."""
    return (path / DESCRIPTION).is_file()


def packed(path: Path) -> Path:
    """The FMU at `path`: a file as it is; of a folder like an unpacked one an archive, made once for what is in it.

    Raises DescriptionError.
    """
    if not path.is_dir():
        return path
    if not is_fmu(path):
        raise DescriptionError(f"{path} is a folder but no FMU: it has no {DESCRIPTION}.")
    try:
        files = sorted(_files(path))
        known = path.resolve(), *((name, status.st_size, status.st_mtime_ns) for name, status in files)
        if known not in _packed:
            made = temporary.folder("fmu_") / f"{path.resolve().stem}.fmu"
            with zipfile.ZipFile(made, "w") as archive:
                for name, _ in files:
                    archive.write(path / name, name)
            _packed[known] = made
    except (OSError, ValueError) as error:
        raise DescriptionError(f"{path} cannot be read: {getattr(error, 'strerror', None) or error}.") from None
    return _packed[known]


def _files(path: Path) -> Iterator[tuple[str, os.stat_result]]:
    """The files of a folder and what they are like; refused is what an archive could not hold."""
    count = room = 0
    for folder, _, names in os.walk(path):
        for name in names:
            file = Path(folder, name)
            status = file.lstat()
            if not file.is_file() or file.is_symlink():
                raise DescriptionError(f"{file} is a link or a device, no file; nothing outside {path} is read.")
            count, room = count + 1, room + status.st_size
            if count > ENTRIES or room > LARGEST:
                raise DescriptionError(f"{path} holds more than {ENTRIES} files or {LARGEST >> 20} MiB: pack it into a .fmu.")
            yield file.relative_to(path).as_posix(), status


def tidy(folder: Path) -> list[str]:
    """Put what was unpacked into `folder` where it should lie, and tell what was moved."""
    notes = []
    if _alike(folder, DESCRIPTION) is None:
        inner = [one for one in folder.iterdir() if one.is_dir() and _alike(one, DESCRIPTION)]
        if len(inner) == 1:
            notes.append(f"all of it lies in a folder, {inner[0].name!r}, which is taken as the FMU")
            for one in list(inner[0].iterdir()):
                if not (folder / one.name).exists():
                    one.rename(folder / one.name)
    for name in NAMES:
        notes += renamed(folder, name)
    return notes


def renamed(folder: Path, name: str) -> list[str]:
    """Give what differs from `name` by its letters alone, A for a, that name: systems that do not tell them apart would find it."""
    if (folder / name).exists() or (found := _alike(folder, name)) is None:
        return []
    found.rename(folder / name)
    return [f"{found.name!r} is taken as {name!r}"]


def _alike(folder: Path, name: str) -> Path | None:
    """The one entry of a folder that has this name but for small and capital letters."""
    found = [one for one in folder.iterdir() if one.name.lower() == name.lower()] if folder.is_dir() else []
    return found[0] if len(found) == 1 else None
