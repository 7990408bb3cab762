"""What an error is made of over the angle of a shaft: waves in a turn, as teeth, poles and eccentric parts leave them.

Over an angle, not over time: a wave that is fixed to a shaft is sharp there however fast the shaft turns.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from selflock.view.figures import axis, line, rule

from ..residuals import drive
from ..residuals.drive_experiment import DriveExperiment
from ..residuals.mending import Mending
from ..rules import RULES
from .traces import AFTER, BEFORE

SHAFTS = ("the input shaft", "the output shaft")


@dataclass(frozen=True)
class Way:
    """A shaft's angle in one run, rad, not wound back, and how far each trusted sample goes of it."""

    angle: np.ndarray
    length: np.ndarray

    @classmethod
    def of(cls, angle: np.ndarray, trusted: np.ndarray) -> Way:
        return cls(angle, abs(np.gradient(angle)) * trusted)

    @property
    def turns(self) -> float:
        """From one end to the other."""
        there = self.angle[self.length > 0.0]
        return float(np.ptp(there)) / (2.0 * np.pi) if len(there) else 0.0


def waves(errors: list[np.ndarray], ways: list[Way]) -> tuple[np.ndarray, np.ndarray]:
    """Orders (waves in a turn) and the amplitude of each in the errors of all runs, each run with a phase of its own.

    Means along the way that a shaft goes, so that where it rests nothing counts, without the mean of each direction.
    """
    highest = RULES.search.highest_order
    turns = int(np.clip(max(way.turns for way in ways), 1, highest))  # so many together are one period: orders are its parts
    places = 8 * highest  # in a turn
    energy, total = np.zeros(turns * highest + 1), 0.0
    for error, way in zip(errors, ways):
        weight, left = way.length, np.where(way.length > 0.0, error, 0.0)
        forward = np.gradient(way.angle) > 0.0
        for mine in (forward, ~forward):
            if weight[mine].any():
                left = np.where(mine, left - np.average(left[mine], weights=weight[mine]), left)
        place = np.floor(np.mod(way.angle / (2.0 * np.pi), turns) * places).astype(int) % (turns * places)
        sums = np.bincount(place, weight * left, turns * places)
        if weight.any():
            energy += abs(np.fft.rfft(sums)[: len(energy)]) ** 2 / weight.sum()
            total += weight.sum()
    return np.arange(len(energy)) / turns, 2.0 * np.sqrt(energy / max(total, 1e-300))


def by_chance(noise: float, ways: list[Way]) -> float:
    """Amplitude (root mean square) that every wave has in noise that is new in each sample."""
    squares = sum(float((way.length**2).sum() / way.length.sum()) for way in ways if way.length.any())
    total = sum(float(way.length.sum()) for way in ways)
    return 2.0 * noise * float(np.sqrt(squares / total)) if total > 0.0 else 0.0


def shafts(mending: Mending) -> dict[str, list[Way]]:
    """Ways of the shafts that turn once at least, where the log has an angle of the drive."""
    experiment, residual = mending.experiment, mending.residual
    if not isinstance(experiment, DriveExperiment) or experiment.steady or experiment.rig.linear:
        return {}
    channels = [experiment.channels[i, residual.prefix] for i in range(len(experiment.runs))]
    if not all(ch.has("reducer.input_angle") or ch.has("load.angle") for ch in channels):
        return {}
    found = {}
    for side, name in enumerate(SHAFTS):
        angles = [ch.taken(drive.both(mending.after, ch)[side].angle) for ch in channels]
        ways = [Way.of(angle, trusted) for angle, trusted in zip(angles, mending.trusted)]
        if max(way.turns for way in ways) >= 1.0:
            found[name] = ways
    return found


def plots(mending: Mending, noise: float) -> list[dict[str, Any]]:
    """The spectrum of the error over the angles that the log knows, before and after; none where no shaft turns once."""
    made = []
    for name, ways in shafts(mending).items():
        marks = [rule(by_chance(noise, ways), "y", "noise floor"), line(*waves(mending.old, ways), "nominal", BEFORE, thin=True)]
        if mending.changed:
            marks.append(line(*waves(mending.new, ways), "extended", AFTER, thin=True))
        amplitude = axis("amplitude of the error", mending.residual.unit, start=0.0)
        made.append({"x": axis(f"waves in a turn of {name}"), "y": amplitude, "marks": marks})
    return made
