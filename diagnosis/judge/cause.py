"""One named cause, as an answer tells it."""

from __future__ import annotations

from dataclasses import asdict, dataclass, field


@dataclass
class Cause:
    """One named cause."""

    component: str
    effect: str
    parameters: dict[str, dict]  # name: {value, low, high, unit, determined}
    confidence: float
    indistinguishable_from: list[str] = field(default_factory=list)
    separate_by: str = ""
    channel: str = ""  # of a sensor

    @property
    def label(self) -> str:
        """The cause's name in reports: component and effect, with the parameter or channel that it is about."""
        if self.effect == "parameter":
            return f"parameter {next(iter(self.parameters))}"
        return f"{self.component} {self.effect}" + (f" ({self.channel})" if self.channel else "")

    def row(self) -> dict:
        """As diagnosis.json has it; a channel is a sensor's."""
        return {key: value for key, value in asdict(self).items() if key != "channel" or value}
