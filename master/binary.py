"""What an FMU file holds, unpacked once per content: its description, its library, its voice.

Unpacking goes to a plain ASCII folder (pythonfmu decodes nothing but %20 in the resource URI), shared by all
instances of the same content and removed at exit. Logging is always on; the last lines of every instance are kept.
"""

from __future__ import annotations

import atexit
import ctypes
import hashlib
import itertools
import shutil
import tempfile
import zipfile
import zlib
from collections import deque
from dataclasses import dataclass
from functools import cache, cached_property
from pathlib import Path
from xml.etree import ElementTree

import fmpy
import pythonfmu  # noqa: F401  ours first: FMUs made with it put the folder with their own at the head of sys.path
from fmpy import fmi2
from fmpy.model_description import ModelDescription

from .errors import DescriptionError

LINES_KEPT = 50
STATUS = ("OK", "Warning", "Discard", "Error", "Fatal", "Pending")


@dataclass
class Binary:
    """An unpacked FMU and its library, loaded when it is first wanted."""

    path: Path
    folder: Path
    description: ModelDescription

    @cached_property
    def library(self) -> ctypes.CDLL:
        name = f"{self.description.coSimulation.modelIdentifier}{fmpy.sharedLibraryExtension}"
        try:
            return ctypes.CDLL(str(self.folder / "binaries" / fmpy.platform / name))
        except OSError as error:
            raise DescriptionError(
                f"The binary of {self.path} cannot be loaded: {error}. Something it needs is missing here."
            ) from None


def open_fmu(path: Path | str) -> Binary:
    """The FMU file at `path`, unpacked; the same content is unpacked once per process."""
    path = Path(path)
    try:
        content = path.read_bytes()
    except FileNotFoundError:
        raise DescriptionError(f"There is no FMU at {path}. Check the path; it is relative to the system file.") from None
    except OSError as error:
        raise DescriptionError(f"{path} cannot be read: {error.strerror}.") from None
    return _open(hashlib.sha256(content).hexdigest(), path)


def describe(path: Path | str) -> ModelDescription:
    """The model description of the FMU file at `path`, checked for what this master couples."""
    path = Path(path)
    try:
        with zipfile.ZipFile(path) as archive:
            broken = _damaged(archive)
            if broken:
                raise DescriptionError(f"{path} is damaged: {broken} in it does not match its checksum. Copy or build it again.")
            if "modelDescription.xml" not in archive.namelist():
                raise DescriptionError(f"{path} is a zip file but no FMU: it has no modelDescription.xml.")
    except (zipfile.BadZipFile, EOFError):
        raise DescriptionError(f"{path} is not an FMU: it is no zip file, or only part of one. Copy or build it again.") from None
    try:
        with zipfile.ZipFile(path) as archive:
            version = ElementTree.fromstring(archive.read("modelDescription.xml")).get("fmiVersion")
        if version != "2.0":
            raise DescriptionError(f"{path} is FMI {version}; only FMI 2.0 co-simulation is coupled here.")
        description = fmpy.read_model_description(str(path), validate=False)
    except DescriptionError:
        raise
    except Exception as error:  # whatever a parser meets in a foreign file
        raise DescriptionError(f"The modelDescription.xml of {path} cannot be understood: {error}") from None
    if description.coSimulation is None:
        raise DescriptionError(f"{path} is for model exchange only: it has no solver of its own. Export it for co-simulation.")
    if fmpy.platform not in fmpy.supported_platforms(str(path)):
        has = ", ".join(fmpy.supported_platforms(str(path))) or "none"
        raise DescriptionError(
            f"{path} has no binary for this machine ({fmpy.platform}; it has: {has}). Export it for {fmpy.platform}."
        )
    return description


def _damaged(archive: zipfile.ZipFile) -> str | None:
    """The first file in the archive that cannot be unpacked as it was packed."""
    for name in archive.namelist():
        try:
            archive.read(name)
        except (zipfile.BadZipFile, zlib.error, EOFError):
            return name
    return None


@cache
def _root() -> Path:
    """The folder under which FMUs are unpacked in this process."""
    base = tempfile.gettempdir()
    plain = base.isascii() and not set(base) & set(" #%()[]+")
    root = Path(tempfile.mkdtemp(prefix="selflock_", dir=base if plain else "/tmp"))
    atexit.register(shutil.rmtree, root, ignore_errors=True)
    return root


_opened: dict[str, Binary] = {}


def _open(digest: str, path: Path) -> Binary:
    if digest not in _opened:
        description = describe(path)
        folder = _root() / digest[:16]
        fmpy.extract(str(path), str(folder))
        _opened[digest] = Binary(path, folder, description)
    return _opened[digest]


# --- the voice of the instances ----------------------------------------------------------------------------------

_voices: dict[int | bytes, deque[str]] = {}  # by the number given as environment, and by the instance's name
_numbers = itertools.count(1)


@fmi2.fmi2CallbackLoggerTYPE
def _hear(environment, instance, status, category, message):
    """The logger of every instance: its line goes to the one that `environment` numbers, else to the one of that name."""
    lines = _voices.get(environment, _voices.get(instance))
    if lines is not None:
        text = (message or b"").decode("utf-8", "replace").rstrip()
        lines.append(f"{STATUS[status] if 0 <= status < 6 else status}: {text}")


@cache
def _proxy() -> ctypes.CDLL:
    """FMPy's C library that formats the logger's printf arguments; a copy of it, for it serves one logger only."""
    name = f"logging{fmpy.sharedLibraryExtension}"
    copy = _root() / name
    shutil.copy(Path(fmpy.__file__).parent / "logging" / fmpy.platform / name, copy)
    library = ctypes.CDLL(str(copy))
    library.addLoggerProxy.argtypes, library.addLoggerProxy.restype = [ctypes.c_void_p], None
    return library


def callbacks(instance: str) -> tuple[fmi2.fmi2CallbackFunctions, deque[str]]:
    """The callback functions for one instance, and the list in which its log lines arrive."""
    number = next(_numbers)
    lines: deque[str] = deque(maxlen=LINES_KEPT)
    _voices[number] = _voices[instance.encode()] = lines
    functions = fmi2.fmi2CallbackFunctions()
    functions.logger = _hear
    functions.allocateMemory = fmi2.defaultCallbacks.allocateMemory
    functions.freeMemory = fmi2.defaultCallbacks.freeMemory
    functions.componentEnvironment = number
    _proxy().addLoggerProxy(ctypes.byref(functions))
    return functions, lines


def forget(functions: fmi2.fmi2CallbackFunctions) -> None:
    """Listen no more to an instance that is gone."""
    _voices.pop(functions.componentEnvironment, None)
