"""Of which comparison the error is told, where no cause was found."""

from types import SimpleNamespace

import numpy as np
import pytest

from diagnosis.verdict import Judge

BINS = 50


@pytest.mark.parametrize("sizes, shares, told", [
    ((1.2, 1.4, 20.0), (1.0, 1.0, 1.0), "motor"), ((1.2, 3.0, 20.0), (1.0, 1.0, 0.02), "motor"), ((2.0, 1.4, 1.1), (1.0, 1.0, 1.0), "gear"),
    ((1.2, 1.1, 1.2), (1.0, 1.0, 1.0), "gear"),
])  # fmt: skip
def test_the_error_is_that_of_the_comparison_that_is_off_most(sizes, shares, told):
    """However few of its bins have samples; the gear's where none is off."""
    rng = np.random.default_rng()
    cuts = [SimpleNamespace(name=name) for name in ("gear", "controller", "motor")]
    present = np.concatenate([np.arange(30 * BINS).reshape(30, BINS) % round(1 / share) == 0 for share in shares], axis=1)
    residual = np.repeat(sizes, BINS) * rng.choice([-1.0, 1.0], (30, 3 * BINS)) * present
    bench = SimpleNamespace(cuts=cuts, slice=lambda cut: slice(cuts.index(cut) * BINS, (cuts.index(cut) + 1) * BINS))
    contest = SimpleNamespace(bench=bench, present=present, shape=residual.shape)
    judge = Judge(bench, contest, None, None, [], rng)
    assert judge._most_off(SimpleNamespace(base=SimpleNamespace(residual=residual.ravel()))).name == told
