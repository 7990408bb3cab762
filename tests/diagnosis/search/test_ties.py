"""Causes that leave no more than noise: what tells them apart, and which is named."""

from __future__ import annotations

import numpy as np
import pytest

from selflock.diagnosis.search.candidate import Candidate, equal, simplest, worse
from selflock.diagnosis.search.fit import Fit
from selflock.diagnosis.search.hypotheses import Free, Hypothesis

BLOCKS, CHANCE = 36, 1e-4


def candidate(rng, component, effect, losses, complete, told=False):
    free = (Free(f"{component}.{effect}", 0.0, 0.0, 1.0, told=told),)
    misfit = rng.standard_normal(BLOCKS)
    fit = Fit(free, {free[0].name: 0.5}, misfit, np.ones((BLOCKS, 1)), np.ones(BLOCKS), by_channel=True)
    return Candidate(Hypothesis(component, effect, free), free, fit, losses[:, None], complete=complete)


@pytest.fixture
def near(rng):
    """Losses of two: the second leaves a twentieth more in each block, and most of that in one that is far more than all others."""
    one = rng.uniform(0.9, 1.1, BLOCKS)
    other = 1.05 * one
    one[0], other[0] = 30.0, 33.0
    return one, other


def two(rng, near, complete, **told):
    damping = candidate(rng, "load", "parameter", near[0], complete, **told)
    return damping, candidate(rng, "reducer", "viscous", near[1], complete)


def test_what_few_blocks_tell_is_no_difference_between_causes_that_leave_noise_alone(rng, near):
    """Blocks that differ alike tell them apart only where something is left that one of them does not explain."""
    for complete in (False, True):
        damping, viscous = two(rng, near, complete)
        assert worse(viscous, damping, CHANCE) is not complete
        assert equal(viscous, damping, CHANCE) is complete
    far = candidate(rng, "reducer", "viscous", near[0] + rng.uniform(0.4, 0.6, BLOCKS), True)
    assert (
        far.complete and damping.complete and worse(far, damping, CHANCE)
    )  # beyond what varies between blocks: told apart all the same


@pytest.mark.parametrize(
    ("complete", "told", "first"), [(True, False, "viscous"), (True, True, "parameter"), (False, False, "parameter")]
)
def test_an_effect_goes_before_a_nominal_value_that_no_rig_gives_where_nothing_is_left_to_tell_them(
    rng, near, complete, told, first
):
    real = list(two(rng, near, complete, told=told))
    assert simplest(real, [], CHANCE, lambda a, b: a is b).hypothesis.effect == first
