"""Is the step fine enough? A replay steps from row to row of a log; here it is run with parts of these steps.

Between two rows nothing is known. Measured inputs go straight from one to the next; a command is held over the step, as
the replay has it, or was followed by others that the log left out, and then a straight line is nearer: the better one
counts. Where it moves the simulation less than the noise, a finer step would say nothing else. Where it takes the error
away, with nothing fitted, the step is the cause, before any law.
"""

from __future__ import annotations

from dataclasses import asdict, dataclass, replace

import numpy as np
from scipy.special import ndtr

from ..data.log import VALID, MeasuredRun
from ..data.rig import split
from ..data.signals import GIVEN
from ..residuals.drive import between
from ..residuals.drive_experiment import DriveExperiment
from ..residuals.experiment import Experiment
from ..residuals.mending import Mending, most_mended
from ..residuals.noise import floor
from ..residuals.residual import Residual
from ..rules import RULES
from .cause import Cause
from .gain import measure
from .verdict import Judgement


@dataclass(frozen=True)
class TimeStep:
    """What parts of a step change in the comparison that they change most, without any cause mended."""

    residual: str
    unit: str
    size: float  # s, of the log
    held: bool  # commands over the step; else straight lines
    moved: float  # the simulation, root mean square, in `unit`
    noise: float
    before: float  # error (root mean square) with the log's step
    after: float  # with parts of it
    left: float  # with the log's step, the causes found mended

    @property
    def ratio(self) -> float:
        """Change of the simulation in units of the noise."""
        return self.moved / self.noise if self.noise else 0.0

    @property
    def explains(self) -> bool:
        """Whether a finer step alone closes the error, and as well as the causes found."""
        rules, above = RULES.judge, self.before**2 - self.noise**2
        closes = self.before**2 - self.after**2 > rules.step_enough * above
        return self.ratio > rules.step_moves and closes and self.after < rules.step_as_good * self.left

    def row(self) -> dict:
        """As diagnosis.json has it."""
        return asdict(self) | {"ratio": self.ratio, "explains": self.explains}

    def __str__(self) -> str:
        moves = (
            f"{RULES.judge.parts} parts of a step move the simulation ({self.residual}) by {100 * self.ratio:.0f} % of its noise"
        )
        if self.ratio < RULES.judge.step_moves:
            return f"the step of {self.size:.3g} s is fine enough: {moves}"
        if self.after > RULES.judge.step_little * self.before:
            share = 100 * self.moved / self.before
            return f"the step of {self.size:.3g} s is not what is wrong: {moves}, {share:.1f} % of its error"
        return (
            f"the step of {self.size:.3g} s is coarse: {moves}, its error from {self.before:.3g} to {self.after:.3g} "
            f"{self.unit}. Log more rows a second"
        )


def finest(experiment: DriveExperiment, before: dict, after: dict, blocks: np.ndarray) -> TimeStep | None:
    """The comparison that a finer step changes most on these blocks; steady-state points have no step.

    before, after: values without the causes found and with them.
    """
    if experiment.steady:
        return None
    experiment, found = experiment.head(experiment.enough(blocks)), []
    size = experiment.step
    ways = {held: refined(experiment, held, before) for held in (True, False)}
    for residual in experiment.residuals:
        mending = Mending(experiment, residual, before, after, blocks)
        errors, left, pick = mending.old, mending.new, mending.size
        finer = {held: errors_of(fine, residual, before, errors) for held, fine in ways.items()}
        held = min(ways, key=lambda way: pick(finer[way]))
        moved = pick([f - e for f, e in zip(finer[held], errors)])
        noise = floor(experiment, residual, after, left, mending.trusted)
        found.append(
            TimeStep(residual.name, residual.unit, size, held, moved, noise, pick(errors), pick(finer[held]), pick(left))
        )
    return max(found, key=lambda step: step.ratio)


def to_blame(
    step: TimeStep, whole: DriveExperiment, found: Judgement, blocks: np.ndarray, names: list[str], rng: np.random.Generator
) -> tuple[Judgement, Cause]:
    """The step in the place of causes that were found where it acts, and what is left of these; they keep their fit.

    The gain is the step's own where it is the only cause.
    """
    before, outcome = found.mending.before, found.outcome
    experiment = whole.head(whole.enough(blocks))
    residual = next(residual for residual in experiment.residuals if residual.name == step.residual)
    mending = Mending(experiment, residual, before, before, blocks)
    finer = errors_of(refined(experiment, step.held, before), residual, before, mending.old)
    count = experiment.layout.count
    drops = np.zeros(count)
    for i, (e, f, t) in enumerate(zip(mending.old, finer, mending.trusted)):
        drops += np.bincount(experiment.layout.block(i)[t], (e**2 - f**2)[t], count)
    drops = drops[drops != 0.0]
    spread = drops.std(ddof=1) / np.sqrt(len(drops)) if len(drops) > 1 else np.inf
    size = {"value": step.size, "low": step.size, "high": step.size, "unit": "s", "determined": True, "doubt": ""}
    cause = Cause("simulation", "step", {"step": size}, round(float(ndtr(drops.mean() / max(spread, 1e-300))), 4))
    acts = lambda h: h.component in residual.components or h.channel in (*residual.reads, residual.output)
    kept = [(c, stage) for c, stage in zip(outcome.causes, outcome.kept) if not acts(c.hypothesis)]
    gone = {p.name for c in outcome.causes if acts(c.hypothesis) for p in c.free} - {p.name for c, _ in kept for p in c.free}
    after = {name: value for name, value in found.mending.after.items() if name not in gone}
    after |= {name: value for name, value in before.items() if name in gone}
    outcome = replace(outcome, causes=[c for c, _ in kept], kept=[stage for _, stage in kept])
    if not kept:
        return Judgement(outcome, mending, measure(mending, names, rng, finer), []), cause
    mending = Mending(whole, most_mended(whole, before, after, blocks), before, after, blocks)
    return Judgement(outcome, mending, measure(mending, names, rng), []), cause


def errors_of(fine: Experiment, residual: Residual, values: dict, errors: list[np.ndarray]) -> list[np.ndarray]:
    """Errors of a refined experiment at the rows of the log; what cannot be simulated there stays as it was."""
    values = {name: value for name, value in values.items() if not name.startswith("recorder.")}  # see refined
    found = [(measured - simulated)[:: RULES.judge.parts] for simulated, measured, _ in fine.compare(residual, values)]
    return [np.where(np.isfinite(f), f, e) for f, e in zip(found, errors)]


def refined(experiment: DriveExperiment, held: bool, values: dict) -> DriveExperiment:
    """The same comparisons in parts of steps; row i of the log is sample i times as many.

    A measured voltage of which a fit has found how it is to be read between rows is read so here: that is known.
    """
    return experiment.finer(
        [_read(run, _between(run, experiment.rig.drives, held), values) for run in experiment.runs], RULES.judge.parts
    )


def _read(run: MeasuredRun, finer: MeasuredRun, values: dict) -> MeasuredRun:
    """The finer run with voltages as `values` have them read between rows, in the middle of each of its steps."""
    middle = finer.time + 0.5 * np.append(np.diff(finer.time), 0.0)
    of = lambda name: f"recorder.{name}.shift"
    known = {name: between(x, run.time, values[of(name)])(middle) for name, x in run.signals.items() if of(name) in values}
    return replace(finer, signals=finer.signals | known)


def _between(run: MeasuredRun, drives: tuple[str, ...], held: bool) -> MeasuredRun:
    """A run with rows between its rows; one is good where both its neighbours are."""
    parts = RULES.judge.parts
    rows = np.arange((len(run) - 1) * parts + 1)
    before = rows // parts
    after = np.minimum(before + (rows % parts > 0), len(run) - 1)
    line = lambda x: np.interp(rows / parts, np.arange(len(run)), x)
    still = {name for name in run.signals if name == VALID or (held and split(name, drives)[1] in GIVEN)}
    signals = {name: x[before] if name in still else line(x) for name, x in run.signals.items()}
    good = {name: g[before] & g[after] for name, g in run.good.items()}
    return MeasuredRun(run.log, run.name, run.rows[before], line(run.time), signals, good, source=run.source)
