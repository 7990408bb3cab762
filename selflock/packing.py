"""Every FMU of the project: the components of `selflock.fmus`, and the parts of upper rooms that can be packed as FMUs."""

from __future__ import annotations

from collections.abc import Iterable
from importlib import import_module
from pathlib import Path

from selflock.fmus import build as components
from selflock.fmus.errors import BuildError

PARTS = {"Robot": "selflock.vehicle.robot_fmu", "Setpoints": "selflock.study.setpoints_fmu"}


def build(out: str | Path, only: Iterable[str] | None = None) -> list[Path]:
    """Build every FMU, or those named in `only`, into the folder `out`. Raises BuildError."""
    there = (*components.FACES, *PARTS)
    names = list(only or there)
    for name in names:
        if name not in there:
            raise BuildError(f"There is no FMU {name!r}. There are {', '.join(there)}.")
    return [import_module(PARTS[name]).build(out) if name in PARTS else components.build(name, out) for name in names]
