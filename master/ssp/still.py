"""A system in which nothing moves: the values of its connectors are all there is to tell."""

from __future__ import annotations

from typing import Any

from ...fmus.variable import Variable
from ..face import Part


class Still(Part):
    """A system without FMUs, in a file whose whole structure has none; see `structure.load`."""

    tells_ahead = False

    def __init__(self, name: str, values: dict[str, Any]):
        super().__init__(
            name,
            [Variable(key, start=value, causality="output", depends_on=(), initial="exact") for key, value in values.items()],
        )

    def at(self, time: float) -> None:
        """The values as they are."""
        self.y[:] = [float(self.values[name]) for name in self.outputs]
