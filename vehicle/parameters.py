"""The vehicle's variables as the master knows them, and the check of a value that is set."""

from __future__ import annotations

import math
from typing import Any

from ..master.errors import DescriptionError
from ..master.face import Variable
from . import tables


def variables() -> dict[str, Variable]:
    """All variables of the vehicle by name."""
    listed = [
        Variable(name, "parameter", "Real", unit, start, least, greatest, variability="fixed", description=text)
        for name, unit, start, least, greatest, text in tables.PARAMETERS
    ]
    listed += [
        Variable(name, "parameter", kind, "", start, least, greatest, variability="fixed", description=text)
        for name, kind, start, least, greatest, text in tables.CHOICES
    ]
    listed.append(
        Variable(
            "sprocket_radius",
            "local",
            unit="m",
            variability="fixed",
            description="pitch circle of a sprocket, from teeth and pitch",
        )
    )
    listed += [Variable(name, "input", unit=unit, start=start, description=text) for name, unit, start, text in tables.INPUTS]
    for name in tables.OUTPUTS:
        (unit, text), of = tables.told(name), tables.derivative_of(name)
        listed.append(Variable(name, "output", unit=unit, description=text, depends_on=(), derivative_of=of))
    return {variable.name: variable for variable in listed}


VARIABLES = variables()
INPUTS = tuple(name for name, *_ in tables.INPUTS)


def checked(part: str, name: str, value: Any) -> Any:
    """A parameter's or input's value in its type, or the reason why it cannot be."""
    variable = VARIABLES.get(name)
    if variable is None:
        raise DescriptionError(f"{part}: there is no variable {name!r}. It has: {', '.join(VARIABLES)}.")
    if variable.causality not in ("parameter", "input"):
        raise DescriptionError(f"{part}.{name} is an {variable.causality} and cannot be set.")
    try:
        if variable.type == "String":
            return str(value)
        if variable.type == "Boolean":
            if isinstance(value, str):
                return {"true": True, "1": True, "false": False, "0": False}[value.strip().lower()]
            return bool(value)
        number = float(value)
    except (ValueError, TypeError, KeyError):
        raise DescriptionError(f"{part}.{name} = {value!r} is not a {variable.type}.") from None
    if not math.isfinite(number):
        raise DescriptionError(f"{part}.{name} = {value!r} is not finite.")
    if variable.minimum is not None and not variable.minimum <= number <= variable.maximum:
        limits = f"{variable.minimum:g} … {variable.maximum:g} {variable.unit}".rstrip()
        raise DescriptionError(f"{part}.{name} = {number:g} is outside {limits}: {variable.description}.")
    if variable.type == "Integer":
        if number != int(number):
            raise DescriptionError(f"{part}.{name} = {value!r} is not a whole number.")
        return int(number)
    return number
