"""What all residuals of a drive have in common: the rig, the smoothing of each drive, and the loops that run the laws."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from types import SimpleNamespace

from ..data.rig import Rig, split
from ..rules import RULES
from .laws import default


@dataclass(frozen=True)
class Setting:
    """How measured channels become comparisons; another smoothing or other loops are another setting."""

    rig: Rig
    samples: int  # of all runs
    kernels: SimpleNamespace  # loops by name: compiled laws, or FMUs in their places
    smoothing: Mapping[str, int]  # samples, by drive
    whole_step: float = RULES.residuals.whole_step  # s, longest of a whole drive's simulation
    shaft_step: float = RULES.residuals.shaft_step  # rad, longest of its output shaft's swing
    windows: Mapping[str, float] = field(default_factory=dict)  # s over which a channel's speed is a difference, by its full name
    balanced: bool = True  # False: the balance at the motor's shaft is not smoothed, while the smoothing is chosen

    @property
    def steady(self) -> bool:
        """Whether samples are steady-state points."""
        return self.rig.kind == "steady"

    def value(self, name: str, values: dict[str, float]) -> float:
        """A parameter's value: fitted, else nominal, else the law's default."""
        for known in (values, self.rig.parameters):
            if name in known:
                return float(known[name])
        component, _, parameter = name.rpartition(".")
        return default(split(component, self.rig.drives)[1], parameter)
