"""What mending brings, measured on blocks or runs that no fit has seen: before, after, noise floor, regimes, blame."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np

from . import drive
from .bench import Bench
from .cuts import Cut
from .layout import compared
from .noise import floor

DRAWS = 400


@dataclass
class Gain:
    """Error (root mean square) of one cut on held-out data before and after the extension; all in `unit`."""

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


def samples(bench: Bench, cut: Cut, values: dict, blocks: np.ndarray) -> tuple[list[np.ndarray], list[np.ndarray]]:
    """Residual and trust of each run at the samples simulated, trusted only in the chosen blocks."""
    errors, trusted = [], []
    for i, (simulated, measured, good) in enumerate(bench.compare(cut, values)):
        first = int(np.flatnonzero(bench.block_run == i)[0])
        block = compared(bench.block_of[i], bench.channels[i, cut.prefix].take, len(good))
        errors.append(measured - simulated)
        trusted.append(good & np.isfinite(simulated) & blocks[first + block])
    return errors, trusted


def rms(parts: list[np.ndarray]) -> float:
    """Root mean square over all parts; 0 of nothing."""
    joined = np.concatenate(parts) if parts else np.zeros(0)
    return float(np.sqrt(np.mean(joined**2))) if len(joined) else 0.0


def sizes(bench: Bench, residual: np.ndarray, present: np.ndarray) -> dict[str, float]:
    """Error (root mean square) of each cut in units of its noise, where there is something to compare."""
    parts = {cut.name: bench.slice(cut) for cut in bench.cuts}
    return {name: rms([residual[:, part][present[:, part]]]) for name, part in parts.items()}


def improvement(bench: Bench, cut: Cut, before: dict, after: dict, blocks: np.ndarray) -> float:
    """Share by which a cut's error falls in these blocks."""
    if not any(cut.uses(name) and before.get(name) != after.get(name) for name in {*before, *after}):
        return 0.0
    old, trusted = samples(bench, cut, before, blocks)
    new, _ = samples(bench, cut, after, blocks)
    was = rms([e[t] for e, t in zip(old, trusted)])
    return 1.0 - rms([e[t] for e, t in zip(new, trusted)]) / was if was > 0.0 else 0.0


def most_mended(bench: Bench, before: dict, after: dict, blocks: np.ndarray) -> Cut:
    """The cut whose error falls most in these blocks."""
    return max(bench.cuts, key=lambda cut: improvement(bench, cut, before, after, blocks))


def levels(
    bench: Bench, cut: Cut, values: dict, old: list[np.ndarray], new: list[np.ndarray], trusted: list[np.ndarray]
) -> tuple[float, float, float]:
    """Error (root mean square) before and after, and the noise floor, which is no higher; `values`: those after."""
    was, now = (rms([e[t] for e, t in zip(errors, trusted)]) for errors in (old, new))
    return was, now, min(floor(bench, cut, values, new, trusted), now)


def measure(
    bench: Bench,
    cut: Cut,
    before: dict,
    after: dict,
    blocks: np.ndarray,
    names: list[str],
    rng: np.random.Generator,
    new: list[np.ndarray] | None = None,
) -> Gain:
    """The gain of one cut over `blocks`, which are called `names`; `new`: errors after, where not those of `after`."""
    old, trusted = samples(bench, cut, before, blocks)
    if new is None:
        new, _ = samples(bench, cut, after, blocks)
    first = [int(np.flatnonzero(bench.block_run == i)[0]) for i in range(len(bench.runs))]
    sums = np.zeros(bench.blocks)
    counts = np.zeros(bench.blocks)
    for i, (e, t) in enumerate(zip(new, trusted)):
        block = first[i] + bench.block_of[i]
        sums += np.bincount(block[t], e[t] ** 2, bench.blocks)
        counts += np.bincount(block[t], minlength=bench.blocks)
    there = np.flatnonzero(counts)
    picks = rng.choice(there, (DRAWS, len(there)))
    low, high = np.sqrt(np.quantile(sums[picks].sum(1) / counts[picks].sum(1), [0.025, 0.975]))
    was, now, noise = levels(bench, cut, after, old, new, trusted)
    closed = float(np.clip((was**2 - now**2) / (was**2 - noise**2), 0.0, 1.0)) if was > noise and was > now else 0.0
    what = f"the torque at the motor's shaft ({cut.name})" if cut.name.endswith("gear") else f"{cut.output} ({cut.name})"
    gain = Gain(f"root mean square error of {what}", cut.unit, was, now, float(low), float(high), closed, noise, names)
    gain.regimes = _regimes(bench, cut, after, old, new, trusted)
    return gain


def _regimes(bench, cut, values, old, new, trusted) -> list[dict]:
    """Where it got better, and where worse: by speed, direction and load."""
    parts: dict[str, list[np.ndarray]] = {}
    speeds, loads = [], []
    for i in range(len(bench.runs)):
        ch = bench.channels[i, cut.prefix]
        try:
            first, second = drive.both(bench, cut.prefix, values, ch)
        except AttributeError:  # no motion in this log
            return []
        speeds.append(first.speed)
        loads.append(drive.delivered(bench, cut.prefix, values, ch, second) * np.sign(first.speed))
    known = abs(np.concatenate([s[t] for s, t in zip(speeds, trusted)]))
    if not len(known):
        return []
    edges = np.unique(np.round(np.quantile(known, [0.0, 0.33, 0.67, 1.0]), 12))
    word = "m/s" if bench.rig.linear else "rad/s"
    for low, high in zip(edges[:-1], edges[1:]):
        parts[f"speed {low:.3g} to {high:.3g} {word}"] = [(abs(s) >= low) & (abs(s) <= high) for s in speeds]
    parts["forward"] = [s > 0 for s in speeds]
    parts["backward"] = [s < 0 for s in speeds]
    parts["load resists"] = [p > 0 for p in loads]
    parts["load helps"] = [p < 0 for p in loads]
    rows = []
    for where, masks in parts.items():
        inside = [t & m for t, m in zip(trusted, masks)]
        if sum(int(m.sum()) for m in inside) >= 3:
            rows.append(
                {
                    "where": where,
                    "before": rms([e[m] for e, m in zip(old, inside)]),
                    "after": rms([e[m] for e, m in zip(new, inside)]),
                }
            )
    return rows


def blame(bench: Bench, base: np.ndarray, present: np.ndarray, causes: list, by_step: str = "") -> list[dict]:
    """Share of the error above the noise floor that each component bears.

    A cut's excess belongs to the components that a cause was found in, in proportion to nothing finer than the cut;
    without one, to those of its components that no clean cut of their own acquits; in the cut `by_step` to the step.
    """
    excess = {}
    for cut in bench.cuts:
        part = bench.slice(cut)
        here = present[:, part]
        r = base[:, part][here]
        excess[cut.name] = max(0.0, float(np.mean(r**2)) - 1.0) * here.sum() if len(r) else 0.0
    clean = {
        c
        for cut in bench.cuts
        if len(cut.components) == 1 and excess[cut.name] < 0.2 * present[:, bench.slice(cut)].sum()
        for c in cut.components
    }
    shares: dict[str, float] = {}
    named = [c.hypothesis.component if c.hypothesis.component != "sensor" else f"sensor {c.hypothesis.channel}" for c in causes]
    for cut in bench.cuts:
        touched = [n for n in named if n in cut.components or n.removeprefix("sensor ") in (*cut.reads, cut.output)]
        bearers = (
            ["simulation"]
            if cut.name == by_step
            else touched or [c for c in cut.components if c not in clean] or list(cut.components)
        )
        for name in bearers:
            shares[name] = shares.get(name, 0.0) + excess[cut.name] / len(bearers)
    total = sum(shares.values())
    if total <= 0.0:
        return []
    return [
        {"component": name, "share": round(float(share / total), 4)}
        for name, share in sorted(shares.items(), key=lambda x: -x[1])
        if share > 0.005 * total
    ]
