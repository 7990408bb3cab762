"""What an FMU file holds, unpacked once per content: its description, its library, its voice.

Unpacking goes to a plain ASCII folder (pythonfmu decodes nothing but %20 in the resource URI), shared by all
instances of the same content and removed at exit. Logging is always on; the last lines of every instance are kept.
"""

from __future__ import annotations

import ctypes
import hashlib
import itertools
import re
import shutil
import tempfile
from collections import deque
from dataclasses import dataclass
from functools import cache, cached_property
from pathlib import Path

import fmpy
import pythonfmu  # noqa: F401  ours first: FMUs made with it put the folder with their own at the head of sys.path
from fmpy import fmi2
from fmpy.model_description import ModelDescription

from ..fmus import temporary
from . import archive
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
        try:
            return ctypes.CDLL(str(_file(self.folder, self.description)))
        except OSError as error:
            said = str(error)
            missing = re.match(r"([^/:]+): cannot open shared object file", said)  # as Linux says it of what is needed
            why = (
                f"it needs the system library {missing[1]}, which is not on this machine. Install what brings it, or export the "
                "FMU with its libraries inside"
                if missing
                else said
            )
            raise DescriptionError(f"The binary of {self.path} cannot be loaded: {why}.") from None


def open_fmu(path: Path | str, unlimited: bool = False) -> Binary:
    """The FMU file at `path`, unpacked; the same content is unpacked once per process. unlimited: of any size."""
    path = Path(path)
    try:
        if not unlimited and path.stat().st_size > archive.LARGEST:
            raise DescriptionError(
                f"{path} has {path.stat().st_size >> 20} MiB; at most {archive.SAID} are unpacked. --unlimited of run and export takes these limits away."
            )
        with path.open("rb") as file:
            digest = hashlib.file_digest(file, "sha256").hexdigest()
    except FileNotFoundError:
        raise DescriptionError(f"There is no FMU at {path}. Check the path; it is relative to the system file.") from None
    except OSError as error:
        raise DescriptionError(f"{path} cannot be read: {error.strerror}.") from None
    except ValueError as error:  # a zero byte in its name
        raise DescriptionError(f"{str(path)!r} is no path of a file: {error}.") from None
    return _open(digest, path, unlimited)


def describe(folder: Path, path: Path, unlimited: bool = False) -> ModelDescription:
    """The model description of the FMU of `path`, unpacked in `folder`, checked for what this master couples."""
    if not (folder / "modelDescription.xml").is_file():
        raise DescriptionError(f"{path} is a zip file but no FMU: it has no modelDescription.xml.")
    what = f"The modelDescription.xml of {path}"
    version = archive.root_of(folder / "modelDescription.xml", what, unlimited).get("fmiVersion")
    if version != "2.0":
        raise DescriptionError(f"{path} is FMI {version}; only FMI 2.0 co-simulation is coupled here.")
    try:
        description = fmpy.read_model_description(str(folder), validate=False)
    except Exception as error:  # whatever a parser meets in a foreign file
        raise DescriptionError(f"{what} cannot be understood: {error}") from None
    if description.coSimulation is None:
        raise DescriptionError(f"{path} is for model exchange only: it has no solver of its own. Export it for co-simulation.")
    has = fmpy.supported_platforms(str(folder))
    if fmpy.platform not in has:
        raise DescriptionError(
            f"{path} has no binary for this machine ({fmpy.platform}; it has: {', '.join(has) or 'none'}). "
            f"Export it for {fmpy.platform}."
        )
    if not re.fullmatch(r"[^\W\d]\w*", description.coSimulation.modelIdentifier or ""):
        raise DescriptionError(
            f"{path}: {description.coSimulation.modelIdentifier!r} is no modelIdentifier, which names its binary."
        )
    file = _file(folder, description)
    if not file.is_file():
        there = ", ".join(sorted(one.name for one in file.parent.iterdir())[:5]) or "nothing"
        raise DescriptionError(
            f"{path} has no binary named after its modelIdentifier: in {file.parent.relative_to(folder)} there is {there}, "
            f"not {file.name}. Whoever made it must build it again."
        )
    _check_script(folder, path)
    return description


def _file(folder: Path, description: ModelDescription) -> Path:
    """Where the binary of an unpacked FMU lies, on this machine."""
    return folder / "binaries" / fmpy.platform / f"{description.coSimulation.modelIdentifier}{fmpy.sharedLibraryExtension}"


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


@cache
def root() -> Path:
    """The folder under which FMUs are unpacked in this process."""
    base = tempfile.gettempdir()
    plain = base.isascii() and not set(base) & set(" #%()[]+")
    return temporary.folder(base=base if plain else "/tmp")


_opened: dict[str, Binary] = {}


def _open(digest: str, path: Path, unlimited: bool) -> Binary:
    if digest not in _opened:
        folder = root() / digest[:16]
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
    lines = _voices.get(environment, _voices.get(instance))
    if lines is not None:
        text = (message or b"").decode("utf-8", "replace").rstrip()
        lines.append(f"{STATUS[status] if 0 <= status < 6 else status}: {text}")


@cache
def _proxy() -> ctypes.CDLL:
    """FMPy's C library that formats the logger's printf arguments; a copy of it, for it serves one logger only."""
    name = f"logging{fmpy.sharedLibraryExtension}"
    copy = root() / name
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
