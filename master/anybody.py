"""Anybody's FMU as a part: the class by its version and the interface that it is coupled by."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any

from .binary import open_fmu
from .described import sizes_in
from .exchange import ModelExchange2, ModelExchange3
from .fmi1 import CoSimulation1, ModelExchange1
from .fmi3 import CoSimulation3, Scheduled
from .fmu import FmuPart
from .instance import Fmu

CLASSES: dict[tuple[int, str], type[Fmu]] = {
    (1, "cs"): CoSimulation1,
    (1, "me"): ModelExchange1,
    (2, "cs"): FmuPart,
    (2, "me"): ModelExchange2,
    (3, "cs"): CoSimulation3,
    (3, "me"): ModelExchange3,
    (3, "se"): Scheduled,
}


def part_of(
    name: str, path: Path | str, tolerance: float | None = None, interface: str = "", given: Mapping[str, Any] | None = None
) -> Fmu:
    """An instance of the FMU at `path`. Raises DescriptionError, PartFailed.

    tolerance, interface: as of an Fmu. given: values that it will be given; those that are sizes of arrays it needs now.
    """
    binary = open_fmu(path)
    way, _ = binary.interface(interface)
    return CLASSES[binary.description.fmiMajorVersion, way](name, path, tolerance, way, sizes_in(binary.description, given or {}))
