"""SSP 1.0 both ways: `export` writes a system as an .ssp, `load` reads an .ssp, ours or others', as a system."""

from __future__ import annotations

import atexit
import shutil
import tempfile
from pathlib import Path

from master.errors import DescriptionError
from master.ssp.read import read
from master.ssp.write import export
from master.system import ALGORITHMS, Component, Connection, Run, System

__all__ = ["export", "load", "read"]


def load(path: Path | str, variant: str = "SystemStructure.ssd") -> System:
    """The system in an SSP archive. Its FMUs are unpacked to a temporary folder that lives as long as the process.

    An SSP says nothing of algorithm and step: ours carry an annotation; for others it is Gauss-Seidel in the order
    of the file with the smallest default step of the FMUs, or 1 ms. Raises DescriptionError.
    """
    folder = Path(tempfile.mkdtemp(prefix="selflock_ssp_"))
    atexit.register(shutil.rmtree, folder, ignore_errors=True)
    flat = read(Path(path), folder, variant)
    said = flat.run
    run = Run(start=flat.start_time, open_inputs=True)  # SSP leaves unconnected inputs at their start values
    run.stop = flat.stop_time if flat.stop_time is not None else flat.start_time + 1.0
    run.step = float(said.get("step", 0.0)) or flat.smallest_step or 1e-3
    run.algorithm = said.get("algorithm", "gauss-seidel")
    if run.algorithm not in ALGORITHMS:
        raise DescriptionError(f"{path}: its annotation asks for the algorithm {run.algorithm}; known: {', '.join(ALGORITHMS)}.")
    system = System(flat.name, flat.description, folder, run)
    steps = dict(pair.rsplit("=", 1) for pair in said.get("steps", "").split())
    for name, fmu in flat.fmus.items():
        start = {variable: value for (component, variable), value in flat.start.items() if component == name}
        system.components[name] = Component(fmu=str(fmu), step=float(steps.get(name, 0.0)), start=start)
    order = said.get("order", "").split()
    run.order = order if sorted(order) == sorted(system.components) else []
    for (component, variable), ((source, output), change) in flat.connections.items():
        system.connections[f"{component}.{variable}"] = Connection(f"{source}.{output}", change.factor, change.offset, convert=False)
    return system
