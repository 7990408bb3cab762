"""SSP 1.0 both ways: `export` writes a system as an .ssp, `load` reads an .ssp, ours or others', as a system."""

from __future__ import annotations

import atexit
import math
import shutil
import tempfile
from pathlib import Path

from ..system import Connection, System, from_dict
from .read import read
from .write import export

__all__ = ["export", "load", "read"]


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
