"""Rivals in one table: what is told is the log density of unseen blocks, its differences, and their errors over blocks."""

from types import SimpleNamespace

import numpy as np
import pytest

from selflock.diagnosis.data.log import MeasuredRun
from selflock.diagnosis.judge import rivals as table
from selflock.diagnosis.judge.depends import Dependence, _energies, _functions, _shares, without
from selflock.diagnosis.judge.likely import density
from selflock.diagnosis.judge.rivals import BASE, rivals
from selflock.diagnosis.residuals.blocks import Blocks
from selflock.diagnosis.search.candidate import Candidate
from selflock.diagnosis.search.hypotheses import Free, Hypothesis
from selflock.diagnosis.search.problem import Problem
from selflock.diagnosis.search.selection import Selection
from selflock.diagnosis.search.step import Stage

BLOCKS, BINS = 20, 30


class Compared:
    """Two residuals of which the second is smoothed over so many samples."""

    def __init__(self, per_bin, reach):
        self.residuals, self.steady = ("motor", "gear"), False
        self.layout = SimpleNamespace(per_bin=per_bin, count=BLOCKS, bins=BINS)
        self.reach = lambda residual: reach if residual == "gear" else 1

    def slice(self, residual):
        place = self.residuals.index(residual)
        return slice(place * BINS, (place + 1) * BINS)


def problem(rng, per_bin=1, reach=1):
    """Every fourth block judges, a tenth of the entries is absent; far out the loss is no square any more."""
    train, present = np.arange(BLOCKS) % 4 != 3, rng.random((BLOCKS, 2 * BINS)) < 0.9
    ones = np.ones(2)
    return Problem(Compared(per_bin, reach), train, (), (), {}, ones, ones, present, loss_scale=1e3)


@pytest.mark.parametrize("per_bin, reach, share", [(1, 1, 1.0), (4, 1, 1.0), (1, 5, 0.2), (3, 5, 0.6)])
def test_the_density_is_that_of_normal_noise_and_what_smoothing_ties_counts_as_what_is_new(per_bin, reach, share, rng):
    ground, r = problem(rng, per_bin, reach), rng.standard_normal((BLOCKS, 2 * BINS))
    squares = (-0.5 * r**2 * ground.present)[ground.train]
    expected = squares[:, :BINS].sum(1) + share * squares[:, BINS:].sum(1)
    np.testing.assert_allclose(density(ground, ground.block_loss(r.ravel())), expected, rtol=1e-4)
    assert ground.entries.sum() == ground.present[ground.train].sum()


def test_differences_and_their_errors_are_those_over_blocks(rng, monkeypatch):
    monkeypatch.setattr(table, "depends", lambda *given: [])
    ground, base = problem(rng), 1.5 * rng.standard_normal((BLOCKS, 2 * BINS))
    left = {"motor brush_drop": base / 1.5, "load tilt": base / 1.2}
    losses = {label: ground.block_loss(r.ravel()) for label, r in left.items()}
    fitted = [
        Candidate(Hypothesis(*label.split(), ()), (Free("a", 0.0, 0.0, 1.0),), object(), losses[label], chance=0.01, doubt=doubt)
        for label, doubt in zip(left, ("", "a reason"))
    ]
    nothing = Candidate(Hypothesis("", "none", ()), (), SimpleNamespace(values={}), ground.block_loss(base.ravel()))
    looked = Candidate(Hypothesis("load", "fluid", ()), (), None, nothing.losses)
    stage = Stage(nothing, [*fitted, looked], fitted[0], unseen=np.zeros(base.size))
    outcome = Selection(ground, [stage], [fitted[0]], [stage], None, None, ground)  # all its samples were simulated
    (told,) = rivals(outcome, rng)
    assert [row["label"] for row in told["rows"]] == ["motor brush_drop", "load tilt", BASE]
    assert [row["role"] for row in told["rows"]] == ["named", "considered", "base"]
    assert [row["doubt"] for row in told["rows"]] == ["", "a reason", ""] and told["looked_at"] == ["load fluid"]
    densities = [(-0.5 * r**2 * ground.present)[ground.train].sum(1) for r in (*left.values(), base)]
    for row, one in zip(told["rows"], densities):
        apart = one - densities[0]
        assert row["elpd"] == pytest.approx(one.sum(), rel=1e-4)
        assert row["elpd_diff"] == pytest.approx(apart.sum(), rel=1e-4)
        assert row["dse"] == pytest.approx(np.sqrt(len(apart)) * apart.std(ddof=1), rel=1e-4)


def test_a_free_curve_leaves_what_its_share_says(rng):
    """Of a function of the variable and noise nothing but the noise is left, on blocks that it was not learnt on."""
    blocks, bins = 36, 100
    x = rng.uniform(-1.0, 1.0, (blocks, bins))
    layout = Blocks([MeasuredRun("log", "", np.arange(x.size), np.arange(x.size) * 1e-3, {})], steady=False)
    assert (layout.count, layout.bins) == (blocks, bins)
    gear, other = (SimpleNamespace(name=name) for name in ("gear", "motor"))
    experiment = SimpleNamespace(residuals=(other, gear), layout=layout, variables=lambda *_: {"speed": [x.ravel()]})
    experiment.slice = lambda one: slice(0, bins) if one is other else slice(bins, 2 * bins)
    noise = rng.standard_normal((2, blocks, bins))
    r = np.concatenate([noise[0], 3.0 * np.sin(2.0 * x) + noise[1]], 1)
    left, knots = without(experiment, r, np.ones(r.shape, bool), {}, Dependence("speed", "gear", 0.8, 0.01))
    assert (left[:, :bins] == r[:, :bins]).all() and 11 <= knots <= 21
    assert np.mean(left[:, bins:] ** 2) == pytest.approx(1.0, abs=0.1)  # 3600 samples: 0.024 of noise, 0.006 of the knots
    signs, orders, folds = np.ones((1, blocks)), np.arange(blocks)[None], np.arange(blocks) % 5
    held = np.clip(r[:, bins:], *np.quantile(r[:, bins:], (0.005, 0.995)))
    energy, functions = _energies(held, np.ones(x.shape, bool), orders), _functions(layout, [x.ravel()], np.ones(x.shape, bool))
    best = max(_shares(held, f, energy, folds, orders, signs)[0] for f in functions)
    assert 1.0 - np.mean(left[:, bins:] ** 2) / np.mean(r[:, bins:] ** 2) == pytest.approx(best, abs=0.02)
    assert without(experiment, r, np.ones(r.shape, bool), {}, Dependence("time, period 3 s", "gear", 0.8, 0.01)) is None
