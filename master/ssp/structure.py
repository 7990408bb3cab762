"""A system from a file: a system structure (.ssp), ours or others', a TOML file, or one FMU that is all of it."""

from __future__ import annotations

import atexit
import math
import shutil
import tempfile
from dataclasses import replace
from pathlib import Path

from ..binary import open_fmu
from ..system import Component, Connection, Run, System, from_dict, load_toml
from .read import read


def system_of(path: Path | str, allow_code: bool = False, unlimited: bool = False, isolate: bool = False) -> System:
    """The system described in a TOML file or in a system structure (.ssp), or of the one FMU that is given (.fmu).

    allow_code: its parts may be of other packages than this. Whoever wrote the file then runs what they like as you; no
    code but that of its FMUs is ever run from an .ssp.
    unlimited: its archives, FMUs and SSPs, may be of any size (docs/security.md).
    isolate: every FMU runs in a process of its own with limits and without rights.
    """
    if Path(path).suffix.lower() == ".ssp":
        return replace(load(path, unlimited=unlimited), isolate=isolate)
    if Path(path).suffix.lower() == ".fmu":
        return replace(alone(Path(path), unlimited), isolate=isolate)
    return load_toml(path, allow_code, unlimited, isolate)


def alone(path: Path, unlimited: bool = False) -> System:
    """An FMU as a system of one component called as its file, from start to stop and in steps as the FMU would have it.

    What it does not tell is 0 s, 1 s later and 1 ms. Inputs stay at their start values. Raises DescriptionError.
    """
    default = open_fmu(path, unlimited).description.defaultExperiment
    start, stop, step = (float(getattr(default, key, None) or 0.0) for key in ("startTime", "stopTime", "stepSize"))
    stop = stop if stop > start else start + 1.0
    run = Run(start, stop, _step(step or 1e-3, stop - start), open_inputs=True)
    system = System(path.stem, folder=path.parent, run=run, components={path.stem: Component(fmu=path.name)})
    system.unlimited = unlimited
    return system


def load(path: Path | str, variant: str = "SystemStructure.ssd", unlimited: bool = False) -> System:
    """The system in an SSP archive. Its FMUs are unpacked to a temporary folder that lives as long as the process.

    An SSP says nothing of algorithm and step: ours carry an annotation; for others it is Gauss-Seidel in the order
    of the file with the smallest default step of the FMUs, or 1 ms, shortened to a whole fraction of the experiment.
    Raises DescriptionError.
    """
    folder = Path(tempfile.mkdtemp(prefix="selflock_ssp_"))
    atexit.register(shutil.rmtree, folder, ignore_errors=True)
    flat = read(Path(path), folder, variant, unlimited)
    stop = flat.stop_time if flat.stop_time is not None else flat.start_time + 1.0
    told = flat.ours | {"system": {"name": flat.name, "description": flat.description}, "components": {}}
    told["run"] = flat.ours.get("run", {}) | {"start": flat.start_time, "stop": stop}
    told["run"]["open_inputs"] = True  # SSP leaves unconnected inputs at their start values
    told["run"].setdefault("step", _step(flat.smallest_step or 1e-3, stop - flat.start_time))
    for name, fmu in flat.fmus.items():
        start = {variable: value for (component, variable), value in flat.start.items() if component == name}
        told["components"][name] = flat.ours.get("components", {}).get(name, {}) | {"fmu": str(fmu), "start": start}
    system = from_dict(told, folder)
    system.unlimited = unlimited
    if sorted(system.run.order) != sorted(system.components):  # another tool changed the file
        system.run.order = []
    for (component, variable), ((source, output), change) in flat.connections.items():
        system.connections[f"{component}.{variable}"] = Connection(
            f"{source}.{output}", change.factor, change.offset, convert=False
        )
    return system


def _step(step: float, length: float) -> float:
    """The longest step up to `step` of which `length` is a whole number."""
    return length / max(1, math.ceil(length / step - 1e-6))
