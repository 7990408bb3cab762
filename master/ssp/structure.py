"""A system structure of SSP, ours or others', as a system."""

from __future__ import annotations

from pathlib import Path
from typing import Any

from ...fmus import temporary
from ..single import Table
from ..system import Connection, System, from_dict
from .flat import Flat, Mapping
from .read import read
from .still import Still
from .values import Item

TABLE, STILL = (f"{kind.__module__}:{kind.__qualname__}" for kind in (Table, Still))


def load(path: Path | str, variant: str = "SystemStructure.ssd", unlimited: bool = False) -> System:
    """The system in an SSP: an archive, a folder like an unpacked one, or an .ssd beside its files.

    Archives are unpacked to a temporary folder that lives as long as the process; files in folders stay where they are.
    variant: another structure in the archive or folder.

    An SSP says nothing of algorithm and step. Ours carry an annotation, and so do those of OSP and OMSimulator; for
    others it is Gauss-Seidel in the order of the file with the smallest default step of the FMUs, or 1 ms, shortened to a
    whole fraction of the experiment.
    Raises DescriptionError.
    """
    folder = temporary.folder("ssp_") / "files"
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
        if name in flat.tables:
            told["components"][name] = {"part": TABLE, "options": {"path": str(fmu), "types": flat.tables[name]}}
            continue
        said = {"interface": flat.interfaces[name]} | said if name in flat.interfaces else said
        if name in flat.places:
            said = ({"host": flat.places[name]} if flat.places[name] else {"process": True}) | said
        told["components"][name] = said | {"fmu": str(fmu), "start": start}
    if not flat.fmus:
        told["components"] = _still(flat)
        flat.notes.append("there is no FMU in it: the values of its connectors are all there is to tell")
    system = from_dict(told, folder)
    system.unlimited, system.notes = unlimited, flat.notes + others.notes
    if sorted(system.run.order) != sorted(system.components):  # another tool changed the file
        system.run.order = []
    for (component, variable), ((source, output), change) in flat.connections.items():
        made = Connection(f"{source}.{output}", convert=False)
        if isinstance(change, Mapping):
            made.mapping = {str(old): new for old, new in change.entries}
        else:
            made.factor, made.offset = change.factor, change.offset
        system.connections[f"{component}.{variable}"] = made
    return system


def _still(flat: Flat) -> dict[str, Any]:
    """A component for each system that has values, where no FMU is."""
    top = flat.root if all(path != flat.root for path, _ in flat.told) else "system"
    values: dict[str, dict[str, object]] = {}
    for (path, name), value in flat.told.items():
        values.setdefault(path or top, {})[name] = str(value) if isinstance(value, Item) else value
    return {path: {"part": STILL, "options": {"values": told}} for path, told in values.items()}
