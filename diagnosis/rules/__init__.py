"""All numbers that steer the diagnosis, each with its meaning and where it came from: RULES.room.name.

    python -m selflock.diagnosis.rules > docs/rules.md

What decides nothing (tables of variables, colours, sizes of drawings, guards against a division by zero, the halves and
quarters of a formula) stands where it is used.
"""

from __future__ import annotations

from dataclasses import dataclass, field, fields
from typing import Any

from .begin import BeginRules
from .calibrate import CalibrateRules
from .data import DataRules
from .judge import JudgeRules
from .naming import NamingRules
from .pipeline import PipelineRules
from .planning import PlanningRules
from .residuals import ResidualRules
from .rule import Rule, of
from .search import SearchRules
from .tracking import TrackingRules


@dataclass(frozen=True)
class Rules:
    """The rules of each room."""

    data: DataRules = field(default_factory=DataRules)
    residuals: ResidualRules = field(default_factory=ResidualRules)
    search: SearchRules = field(default_factory=SearchRules)
    judge: JudgeRules = field(default_factory=JudgeRules)
    pipeline: PipelineRules = field(default_factory=PipelineRules)
    calibrate: CalibrateRules = field(default_factory=CalibrateRules)
    naming: NamingRules = field(default_factory=NamingRules)
    planning: PlanningRules = field(default_factory=PlanningRules)
    begin: BeginRules = field(default_factory=BeginRules)
    tracking: TrackingRules = field(default_factory=TrackingRules)

    def listed(self) -> list[Rule]:
        """All of them, room by room."""
        return [one for room in fields(self) for one in of(getattr(self, room.name), room.name + ".")]

    def by_name(self) -> dict[str, Any]:
        """Their values, as diagnosis.json carries them."""
        return {one.name: one.value for one in self.listed()}


RULES = Rules()
