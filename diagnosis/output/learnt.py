"""learnt.py: where no cause explains what is missing, the torque that a log asks for, as an effect file to edit and give back.

What the gear and the shaft's inertia take is compared with what the motor gives; the difference is a torque on the input
shaft. It is learnt as a function of one variable that the reducer's hooks know, straight between knots and constant beyond
them, on the blocks that teach; as many knots as predict most of blocks that they were not learnt from. It is a curve and no
cause: the verdict stays `unknown`.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from ..judge.depends import Dependence
from ..residuals import drive
from ..residuals.blocks import compared
from ..residuals.compare import gear_inputs
from ..residuals.drive_experiment import DriveExperiment
from ..residuals.residual import Residual
from ..rules import RULES

NAME = "learnt.py"


@dataclass(frozen=True)
class Axis:
    """A variable that the reducer's hooks know."""

    said: str  # in the file, of the condition x
    unit: str
    words: str
    needs: str = ""


AXES = {
    "speed": Axis("x.speed", "rad/s", "the speed of the input shaft"),
    "load": Axis("x.output_torque", "N.m", "the output torque"),
    "position": Axis("x.angle", "rad", "the angle of the input shaft", "angle"),
    "output position": Axis("x.output_angle", "rad", "the angle of the output shaft", "angle"),
    "time": Axis("x.time", "s", "the time since the start", "time"),
}

FILE = '''\
"""A torque over {words}: learnt from a log, no law, and no cause. Look at it, put a law in its place, or keep it.

Straight between the knots, constant beyond the first and the last: outside of {low:.6g} to {high:.6g} {unit} nothing was seen.
On data that it was not learnt from it takes the error from {before:.4g} to {after:.4g} N.m (root mean square, at the input
shaft; before anything is fitted again). Give it back by effects = "..." in the rig, which names the folder that it is in.
"""

from selflock.fmus.effect import AMPLITUDE, Effect, Parameter

KNOTS = (  # {unit}, N.m against positive motion; behind it the standard error
{knots}
)


def table(at):
    """Torque at this place, N.m."""
    if at <= KNOTS[0][0]:
        return KNOTS[0][1]
    for i in range(1, len(KNOTS)):
        if at <= KNOTS[i][0]:
            share = (at - KNOTS[i - 1][0]) / (KNOTS[i][0] - KNOTS[i - 1][0])
            return KNOTS[i - 1][1] + share * (KNOTS[i][1] - KNOTS[i - 1][1])
    return KNOTS[len(KNOTS) - 1][1]


def active(p, x):
    return 2.0 if p.learnt_torque != 0.0 else 0.0


def torque(p, x):
    return p.learnt_torque * table({said})


EFFECT = Effect(
    component="reducer",
    name="learnt",
    summary="a table of torque over {words}, straight between knots, constant beyond them",
    parameters=(Parameter("learnt_torque", "", 0.0, -3.0, 3.0, "factor on the table; 1: as it was learnt", AMPLITUDE),),
    source="learnt from a log",
    hooks={{"active": active, "torque": torque}},
    advice="the range of the table once more, in another order and at another load",
    shown_over="{shown}",
    needs={needs!r},
)
'''


@dataclass(frozen=True)
class Samples:
    """Missing torque over a variable: flat over all runs."""

    x: np.ndarray
    torque: np.ndarray  # N.m, positive against positive motion
    block: np.ndarray  # of each

    def of(self, blocks: np.ndarray) -> Samples:
        """Those in blocks that are true."""
        some = blocks[self.block]
        return Samples(self.x[some], self.torque[some], self.block[some])


@dataclass(frozen=True)
class Curve:
    """A learnt function, straight between knots and constant beyond them."""

    variable: str
    wraps: bool  # the variable is an angle within a turn
    knots: np.ndarray
    torque: np.ndarray  # N.m, at each knot
    errors: np.ndarray  # standard error of each
    share: float  # of the squared torque that it predicts in blocks that it was not learnt from

    def __call__(self, x: np.ndarray) -> np.ndarray:
        return np.interp(x, self.knots, self.torque)


def write_learnt(
    experiment: DriveExperiment, values: dict, left: Sequence[Dependence], train: np.ndarray, out: Path
) -> dict[str, object] | None:
    """Write learnt.py of the variable that predicts most, and tell what is in it; None where no curve predicts enough.

    values: of the drive without a cause. left: with what its error goes. train: blocks to learn from; the others judge.
    """
    best: tuple[Curve, Samples] | None = None
    for dependence in left:
        residual = next(one for one in experiment.residuals if one.name == dependence.residual)
        if residual.kind != "gear" or dependence.variable not in AXES or residual.unit not in ("N.m", "A"):
            continue
        samples, wraps = _samples(experiment, residual, dependence.variable, values)
        curve = learn(samples.of(train), dependence.variable, wraps)
        if curve and curve.share >= RULES.judge.variance and (best is None or curve.share > best[0].share):
            best = curve, samples
    if best is None:
        return None
    curve, samples = best
    unseen, rms = samples.of(~train), lambda e: float(np.sqrt(np.mean(e**2)))
    if not len(unseen.x):
        return None
    before, after = rms(unseen.torque), rms(unseen.torque - curve(unseen.x))
    if not after < before:
        return None
    (out / NAME).write_text(source(curve, before, after), encoding="utf-8")
    low, high = float(curve.knots[0]), float(curve.knots[-1])
    return {"file": NAME, "over": curve.variable, "low": low, "high": high, "before": before, "after": after, "unit": "N.m"}


def source(curve: Curve, before: float, after: float) -> str:
    """The effect file of a curve; before, after: root mean square of what is missing in unseen data, N.m."""
    axis = AXES[curve.variable]
    rows = zip(curve.knots, curve.torque, curve.errors)
    said = {"knots": "\n".join(f"    ({_text(x)}, {_text(torque)}),  # {error:.2g}" for x, torque, error in rows)}
    said |= {"said": f"{axis.said} % {2.0 * np.pi!r}" if curve.wraps else axis.said, "shown": curve.variable}
    needs = (axis.needs,) if axis.needs else ()
    numbers = {"low": curve.knots[0], "high": curve.knots[-1], "before": before, "after": after}
    return FILE.format(words=axis.words, unit=axis.unit, needs=needs, **said, **numbers)


def _text(value: float) -> str:
    """A number that is no integer to Python, so that all knots are of one type."""
    return repr(float(f"{value:.6g}"))


def _samples(experiment: DriveExperiment, residual: Residual, variable: str, values: dict) -> tuple[Samples, bool]:
    """What is missing at the input shaft in each trusted sample; whether the variable goes beyond a turn."""
    parts: list[tuple[np.ndarray, ...]] = []
    for i, (simulated, measured, good) in enumerate(experiment.compare(residual, values)):
        run, ch = experiment.runs[i], experiment.channels[i, residual.prefix]
        inputs, _ = gear_inputs(values, ch)
        _, second = drive.both(values, ch)
        over = {
            "position": inputs[0],
            "speed": inputs[1],
            "output position": inputs[2],
            "load": drive.delivered(values, ch, second),
            "time": run.time - run.time[0],
        }
        constant = drive.law("motor", values, ch).torque_constant if residual.unit == "A" else 1.0
        n = len(simulated)
        x, block = (compared(a, ch.take, n) for a in (over[variable], experiment.layout.block(i)))
        torque = constant * (measured - simulated)
        known = good & np.isfinite(torque) & np.isfinite(x)
        parts.append((x[known], torque[known], block[known]))
    x, torque, block = (np.concatenate(arrays) for arrays in zip(*parts))
    wraps = AXES[variable].needs == "angle" and len(x) > 0 and float(np.ptp(x)) >= 2.0 * np.pi
    return Samples(np.mod(x, 2.0 * np.pi) if wraps else x, torque, block), wraps


def learn(samples: Samples, variable: str, wraps: bool = False) -> Curve | None:
    """The curve with the number of knots that predicts most of unseen blocks; None where there is too little to learn from."""
    rules = RULES.judge
    labels, number = np.unique(samples.block, return_inverse=True)
    if len(labels) < rules.blocks:
        return None
    fold, torque = number % rules.folds, np.clip(samples.torque, *np.quantile(samples.torque, rules.tails))
    best: tuple[float, np.ndarray, list[np.ndarray]] | None = None
    for count in rules.learnt_knots:
        knots = _knots(samples.x, count)
        if len(knots) < 2:
            continue
        fits = [_fit(samples.x[fold != f], torque[fold != f], knots) for f in range(rules.folds)]
        left = sum(
            float(((torque[fold == f] - np.interp(samples.x[fold == f], knots, fit)) ** 2).sum()) for f, fit in enumerate(fits)
        )
        if best is None or left < best[0]:
            best = left, knots, fits
    if best is None:
        return None
    left, knots, fits = best
    spread = np.stack(fits) - np.mean(fits, axis=0)
    errors = np.sqrt((len(fits) - 1) / len(fits) * (spread**2).sum(0))  # the jackknife's, over folds
    share = 1.0 - left / max(float((torque**2).sum()), 1e-300)
    return Curve(variable, wraps, knots, _fit(samples.x, torque, knots), errors, share)


def _knots(x: np.ndarray, count: int) -> np.ndarray:
    """Places even over the range, those alone that have samples around them."""
    even = np.linspace(x.min(), x.max(), count)
    if not even[-1] > even[0]:
        return even[:1]
    near = np.bincount(np.rint((x - even[0]) / (even[1] - even[0])).astype(int), minlength=count)
    return even[near >= RULES.judge.knot_bins]


def _fit(x: np.ndarray, torque: np.ndarray, knots: np.ndarray) -> np.ndarray:
    """Least squares, held back by the ridge."""
    place = np.clip(np.searchsorted(knots, x, side="right") - 1, 0, len(knots) - 2)
    share = np.clip((x - knots[place]) / (knots[place + 1] - knots[place]), 0.0, 1.0)
    gram, pull = np.zeros((len(knots), len(knots))), np.zeros(len(knots))
    for a, first in ((1.0 - share, place), (share, place + 1)):
        pull += np.bincount(first, a * torque, len(knots))
        for b, second in ((1.0 - share, place), (share, place + 1)):
            np.add.at(gram, (first, second), a * b)
    return np.linalg.solve(gram + np.diag(1.0 + RULES.judge.ridge * np.diag(gram)), pull)
