"""Archives of strangers (FMU, SSP): looked through before anything is unpacked, and bounded while it is."""

from __future__ import annotations

import shutil
import stat
import struct
import zipfile
import zlib
from io import BytesIO
from pathlib import Path, PurePosixPath
from typing import Any, BinaryIO
from xml.parsers import expat

from ..fmus.place import ending
from . import xml
from .errors import DescriptionError

ENTRIES = 10_000
LARGEST = 1 << 30  # bytes, of the archive and of all that is in it
RATIO = 200  # unpacked to packed,
SMALL = 32 << 20  # bytes: from which on the ratio counts
XML = 64 << 20  # bytes of one XML document
DIRECTORY = 16 << 20  # bytes of the list of contents
PIECE = 1 << 20
SAID = f"{ENTRIES} entries, {LARGEST >> 20} MiB unpacked and {RATIO} times its own size"


def unpack(path: Path, folder: Path, what: str, unlimited: bool = False) -> None:
    """Unpack the archive into a folder: all of it or, with a DescriptionError, nothing.

    what: it should be, such as "FMU".
    unlimited: of any number and size; names that leave the folder, links and encrypted files are refused all the same.
    """
    new = not folder.exists()
    try:
        ending(path)
        if not unlimited and (size := path.stat().st_size) > LARGEST:
            raise _too_much(path, f"it has {size >> 20} MiB")
        if not unlimited and (size := contents(path)) > DIRECTORY:
            raise _too_much(path, f"its list of contents has {size >> 20} MiB")
        with zipfile.ZipFile(path) as archive:
            room = None if unlimited else LARGEST
            for entry, name in _checked(archive, path, unlimited):
                room = _write(archive, entry, folder / name, path, room)
        folder.mkdir(parents=True, exist_ok=True)
    except BaseException as error:
        if new:
            shutil.rmtree(folder, ignore_errors=True)
        match error:
            case FileNotFoundError():
                raise DescriptionError(f"{error.filename or path}: there is no such file.") from None
            case zipfile.BadZipFile() | EOFError() | struct.error():
                said = f"{path} is not an {what}: it is not a zip archive, or it is cut off. Copy or build it again."
                raise DescriptionError(said) from None
            case OSError() | ValueError() | NotImplementedError():
                raise DescriptionError(f"{path} cannot be unpacked: {getattr(error, 'strerror', None) or error}.") from None
        raise


def _refuse(path: Path, what: str) -> DescriptionError:
    return DescriptionError(f"{path} is not unpacked: {what}.")


def _too_much(path: Path, what: str) -> DescriptionError:
    return _refuse(
        path,
        f"{what}. At most {SAID} are; --unlimited of run, sweep and export (unlimited=True in Python) takes these limits away",
    )


def contents(path: Path) -> int:
    """The bytes of an archive's list of contents, which ZipFile reads at once: looked at before it does."""
    with path.open("rb") as file:
        end = zipfile._EndRecData(file)  # type: ignore[attr-defined]
    return int(end[5]) if end else 0


def _checked(archive: zipfile.ZipFile, path: Path, unlimited: bool) -> list[tuple[zipfile.ZipInfo, str]]:
    """The files in the archive with the names that they get; refused by what the archive says of itself."""
    infos = archive.infolist()
    if not unlimited:
        total, packed = sum(one.file_size for one in infos), max(path.stat().st_size, 1)
        if len(infos) > ENTRIES:
            raise _too_much(path, f"it has {len(infos)} entries")
        if total > LARGEST:
            raise _too_much(path, f"it would take {total >> 20} MiB")
        if total > SMALL and total > RATIO * packed:
            raise _too_much(path, f"it would grow to {total // packed} times its size, {total >> 20} MiB")
    files: dict[str, zipfile.ZipInfo] = {}
    for one in infos:
        name, kind = one.filename.replace("\\", "/"), stat.S_IFMT(one.external_attr >> 16)  # as some tools of Windows write them
        parts = PurePosixPath(name).parts
        if not parts or name.startswith("/") or ".." in parts or ":" in name or not name.isprintable():
            raise _refuse(path, f"{name!r} in it lies outside the archive, or is no name that every system takes")
        if kind not in (0, stat.S_IFREG, stat.S_IFDIR):
            raise _refuse(path, f"{name!r} in it is a link or a device, no file")
        if one.flag_bits & 0x1:
            raise _refuse(path, f"{name!r} in it is encrypted. Ask for it without a password")
        if name.endswith("/"):
            continue
        plain = "/".join(parts)
        if plain in files and (one.CRC, one.file_size) != (files[plain].CRC, files[plain].file_size):
            raise _refuse(path, f"{name!r} is in it twice")
        files.setdefault(plain, one)
    for plain in files:
        if any(str(parent) in files for parent in PurePosixPath(plain).parents):
            raise _refuse(path, f"{plain!r} in it lies below another file")
    return [(one, plain) for plain, one in files.items()]


def _write(archive: zipfile.ZipFile, entry: zipfile.ZipInfo, target: Path, path: Path, room: int | None) -> int | None:
    """Unpack one file, piece by piece; the bytes that may still come."""
    target.parent.mkdir(parents=True, exist_ok=True)
    target.unlink(missing_ok=True)
    try:
        with archive.open(entry) as source, target.open("xb") as file:
            while piece := source.read(PIECE):
                if room is not None and (room := room - len(piece)) < 0:
                    raise _too_much(path, f"it holds more than it says, {entry.filename!r} in it first")
                file.write(piece)
        if entry.external_attr >> 16 & stat.S_IXUSR:  # a program that an FMU calls
            target.chmod(0o700)
    except (zipfile.BadZipFile, zlib.error, EOFError):
        raise DescriptionError(
            f"{path} is damaged: {entry.filename} in it does not match its checksum. Copy or build it again."
        ) from None
    return room


# --- XML ---------------------------------------------------------------------------------------------------------


class _Enough(Exception):
    pass


def root_of(file: Path, what: str, unlimited: bool = False) -> dict[str, str]:
    """The attributes of an XML document's root. Refused: what is no XML, is too large, or declares a document type.

    Entities, which grow without end or read other files, can only be declared in a document type; FMI and SSP have none.
    """
    if not unlimited and (size := ending(file).stat().st_size) > XML:
        raise DescriptionError(
            f"{what} has {size >> 20} MiB; at most {XML >> 20} MiB are read. --unlimited takes the limit away."
        )
    try:
        with file.open("rb") as source:
            found = _attributes(source, what)
    except (expat.ExpatError, ValueError, LookupError) as error:
        given = file.read_bytes()
        content, _ = xml.legible(xml.sound(given)[0])
        if content == given:
            raise DescriptionError(f"{what} cannot be understood: {error}") from None
        return _of_mended(content, what)
    return found


def _of_mended(content: bytes, what: str) -> dict[str, str]:
    try:
        return _attributes(BytesIO(content), what)
    except (expat.ExpatError, ValueError, LookupError) as error:
        raise DescriptionError(f"{what} cannot be understood: {error}") from None


def _attributes(source: BinaryIO, what: str) -> dict[str, str]:
    """The attributes of the root, or a sentence; raises what the parser does."""
    found: dict[str, str] = {}

    def start(name: str, attributes: dict[str, str]) -> Any:
        found.update(attributes)
        raise _Enough

    def refuse(*_: Any) -> Any:
        raise DescriptionError(f"{what} {xml.TYPED}")

    parser = expat.ParserCreate()
    parser.StartElementHandler, parser.StartDoctypeDeclHandler = start, refuse
    try:
        while piece := source.read(65536):
            parser.Parse(piece, False)
        parser.Parse(b"", True)
    except _Enough:
        return found
    raise DescriptionError(f"{what} cannot be understood: it is empty")
