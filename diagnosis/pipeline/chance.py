"""What the whole search finds in nothing: the null distribution of a diagnosis, from simulated logs.

The search measures chance quickly, by a linear search in shuffled misfits (screen). Here the search itself is run
on logs that hold no effect. Such a log is the base simulation (the nominal drive, what is uncertain refitted) and
errors e*: what the best model leaves on the measured log, its blocks permuted and their signs flipped. A simulation
with other values is off on it by

    misfit*(values) = misfit(values) - misfit(base values) + e*

which is exact, for both sides run on the same measured inputs; no log need be written. On it the first stage of the
search is run as it is: base fit, first look at all hypotheses, fits, judgement on blocks not seen. What it gives is
the largest gain that the search finds by chance, and which hypothesis made it.
"""

from __future__ import annotations

import hashlib
import json
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any

import numpy as np
from threadpoolctl import threadpool_limits

from ..data.log import MeasuredRun
from ..data.rig import Rig, load
from ..errors import DataError
from ..output.figures import AFTER, BEFORE, MEASURED, save, styled, subplots
from ..residuals.drive_experiment import DriveExperiment
from ..residuals.laws import check_names
from ..rules import RULES
from ..search.problem import Problem
from ..search.selection import ForwardSelection
from ..search.step import Stage
from . import hold_out as blocks
from .run import gather, problem_of

LEVELS = (0.5, 0.9, 0.95, 0.98)
"""Quantiles that are told."""


@dataclass
class ChanceStudy:
    """A diagnosis whose chance is asked for: what every draw has in common. Plain data until it is opened."""

    rig: Rig
    runs: list[MeasuredRun]
    held: list[bool]
    seed: int
    left: np.ndarray = field(
        init=False
    )  # what the best model leaves on the measured log, in units of its noise (blocks, samples)
    problem: Problem = field(init=False)  # of the measured log, once opened
    base: np.ndarray = field(init=False)  # the misfit of the base simulation on it

    def open(self, _folder: Any = None) -> ChanceStudy:
        """Lay out the log, fit the nominal drive. Always the same numbers, so every worker does it for itself."""
        experiment = DriveExperiment(self.rig, self.runs)
        train, _ = blocks.split(experiment, self.runs, self.held)
        self.problem = problem_of(experiment, self.runs, self.held, train).with_noise()
        self.base = self.problem.fit(self.problem.base_free, self.problem.nominal).misfit
        return self

    def measured(self) -> Stage:
        """The first stage on the measured log; what its best model leaves is what draws are made of."""
        stage = first_stage(self.problem, np.random.default_rng(self.seed))
        best = stage.candidates[0].fit if stage.candidates and stage.candidates[0].fit else stage.base.fitted
        self.left = best.misfit.reshape(self.problem.shape)
        return stage

    def without_effect(self, rng: np.random.Generator) -> Problem:
        """The problem of a simulated log: the measured one with its errors in other places and signs."""
        errors, taught = self.left.copy(), np.flatnonzero(self.problem.train)
        order, signs = rng.permutation(taught), rng.choice([-1.0, 1.0], len(taught))
        errors[taught] = self.left[order] * signs[:, None]
        return replace(self.problem, shift=errors.ravel() - self.base)

    def __getstate__(self) -> dict:
        return {key: value for key, value in self.__dict__.items() if key not in ("problem", "base")}


def first_stage(problem: Problem, rng: np.random.Generator) -> Stage:
    """The search for the first cause; on mere noise, too, every hypothesis is tried."""
    return ForwardSelection(problem, rng, clean=0.0).step(problem.fit(problem.base_free, problem.nominal), [])


@threadpool_limits.wrap(limits=1)  # so that the bits do not depend on where it is made
def draw(study: ChanceStudy, item: dict) -> dict:
    """One simulated log: the largest gain that the search finds, who made it, how likely the quick draws call it."""
    rng = np.random.default_rng([study.seed, item["draw"]])
    stage = first_stage(study.without_effect(rng), rng)
    fitted = [c for c in stage.candidates if c.fit]
    if not fitted:
        return {"gain": 0.0, "hypothesis": "none", "quick": 1.0}
    best = max(fitted, key=lambda c: c.gain)
    return {"gain": max(best.gain, 0.0), "hypothesis": best.hypothesis.label, "quick": best.chance}


@dataclass
class Chance:
    """How the best of a measured log compares with the best of logs without effect.

    Gains are shares of the loss that the best model leaves.
    """

    gain: float  # best gain on the measured log, its loss in units of what its best model leaves
    hypothesis: str  # which made it
    quick: np.ndarray  # largest gains by chance, linear draws
    draws: list[dict] = field(default_factory=list)  # gain, hypothesis, quick of each simulated log
    failed: int = 0

    @property
    def full(self) -> np.ndarray:
        """Largest gains by chance, whole search."""
        return np.array([row["gain"] for row in self.draws])

    @property
    def size(self) -> float:
        """Share of logs without effect in which the quick draws call the best hypothesis significant."""
        return float(np.mean([row["quick"] <= RULES.search.significant for row in self.draws]))

    def by_chance(self, gains: np.ndarray) -> float:
        """Share of draws in which chance does as well as the measured log's best, that log counted with them."""
        return (1 + int((gains >= self.gain).sum())) / (1 + len(gains))

    def data(self) -> dict:
        names = [row["hypothesis"] for row in self.draws]
        return {
            "gain": self.gain,
            "hypothesis": self.hypothesis,
            "full": {
                "draws": len(self.draws),
                "failed": self.failed,
                "chance": self.by_chance(self.full),
                "quantiles": _quantiles(self.full),
            },
            "quick": {"draws": len(self.quick), "chance": self.by_chance(self.quick), "quantiles": _quantiles(self.quick)},
            "level": RULES.search.significant,
            "passed": self.size,
            "found": {name: names.count(name) for name in sorted(set(names), key=lambda n: (-names.count(n), n))},
        }

    def summary(self) -> str:
        said = self.data()
        lines = [
            f"{self.hypothesis or 'nothing'} gains {100 * self.gain:.3g} % on the measured log. "
            f"By chance as much in a share of {said['full']['chance']:.2g} of {len(self.draws)} simulated logs and "
            f"itself; {said['quick']['chance']:.2g} by the quick draws.",
            "  largest gain by chance in %" + "".join(f"  q{100 * level:.0f}" for level in LEVELS),
        ]
        for name, kind in (("whole search", "full"), ("quick draws", "quick")):
            lines.append(f"    {name:24}" + "".join(f"  {100 * q:.3g}" for q in said[kind]["quantiles"].values()))
        lines.append(
            f"  The quick draws call the best of a log without effect significant in {100 * self.size:.1f} % of logs "
            f"(meant: {100 * RULES.search.significant:.0f} %)."
        )
        lines.append("  found by chance: " + ", ".join(f"{name} ({count})" for name, count in list(said["found"].items())[:6]))
        if self.failed:
            lines.append(f"  {self.failed} draws failed")
        return "\n".join(lines)

    def write(self, out: Path) -> None:
        """chance.json and chance.png."""
        (out / "chance.json").write_text(json.dumps(self.data(), indent=2) + "\n")
        _plot(self, out / "chance.png")


@threadpool_limits.wrap(limits=1)
def chance(
    rig: str | Path | Rig,
    logs: Sequence[str | Path],
    test: Sequence[str | Path] = (),
    draws: int = 100,
    seed: int = 0,
    out: str | Path | None = None,
    spread: Callable[..., list[dict]] | None = None,
) -> Chance:
    """Measure what the search for the first cause finds in logs without effect, and in the measured one.

    out: folder for chance.json and chance.png; None writes nothing.
    spread: makes the draws, as `spread(draw, items, context=..., about=..., folder=..., title=...)`; they are made one
    after the other when it is not given.
    """
    rig = rig if isinstance(rig, Rig) else load(rig)
    if rig.system is not None:
        raise DataError(f"{rig.path}: a system of FMUs has no search of hypotheses, so there is no chance to measure.")
    if rig.effects is not None:
        raise DataError(f"{rig.path}: [rig] effects: chance is measured with our own effects and those of installed packages.")
    check_names(rig)
    runs, _, held = gather(rig, logs, test)
    study = ChanceStudy(rig, runs, held, seed).open()
    if out is not None:
        Path(out).mkdir(parents=True, exist_ok=True)
    stage = study.measured()
    items = [{"draw": number} for number in range(draws)]
    if spread is None:
        rows = [{"status": "ok", **draw(study, item)} for item in items]
    else:
        about = {"rig": rig.name, "log": _digest(study), "seed": seed}
        rows = spread(draw, items, context=study, about=about, folder=out, title="simulated logs")
    best = stage.candidates[0] if stage.candidates and stage.candidates[0].fit else None
    good = [{key: row[key] for key in ("gain", "hypothesis", "quick")} for row in rows if row["status"] == "ok"]
    if not good:
        raise DataError(f"No draw could be made: {rows[0]['reason'] if rows else 'ask for one at least'}.")
    found = Chance(
        best.gain if best else 0.0, best.hypothesis.label if best else "", stage.by_chance, good, len(rows) - len(good)
    )
    if out is not None:
        found.write(Path(out))
    return found


def _quantiles(gains: np.ndarray) -> dict[str, float]:
    return {f"{level:g}": float(np.quantile(gains, level)) for level in LEVELS} if len(gains) else {}


def _digest(study: ChanceStudy) -> str:
    """Which rig and which measured numbers."""
    rig = {
        key: sorted(value) if isinstance(value, frozenset) else str(value)
        for key, value in vars(study.rig).items()
        if key not in ("path", "allow_code", "isolate")
    }
    content = hashlib.sha256(json.dumps([rig, study.held], sort_keys=True).encode())
    for run in study.runs:
        content.update(run.time.tobytes())
        for name, values in sorted(run.signals.items()):
            content.update(name.encode() + np.ascontiguousarray(values).tobytes() + run.usable(name).tobytes())
    return content.hexdigest()[:16]


@styled
def _plot(found: Chance, path: Path) -> Path:
    """The share of draws above each gain, and where the measured log lies."""
    figure, axes = subplots(figsize=(7.5, 4.4))
    for gains, label, color in (
        (found.quick, f"quick: linear search, {len(found.quick)} draws", AFTER),
        (found.full, f"whole search, {len(found.full)} simulated logs", BEFORE),
    ):
        if len(gains):
            x = 100.0 * np.sort(gains)
            axes.step(np.append(0.0, x), 1.0 - np.arange(len(x) + 1) / len(x), where="post", color=color, label=label)
    most = 100.0 * max(found.full.max(), found.quick.max() if len(found.quick) else 0.0, 1e-3)
    mine, name = 100.0 * found.gain, found.hypothesis
    if mine <= 3.0 * most:
        axes.axvline(mine, color=MEASURED, lw=1.2, label=f"measured log: {name}")
        most = max(most, mine)
    else:
        axes.annotate(f"measured log: {name}, {mine:.3g} % →", (0.99, 0.76), xycoords="axes fraction", ha="right")
    axes.axhline(RULES.search.significant, color="0.5", lw=0.8, ls=":")
    axes.annotate(
        f"level of a cause, {RULES.search.significant:g}",
        (0.995, RULES.search.significant),
        xycoords=("axes fraction", "data"),
        ha="right",
        va="bottom",
        fontsize=8,
        color="0.4",
    )
    axes.set(
        yscale="log",
        ylim=(0.5 / max(len(found.full), len(found.quick), 50), 1.2),
        xlim=(0.0, 1.08 * most),
        xlabel="largest held-out gain, % of the loss that the best model leaves",
        ylabel="share of draws above it",
    )
    axes.legend(frameon=False, loc="upper right")
    return save(figure, path)
