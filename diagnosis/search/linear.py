"""What a linear step along a direction gains on blocks that it did not see, and what chance alone would gain.

A direction's gain is the drop of the squared misfit on folds of blocks that the coefficients d of r + X d did not
see, in units of the noise.

Chance: the same computation, with the same search over all hypotheses and starts, on misfits that hold no effect,
made from what the best model leaves by permuting its blocks and flipping their signs. The largest gain over all
hypotheses in each draw is the distribution that a real gain must beat; so the number of hypotheses is paid for.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field
from typing import NamedTuple

import numpy as np

from ..rules import RULES
from .screen import Direction


class Linear:
    """Held-out gains of directions over the base, by block-wise normal equations.

    base_columns: (blocks, samples, numbers). runs: of each block; without, all are of one. makes_up: whether the base is fitted
    again beside an amplitude that ends at its range; else it stays as it was beside what that would have been. own: (blocks,
    samples, numbers), what numbers move that a block has for itself: in it they are fitted again, whatever others say.
    """

    def __init__(
        self,
        base_columns: np.ndarray,
        weights: np.ndarray,
        folds: np.ndarray,
        runs: np.ndarray | None = None,
        makes_up: bool = False,
        own: np.ndarray | None = None,
    ):
        self.makes_up = makes_up
        self.own = None if own is None or not own.any() else _spanned(own * weights[..., None])
        self.weights = weights.astype(np.float32)  # (blocks, samples), 0 for samples not trained on
        self.folds = folds  # (blocks,)
        self.runs = np.zeros(len(folds), int) if runs is None else np.unique(runs, return_inverse=True)[1]
        self.base, self.lengths = _normal((base_columns * weights[..., None]).astype(np.float32))  # (blocks, samples, k0)
        self.gram = np.matmul(self.base.transpose(0, 2, 1), self.base).astype(float)
        if self.own is not None:
            self.base_in_own = np.matmul(self.own.transpose(0, 2, 1), self.base)
            self.gram -= np.matmul(self.base_in_own.transpose(0, 2, 1), self.base_in_own)

    def _energy(self, asked: Equations) -> np.ndarray:
        """Change of the squared misfit on folds not seen, for each draw (..., draws)."""
        gram, cross, limits = asked.gram, asked.cross, asked.limits
        solved = self._one_amplitude if asked.pairs else _solved
        inside = (self.folds == np.unique(self.folds)[:, None]).astype(float)  # (folds, blocks)
        k, k0 = gram.shape[-1], self.base.shape[-1]
        own_gram = np.matmul(inside, gram.reshape(*gram.shape[:-2], k * k)).reshape(*gram.shape[:-3], len(inside), k, k)
        own_cross = np.matmul(inside, cross).swapaxes(-3, -2)  # (..., folds, k, draws)
        other_gram, other_cross = gram.sum(-3)[..., None, :, :] - own_gram, cross.sum(-2)[..., None, :, :] - own_cross
        step = solved(other_gram, other_cross)  # as own_cross
        if limits is not None:
            step = np.clip(step, *limits)
            if self.makes_up and k0:
                beside = np.matmul(other_gram[..., :k0, k0:], step[..., k0:, :])
                step[..., :k0, :] = _solved(other_gram[..., :k0, :k0], other_cross[..., :k0, :] + beside)
        return (step * (2.0 * own_cross + np.matmul(own_gram, step))).sum((-3, -2))

    def _one_amplitude(self, gram: np.ndarray, cross: np.ndarray) -> np.ndarray:
        """Coefficients of a wave that has one amplitude in all runs, and a phase of its own in each; shapes as `_solved`.

        Each run's pair alone says its phase, then all of them the amplitude. With an amplitude for each run one that hardly
        moves would say anything of the blocks that it does not see.
        """
        cross, k0 = np.moveaxis(cross, -1, 0), self.base.shape[-1]
        draws, folds, k = cross.shape
        runs = (k - k0) // 2
        places = k0 + np.arange(k - k0).reshape(runs, 2)
        own = gram[:, places[:, :, None], places[:, None, :]]  # (folds, runs, 2, 2)
        usual = 0.5 * np.trace(own, axis1=-2, axis2=-1)[..., None, None]
        damped = own + (RULES.search.phase_damping * usual + RULES.search.ridge) * np.eye(2)
        pair = -np.linalg.solve(damped, cross[..., k0:].reshape(draws, folds, runs, 2)[..., None])[..., 0]
        pair /= np.maximum(np.sqrt((pair**2).sum(-1, keepdims=True)), 1e-300)
        way = pair.reshape(draws, folds, k - k0)
        # the base's columns as they are, all of the wave's as one
        along = np.einsum("fij,rfj->rfi", gram[..., k0:], way)
        few = np.empty((draws, folds, k0 + 1, k0 + 1))
        few[..., :k0, :k0], few[..., :k0, k0], few[..., k0, :k0] = gram[:, :k0, :k0], along[..., :k0], along[..., :k0]
        few[..., k0, k0] = (along[..., k0:] * way).sum(-1)
        asked = np.concatenate([cross[..., :k0], (cross[..., k0:] * way).sum(-1, keepdims=True)], -1)
        found = -np.linalg.solve(few + RULES.search.ridge * np.eye(k0 + 1), asked[..., None])[..., 0]
        return np.moveaxis(np.concatenate([found[..., :k0], found[..., k0:] * way], -1), 0, -1)

    def _equations(self, direction: Direction | None, draws: Draws) -> Equations:
        """The normal equations of the base, and beside it of a direction."""
        if direction is None:
            return Equations(self.gram, draws.base, self.lengths, None, False)
        weighed = direction.columns * self.weights[:, direction.part, None]
        if direction.squared is None or direction.squared[0] is not self:
            own, own_lengths = _normal(weighed)
            square = self._squared(direction, own, own_lengths)
            direction.squared = self, square
        else:
            square = direction.squared[1]
            own = _of_length_1(weighed, square.own)
        against = draws.cross(own, direction.part)
        if square.mine is not None:
            against = against - np.einsum("bqk,qbr->kbr", square.mine, draws.own)
        if square.pairs:
            against = self._of_runs(against.transpose(1, 2, 0)).transpose(2, 0, 1)
        return Equations(square.gram, np.concatenate([draws.base, against]), square.lengths, square.limits, square.pairs)

    def _squared(self, direction: Direction, own: np.ndarray, own_lengths: np.ndarray) -> Squared:
        """What of the equations of a direction beside the base is the same whatever the misfit; own: its columns, of length 1."""
        k0, part = self.base.shape[-1], direction.part
        every, mine, limits = own_lengths, None, None
        mixed, square = np.matmul(self.base[:, part].transpose(0, 2, 1), own), np.matmul(own.transpose(0, 2, 1), own)
        if self.own is not None:
            mine = np.matmul(self.own[:, part].transpose(0, 2, 1), own)
            square = square - np.matmul(mine.transpose(0, 2, 1), mine)
            mixed = mixed - np.matmul(self.base_in_own.transpose(0, 2, 1), mine)
        if pairs := direction.of_run and self.runs.max() > 0:
            square = self._of_runs(self._of_runs(square).transpose(0, 2, 1))
            mixed = self._of_runs(mixed)
            every = np.tile(own_lengths, self.runs.max() + 1)
        k = k0 + len(every)
        gram = np.zeros((len(own), k, k))
        gram[:, :k0, :k0], gram[:, :k0, k0:], gram[:, k0:, :k0] = self.gram, mixed, mixed.transpose(0, 2, 1)
        gram[:, k0:, k0:] = square
        if not direction.phase:
            free = [direction.jump or end - p.nominal for p in direction.amplitudes for end in (p.low, p.high)]
            ends = np.reshape(free, (-1, 2)) * own_lengths[:, None]
            limits = np.concatenate([np.tile((-np.inf, np.inf), (k0, 1)), ends]).T[..., None]
        return Squared(gram, np.concatenate([self.lengths, every]), own_lengths, limits, pairs, mine)

    def gains(self, direction: Direction | None, draws: Draws) -> np.ndarray:
        """Drop of the held-out squared misfit, for each draw."""
        asked = self._equations(direction, draws)
        if not len(asked.lengths):
            return np.zeros(asked.cross.shape[-1])
        return -self._energy(asked)

    def _of_runs(self, products: np.ndarray) -> np.ndarray:
        """Products with columns, (blocks, any, columns), where each run has the columns for itself: 0 with those of others."""
        blocks, rows, columns = products.shape
        found = np.zeros((blocks, rows, self.runs.max() + 1, columns), products.dtype)
        found[np.arange(blocks), :, self.runs] = products
        return found.reshape(blocks, rows, columns * (self.runs.max() + 1))

    def draws(self, errors: np.ndarray, order: np.ndarray | None = None, signs: np.ndarray | None = None) -> Draws:
        """Misfits to try directions on: blocks as they are, or put in `order` with `signs` (draws, blocks)."""
        found = Draws(errors.astype(np.float32), order, signs)
        found.base = found.cross(self.base, slice(None))
        if self.own is not None:
            found.own = found.cross(self.own, slice(None))
            found.base = found.base - np.einsum("bqk,qbr->kbr", self.base_in_own, found.own)
        found.without = self.gains(None, found)
        return found

    def look(self, direction: Direction, draws: Draws) -> None:
        """Set the direction's gain on the misfit itself, over the base alone, and its amounts."""
        self.looks([direction], draws)

    def looks(self, directions: Sequence[Direction], draws: Draws) -> None:
        """The same of several, which takes less than of each by itself."""
        for some, asked in self._alike(directions, draws):
            gains, amounts = np.atleast_2d(-self._energy(asked) - draws.without), self._amounts(asked)
            for direction, gain, amount in zip(some, gains[:, 0], amounts):
                direction.gain = float(gain)
                direction.amounts = np.array([direction.jump]) if direction.jump else amount

    def _alike(self, directions: Sequence[Direction], draws: Draws) -> Iterator[tuple[list[Direction], Equations]]:
        """Directions whose equations are of one form, with these, a number of them at a time."""
        together = RULES.search.together
        for some in (directions[i : i + together] for i in range(0, len(directions), together)):
            alike: dict[tuple, list[tuple[Direction, Equations]]] = {}
            for direction in some:
                asked = self._equations(direction, draws)
                alike.setdefault(asked.form, []).append((direction, asked))
            for group in alike.values():
                whose, equations = zip(*group)
                yield list(whose), _stacked(equations)

    def _amounts(self, asked: Equations) -> np.ndarray:
        """Coefficients by all blocks, of the first draw: of each of some directions."""
        solved = self._one_amplitude if asked.pairs else _solved
        gram, cross = asked.gram.sum(-3)[..., None, :, :], asked.cross[..., :1].sum(-2)[..., None, :, :]
        full = solved(gram, cross)[..., 0, :, 0] / asked.lengths
        return np.atleast_2d(full)[:, self.base.shape[-1] :]

    def chance(self, found: list[Direction], errors: np.ndarray, draws: int, rng: np.random.Generator) -> np.ndarray:
        """Largest gain over all directions, in each draw from misfits without an effect."""
        blocks = len(errors)
        order = np.stack([rng.permutation(blocks) for _ in range(draws)])
        mixed = self.draws(errors, order, rng.choice([-1.0, 1.0], (draws, blocks)))
        largest = np.zeros(draws)
        for _, asked in self._alike(found, mixed):
            largest = np.maximum(largest, np.atleast_2d(-self._energy(asked) - mixed.without).max(0))
        return largest


class Equations(NamedTuple):
    """Normal equations of columns of length 1 in each block, and what else a step along them asks for; `...`: of several."""

    gram: np.ndarray  # X_b' X_b, (..., blocks, k, k)
    cross: np.ndarray  # X_b' e_b of each draw, (..., k, blocks, draws)
    lengths: np.ndarray  # of the columns as they were, (..., k)
    limits: np.ndarray | None  # least and most of a step along them, (2, ..., k, 1)
    pairs: bool  # columns behind the base's are a wave's in each run

    @property
    def form(self) -> tuple:
        """What those have in common that are solved together; those of a wave in each run are solved one by one."""
        return len(self.lengths), self.limits is None, id(self.gram) if self.pairs else 0


class Squared(NamedTuple):
    """Of Equations what goes with no misfit."""

    gram: np.ndarray
    lengths: np.ndarray
    own: np.ndarray  # lengths of the direction's columns
    limits: np.ndarray | None
    pairs: bool
    mine: np.ndarray | None  # columns in what blocks have for themselves, (blocks, own, k)


@dataclass
class Draws:
    """Misfits (blocks, samples), and how their blocks are put in other places and signs in each draw."""

    errors: np.ndarray
    order: np.ndarray | None = None
    signs: np.ndarray | None = None
    base: np.ndarray = field(default_factory=lambda: np.zeros((0, 0, 0)))  # cross products with the base's columns
    without: np.ndarray = field(default_factory=lambda: np.zeros(0))  # gain of the base alone
    own: np.ndarray = field(default_factory=lambda: np.zeros((0, 0, 0)))  # cross products with what blocks have for themselves

    def __post_init__(self) -> None:
        if self.order is not None:  # where in (blocks, blocks) the misfit is that comes to each block, (blocks, draws)
            self._places = (np.arange(self.order.shape[1]) * len(self.errors) + self.order).T

    def cross(self, columns: np.ndarray, part: slice) -> np.ndarray:
        """X_b' e_b for each draw (k, blocks, draws)."""
        turned, errors = columns.transpose(0, 2, 1), np.ascontiguousarray(self.errors[:, part])
        if self.order is None or self.signs is None:
            return np.matmul(turned, errors[..., None]).astype(float).transpose(1, 0, 2)
        pairs = np.matmul(turned, errors.T).transpose(1, 0, 2).astype(float, order="C")  # (k, block, block)
        found = np.take(pairs.reshape(len(pairs), pairs.shape[1] * pairs.shape[2]), self._places, axis=1)
        found *= self.signs.T
        return found


def _stacked(group: Sequence[Equations]) -> Equations:
    """Equations of one form, together; one alone as it is."""
    if len(group) == 1:
        return group[0]
    grams, crosses, lengths, limits, _ = zip(*group)
    ends = None if limits[0] is None else np.stack(limits, 1)[:, :, None]
    return Equations(np.stack(grams), np.stack(crosses), np.stack(lengths), ends, False)


def _solved(gram: np.ndarray, cross: np.ndarray) -> np.ndarray:
    """Coefficients, (..., folds, k, draws), of normal equations: gram (..., folds, k, k), cross as they."""
    return -np.linalg.solve(gram + RULES.search.ridge * np.eye(gram.shape[-1]), cross)


def _spanned(columns: np.ndarray) -> np.ndarray:
    """An orthonormal base of each block's columns, 0 where it has none."""
    base, sizes, _ = np.linalg.svd(columns, full_matrices=False)
    largest = max(float(sizes.max(initial=0.0)), 1e-300)
    return np.asarray(base * (sizes > RULES.naming.degenerate * largest)[:, None, :], np.float32)


def _normal(columns: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Columns of length 1, and their lengths."""
    lengths = np.sqrt(np.maximum(np.einsum("bsk,bsk->k", columns, columns, dtype=float), 1e-30))
    return _of_length_1(columns, lengths), lengths


def _of_length_1(columns: np.ndarray, lengths: np.ndarray) -> np.ndarray:
    return (columns / lengths).astype(np.float32)
