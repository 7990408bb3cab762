"""What a log's columns seem to be, as plain data."""

from __future__ import annotations

from dataclasses import dataclass, field
from math import pi

import numpy as np

from .raw import LIKELY, SURE, UNSURE, Raw

RPM, DEG, TURN = pi / 30.0, pi / 180.0, 2.0 * pi
FACTORS = {
    "rad": 1.0, "mrad": 1e-3, "deg": DEG, "turn": TURN, "rad/s": 1.0, "rpm": RPM, "deg/s": DEG, "turn/s": TURN,
    "m": 1.0, "mm": 1e-3, "um": 1e-6, "m/s": 1.0, "mm/s": 1e-3,
}  # fmt: skip
SLIPS = (1.0, 1.0 / DEG, 1.0 / RPM, RPM / DEG, 1e3)
"""Factors between units of one motion: what goes so much farther may be the same in another unit."""
METRES = {"m", "mm", "um", "m/s", "mm/s"}
ROUND = {n * k for n in (100, 125, 128, 250, 256, 360, 400, 500, 512, 600, 720, 1000, 1024, 1250, 1440, 2000, 2048, 2500, 3600, 4000, 4096, 5000, 8192, 16384, 32768, 65536, 131072, 262144) for k in (1, 2, 4, 10)}  # fmt: skip
"""Counts that encoders have to a turn."""


@dataclass
class Taken:
    """A column that has a place."""

    column: str
    signal: str
    unit: str = ""
    factor: float = 1.0
    offset: float = 0.0
    nominal: float = 0.0
    wraps: float = 0.0
    commanded: bool = False
    unsaid: bool = False  # its unit was taken, for nobody says one
    lacks: str = ""  # a number without which it is not in force: nominal, or factor
    sure: str = LIKELY
    why: list[str] = field(default_factory=list)

    def doubt(self, why: str, sure: str = UNSURE) -> None:
        """Something is not known of it."""
        order = (UNSURE, LIKELY, SURE)
        self.sure = min(self.sure, sure, key=order.index)
        self.why.append(why)


@dataclass
class LogGuess:
    """What a log's columns seem to be."""

    raw: Raw
    taken: dict[str, Taken] = field(default_factory=dict)  # by signal
    left: dict[str, str] = field(default_factory=dict)  # column: what it looks like
    linear: bool = False
    valid: str = ""
    ratio: tuple[float, float, str] | None = None  # value, its error, by what
    firm: bool = True  # the ratio does not hang on a unit that nobody says
    hints: dict[str, str] = field(default_factory=dict)  # parameter: what the log says of it
    notes: list[str] = field(default_factory=list)
    drives: list[str] = field(default_factory=list)  # of which one was taken

    def si(self, signal: str) -> np.ndarray:
        """A placed channel's means over the pieces, in SI as the rig would have it (without offset)."""
        return self.scale(signal) * self.raw.columns.mean(self.taken[signal].column)

    def scale(self, signal: str) -> float:
        """SI for each unit of a placed column."""
        one = self.taken[signal]
        return one.factor * FACTORS.get(
            one.unit, {"mA": 1e-3, "mV": 1e-3, "mN.m": 1e-3, "N.cm": 1e-2, "kN": 1e3, "%": 1e-2}.get(one.unit, 1.0)
        )
