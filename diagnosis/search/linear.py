"""What a linear step along a direction gains on blocks that it did not see, and what chance alone would gain.

A direction's gain is the drop of the squared misfit on folds of blocks that the coefficients d of r + X d did not
see, in units of the noise.

Chance: the same computation, with the same search over all hypotheses and starts, on misfits that hold no effect,
made from what the best model leaves by permuting its blocks and flipping their signs. The largest gain over all
hypotheses in each draw is the distribution that a real gain must beat; so the number of hypotheses is paid for.
"""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np

from ..rules import RULES
from .screen import Direction


class Linear:
    """Held-out gains of directions over the base, by block-wise normal equations."""

    def __init__(self, base_columns: np.ndarray, weights: np.ndarray, folds: np.ndarray):
        self.weights = weights.astype(np.float32)  # (blocks, samples), 0 for samples not trained on
        self.folds = folds  # (blocks,)
        self.base, self.lengths = _normal((base_columns * weights[..., None]).astype(np.float32))  # (blocks, samples, k0)
        self.gram = np.matmul(self.base.transpose(0, 2, 1), self.base).astype(float)

    def _energy(self, gram: np.ndarray, cross: np.ndarray, limits=None):
        """Change of the squared misfit on folds not seen, for each draw, and the coefficients of all folds together.

        gram: X_b' X_b (blocks, k, k); cross: X_b' e_b of each draw (draws, blocks, k). Columns have length 1.
        """
        k = gram.shape[-1]
        ridge = RULES.search.ridge * np.eye(k)
        inside = (self.folds == np.unique(self.folds)[:, None]).astype(float)  # (folds, blocks)
        own_gram = np.tensordot(inside, gram, 1)
        own_cross = np.matmul(inside, cross)  # (draws, folds, k)
        total_gram, total_cross = gram.sum(0), cross.sum(1)
        rest = (total_cross[:, None] - own_cross).transpose(1, 2, 0)
        step = -np.linalg.solve(total_gram - own_gram + ridge, rest).transpose(2, 0, 1)  # as own_cross
        if limits is not None:
            step = np.clip(step, *limits)
        change = (step * (2.0 * own_cross + np.einsum("fij,rfj->rfi", own_gram, step))).sum((1, 2))
        return change, -np.linalg.solve(total_gram + ridge, total_cross.T).T

    def gains(self, direction: Direction | None, draws: Draws):
        """Drop of the held-out squared misfit, and the coefficients, for each draw."""
        k0 = self.base.shape[-1]
        gram, cross, lengths, limits = self.gram, draws.base, self.lengths, None
        if direction is not None:
            part = direction.part
            own, own_lengths = _normal(direction.columns * self.weights[:, part, None])
            mixed = np.matmul(self.base[:, part].transpose(0, 2, 1), own)
            gram = np.zeros((len(own), k0 + own.shape[-1], k0 + own.shape[-1]))
            gram[:, :k0, :k0], gram[:, :k0, k0:], gram[:, k0:, :k0] = self.gram, mixed, mixed.transpose(0, 2, 1)
            gram[:, k0:, k0:] = np.matmul(own.transpose(0, 2, 1), own)
            cross = np.concatenate([draws.base, draws.cross(own, part)], axis=-1)
            lengths = np.concatenate([self.lengths, own_lengths])
            if not direction.phase:
                least, most = zip(
                    *((direction.jump or p.low - p.nominal, direction.jump or p.high - p.nominal) for p in direction.amplitudes)
                )
                limits = (
                    np.concatenate([np.full(k0, -np.inf), least * own_lengths]),
                    np.concatenate([np.full(k0, np.inf), most * own_lengths]),
                )
        if gram.shape[-1] == 0:
            return np.zeros(len(cross)), np.zeros((len(cross), 0))
        change, full = self._energy(gram, cross, limits)
        return -change, full / lengths

    def draws(self, errors: np.ndarray, order: np.ndarray | None = None, signs: np.ndarray | None = None) -> Draws:
        """Misfits to try directions on: blocks as they are, or put in `order` with `signs` (draws, blocks)."""
        found = Draws(errors.astype(np.float32), order, signs)
        found.base = found.cross(self.base, slice(None))
        found.without = self.gains(None, found)[0]
        return found

    def look(self, direction: Direction, draws: Draws) -> None:
        """Set the direction's gain on the misfit itself, over the base alone, and its amounts."""
        with_it, coefficients = self.gains(direction, draws)
        direction.gain = float(with_it[0] - draws.without[0])
        direction.amounts = np.array([direction.jump]) if direction.jump else coefficients[0, self.base.shape[-1] :]

    def chance(self, found: list[Direction], errors: np.ndarray, draws: int, rng: np.random.Generator) -> np.ndarray:
        """Largest gain over all directions, in each draw from misfits without an effect."""
        blocks = len(errors)
        order = np.stack([rng.permutation(blocks) for _ in range(draws)])
        mixed = self.draws(errors, order, rng.choice([-1.0, 1.0], (draws, blocks)))
        largest = np.zeros(draws)
        for direction in found:
            largest = np.maximum(largest, self.gains(direction, mixed)[0] - mixed.without)
        return largest


@dataclass
class Draws:
    """Misfits (blocks, samples), and how their blocks are put in other places and signs in each draw."""

    errors: np.ndarray
    order: np.ndarray | None = None
    signs: np.ndarray | None = None
    base: np.ndarray = field(default_factory=lambda: np.zeros((0, 0, 0)))  # cross products with the base's columns
    without: np.ndarray = field(default_factory=lambda: np.zeros(0))  # gain of the base alone

    def cross(self, columns: np.ndarray, part: slice) -> np.ndarray:
        """X_b' e_b for each draw (draws, blocks, k)."""
        turned, errors = columns.transpose(0, 2, 1), np.ascontiguousarray(self.errors[:, part])
        if self.order is None or self.signs is None:
            return np.matmul(turned, errors[..., None])[None, ..., 0].astype(float)
        pairs = np.matmul(turned, errors.T).transpose(0, 2, 1).astype(float)  # (block, block, k)
        return pairs[np.arange(len(columns))[None, :], self.order] * self.signs[..., None]


def _normal(columns: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Columns of length 1, and their lengths."""
    lengths = np.sqrt(np.maximum(np.einsum("bsk,bsk->k", columns, columns, dtype=float), 1e-30))
    return (columns / lengths).astype(np.float32), lengths
