"""The binaries of an FMU.

pythonfmu's library for Linux loads in a Python process only (its issue 202). So the FMU's binary is a small library of
our own (forward.c, door.c, python.c), which brings a Python where there is none, makes plain steps itself and passes every
other call on to pythonfmu's library beside it. It is compiled here once, by the C compiler that CC names, or cc, and kept in the user's cache. Without a compiler
the FMU gets pythonfmu's library alone and a warning tells that it will run in Python hosts only. On Windows it is pythonfmu's
library always.
"""

from __future__ import annotations

import hashlib
import os
import platform
import shutil
import subprocess
import tempfile
import warnings
from functools import cache
from pathlib import Path

import pythonfmu

from ..cache import kept, write

HERE = Path(__file__).parent
PYTHONFMU = Path(pythonfmu.__file__).parent / "resources" / "binaries"
SOURCES = ("forward.c", "door.c", "python.c")
OPTIONS = (
    "-std=gnu11",
    "-O2",
    "-Wall",
    "-fPIC",
    "-shared",
    "-fvisibility=hidden",
    "-Wl,-z,nodelete",
    "-Wl,--build-id=none",
    "-Wl,-z,relro",
)

LET_GO = '''\
"""pythonfmu's library ends its hold on Python twice at the end of a process, the second time through freed memory.

Ended here before, both find nothing left to do.
"""

import atexit
import ctypes
import sys
from pathlib import Path

if sys.platform == "linux":
    library = Path(__file__).parents[2] / "binaries" / "linux64" / "{name}.so"
    atexit.register(ctypes.CDLL(str(library)).finalizePythonInterpreter)
'''
"""What forward.c does at the end, where there is no forward.c."""


def compiler() -> str | None:
    """The C compiler for the loader: what CC names, else cc or gcc; None where there is none or the machine is not x86-64 Linux."""
    if platform.system() != "Linux" or platform.machine() != "x86_64":
        return None
    named = os.environ.get("CC")
    return shutil.which(named) if named else shutil.which("cc") or shutil.which("gcc")


@cache
def _compiled(program: str) -> bytes | str:
    """The loader, from the user's cache where this compiler made it before; or what the compiler complained about."""
    about = os.stat(program)
    recipe = repr((program, about.st_size, about.st_mtime_ns, OPTIONS)).encode()
    key = hashlib.sha256(recipe + b"".join(file.read_bytes() for file in sorted(HERE.glob("*.[ch]")))).hexdigest()[:16]

    def make(path: Path) -> None:
        with tempfile.TemporaryDirectory() as folder:
            library = Path(folder) / "loader.so"
            command = [program, *OPTIONS, "-o", str(library), *SOURCES, "-ldl", "-lm", "-lpthread"]
            subprocess.run(command, cwd=HERE, capture_output=True, text=True, check=True)
            write(path, library.read_bytes())

    try:
        return kept(f"loader_{key}/loader.so", make).read_bytes()
    except subprocess.CalledProcessError as error:
        return str(error.stderr).strip()


def loader() -> bytes | None:
    """The compiled loader; None, with a warning, where it cannot be compiled."""
    program = compiler()
    made = _compiled(program) if program else "no C compiler for x86-64 Linux found (looked for CC, cc, gcc)"
    if isinstance(made, bytes):
        return made
    warnings.warn(f"The FMU will run in Python hosts only on Linux: {made}", stacklevel=2)
    return None


def binaries(name: str, package: str) -> dict[str, bytes]:
    """The files below binaries/ of the FMU `name`, and what its `package` of sources does for pythonfmu's library alone."""
    linux = (PYTHONFMU / "linux64" / "libpythonfmu-export.so").read_bytes()
    files = {f"binaries/win64/{name}.dll": (PYTHONFMU / "win64" / "pythonfmu-export.dll").read_bytes()}
    own = loader()
    if own is None:
        return files | {
            f"binaries/linux64/{name}.so": linux,
            f"resources/{package}/__init__.py": LET_GO.format(name=name).encode(),
        }
    return files | {f"binaries/linux64/{name}.so": own, "binaries/linux64/libpythonfmu-export.so": linux}
