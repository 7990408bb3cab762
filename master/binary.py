"""What an FMU file holds, unpacked once per content: its description, its library, its voice.

Unpacking goes to a plain ASCII folder (pythonfmu decodes nothing but %20 in the resource URI), shared by all
instances of the same content and removed at exit. Logging is always on; the last lines of every instance are kept.
"""

from __future__ import annotations

import ctypes
import itertools
import logging
import os
import re
import shutil
import tempfile
from collections import deque
from dataclasses import dataclass, field
from functools import cache
from pathlib import Path

import fmpy
import pythonfmu  # noqa: F401  ours first: FMUs made with it put the folder with their own at the head of sys.path
from fmpy import fmi1, fmi2, fmi3
from fmpy.model_description import InterfaceType, ModelDescription

from ..fmus import temporary
from ..fmus.cache import sha256
from ..fmus.place import ending
from . import archive
from .described import chosen, is_name, offered
from .errors import DescriptionError, warn
from .folder import packed, renamed, tidy
from .reading import read_description, version_of

log = logging.getLogger(__name__)

LINES_KEPT = 50
STATUS = ("OK", "Warning", "Discard", "Error", "Fatal", "Pending")


PLATFORMS = fmpy.platform, fmpy.platform_tuple  # the folder of this machine's binaries, in FMI 1.0 and 2.0 and in 3.0
VERSIONS = ("1.0", "2.0", "3.0")


@dataclass
class Binary:
    """An unpacked FMU and its libraries, loaded when they are first wanted."""

    path: Path
    folder: Path
    description: ModelDescription
    _loaded: dict[str, ctypes.CDLL] = field(default_factory=dict)

    def interface(self, wanted: str = "") -> tuple[str, InterfaceType]:
        """The interface to couple it by, "cs", "me" or "se", and what it says of it. Raises DescriptionError."""
        name = chosen(self.description, self.path, wanted)
        return name, offered(self.description)[name]

    def library(self, identifier: str) -> ctypes.CDLL:
        """Its library of that modelIdentifier. Raises DescriptionError."""
        if identifier not in self._loaded:
            self._loaded[identifier] = self._load(identifier)
        return self._loaded[identifier]

    def _load(self, identifier: str) -> ctypes.CDLL:
        _check_binary(self.folder, self.description, identifier, self.path)
        file = _file(self.folder, self.description, identifier)
        try:
            return _with_its_own(file)
        except OSError as error:
            said = str(error)
            missing = _missing(error)
            if missing and (file.parent / missing).is_file():
                missing, said = "", f"{missing}, which it needs, lies beside it without a soname, by which Linux would know it"
            why = (
                f"it needs the system library {missing}, which is not on this machine. Install what brings it, or export the "
                "FMU with its libraries inside"
                if missing
                else said
            )
            raise DescriptionError(f"The binary of {self.path} cannot be loaded: {why}.") from None


def _missing(error: OSError) -> str:
    """The library that another one needs and that is not found, as Linux says it; "" where it is something else."""
    found = re.match(r"([^/:]+): cannot open shared object file", str(error))
    return found[1] if found else ""


def _with_its_own(file: Path, loaded: set[str] | None = None) -> ctypes.CDLL:
    """A library, and before it those that it needs where they lie beside it: Linux does not look there by itself.

    It then knows them by their soname; one that has none it does not find all the same.
    """
    mode, loaded = (ctypes.DEFAULT_MODE, set()) if loaded is None else (ctypes.RTLD_GLOBAL, loaded)
    while True:
        try:
            return ctypes.CDLL(str(file), mode)
        except OSError as error:
            needed = _missing(error)
            if not needed or needed in loaded or not (file.parent / needed).is_file():
                raise
        loaded.add(needed)
        _with_its_own(file.parent / needed, loaded)


def open_fmu(path: Path | str, unlimited: bool = False) -> Binary:
    """The FMU at `path`, a file or a folder, unpacked; the same content is unpacked once per process. unlimited: of any size."""
    path = packed(Path(path))
    try:
        if not unlimited and ending(path).stat().st_size > archive.LARGEST:
            raise DescriptionError(
                f"{path} has {path.stat().st_size >> 20} MiB; at most {archive.SAID} are unpacked. --unlimited of run, sweep and export takes these limits away."
            )
        digest = sha256(ending(path))
    except FileNotFoundError:
        raise DescriptionError(f"There is no FMU at {path}. Check the path; it is relative to the system file.") from None
    except OSError as error:
        raise DescriptionError(f"{path} cannot be read: {error.strerror}.") from None
    return _open(digest, path, unlimited)


def describe(folder: Path, path: Path, unlimited: bool = False) -> ModelDescription:
    """The model description of the FMU of `path`, unpacked in `folder`, checked for what this master couples."""
    moved = tidy(folder)
    if not (folder / "modelDescription.xml").is_file():
        raise DescriptionError(f"{path} is a zip file but no FMU: it has no modelDescription.xml.")
    what = f"The modelDescription.xml of {path}"
    version = version_of(archive.root_of(folder / "modelDescription.xml", what, unlimited).get("fmiVersion", ""))
    if version not in VERSIONS and not version.startswith(("2.0.", "3.0.")):
        raise DescriptionError(
            f"{path} is FMI {version or 'of no version'}; FMI {', '.join(VERSIONS[:-1])} and 3.0 are coupled here."
        )
    try:
        description, mended = read_description(folder)
    except Exception as error:  # whatever a parser meets in a foreign file
        raise DescriptionError(f"{what} cannot be understood: {error}") from None
    has = offered(description)
    if not has:
        raise DescriptionError(f"{path} is for nothing: its modelDescription.xml names neither co-simulation nor model exchange.")
    for way in list(has.values())[:1]:
        if not is_name(way.modelIdentifier or ""):
            said = f"{way.modelIdentifier!r} is no modelIdentifier" if way.modelIdentifier else "it has no modelIdentifier"
            raise DescriptionError(f"{path}: {said}, which names its binary.")
        moved += _check_binary(folder, description, way.modelIdentifier, path)
    _check_script(folder, path)
    for note in moved + mended:
        warn(f"{path}: {note}")
    return description


def _platform(folder: Path, description: ModelDescription) -> str:
    """The folder for this machine in an FMU of that version; that of another version where the FMU has it under that name."""
    own, other = PLATFORMS
    if description.fmiMajorVersion == 3:
        own, other = other, own
    there = [(folder / "binaries" / one).is_dir() for one in (own, other)]
    return other if there == [False, True] else own


def _check_binary(folder: Path, description: ModelDescription, identifier: str, path: Path) -> list[str]:
    """Refuse an FMU without a binary of that modelIdentifier for this machine. Tells whose name had other letters."""
    notes = [note for name in PLATFORMS for note in renamed(folder / "binaries", name)]
    file = _file(folder, description, identifier)
    notes += renamed(file.parent, file.name)
    if file.is_file():
        return notes
    own = _platform(folder, description)
    if not file.parent.is_dir():
        has = sorted(one.name for one in (folder / "binaries").iterdir()) if (folder / "binaries").is_dir() else []
        sources = (folder / "sources").is_dir()
        said = f"{path} has no binary for this machine ({own}; it has: {', '.join(has + ['c-code'] * sources) or 'none'}). Export it for {own}"
        raise DescriptionError(f"{said}, or compile its sources into it: `fmpy compile {path.name}`." if sources else f"{said}.")
    there = ", ".join(sorted(one.name for one in file.parent.iterdir())[:5]) or "nothing"
    raise DescriptionError(
        f"{path} has no binary named after its modelIdentifier: in {file.parent.relative_to(folder)} there is {there}, "
        f"not {file.name}. Whoever made it must build it again."
    )


def _file(folder: Path, description: ModelDescription, identifier: str) -> Path:
    """Where the binary of an unpacked FMU lies, on this machine."""
    return folder / "binaries" / _platform(folder, description) / f"{identifier}{fmpy.sharedLibraryExtension}"


def _check_script(folder: Path, path: Path) -> None:
    """Of an FMU in Python: that there is the script that it names. pythonfmu itself ends the process where there is none."""
    file = folder / "resources" / "slavemodule.txt"
    if file.is_file():
        with file.open("rb") as source:
            name = source.read(1000).decode("utf-8", "replace").strip()
        if (
            len(name) > 200
            or not name.isprintable()
            or set(name) & set("/\\")
            or not (folder / "resources" / f"{name}.py").is_file()
        ):
            raise DescriptionError(f"{path}: resources/slavemodule.txt names no script beside it: {name[:60]!r}. Build it again.")


def root() -> Path:
    """The folder under which FMUs are unpacked in this process; one that was forked has its own, or two would unpack an FMU in one place."""
    return _root(os.getpid())


@cache
def _root(process: int) -> Path:
    base = tempfile.gettempdir()
    plain = base.isascii() and not set(base) & set(" #%()[]+")
    return temporary.folder(base=base if plain else "/tmp")


_opened: dict[str, Binary] = {}


def _open(digest: str, path: Path, unlimited: bool) -> Binary:
    if digest not in _opened:
        folder = root() / digest[:16]
        log.info("unpacking %s", path)
        archive.unpack(path, folder, "FMU", unlimited)
        try:
            _opened[digest] = Binary(path, folder, describe(folder, path, unlimited))
        except BaseException:
            shutil.rmtree(folder, ignore_errors=True)
            raise
    return _opened[digest]


# --- the voice of the instances ----------------------------------------------------------------------------------

_voices: dict[int | bytes, deque[str]] = {}  # by the number given as environment, and by the instance's name
_numbers = itertools.count(1)


@fmi2.fmi2CallbackLoggerTYPE
def _hear(environment, instance, status, category, message):
    """The logger of every instance: its line goes to the one that `environment` numbers, else to the one of that name."""
    _hear_line(environment, instance, status, message)


def _hear_line(environment: int | None, instance: bytes, status: int, message: bytes | None) -> None:
    lines = _voices.get(environment or 0, _voices.get(instance))
    if lines is not None:
        text = (message or b"").decode("utf-8", "replace").rstrip()
        lines.append(f"{STATUS[status] if 0 <= status < 6 else status}: {text}")


@fmi3.fmi3LogMessageCallback
def hear3(environment, status, category, message):
    """The same in FMI 3.0, whose lines come formatted."""
    _hear_line(environment, b"", status, message)


@fmi3.fmi3ClockUpdateCallback
def clock_update(_):
    """A clock of scheduled execution has news: they are asked after each partition anyway."""


@fmi3.fmi3LockPreemptionCallback
def lock():
    """Partitions are run one after the other; none interrupts another."""


@cache
def _proxy() -> ctypes.CDLL:
    """FMPy's C library that formats the logger's printf arguments; a copy of it, for it serves one logger only."""
    name = f"logging{fmpy.sharedLibraryExtension}"
    copy = root() / name
    shutil.copy(Path(fmpy.__file__).parent / "logging" / fmpy.platform / name, copy)
    library = ctypes.CDLL(str(copy))
    library.addLoggerProxy.argtypes, library.addLoggerProxy.restype = [ctypes.c_void_p], None
    return library


def voice(instance: str) -> tuple[int, deque[str]]:
    """A number for one instance, to be given as its environment, and the list in which its log lines arrive."""
    number = next(_numbers)
    lines: deque[str] = deque(maxlen=LINES_KEPT)
    _voices[number] = _voices[instance.encode()] = lines
    return number, lines


def callbacks(number: int) -> fmi2.fmi2CallbackFunctions:
    """The callback functions for the instance of that number."""
    functions = fmi2.fmi2CallbackFunctions()
    functions.logger = _hear
    functions.allocateMemory = fmi2.defaultCallbacks.allocateMemory
    functions.freeMemory = fmi2.defaultCallbacks.freeMemory
    functions.componentEnvironment = number
    _proxy().addLoggerProxy(ctypes.byref(functions))
    return functions


def callbacks1(number: int) -> fmi1.fmi1CallbackFunctions:
    """The same in FMI 1.0, which knows no environment: lines come by the instance's name."""
    functions = fmi1.fmi1CallbackFunctions()
    functions.logger = ctypes.cast(callbacks(number).logger, fmi1.fmi1CallbackLoggerTYPE)
    functions.allocateMemory = fmi1.defaultCallbacks.allocateMemory
    functions.freeMemory = fmi1.defaultCallbacks.freeMemory
    return functions


def forget(number: int) -> None:
    """Listen no more to an instance that is gone."""
    _voices.pop(number, None)
