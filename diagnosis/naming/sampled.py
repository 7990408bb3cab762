"""FMUs that act once a step, as a sampled controller does: with other steps they are others.

What an FMU with a state of its own tells in finer steps comes nearer to something. One that only computes tells what it computed
at its step until the next, whatever the step's size: where it stands for something that is sampled its period is the rig's step.
From the FMU alone nobody can say whether it does, or passes on at once what flows; so both are tried (run.name_system).
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
    """Whether it tells the same a half and a whole step on, or whether less steps never come nearer to what finer ones tell."""
    parts = played.parts
    inputs = [name for name in parts.inputs[component] if name in series]
    mine = {name: value for name, value in settings.items() if parts.owner(name) == component}
    found = [_alone(played, component, inputs, series, mine, pieces) for pieces in (1, 2, 4)] if inputs else [None]
    if any(one is None for one in found):
        return False
    whole, half, quarter = (one for one in found if one is not None)
    size = {name: float(np.ptp(x)) for name, x in half.items()}
    moving = [name for name in half if size[name] > RULES.judge.constant * float(abs(half[name]).max())]
    close = lambda a, b, name: float(abs(a - b).max()) <= RULES.naming.digits * size[name]
    if not moving:
        return False
    if all(close(half[name][1::2], half[name][2::2], name) for name in moving):
        return True
    far = lambda a, b: max(float(abs(a[name] - b[name]).max()) / size[name] for name in moving)
    at = lambda one, pieces: {name: x[::pieces] for name, x in one.items()}
    first, second = far(whole, at(half, 2)), far(at(half, 2), at(quarter, 4))
    return first > RULES.naming.digits and second > RULES.naming.settles * first


def _alone(
    played: Extended, component: str, inputs: list[str], series: dict[str, np.ndarray], settings: dict[str, float], pieces: int
) -> dict[str, np.ndarray] | None:
    """What a component tells alone, given what it is given in the system, held for a step of it, in so many pieces of that each."""
    parts, system = played.parts, played.plain[0]
    outputs = [
        name
        for name, v in parts.variables.items()
        if parts.owner(name) == component and v.causality == "output" and v.type == "Real"
    ]
    if not outputs:
        return None
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
