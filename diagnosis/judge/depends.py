"""On what a remainder depends: speed, direction, load, position in the turn, current, temperature, time, set-points.

For each variable a free function of it, straight between knots that lie evenly, or closer at the ends of its range
where stops and limits are, is learnt on some blocks and tried on the others; the share of the misfit's variance that this
predicts is compared with what chance predicts: blocks of the misfit permuted and their signs flipped, the best over
all variables in each draw. Friction changes its sign with the direction and grows with the load, so the same is asked
with a second function beside the first that goes with the direction, or with direction and load: a variable counts
there by what it predicts beyond their mere proportion. Last, a line in the spectrum over time.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from ..residuals.blocks import Blocks
from ..residuals.experiment import Experiment
from ..residuals.noise import of_bins
from ..residuals.residual import Residual
from ..rules import RULES


@dataclass(frozen=True)
class Dependence:
    variable: str
    residual: str
    share: float  # of the misfit's variance on blocks that were not learnt from
    chance: float
    curve: tuple[int, int] = 0, 0  # the function that predicts most: its place among what it goes with, and of the variable's


def depends(
    experiment: Experiment, misfit: np.ndarray, present: np.ndarray, values: dict, rng: np.random.Generator
) -> list[Dependence]:
    """What the misfit (blocks, bins of all residuals) depends on beyond chance and enough to matter, strongest first."""
    found: list[Dependence] = []
    rules = RULES.judge
    blocks = experiment.layout.count
    if blocks < rules.blocks:
        return []
    folds = np.arange(blocks) % rules.folds
    inside = _inside(folds)
    orders = np.stack([np.arange(blocks), *(rng.permutation(blocks) for _ in range(rules.draws))])
    signs = np.concatenate([np.ones((1, blocks)), rng.choice([-1.0, 1.0], (rules.draws, blocks))])
    lines = {} if experiment.steady else _lines(experiment, misfit, present, folds, signs)
    for residual in experiment.residuals:
        part = experiment.slice(residual)
        r, here = misfit[:, part] * present[:, part], present[:, part]
        if here.sum() < rules.bins or _quiet(experiment, residual, r, here):
            continue
        r = np.clip(r, *np.quantile(r[here], rules.tails)) * here
        shares: dict[str, np.ndarray] = {}
        known = experiment.variables(residual, values)
        free = {label: _functions(experiment.layout, parts, here) for label, parts in known.items()}
        energies = {label: _energies(r, np.any(every[0], -1), orders) for label, every in free.items() if every}
        curves: dict[str, tuple[float, tuple[int, int]]] = {}
        alone: dict[tuple[str, int], _Products] = {}
        for i, along in enumerate(_regressors(experiment.layout, known, here)):
            mere = 0.0 if along is None else _shares(r, along, _energies(r, np.any(along, -1), orders), folds, orders, signs)
            for label, j, functions in ((label, j, one) for label, every in free.items() for j, one in enumerate(every)):
                if along is None:
                    alone[label, j] = both = _Products.of(r, functions, inside, orders, signs)
                else:
                    both = alone[label, j].beside(r, functions, functions * along, inside, orders, signs)
                predicted = both.share(energies[label])
                shares[label] = np.maximum(predicted - mere, shares.get(label, -np.inf))
                if label not in curves or predicted[0] > curves[label][0]:
                    curves[label] = float(predicted[0]), (i, j)
        if residual.name in lines:
            period, share = lines[residual.name]
            shares[f"time, period {period:.3g} s"] = share
        if not shares:
            continue
        best_by_chance = np.max([s[1:] for s in shares.values()], axis=0)
        for label, s in shares.items():
            chance = (1 + int((best_by_chance >= s[0]).sum())) / (1 + rules.draws)
            if chance <= rules.significant and s[0] >= rules.variance:
                curve = curves[label][1] if label in curves else (0, 0)
                found.append(Dependence(label, residual.name, float(s[0]), chance, curve))
    found.sort(key=lambda d: -d.share)
    return found


def without(
    experiment: Experiment, misfit: np.ndarray, present: np.ndarray, values: dict, dependence: Dependence
) -> tuple[np.ndarray, int] | None:
    """The misfit without what the free function of a dependence predicts of blocks that it was not learnt on; its numbers.

    None of a line in the spectrum, which is no function of a variable.
    """
    residual = next(one for one in experiment.residuals if one.name == dependence.residual)
    part = experiment.slice(residual)
    here, known = present[:, part], experiment.variables(residual, values)
    if dependence.variable not in known:
        return None
    r, folds = misfit[:, part] * here, np.arange(len(misfit)) % RULES.judge.folds
    held = np.clip(r, *np.quantile(r[here], RULES.judge.tails)) * here
    i, j = dependence.curve
    functions = _functions(experiment.layout, known[dependence.variable], here)[j]
    best = _with(functions, _regressors(experiment.layout, known, here)[i])
    out = misfit.copy()
    for fold in np.unique(folds):
        out[folds == fold, part] -= best[folds == fold] @ _learnt(held, best, folds != fold) * here[folds == fold]
    return out, best.shape[-1]


def _with(functions: np.ndarray, along: np.ndarray | None) -> np.ndarray:
    """Functions, and beside them the same times what the misfit may go with."""
    return functions if along is None else np.concatenate([functions, functions * along], -1)


def _learnt(r: np.ndarray, columns: np.ndarray, seen: np.ndarray) -> np.ndarray:
    """Amounts of the columns (blocks, bins, k) that predict r (blocks, bins) best in the blocks seen, held back by the ridge."""
    turned = columns[seen].transpose(0, 2, 1)
    known, pull = (turned @ columns[seen]).sum(0), (turned @ r[seen][..., None]).sum(0)[:, 0]
    return np.linalg.solve(known + np.diag(1.0 + RULES.judge.ridge * np.diag(known)), pull)


def _quiet(experiment: Experiment, residual: Residual, r: np.ndarray, here: np.ndarray) -> bool:
    """Whether a residual's misfit is its noise: then nothing remains, whatever it goes with."""
    if experiment.steady:
        return False
    return float(np.sqrt(np.mean(r[here] ** 2))) < RULES.judge.quiet * of_bins(
        r, here, False, 1 + experiment.reach(residual) // experiment.layout.per_bin
    )


def _means(layout: Blocks, parts: list[np.ndarray], here: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """A variable's mean in each bin, and where there is one."""
    total, count = np.zeros(here.size), np.zeros(here.size, int)
    for i, x in enumerate(parts):
        sums, counts = layout.bin(layout.place[i], x, np.isfinite(x))
        total, count = total + sums, count + counts
    return (total / np.maximum(count, 1)).reshape(here.shape), here & (count.reshape(here.shape) > 0)


def _regressors(layout: Blocks, known: Mapping[str, list[np.ndarray]], here: np.ndarray) -> list[np.ndarray | None]:
    """What the misfit may go with, (blocks, bins, 1): nothing, the direction, direction and load."""
    found: list[np.ndarray | None] = [None]
    if "direction" in known:
        direction = (np.sign(_means(layout, known["direction"], here)[0]) * here)[..., None]
        found.append(direction)
        if "load" in known:
            load = abs(_means(layout, known["load"], here)[0])[..., None]
            if (load[here] > 0.0).any():
                found.append(direction * load / load[here].max())
    return found


def _functions(layout: Blocks, parts: list[np.ndarray], here: np.ndarray) -> list[np.ndarray]:
    """Free functions of a variable, (blocks, bins, knots): 1 at a knot, 0 from its neighbours on; none of a constant."""
    rules = RULES.judge
    x, known = _means(layout, parts, here)
    if known.sum() < rules.bins:
        return []
    least = rules.constant * max(1.0, abs(x[known]).max())  # values no farther apart are one: a slope between them is no double
    if np.ptp(x[known]) <= least:
        return []
    most = int(known.sum() // rules.knot_bins)
    found = []
    for quantiles in [q for q in rules.knots if len(q) <= most] or [tuple(np.linspace(0.0, 1.0, max(2, most)))]:
        knots = np.unique(np.quantile(x[known], quantiles))
        knots = knots[np.diff(knots, prepend=-np.inf) > least]
        found.append(_hats(x, knots) * known[..., None])
    return found


def _hats(x: np.ndarray, knots: np.ndarray) -> np.ndarray:
    """Of each knot what goes straight from 1 there to 0 at its neighbours, at x: numpy's interp of them all, to the bit."""
    if len(knots) < 2:
        return np.ones((*x.shape, len(knots)))
    below = np.clip(np.searchsorted(knots, x, "right") - 1, 0, len(knots) - 2)
    up = np.where(x < knots[-1], 1.0 / np.diff(knots)[below] * (np.maximum(x, knots[0]) - knots[below]), 1.0)
    found = np.zeros((*x.shape, len(knots)))
    np.put_along_axis(found, below[..., None], 1.0 - up[..., None], -1)
    np.put_along_axis(found, below[..., None] + 1, up[..., None], -1)
    return found


def _lines(
    experiment: Experiment, misfit: np.ndarray, present: np.ndarray, folds: np.ndarray, signs: np.ndarray
) -> dict[str, tuple]:
    """The strongest line of each residual's spectrum, each run with a phase of its own: (period, shares for each draw).

    A line of a run is learnt on some of its blocks and tried on the others, as all else.
    """
    time, known = _means(
        experiment.layout,
        [run.time - run.time[0] for run in experiment.runs],
        np.ones((experiment.layout.count, experiment.layout.bins), bool),
    )
    longest = max(run.time[-1] - run.time[0] for run in experiment.runs)
    usual = np.median(np.concatenate([np.diff(t[k]) for t, k in zip(time, known)]))
    rules = RULES.judge
    fastest = min(rules.line_fastest / usual, rules.line_most / longest)
    frequencies = np.arange(rules.line_slowest / longest, fastest, rules.line_apart / longest)
    if len(frequencies) < 2:
        return {}
    kept = (misfit * present).reshape(experiment.layout.count, len(experiment.residuals), experiment.layout.bins)
    sums = np.empty(
        (len(experiment.residuals), experiment.layout.count, len(frequencies)), complex
    )  # of r exp(-i w t) over each block
    for block in range(experiment.layout.count):
        sums[:, block] = _waves(kept[block][:, known[block]], time[block, known[block]], frequencies)
    parts, found = sums.view(float), {}  # real and imaginary ones in turns, of which squares are added up alike
    for number, residual in enumerate(experiment.residuals):
        energy, counts = float((kept[:, number] ** 2).sum()), present[:, experiment.slice(residual)].sum(1).astype(float)
        if energy == 0.0:
            continue
        gain = np.zeros((len(signs), 2 * len(frequencies)))  # drop of the squared misfit
        for run in np.unique(experiment.layout.run_of):
            own = experiment.layout.run_of == run
            total = signs[:, own] @ parts[number, own]
            for fold in np.unique(folds[own]):
                unseen = own & (folds == fold)
                there = signs[:, unseen] @ parts[number, unseen]
                amplitude = (total - there) * (2.0 / max(counts[own & ~unseen].sum(), 1.0))
                there *= 2.0
                there -= (0.5 * counts[unseen].sum()) * amplitude
                there *= amplitude
                gain += there
        gain = gain[:, ::2] + gain[:, 1::2]
        found[residual.name] = 1.0 / frequencies[int(gain[0].argmax())], gain.max(1) / energy
    return found


def _waves(rows: np.ndarray, time: np.ndarray, frequencies: np.ndarray) -> np.ndarray:
    """Sums over time of rows (k, times) times exp(-2 i pi time frequency), (k, frequencies), of frequencies that lie evenly.

    exp(a + b) = exp(a) exp(b): the rows times exponentials of every 64th frequency, and what 64 steps between two make of these.
    """
    apart, fine = frequencies[1] - frequencies[0], 64
    wave = lambda f: np.exp(-2j * np.pi * np.outer(f, time))
    coarse = rows[:, None] * wave(frequencies[::fine])
    return (coarse @ wave(apart * np.arange(fine)).T).reshape(len(rows), -1)[:, : len(frequencies)]


def _energies(r: np.ndarray, inside: np.ndarray, orders: np.ndarray) -> np.ndarray:
    """Energy of r (blocks, bins) in each draw of blocks, where columns that stay in place are not 0: `inside`.

    All functions of a variable are there where it is known, whatever stands beside them: one of them is 1/2 at least.
    """
    there = (r**2) @ inside.T.astype(float)  # block c's energy where block b has columns
    return there[orders, np.arange(len(r))].sum(1)


def _shares(
    r: np.ndarray, columns: np.ndarray, energy: np.ndarray, folds: np.ndarray, orders: np.ndarray, signs: np.ndarray
) -> np.ndarray:
    """Share of the variance of r (blocks, bins), `energy`, that columns (blocks, bins, k) predict on unseen blocks.

    For each draw of blocks and signs, in which the misfit moves and the columns stay in place.
    """
    return _Products.of(r, columns, _inside(folds), orders, signs).share(energy)


def _inside(folds: np.ndarray) -> np.ndarray:
    """Which blocks are in each fold, (folds, blocks), as 0 and 1."""
    return (folds == np.unique(folds)[:, None]).astype(float)


@dataclass
class _Products:
    """Of each fold: of columns with each other, (folds, k, k), and with the misfit of each draw, (folds, draws, k)."""

    grams: np.ndarray
    crosses: np.ndarray

    @classmethod
    def of(cls, r: np.ndarray, columns: np.ndarray, inside: np.ndarray, orders: np.ndarray, signs: np.ndarray) -> _Products:
        """Of these columns (blocks, bins, k) and the misfit r (blocks, bins); inside: which blocks are in each fold."""
        pairs = r @ columns  # of block c's misfit with block b's columns
        sums = np.take(pairs.reshape(-1, pairs.shape[-1]), np.arange(len(r)) * len(r) + orders, axis=0)  # (draws, blocks, k)
        sums *= signs[..., None]
        return cls(_folded(columns, columns, inside), (inside @ sums).transpose(1, 0, 2))

    def beside(self, r: np.ndarray, columns: np.ndarray, more: np.ndarray, inside: np.ndarray, *drawn: np.ndarray) -> _Products:
        """Of these `columns`, whose products these are, with more columns beside them."""
        own, mixed = _Products.of(r, more, inside, *drawn), _folded(columns, more, inside)
        above, below = np.concatenate([self.grams, mixed], 2), np.concatenate([mixed.transpose(0, 2, 1), own.grams], 2)
        return _Products(np.concatenate([above, below], 1), np.concatenate([self.crosses, own.crosses], 2))

    def share(self, energy: np.ndarray) -> np.ndarray:
        """What is predicted of the misfit's `energy` in each draw, of each fold by the others."""
        grams, crosses = self.grams, self.crosses
        others, pull = grams.sum(0) - grams, crosses.sum(0) - crosses  # of all folds but one
        ridge = (1.0 + RULES.judge.ridge * np.diagonal(others, axis1=1, axis2=2))[..., None] * np.eye(grams.shape[-1])
        amount = np.linalg.solve(others + ridge, pull.transpose(0, 2, 1)).transpose(0, 2, 1)
        left = ((amount @ grams - 2.0 * crosses) * amount).sum(2).sum(0)
        return -left / np.maximum(energy, 1e-300)


def _folded(columns: np.ndarray, others: np.ndarray, inside: np.ndarray) -> np.ndarray:
    """Products of columns with others, of each fold."""
    return np.tensordot(inside, columns.transpose(0, 2, 1) @ others, 1)
