"""modelDescription.xml of a slave: what hosts, checkers and people read of an FMU before it runs.

Nothing in it depends on when or where it is made, so that two builds of the same content are the same bytes.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any
from xml.etree.ElementTree import Element, SubElement

import pythonfmu

from . import units

if TYPE_CHECKING:
    from .slave import Slave
    from .variable import Variable

CAPABILITIES = {
    "needsExecutionTool": "true",  # a Python on the machine
    "canHandleVariableCommunicationStepSize": "true",
    "canInterpolateInputs": "false",
    "canBeInstantiatedOnlyOncePerProcess": "false",
    "canNotUseMemoryManagementFunctions": "true",
    "canGetAndSetFMUstate": "true",
    "canSerializeFMUstate": "true",
}


def describe(slave: Slave) -> Element:
    """The modelDescription.xml of a slave (FMI 2.0, 2.2): units, log categories, variables and their structure."""
    name = slave.modelName or type(slave).__name__
    about = {
        "fmiVersion": "2.0",
        "modelName": name,
        "guid": str(slave.guid),
        "description": _sentence(slave),
        "generationTool": f"selflock with pythonfmu {pythonfmu.__version__}",
        "variableNamingConvention": "flat",
        "numberOfEventIndicators": "0",
    }
    root = Element("fmiModelDescription", about)
    SubElement(root, "CoSimulation", {"modelIdentifier": name} | CAPABILITIES)
    table = slave._table
    _add_units(root, sorted({row.unit for row in table if row.unit}))
    categories = SubElement(root, "LogCategories")
    for category, text in slave.log_categories.items():
        SubElement(categories, "Category", name=category, description=text)
    start, stop, step = slave.experiment
    SubElement(root, "DefaultExperiment", startTime=_text(start), stopTime=_text(stop), stepSize=_text(step))
    variables = SubElement(root, "ModelVariables")
    for place, row in enumerate(table):
        variables.append(_variable(slave, place, row))
    _add_structure(root, slave)
    return root


def _sentence(slave: Slave) -> str:
    """The first line of the face's docstring."""
    return (type(slave).__doc__ or slave.modelName or "").strip().splitlines()[0]


def _text(value: Any) -> str:
    return str(value).lower() if isinstance(value, bool) else repr(value) if isinstance(value, float) else str(value)


def _add_units(root: Element, names: list[str]) -> None:
    if not names:
        return
    definitions = SubElement(root, "UnitDefinitions")
    for name in names:
        unit = units.parse(name)
        powers = {base: str(power) for base, power in unit.exponents.items()}
        conversion = {"factor": _text(unit.factor)} if unit.factor != 1.0 else {}
        conversion |= {"offset": _text(unit.offset)} if unit.offset != 0.0 else {}
        SubElement(SubElement(definitions, "Unit", name=name), "BaseUnit", powers | conversion)


def _variable(slave: Slave, place: int, row: Variable) -> Element:
    initial = {"parameter": {"initial": "exact"}, "output": {"initial": "calculated"}}.get(row.causality, {})
    about = {
        "name": row.name,
        "valueReference": str(place),
        "description": row.description,
        "causality": row.causality,
        "variability": row.variability,
    }
    variable = Element("ScalarVariable", about | initial)
    attributes = {}
    if row.type == "Real":
        limits = {"unit": row.unit or None, "min": row.minimum, "max": row.maximum, "nominal": row.nominal}
        attributes = {key: _text(value) for key, value in limits.items() if value is not None}
    elif row.type == "Integer":
        limits = {"min": row.minimum, "max": row.maximum}
        attributes = {key: str(int(value)) for key, value in limits.items() if value is not None}
    if row.causality != "output":
        attributes["start"] = _text(row.start)
    if row.derivative_of:
        attributes["derivative"] = str(slave._place[row.derivative_of] + 1)
    SubElement(variable, row.type, attributes)
    return variable


def _add_structure(root: Element, slave: Slave) -> None:
    """Outputs, and as initial unknowns the same: each with the inputs (at the start also the parameters) it depends on."""
    structure = SubElement(root, "ModelStructure")
    parameters = range(slave._first_parameter, len(slave._table))
    for name, always in (("Outputs", ()), ("InitialUnknowns", parameters)):
        if not slave.outputs:
            continue
        unknowns = SubElement(structure, name)
        for place, row in enumerate(slave._table[slave._first_output : slave._first_parameter], slave._first_output):
            known = sorted((*(slave._place[name] for name in row.depends_on or ()), *always))
            indices = " ".join(str(place + 1) for place in known)
            kinds = " ".join(["dependent"] * len(known))
            SubElement(unknowns, "Unknown", index=str(place + 1), dependencies=indices, dependenciesKind=kinds)
