"""A system from a file: a system structure (.ssp), ours or others', a TOML file, or one FMU."""

from __future__ import annotations

import atexit
import shutil
import tempfile
from dataclasses import replace
from pathlib import Path

from ..single import single
from ..system import Connection, System, from_dict, load_toml
from .read import read


def system_of(path: Path | str, allow_code: bool = False, unlimited: bool = False, isolate: bool = False) -> System:
    """The system described in a TOML file, in a system structure (.ssp), or of one FMU (.fmu).

    allow_code: its parts may be of other packages than this. Whoever wrote the file then runs what they like as you; no
    code but that of its FMUs is ever run from an .ssp.
    unlimited: its archives, FMUs and SSPs, may be of any size (docs/security.md).
    isolate: every FMU runs in a process of its own with limits and without rights.
    """
    if Path(path).suffix.lower() == ".fmu":
        return replace(single(path, unlimited), isolate=isolate)
    if Path(path).suffix.lower() == ".ssp":
        return replace(load(path, unlimited=unlimited), isolate=isolate)
    return load_toml(path, allow_code, unlimited, isolate)


def load(path: Path | str, variant: str = "SystemStructure.ssd", unlimited: bool = False) -> System:
    """The system in an SSP archive. Its FMUs are unpacked to a temporary folder that lives as long as the process.

    An SSP says nothing of algorithm and step. Ours carry an annotation, and so do those of OSP and OMSimulator; for
    others it is Gauss-Seidel in the order of the file with the smallest default step of the FMUs, or 1 ms, shortened to a
    whole fraction of the experiment.
    Raises DescriptionError.
    """
    folder = Path(tempfile.mkdtemp(prefix="selflock_ssp_"))
    atexit.register(shutil.rmtree, folder, ignore_errors=True)
    flat = read(Path(path), folder, variant, unlimited)
    stop = flat.stop_time if flat.stop_time is not None else flat.start_time + 1.0
    told = flat.ours | {"system": {"name": flat.name, "description": flat.description}, "components": {}}
    told["run"] = flat.ours.get("run", {}) | {"start": flat.start_time, "stop": stop}
    told["run"]["open_inputs"] = True  # SSP leaves unconnected inputs at their start values
    others = flat.others if not flat.ours else flat.others.beside_ours()
    told["run"] = others.run(flat.smallest_step or 1e-3, stop - flat.start_time) | told["run"]
    for name, fmu in flat.fmus.items():
        start = {variable: value for (component, variable), value in flat.start.items() if component == name}
        said = others.component(name, told["run"]["step"]) | flat.ours.get("components", {}).get(name, {})
        told["components"][name] = said | {"fmu": str(fmu), "start": start}
    system = from_dict(told, folder)
    system.unlimited, system.notes = unlimited, others.notes
    if sorted(system.run.order) != sorted(system.components):  # another tool changed the file
        system.run.order = []
    for (component, variable), ((source, output), change) in flat.connections.items():
        system.connections[f"{component}.{variable}"] = Connection(
            f"{source}.{output}", change.factor, change.offset, convert=False
        )
    return system
