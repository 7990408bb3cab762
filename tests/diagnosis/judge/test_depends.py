"""A free function of a variable: what it predicts is its share of the variance, of noise nothing, of a reading's ends enough."""

import numpy as np
import pytest

from selflock.diagnosis.data.log import MeasuredRun
from selflock.diagnosis.judge.depends import _energies, _functions, _regressors, _shares, _waves
from selflock.diagnosis.residuals.blocks import Blocks
from selflock.diagnosis.residuals.drive_experiment import in_turn

BLOCKS, BINS = 36, 100


def shares(x, r, beside=None, draws=0, rng=None):
    """Of r (blocks, bins) by a free function of x, alone or with a second one that goes with `beside`; first as it is, then drawn."""
    layout = Blocks([MeasuredRun("log", "", np.arange(x.size), np.arange(x.size) * 1e-3, {})], steady=False)
    assert (layout.count, layout.bins) == (BLOCKS, BINS)
    ways = _functions(layout, [x.ravel()], np.ones(x.shape, bool))
    if beside is not None:
        ways = [np.concatenate([functions, functions * beside[..., None]], -1) for functions in ways]
    orders = np.stack([np.arange(BLOCKS), *(rng.permutation(BLOCKS) for _ in range(draws))])
    signs = np.concatenate([np.ones((1, BLOCKS)), rng.choice([-1.0, 1.0], (draws, BLOCKS))]) if draws else np.ones((1, BLOCKS))
    energy = _energies(r, np.ones(r.shape, bool), orders)
    return np.max([_shares(r, functions, energy, np.arange(BLOCKS) % 5, orders, signs) for functions in ways], 0)


def test_of_a_function_of_the_variable_all_but_the_noise_is_predicted(rng):
    x = rng.uniform(-1.0, 1.0, (BLOCKS, BINS))
    r = np.sin(2.0 * x) + 0.5 * rng.standard_normal(x.shape)
    signal = np.var(np.sin(2.0 * x))
    assert shares(x, r)[0] == pytest.approx(signal / (signal + 0.25), abs=0.05)


def test_a_share_is_learnt_on_some_blocks_and_tried_on_the_others(rng):
    columns, folds = rng.standard_normal((BLOCKS, BINS, 3)), np.arange(BLOCKS) % 5
    r = columns @ [0.5, -1.0, 0.2] + rng.standard_normal((BLOCKS, BINS))
    left = 0.0
    for fold in range(5):
        seen, unseen = folds != fold, folds == fold
        amounts = np.linalg.lstsq(columns[seen].reshape(-1, 3), r[seen].ravel(), rcond=None)[0]
        left += ((r[unseen] - columns[unseen] @ amounts) ** 2).sum()
    orders = np.arange(BLOCKS)[None]
    found = _shares(r, columns, _energies(r, columns.any(-1), orders), folds, orders, np.ones((1, BLOCKS)))
    assert found[0] == pytest.approx(1.0 - left / (r**2).sum(), rel=1e-2)


def test_of_noise_nothing_is_predicted_and_draws_do_as_well(rng):
    x, r = rng.uniform(-1.0, 1.0, (BLOCKS, BINS)), rng.standard_normal((BLOCKS, BINS))
    found = shares(x, r, draws=50, rng=rng)
    assert found[0] < 0.01 and abs(found[0] - found[1:].mean()) < 6.0 * found[1:].std()


def test_a_stop_at_the_end_of_the_range_is_seen(rng):
    """A few bins of a hundred touch it: a mean over a tenth of the range would hardly feel that."""
    turns, reach = rng.uniform(1.0, 2.0, (BLOCKS, 1)), rng.permutation(np.linspace(0.6, 1.0, BLOCKS))[:, None]
    x = reach * np.sin(2.0 * np.pi * turns * np.linspace(0.0, 1.0, BINS))
    push = 40.0 * np.maximum(x - 0.9, 0.0)
    assert 0.005 < np.mean(push > 0.0) < 0.1
    r = push + 0.3 * rng.standard_normal(x.shape)
    assert shares(x, r)[0] > 0.6 * np.var(push) / np.var(r)


def test_a_travel_of_less_than_a_turn_keeps_its_ends_and_a_longer_one_comes_round():
    swing = np.array([-1.0, 0.0, 1.0])
    assert in_turn([swing, 2.0 * swing])[0] is swing
    longer = in_turn([swing, 4.0 * swing])
    assert np.allclose(longer[0], [2.0 * np.pi - 1.0, 0.0, 1.0]) and np.allclose(longer[1], [2.0 * np.pi - 4.0, 0.0, 4.0])


def test_what_changes_its_sign_with_the_direction_needs_the_direction(rng):
    x, direction = rng.uniform(0.0, 1.0, (BLOCKS, BINS)), rng.choice([-1.0, 1.0], (BLOCKS, BINS))
    r = direction * x**2 + 0.1 * x
    assert shares(x, r)[0] < 0.1 < 0.95 < shares(x, r, direction)[0]


def test_waves_of_frequencies_that_lie_evenly_are_those_of_each_alone(rng):
    time, frequencies, rows = rng.uniform(0.0, 300.0, 50), np.arange(0.02, 7.0, 0.01), rng.normal(size=(3, 50))
    alone = rows @ np.exp(-2j * np.pi * np.outer(time, frequencies))
    assert _waves(rows, time, frequencies) == pytest.approx(alone, abs=1e-9)


def test_a_load_that_acts_where_nothing_is_compared_is_no_measure_of_it():
    """Next to nothing where it counts, that is a size that doubles cannot divide by."""
    place = np.arange(BLOCKS * BINS)
    layout = Blocks([MeasuredRun("log", "", place, place * 1e-3, {})], steady=False)
    here = (place < 1000).reshape(BLOCKS, BINS)
    load = np.where(here.ravel(), 5e-324, 3.0)
    _, direction, loaded = _regressors(layout, {"direction": [np.ones(place.size)], "load": [load]}, here)
    assert (direction == here[..., None]).all() and (loaded == here[..., None]).all()


def test_a_variable_that_dies_away_at_rest_has_functions(rng):
    """A simulated current goes on below any number that is one, as far as doubles do."""
    x = rng.choice([0.0, 1.5e-323, 1.0], (BLOCKS, BINS), p=[0.3, 0.3, 0.4]) * rng.uniform(-1.0, 1.0, (BLOCKS, BINS))
    r = np.sin(2.0 * x) + 0.5 * rng.standard_normal(x.shape)
    assert shares(x, r)[0] == pytest.approx(np.var(np.sin(2.0 * x)) / np.var(r), abs=0.06)
