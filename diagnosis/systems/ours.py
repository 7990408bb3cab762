"""A blamed FMU of a system that is one of ours: known by its parameters, it becomes a drive of one component.

An FMU is ours where it has the nominal parameters of a component and those of all effects of ours, whatever its name.
What the log has of its inputs and outputs is then read as the signals of a drive, and its law is fitted.
"""

from __future__ import annotations

from dataclasses import replace
from importlib import import_module

from selflock.fmus.laws import OURS

from ..data.log import HELD
from ..data.rig import LogColumn, Rig
from ..data.signals import SIGNALS, canonical, unit
from ..residuals.laws import COMPONENTS, LAWS, law
from .parts import Parts


def kind(parts: Parts, component: str) -> str:
    """controller, motor, reducer or load; "" for an FMU that is none of ours."""
    known = {name[len(component) + 1 :] for name in parts.variables if parts.owner(name) == component}
    for part in COMPONENTS:
        if set(import_module(f"{OURS}.{LAWS[part]}").Parameters._fields) <= known:
            return part
    return ""


def as_drive(parts: Parts, rig: Rig, component: str, logged: set[str]) -> Rig | None:
    """The rig that reads the log as one of a drive in which this component alone is compared."""
    part = kind(parts, component)
    if not part:
        return None
    prefix = component.removesuffix(part) if component.endswith(part) else f"{component}_"
    columns: dict[str, LogColumn] = {}
    for name, variable in parts.variables.items():
        if parts.owner(name) != component or variable.causality not in ("input", "output"):
            continue
        signal = canonical(f"{part}.{variable.name}")
        link = parts.links.get(name)
        source = name if name in logged or not link else f"{link.source}.{link.output}"
        if signal not in SIGNALS or signal in columns or source not in logged or parts.variables[source].unit != unit(signal):
            continue
        factor, offset, late = 1.0, 0.0, False
        if link and source != name:
            factor, offset, late = link.factor, link.offset, parts.ahead(link.source, component)
        old = next((c for c in rig.columns if c.signal == source), LogColumn(source, source))
        columns[signal] = LogColumn(
            old.column,
            prefix + signal,
            old.unit,
            factor * old.factor,
            factor * old.offset + offset,
            late and signal in HELD,
        )
    sheet = law(part).Parameters()
    given = {
        name: parts.variables[f"{component}.{name}"].start for name in sheet._fields if f"{component}.{name}" in parts.variables
    }
    given |= parts.values.get(component, {})  # what the system says goes over what the FMU was built with
    others = tuple(
        LogColumn(c.column, c.signal, c.unit, c.factor, c.offset) for c in rig.columns if c.signal not in parts.variables
    )
    renamed = lambda name: prefix + part + name.removeprefix(component)  # as a parameter of the drive
    mine = lambda table: {renamed(name): value for name, value in table.items() if name.startswith(component + ".")}
    return replace(
        rig,
        system=None,
        named=False,
        units={},
        drives=(prefix,),
        columns=(*columns.values(), *others),
        only=prefix + part,
        parameters={f"{prefix}{part}.{name}": float(value) for name, value in given.items() if name in sheet._fields},
        known=frozenset(renamed(name) for name in rig.known if name.startswith(component + ".")),
        uncertain=mine(rig.uncertain),
        logs={pattern: mine(values) for pattern, values in rig.logs.items()},
    )
