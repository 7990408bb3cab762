"""What can be refused before the first run: names, ranges, and values that a part does not accept together."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

from selflock.fmus.errors import SelflockError
from selflock.master.errors import warn
from selflock.master.face import Part
from selflock.master.initial import not_taken
from selflock.master.process import ProcessPart
from selflock.master.simulation import check_times
from selflock.master.system import System
from selflock.master.values import resolved
from selflock.master.wiring import Wiring, make, typed, wire

from .errors import SweepError
from .record import check_window
from .runs import adapt
from .store import canonical
from .study import Study

OURS = "selflock:"
SHOWN = 3  # examples in a message


def check(study: Study, system: System) -> None:
    """Refuse a study that names what is not there, or that has combinations which are not physical.

    Others' FMUs are tried in processes of their own: what ends one of them here is a failed run there.
    """
    stop = system.run.stop if study.stop is None else study.stop
    check_times(system, stop)
    for one in study.record:
        check_window(one, stop)
    apart = {
        name: replace(component, process=True) if component.fmu and not component.fmu.startswith(OURS) else component
        for name, component in system.components.items()
    }
    system = replace(system, components=apart)
    wiring = wire(system)
    try:
        for one in study.record:
            for column in one.columns:
                _, variable = wiring.variable(column, f"[record] {one.name}")
                if variable.causality not in ("output", "input", "local"):
                    raise SweepError(f"[record] {one.name}: {column} is a {variable.causality}; it does not change in a run.")
        settings = [_all_settings(system, run) for run in study.settings]
        variables = {name: wiring.variable(name, "[set] or [vary]") for name in {n for run in settings for n in run}}
        _combinations(study, settings, wiring, variables)
    finally:
        wiring.close()


def _all_settings(system: System, run: dict[str, Any]) -> dict[str, Any]:
    """What a run sets of components, with all that follows from values of the system."""
    mine, settings = adapt(system, run)
    if mine.values == system.values:
        return settings
    before, after = resolved(system), resolved(mine)
    follows = {
        f"{name}.{variable}": value
        for name, component in after.components.items()
        for variable, value in component.start.items()
        if value != before.components[name].start[variable]
    }
    return follows | settings


def _combinations(study: Study, settings: list[dict[str, Any]], wiring: Wiring, variables: dict[str, Any]) -> None:
    """Every component that is varied is initialized once with each set of values that it will meet."""
    seen: dict[str, str | None] = {}  # values of one component → why they are refused
    refused: list[tuple[int, str]] = []
    for number, run in enumerate(settings):
        mine: dict[str, dict[str, Any]] = {}
        for name, value in run.items():
            component, variable = variables[name]
            mine.setdefault(component, {})[variable.name] = value
        for component, values in mine.items():
            key = canonical([component, values])
            if key not in seen:
                seen[key] = _objection(wiring, component, values, study.stop)
            if (objection := seen[key]) is not None:
                refused.append((number, objection))
                break
    if refused:
        reasons = list(dict.fromkeys(reason for _, reason in refused))
        first = ", ".join(f"{name} = {value}" for name, value in study.items[refused[0][0]]["parameters"].items())
        raise SweepError(
            f"{len(refused)} of {len(settings)} combinations are not physical, the first with {first}. "
            "Narrow what varies. Why:\n"
            + "\n".join(f"  {reason}" for reason in reasons[:SHOWN])
            + (f"\n  … and {len(reasons) - SHOWN} more reasons" if len(reasons) > SHOWN else "")
        )


def _objection(wiring: Wiring, name: str, varied: dict[str, Any], stop: float | None) -> str | None:
    """Why the part does not accept these values together; None if it does, or if it ends of them."""
    part, given = wiring.parts[name], wiring.values.get(name, {})
    try:
        return _said(part, given, varied, stop)
    finally:
        if isinstance(part, ProcessPart) and part.ended:
            part.close()
            wiring.parts[name] = make(name, wiring.system.components[name], wiring.system)


def _said(part: Part, given: dict[str, Any], varied: dict[str, Any], stop: float | None) -> str | None:
    try:
        part.reset()
        for name, value in {**given, **varied}.items():
            part.set(name, typed(part.variables[name], value, f"{part.name}.{name}"))
        part.enter_initialization(0.0, stop)
        part.exit_initialization()
    except (SelflockError, ValueError) as error:
        if isinstance(part, ProcessPart) and part.ended:
            return None
        said = [line.removeprefix("Error: ") for line in part.log if line.startswith("Error")]
        return f"{part.name}: {said[0]}" if said else str(error)
    for name, found in part.untaken.items():
        sentence = not_taken(f"{part.name}.{name}", {**given, **varied}[name], found)
        if name in varied and found is not None:
            return sentence
        warn(sentence)
    return None
