"""Our least squares end where SciPy's do, on the same path."""

import numpy as np
import pytest
from scipy.optimize import least_squares as theirs

from selflock.diagnosis.search.trust import least_squares

ENDED, FLAT = (1e-6, 1e-5), 1e-8


def _curved(rng, numbers: int, samples: int):
    """A misfit that is not linear, and its slopes."""
    plain, waves, bent = rng.normal(size=(samples, numbers)), rng.normal(size=numbers), rng.uniform()
    measured = rng.normal(size=samples) * rng.choice([0.1, 1.0, 10.0])
    misfit = lambda x: plain @ x + bent * np.sin(plain @ (waves * x)) - measured
    return misfit, lambda x: plain + bent * np.cos(plain @ (waves * x))[:, None] * plain * waves


@pytest.mark.parametrize("c", [np.inf, 1.0, 3.0])
@pytest.mark.parametrize("effort", [5, 100])
def test_a_fit_goes_as_scipy_s_does(rng, c, effort):
    for numbers in (1, 2, 4):
        misfit, slopes = _curved(rng, numbers, 30)
        low, high = -rng.uniform(0.01, 2.0, numbers), rng.uniform(0.01, 2.0, numbers)
        low[rng.uniform(size=numbers) < 0.2] = -np.inf
        high[rng.uniform(size=numbers) < 0.2] = np.inf
        start = 0.9 * np.clip(rng.normal(size=numbers), low, high)
        robust = {"loss": "soft_l1", "f_scale": c} if np.isfinite(c) else {}
        known = theirs(misfit, start, slopes, (low, high), max_nfev=effort, ftol=ENDED[0], xtol=ENDED[1], gtol=FLAT, **robust).x
        found = least_squares(misfit, slopes, start, low, high, c, effort, ENDED, FLAT)
        assert found == pytest.approx(known, rel=1e-6, abs=1e-6)
        assert np.all((found > low) & (found < high))


def test_slopes_are_asked_for_where_a_step_begins_and_not_where_the_last_one_ended(rng):
    misfit, slopes = _curved(rng, 2, 30)
    places: dict[str, list] = {"misfit": [], "slopes": []}

    def told(what, of):
        return lambda x: (places[what].append(tuple(x)), of(x))[1]

    low, high = np.full(2, -2.0), np.full(2, 2.0)
    found = least_squares(told("misfit", misfit), told("slopes", slopes), np.zeros(2), low, high, np.inf, 50, ENDED, FLAT)
    assert len(places["slopes"]) > 1 and set(places["slopes"]) <= set(places["misfit"])
    assert tuple(found) in places["misfit"]
    assert tuple(found) not in places["slopes"] or len(places["slopes"]) == len(places["misfit"])


def test_a_misfit_that_is_no_number_is_no_place_to_begin():
    nowhere = lambda x: np.array([np.nan, 1.0])
    with pytest.raises(ValueError, match="begins"):
        least_squares(nowhere, lambda x: np.ones((2, 1)), np.zeros(1), -np.ones(1), np.ones(1), 1.0, 5, ENDED, FLAT)
