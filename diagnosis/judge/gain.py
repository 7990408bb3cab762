"""What mending brings, measured on blocks or runs that no fit has seen: before, after, noise floor, regimes, blame."""

from __future__ import annotations

from dataclasses import asdict, dataclass, field, replace

import numpy as np

from ..residuals.experiment import Experiment
from ..residuals.mending import Mending, rms
from ..rules import RULES


@dataclass(frozen=True)
class Errors:
    """How far one comparison is off before and after: in its `unit`, and beside the signal, as others may tell theirs."""

    signal: float  # root mean square of what was measured about its mean
    before: float  # root mean square errors
    after: float
    absolute_before: float  # mean absolute errors
    absolute_after: float
    noise_floor: float

    @classmethod
    def of(cls, mending: Mending, new: list[np.ndarray] | None = None) -> Errors:
        """Of a residual; `new`: errors after, where something else than values made them."""
        old, new = mending.old, mending.new if new is None else new
        was, now, noise = mending.levels(new)
        return cls(mending.signal, was, now, mending.absolute(old), mending.absolute(new), noise)

    def share(self, error: float) -> float | None:
        """Of the signal; None where there is none. 1 - its square is the share of the signal's variance that is explained."""
        return error / self.signal if self.signal > 0.0 else None

    def beside(self) -> dict:
        """What is told beside root mean squares and noise floor."""
        return {
            "signal": self.signal,
            "share_before": self.share(self.before),
            "share_after": self.share(self.after),
            "absolute_before": self.absolute_before,
            "absolute_after": self.absolute_after,
        }


@dataclass
class Gain:
    """Error (root mean square) of one residual on held-out data before and after the extension; all in `unit`."""

    metric: str
    unit: str
    before: float
    after: float
    low: float  # 95 % interval of `after`, over held-out blocks
    high: float
    closed: float  # share of the error above the noise floor that is gone, of squares: independent errors add in squares
    noise_floor: float
    held_out: list[str]
    regimes: list[dict] = field(default_factory=list)  # {where, before, after}
    signal: float = 0.0  # see Errors
    share_before: float | None = None
    share_after: float | None = None
    absolute_before: float = 0.0
    absolute_after: float = 0.0

    @property
    def relative(self) -> str:
        """The error as a share of the signal, before and after, in words; "" where there is no signal."""
        if self.share_before is None or self.share_after is None:
            return ""
        return f"{100 * self.share_before:.3g} -> {100 * self.share_after:.3g} % of the signal"


def closed(was: float, now: float, noise: float) -> float:
    """Share of the squares of an error above its noise that is gone: independent errors add in squares."""
    return float(np.clip((was**2 - now**2) / (was**2 - noise**2), 0.0, 1.0)) if was > noise and was > now else 0.0


def measure(mending: Mending, names: list[str], rng: np.random.Generator, new: list[np.ndarray] | None = None) -> Gain:
    """The gain over blocks that are called `names`; `new`: errors after, where something else than values made them."""
    experiment, residual = mending.experiment, mending.residual
    old, trusted = mending.old, mending.trusted
    new = mending.new if new is None else new
    count = experiment.layout.count
    sums, counts = np.zeros(count), np.zeros(count)
    for i, (e, t) in enumerate(zip(new, trusted)):
        block = experiment.layout.block(i)
        sums += np.bincount(block[t], e[t] ** 2, count)
        counts += np.bincount(block[t], minlength=count)
    there = np.flatnonzero(counts)
    picks = rng.choice(there, (RULES.judge.bootstraps, len(there)))
    low, high = np.sqrt(np.quantile(sums[picks].sum(1) / counts[picks].sum(1), RULES.judge.interval))
    off = Errors.of(mending, new)
    was, now, noise = off.before, off.after, off.noise_floor
    what = residual.quantity if residual.quantity == residual.output else f"the {residual.quantity}"
    metric = f"root mean square error of {what} ({residual.name})"
    regimes = _regimes(mending, old, new, trusted)
    return Gain(
        metric, residual.unit, was, now, float(low), float(high), closed(was, now, noise), noise, names, regimes, **off.beside()
    )


def comparisons(mending: Mending, gain: Gain) -> list[dict]:
    """Errors of all comparisons before and after on the data that judge; `gain`: of the one that it is told of."""
    found = []
    for residual in mending.experiment.residuals:
        if residual.name == mending.residual.name:
            told = asdict(gain)
        else:
            off = Errors.of(replace(mending, residual=residual))
            told = asdict(off) | off.beside()
        row = {"comparison": residual.name, "channel": residual.output, "unit": residual.unit}
        keys = ("before", "after", "noise_floor", "signal", "share_before", "share_after", "absolute_before", "absolute_after")
        found.append(row | {key: told[key] for key in keys})
    return found


def _regimes(mending: Mending, old: list[np.ndarray], new: list[np.ndarray], trusted: list[np.ndarray]) -> list[dict]:
    """Where it got better, and where worse: by speed, direction and load, where the log has a motion."""
    experiment = mending.experiment
    moves = experiment.moves(mending.residual, mending.after)
    if not moves:
        return []
    parts: dict[str, list[np.ndarray]] = {}
    speeds, loads = [speed for speed, _ in moves], [load * np.sign(speed) for speed, load in moves]
    known = abs(np.concatenate([s[t] for s, t in zip(speeds, trusted)]))
    if not len(known):
        return []
    edges = np.unique(np.round(np.quantile(known, RULES.judge.speeds), RULES.judge.speed_digits))
    word = "m/s" if experiment.rig.linear else "rad/s"
    for low, high in zip(edges[:-1], edges[1:]):
        parts[f"speed {low:.3g} to {high:.3g} {word}"] = [(abs(s) >= low) & (abs(s) <= high) for s in speeds]
    parts["forward"] = [s > 0 for s in speeds]
    parts["backward"] = [s < 0 for s in speeds]
    parts["load resists"] = [p > 0 for p in loads]
    parts["load helps"] = [p < 0 for p in loads]
    rows = []
    for where, masks in parts.items():
        inside = [t & m for t, m in zip(trusted, masks)]
        if sum(int(m.sum()) for m in inside) >= RULES.judge.regime_samples:
            rows.append(
                {
                    "where": where,
                    "before": rms([e[m] for e, m in zip(old, inside)]),
                    "after": rms([e[m] for e, m in zip(new, inside)]),
                }
            )
    return rows


def blame(experiment: Experiment, base: np.ndarray, present: np.ndarray, causes: list, by_step: str = "") -> list[dict]:
    """Share of the error above the noise floor that each component bears.

    A residual's excess belongs to the components that a cause was found in, in proportion to nothing finer than the residual;
    without one, to those of its components that no clean residual of their own acquits; in the residual `by_step` to the step.
    """
    excess = {}
    for residual in experiment.residuals:
        part = experiment.slice(residual)
        here = present[:, part]
        r = base[:, part][here]
        excess[residual.name] = max(0.0, float(np.mean(r**2)) - 1.0) * here.sum() if len(r) else 0.0
    clean = {
        c
        for residual in experiment.residuals
        if len(residual.components) == 1
        and excess[residual.name] < RULES.judge.acquitted * present[:, experiment.slice(residual)].sum()
        for c in residual.components
    }
    shares: dict[str, float] = {}
    named = [c.hypothesis.component if c.hypothesis.component != "sensor" else f"sensor {c.hypothesis.channel}" for c in causes]
    for residual in experiment.residuals:
        touched = [
            n for n in named if n in residual.components or n.removeprefix("sensor ") in (*residual.reads, residual.output)
        ]
        bearers = (
            ["simulation"]
            if residual.name == by_step
            else touched or [c for c in residual.components if c not in clean] or list(residual.components)
        )
        for name in bearers:
            shares[name] = shares.get(name, 0.0) + excess[residual.name] / len(bearers)
    total = sum(shares.values())
    if total <= 0.0:
        return []
    return [
        {"component": name, "share": round(float(share / total), 4)}
        for name, share in sorted(shares.items(), key=lambda x: -x[1])
        if share > RULES.judge.told_share * total
    ]
