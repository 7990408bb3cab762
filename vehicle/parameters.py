"""The vehicle's variables as the master knows them, and the check of a value that is set."""

from __future__ import annotations

from typing import Any

from ..fmus.variable import Variable
from ..master.errors import DescriptionError
from . import tables

RADIUS = Variable("sprocket_radius", "m", None, "pitch circle of a sprocket, from teeth and pitch", variability="fixed")
VARIABLES = {v.name: v for v in (*tables.PARAMETERS, RADIUS, *tables.INPUTS, *map(tables.output, tables.OUTPUTS))}
"""All variables of the vehicle by name."""
INPUTS = tuple(variable.name for variable in tables.INPUTS)


def checked(part: str, name: str, value: Any) -> Any:
    """A parameter's or input's value in its type, or the reason why it cannot be."""
    variable = VARIABLES.get(name)
    if variable is None:
        raise DescriptionError(f"{part}: there is no variable {name!r}. It has: {', '.join(VARIABLES)}.")
    if variable.causality not in ("parameter", "input"):
        raise DescriptionError(f"{part}.{name} is an {variable.causality} and cannot be set.")
    try:
        return variable.taken(value)
    except ValueError as error:
        raise DescriptionError(f"{part}.{name} = {value!r} {error} ({variable.description}).") from None
