"""An effect that has no slope where it is off is looked at where it says; a fit goes on from there."""

import numpy as np
import pytest

from selflock.diagnosis.search.fit import fit
from selflock.diagnosis.search.hypotheses import Free, Hypothesis
from selflock.diagnosis.search.screen import directions
from selflock.fmus.effect import AMPLITUDE, ORDER, PHASE, SHAPE

X = np.linspace(-1.0, 1.0, 400)
TRIALS = tuple(0.1 * n for n in range(-9, 10))


def bump(values):
    """A triangle, without any trace beyond its width."""
    return values["depth"] * np.maximum(1.0 - abs(X - values["place"]) / 0.1, 0.0)


def misfit(values):
    noise = 1e-6 * np.cos(50.0 * X)  # 0 stands for a sample that nobody trusts
    return (noise + 0.7 * np.maximum(1.0 - abs(X - 0.43) / 0.1, 0.0) - bump(values)).reshape(4, 100)


def hypothesis(places):
    free = Free("depth", 0.0, -2.0, 2.0, role=AMPLITUDE), Free("place", 30.0, -40.0, 44.0, places=places, role=SHAPE)
    return Hypothesis("gear", "bump", free)


@pytest.mark.parametrize(("places", "seen"), [((), 0), (TRIALS, len(TRIALS))])
def test_it_is_looked_at_in_every_place_that_it_names(places, seen):
    base = {"depth": 0.0, "place": 30.0}
    ways = [way for way in directions(misfit, base, misfit(base), hypothesis(places)) if "place" in way.shape]
    assert sorted(way.shape["place"] for way in ways) == pytest.approx(places) and len(ways) == seen


def test_a_fit_goes_on_between_them():
    start = {"depth": 0.3, "place": TRIALS[13]}
    free = hypothesis(TRIALS).free
    found = fit(lambda values: misfit(values).ravel(), {}, free, start, np.ones(400, bool), np.inf)
    assert found.values == pytest.approx({"depth": 0.7, "place": 0.43}, abs=1e-3)


def test_a_wave_is_no_jump(rng):
    """One whose large amounts act otherwise than in proportion is looked at from 0 on, in every order, at its best phase."""
    angle = np.linspace(0.0, 20.0, 400)
    wave = lambda values: np.tanh(values["size"] * np.sin(values["order"] * angle + values["phase"]))
    error = (0.01 * rng.standard_normal(400) + np.tanh(3.0 * np.sin(3.0 * angle + 3.1))).reshape(4, 100)
    free = Free("size", 0.0, 0.0, 9.0, role=AMPLITUDE), Free("order", 12.0, 1.0, 60.0, role=ORDER, trials=(1.0, 2.0, 3.0))
    of = Hypothesis("motor", "wave", (*free, Free("phase", 0.0, -6.3, 6.3, role=PHASE)))
    base = {"size": 0.0, "order": 12.0, "phase": 0.0}
    ways = directions(lambda values: error - wave(values).reshape(4, 100), base, error, of)
    assert sorted(way.shape["order"] for way in ways) == [1.0, 2.0, 3.0] and not any(way.jump for way in ways)
