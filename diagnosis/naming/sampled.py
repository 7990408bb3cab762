"""FMUs that act once a step, as a sampled controller does: with other steps they are others.

What an FMU with a state of its own tells in finer steps comes nearer to something. One that computes tells what it computed at
its step until the next, whatever the step's size: where it stands for something that is sampled its period is the rig's step.
From the FMU alone nobody can say whether it does, or passes on at once what flows; so both are tried (run._causes). Where there
is none finer steps are nearer to nature, whatever the log says that something is missing from.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from selflock.master.errors import DescriptionError, PartFailed
from selflock.master.simulation import run as run_system
from selflock.master.system import Component, Connection, System

from ..rules import RULES
from ..systems.parts import LOG
from .extended import Extended, Extending


def sampled(problem: Extending, values: dict[str, float]) -> frozenset[str]:
    """Components of a problem that act once a step, seen on what its first run gives them."""
    played, settings = problem.played, problem.settings(values)
    assert isinstance(played, Extended)
    i = problem.which[0]
    if played.inserts:
        return frozenset()
    mine = played.base[i] | {name: value for name, value in settings[i].items() if played.runs_along(name)}
    series = {name: rows[0] for name, rows in played.series(settings, [i]).items()}
    return frozenset(name for name in played.group.members if _acts_once(played, name, series, mine))


def _acts_once(played: Extended, component: str, series: dict[str, np.ndarray], settings: dict[str, float]) -> bool:
    """Whether what others are given of it is there at once, or whether finer steps never come nearer to anything."""
    parts = played.parts
    inputs = [name for name in parts.inputs[component] if name in series]
    heard = sorted({f"{link.source}.{link.output}" for link in parts.links.values() if link.source == component})
    outputs = [name for name in heard if parts.variables[name].type == "Real"]
    if not inputs or not outputs:
        return False
    mine = {name: value for name, value in settings.items() if parts.owner(name) == component}
    found = [_alone(played, outputs, inputs, series, mine, pieces) for pieces in (1, 2, 4)]
    if any(one is None for one in found):
        return False
    whole, half, quarter = (one for one in found if one is not None)
    for name in outputs:
        y = quarter[name]
        size = float(np.ptp(y))
        if size <= RULES.judge.constant * float(abs(y).max()):
            continue
        begun, all_of_it = (float(abs(y[k::4] - y[: len(y) - k : 4]).sum()) for k in (1, 4))
        if begun > RULES.naming.at_once * all_of_it:
            return True
        first, second = (float(abs(a - b).max()) for a, b in ((whole[name], half[name][::2]), (half[name][::2], y[::4])))
        if first > RULES.judge.constant * size and second > RULES.naming.settles * first:
            return True
    return False


def _alone(
    played: Extended,
    outputs: list[str],
    inputs: list[str],
    series: dict[str, np.ndarray],
    settings: dict[str, float],
    pieces: int,
) -> dict[str, np.ndarray] | None:
    """What a component tells alone, given what it is given in the system, held for a step of it, in so many pieces of that each."""
    system, component = played.plain[0], played.parts.owner(outputs[0])
    count, step = len(series["time"]) - 1, system.run.step / pieces
    columns = {name: np.append(np.repeat(series[name][:count], pieces), series[name][-1]) for name in inputs}
    options = {"time": step * np.arange(count * pieces + 1), "columns": columns, "types": dict.fromkeys(inputs, "Real")}
    alone = System(
        system.name,
        folder=system.folder,
        allow_code=system.allow_code,
        isolate=system.isolate,
        components={
            LOG: Component(part="selflock.diagnosis.systems.parts:Signals", options=options),
            component: system.components[component],
        },
        connections={name: Connection(f"{LOG}.{name}", convert=False) for name in inputs},
        run=replace(
            system.run,
            step=step,
            stop=count * pieces * step,
            order=[LOG, component],
            record=outputs,
            open_inputs=True,
            interval=0.0,
        ),
        alone=system.alone,
    )
    try:
        table = run_system(alone, settings=settings).table
    except (PartFailed, DescriptionError):
        return None
    found = {name: table[name].to_numpy(float) for name in outputs}
    return found if all(np.isfinite(x).all() for x in found.values()) else None
