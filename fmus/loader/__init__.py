"""The binaries of an FMU."""

from __future__ import annotations

from pathlib import Path

import pythonfmu

PYTHONFMU = Path(pythonfmu.__file__).parent / "resources" / "binaries"


def compiler_name() -> str:
    return ""


def binaries(name: str) -> dict[str, bytes]:
    """The files below binaries/ of the FMU `name`."""
    return {
        f"binaries/linux64/{name}.so": (PYTHONFMU / "linux64" / "libpythonfmu-export.so").read_bytes(),
        f"binaries/win64/{name}.dll": (PYTHONFMU / "win64" / "pythonfmu-export.dll").read_bytes(),
    }
