"""What is found when a log is held against its rig: a sentence, and how it names things."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

from selflock.fmus import laws
from selflock.fmus.effect import CONSTANT, SWITCH
from selflock.fmus.effect_file import LAWS

from .rig import Rig
from .signals import along


@dataclass(frozen=True)
class Finding:
    """A sentence that names what it is about and says what to do. gross: no drive does that, the rig or the log is wrong."""

    sentence: str
    gross: bool
    about: tuple[str, ...] = ()  # signals and parameters, without their drive's prefix


@dataclass(frozen=True)
class Said:
    """How one drive of a rig names its signals, and what it says of its parameters."""

    rig: Rig
    prefix: str
    values: Mapping[str, float]  # the rig's, those of the log's own among them

    @property
    def linear(self) -> bool:
        """Whether m stands for rad."""
        return self.rig.linear

    def __call__(self, signal: str) -> str:
        """A signal as the log and the rig call it."""
        full = self.prefix + signal
        column = next((c.column for c in self.rig.columns if c.signal == full), full)
        return full if column in ("", full) else f"column {column!r} ({full})"

    def turned(self, signal: str) -> str:
        """The factor that turns a signal's sign."""
        full = self.prefix + signal
        now = next((c.factor for c in self.rig.columns if c.signal == full), 1.0)
        return f"factor = {-now:g}"

    def read_in(self, signal: str, unit: str) -> bool:
        """Whether the rig says, or its column's name, that a signal is in this unit."""
        column = next((c for c in self.rig.columns if c.signal == self.prefix + signal), None)
        return column is not None and (column.unit == unit or column.column.rstrip("])").endswith(("[" + unit, "(" + unit)))

    def given(self, parameter: str) -> bool:
        """Whether somebody gave this value."""
        return self.prefix + parameter in self.values or self.prefix + parameter in self.rig.uncertain

    def value(self, parameter: str) -> float:
        """What the rig says of a parameter, else the FMU's start value, else 0: of an effect's."""
        component, _, name = parameter.partition(".")
        default = next((p.off for p in laws.module(LAWS[component]).BASE if p.name == name), 0.0)
        return self.values.get(self.prefix + parameter, default)

    def ends(self, parameter: str) -> tuple[float, float]:
        """Between which values it lies."""
        value = self.value(parameter)
        return self.rig.uncertain.get(self.prefix + parameter, (value, value))

    def assumed(self, names: tuple[str, ...]) -> dict[str, tuple[float, str]]:
        """Value and unit of what a simulation needs and nobody gave, of components, or of one parameter."""
        unused = ("load.arm", "load.arm_angle") if not self.value("load.mass") else ()
        return {
            f"{self.prefix}{component}.{p.name}": (p.off, along(p.unit, p.name) if self.rig.linear else p.unit)
            for component, _, only in (name.partition(".") for name in names)
            for p in laws.module(LAWS[component]).BASE
            if only in ("", p.name)
            and f"{component}.{p.name}" not in unused
            and p.role not in (CONSTANT, SWITCH)
            and not p.name.startswith("start_")
            and not self.given(f"{component}.{p.name}")
        }
