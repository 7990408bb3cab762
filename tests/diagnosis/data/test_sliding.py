"""Windows about each row, beside SciPy's."""

import numpy as np
import pytest
from scipy import ndimage

from selflock.diagnosis.data import sliding


@pytest.mark.parametrize("rows", [1, 2, 5, 8, 31])
def test_windows_are_those_of_scipy(rng, rows):
    x, held = rng.normal(size=100), rng.uniform(size=100) < 0.6
    assert np.array_equal(sliding.highest(x, rows), ndimage.maximum_filter1d(x, rows))
    assert np.array_equal(sliding.lowest(x, rows), ndimage.minimum_filter1d(x, rows))
    assert np.array_equal(sliding.highest(held, rows), ndimage.maximum_filter1d(held, rows))
    assert np.array_equal(sliding.lasting(held, rows), ndimage.binary_opening(held, np.ones(rows)))
    share = ndimage.uniform_filter1d(held.astype(float), rows)
    told = abs(share - 0.5) > 1e-9  # where it is a half, a running sum says one or the other
    assert np.array_equal(sliding.mostly(held, rows)[told], share[told] > 0.5)
    assert not sliding.mostly(held, rows)[~told].any()


@pytest.mark.parametrize("short", [True, False])
def test_the_middle_of_a_window_is_the_same_however_long_the_log(rng, monkeypatch, short):
    monkeypatch.setattr(sliding, "SHORT", 1000 if short else 10)
    monkeypatch.setattr(sliding, "PIECE", 37)
    x = rng.normal(size=200)
    assert np.array_equal(sliding.middle(x, 15), ndimage.median_filter(x, size=15, mode="reflect"))


@pytest.mark.parametrize("rows", [1, 4])
def test_nothing_holds_beyond_the_ends(rng, rows):
    held = rng.uniform(size=100) < 0.9
    assert np.array_equal(sliding.deep(held, rows), ndimage.binary_erosion(held, iterations=rows))
    assert not sliding.deep(np.ones(5, bool), 3).any()
