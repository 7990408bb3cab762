"""Set-points that a drive may be asked for within limits, drawn at random: moves, creeping, waves and rests."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from ..rules import RULES

KINDS = ("move", "creep", "wave", "rest")


@dataclass(frozen=True)
class Limits:
    """What a planned run keeps to, of the output side, SI. voltage and current: in the simulation of every model."""

    low: float  # rad
    high: float
    speed: float  # rad/s
    acceleration: float  # rad/s2
    duration: float  # s
    voltage: float = np.inf
    current: float = np.inf


@dataclass(frozen=True)
class Segment:
    """A piece of a run. to, speed and acceleration: shares of what the limits allow; length: s of a rest, periods of a wave."""

    kind: str
    to: float
    speed: float
    acceleration: float
    length: float


@dataclass(frozen=True)
class Style:
    """How a run is drawn: shares of the kinds, and ranges of what its segments are."""

    shares: tuple[float, ...]
    slow: float  # the least speed, share
    fast: float
    gentle: float  # the least acceleration, share
    hard: float
    low: float  # places, shares of the way
    high: float

    @classmethod
    def draw(cls, rng: np.random.Generator) -> Style:
        """Another one each time: as different as runs may be, so that some are good for the question at hand."""
        slow, fast = np.sort(np.exp(rng.uniform(np.log(RULES.planning.slowest), 0.0, 2)))
        gentle, hard = np.sort(np.exp(rng.uniform(np.log(RULES.planning.gentlest), 0.0, 2)))
        low, high = np.sort(rng.uniform(0.0, 1.0, 2))
        if high - low < RULES.planning.narrowest or rng.random() < RULES.planning.everywhere:
            low, high = 0.0, 1.0
        shares = rng.dirichlet(RULES.planning.shares)
        return cls(tuple(map(float, shares)), *map(float, (slow, fast, gentle, hard, low, high)))

    def segment(self, rng: np.random.Generator) -> Segment:
        """One piece in this style."""
        within = lambda low, high: float(np.exp(rng.uniform(np.log(low), np.log(high))))
        kind = str(rng.choice(KINDS, p=self.shares))
        to = rng.uniform(self.low, self.high)
        return Segment(
            kind,
            float(to),
            within(self.slow, self.fast),
            within(self.gentle, self.hard),
            float(rng.uniform(*RULES.planning.lengths)),
        )


@dataclass(frozen=True)
class Design:
    """A run as a list of segments, and the style that new ones are drawn in."""

    segments: tuple[Segment, ...]
    style: Style

    @classmethod
    def draw(cls, rng: np.random.Generator) -> Design:
        style = Style.draw(rng)
        return cls(tuple(style.segment(rng) for _ in range(RULES.planning.segments)), style)

    def mutated(self, rng: np.random.Generator) -> Design:
        """With some neighbouring segments drawn anew, in its own style or in another one."""
        style = self.style if rng.random() < 0.5 else Style.draw(rng)
        count = int(rng.integers(1, RULES.planning.segments // 2))
        first = int(rng.integers(0, max(1, len(self.segments) - count)))
        new = tuple(style.segment(rng) for _ in range(count))
        return replace(self, segments=(*self.segments[:first], *new, *self.segments[first + count :]))


def setpoint(
    design: Design, limits: Limits, step: float, start: float | None = None
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Times, angles and speeds of a run, at rest at its start and its end; segments that no time is left for are left out.

    start: the angle that it begins at; in the middle where not given.
    """
    n = int(round(limits.duration / step))
    speed, angle = np.zeros(n + 1), 0.5 * (limits.low + limits.high) if start is None else start
    at = min(n, int(RULES.planning.settle / step))
    for segment in design.segments:
        piece = _piece(segment, angle, limits, step)
        if at + len(piece) > n - 1:
            continue
        speed[at : at + len(piece)] = piece
        angle += float(piece.sum()) * step
        at += len(piece)
    begin = 0.5 * (limits.low + limits.high) if start is None else start
    angles = begin + np.concatenate([[0.0], np.cumsum(0.5 * (speed[1:] + speed[:-1])) * step])
    return np.arange(n + 1) * step, angles, speed


def _piece(segment: Segment, angle: float, limits: Limits, step: float) -> np.ndarray:
    """The speeds of a segment that begins at this angle, rad/s, from rest to rest."""
    top, hard = segment.speed * limits.speed, segment.acceleration * limits.acceleration
    if segment.kind == "rest":
        return np.zeros(int(segment.length / step))
    if segment.kind == "wave":
        room = min(limits.high - angle, angle - limits.low)
        # amplitude a and frequency w: a w = top, a w^2 = hard; the wave begins at rest, as a (1 - cos w t) / 2 does
        rate = min(hard / max(top, 1e-9), 0.5 * np.pi / step / RULES.planning.resolved)
        reach = min(top / max(rate, 1e-9), max(room, 0.0))
        side = 1.0 if limits.high - angle > angle - limits.low else -1.0
        periods = max(1, round(segment.length * RULES.planning.periods))
        time = _times(periods * 2.0 * np.pi / max(rate, 1e-9), limits, step)
        return side * 0.5 * reach * rate * np.sin(rate * time)
    if segment.kind == "creep":
        top *= RULES.planning.creep
    distance = limits.low + segment.to * (limits.high - limits.low) - angle
    top = min(top, np.sqrt(abs(distance) * hard))
    if top <= 0.0:
        return np.zeros(1)
    time = _times(abs(distance) / top + top / hard, limits, step)
    return np.sign(distance) * np.clip(np.minimum(time, time[-1] - time) * hard, 0.0, top)


def _times(length: float, limits: Limits, step: float) -> np.ndarray:
    """The times of a segment so many s long; of one longer than the run only as many as leave it out of any."""
    return np.arange(0.0, min(length, limits.duration + step), step)
