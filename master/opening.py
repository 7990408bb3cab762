"""A system from a file: a TOML file, a system structure (of SSP or OSP), ours or others', or one FMU."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

from . import osp
from .single import of_one, single
from .ssp.structure import load
from .system import System, load_toml


def system_of(path: Path | str, allow_code: bool = False, unlimited: bool = False, isolate: bool = False) -> System:
    """The system in a TOML file, a system structure (.ssp, .ssd, OspSystemStructure.xml or a folder), or one FMU (.fmu, a folder).

    allow_code: its parts may be of other packages than this. Whoever wrote the file then runs what they like as you; no
    code but that of its FMUs is ever run from an .ssp.
    unlimited: its archives, FMUs and SSPs, may be of any size (docs/security.md).
    isolate: every FMU runs in a process of its own with limits and without rights.
    """
    if of_one(Path(path)):
        return replace(single(path, unlimited), isolate=isolate)
    if osp.is_osp(Path(path)):
        return replace(osp.load(Path(path)), unlimited=unlimited, isolate=isolate)
    if Path(path).suffix.lower() in (".ssp", ".ssd") or Path(path).is_dir():
        return replace(load(path, unlimited=unlimited), isolate=isolate)
    return load_toml(path, allow_code, unlimited, isolate)
