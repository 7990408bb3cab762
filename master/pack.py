"""Every FMU of the project: the components of `fmus`, and the parts of the master that can be packed as FMUs."""

from __future__ import annotations

from collections.abc import Iterable
from importlib import import_module
from pathlib import Path

from selflock.fmus import build
from selflock.fmus.errors import BuildError

PARTS = {"Robot": "selflock.vehicle.robot_fmu", "Setpoints": "selflock.study.setpoints_fmu"}


def build_all(out: str | Path, only: Iterable[str] | None = None) -> list[Path]:
    """Build every FMU, or those named in `only`, into the folder `out`. Raises BuildError."""
    names = list(only) if only else [*build.FACES, *PARTS]
    for name in names:
        if name not in build.FACES and name not in PARTS:
            raise BuildError(f"There is no FMU {name!r}. There are {', '.join((*build.FACES, *PARTS))}.")
    return [import_module(PARTS[name]).build(out) if name in PARTS else build.build(name, out) for name in names]
