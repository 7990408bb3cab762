"""The extended system: a Correction.fmu for each thing found, wired in, as system file and as SSP; and run again."""

from __future__ import annotations

from copy import deepcopy
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
import pandas as pd

from selflock.fmus.build import pack, sources_of
from selflock.fmus.correction.fmu import FACES
from selflock.master import ssp
from selflock.master.dump import save as save_system
from selflock.master.errors import DescriptionError, PartFailed, ResultError
from selflock.master.simulation import run as run_system
from selflock.master.system import Component, System

from ..calibration.numbers import label
from ..residuals.mending import rms
from ..rules import RULES
from ..systems.parts import LOG
from .outcome import Naming
from .places import IN, Insert, extended

if TYPE_CHECKING:
    from .whole import Whole
    from .work import Work


def extend(result: Naming, work: Work, best: Whole, out: Path) -> None:
    """Write the FMUs and the system with them, as it was found, and see whether it does on a log what was promised."""
    i = min(work.judges, default=work.which[0])
    settings = best.problem.settings(best.values)[i]

    def made(one: Insert) -> Component:
        mine = {name.rpartition(".")[2]: value for name, value in settings.items() if name.startswith(f"{one.name}.")}
        starts: dict[str, Any] = {"multiplies": one.multiplies, "taken": one.taken, "own": one.own} | dict(one.fixed) | mine
        if one.points:
            starts["points"] = one.points
        face = FACES[one.law]
        path = pack(face, sources_of(face), out / f"{one.name.capitalize()}.fmu", starts)
        if path.name not in result.files:
            result.files.append(path.name)
        return Component(fmu=str(path.resolve()))

    system = deepcopy(work.parts.system)
    for name, value in (work.played.base[i] | settings).items():
        if name in work.parts.variables:
            component, variable = system.split(name, "parameters")
            system.components[component].start[variable] = value
    run = work.runs[i]
    stop = work.played.plain[i].run.stop
    system.run = replace(system.run, start=0.0, stop=stop, open_inputs=True, interval=0.0)
    whole, _ = extended(system, work.parts, work.inserts, made)
    about = f"{result.rig}: what the system lacks, found in {', '.join(result.logs)}\nNumbers of a run's own are those of {label(run)}"
    try:
        whole = replace(whole, folder=system.folder)
        path = save_system(whole, out / "extended.toml", about)
        result.files.append(path.name)
        result.extension = {"system": path.name, "log": label(run)}
        result.files.append(ssp.export(whole, out / "extended.ssp").name)
    except (DescriptionError, ResultError) as error:
        result.notes.append(f"the extended system could not be written whole: {error}")
    if set(work.parts.system.components) == set(work.played.group.members):
        result.files.append(_inputs(work, i, whole, out).name)
    _again(result, work, best, i, made)


def _inputs(work: Work, i: int, whole: System, out: Path) -> Path:
    """What the log gives to the extended system, as a table for `selflock run --input`."""
    components = work.played.plain[i].components
    options: dict[str, Any] = components[LOG].options if LOG in components else {"time": np.zeros(1), "columns": {}}
    columns = {"time": options["time"]}
    for name, values in options["columns"].items():
        entry = next((one for one in work.inserts if one.place.where == IN and one.place.variable == name), None)
        target = f"{entry.name}.signal" if entry else name
        if name in work.parts.variables and target not in whole.connections:  # in the whole its own source gives it
            columns[target] = values
        for one in work.inserts:
            for target, over in (("x", "" if one.own else one.over), ("beside", one.beside)):
                if over == name and f"{one.name}.{target}" not in whole.connections:
                    columns[f"{one.name}.{target}"] = values
    path = out / "inputs.csv"
    pd.DataFrame(columns).to_csv(path, index=False)
    return path


def _again(result: Naming, work: Work, best: Whole, i: int, made: Any) -> None:
    """The FMUs themselves on the log, beside what the fit promised."""
    system, moved = extended(work.played.plain[i], work.parts, work.inserts, made)
    run, most = work.runs[i], RULES.naming.again
    steps = min(most, round(system.run.stop / system.run.step))
    stop = steps * system.run.step
    system = replace(system, run=replace(system.run, stop=stop))
    settings = {
        n: v for n, v in (work.played.base[i] | best.problem.settings(best.values)[i]).items() if n in work.parts.variables
    }
    mine = {name: value for name, value in settings.items() if work.parts.owner(name) in work.played.group.members}
    work.played.rounded = {}  # rounded as the FMU does, wherever the log has it
    work.played.extend(work.inserts)
    promised = best.problem.errors(best.values, [i])
    try:
        table = run_system(system, settings=mine).table
    except (PartFailed, DescriptionError) as error:
        result.notes.append(f"the extended system breaks off when it is run again: {str(error).splitlines()[0]}")
        return
    if promised is None:
        return
    worst: tuple[float, float, float, str] = (-1.0, 0.0, 0.0, "")
    for name in work.played.outputs:
        time = work.played.times(i, name)
        good = (time <= stop + 1e-9 * max(1.0, stop)) & work.played.trusted(name, [i])[0]
        simulated = np.interp(time, table["time"].to_numpy(), table[moved.get(name, name)].to_numpy(float))
        again = run.signals[name] - simulated
        apart = rms([(again - promised[name][0])[good]])
        size = rms([promised[name][0][good]])
        if apart / max(size, 1e-300) > worst[0]:
            worst = apart / max(size, 1e-300), rms([again[good]]), size, name
    agrees = bool(worst[0] <= RULES.naming.agrees)
    apart, fmu, size, output = worst  # of the output in which they are farthest apart
    result.extension |= {
        "output": output, "fmu": fmu, "promised": size, "apart": apart, "agrees": agrees, "seconds": stop,
    }  # fmt: skip
