"""What looks tell: what of a way is left beside the base, and which of many roundings are simulated."""

from types import SimpleNamespace

import numpy as np
import pytest

from selflock.diagnosis.naming import looks as looks_module
from selflock.diagnosis.naming.guesses import PATH, Guess, Trial
from selflock.diagnosis.naming.looks import Looks
from selflock.diagnosis.naming.places import IN, Insert, Place
from selflock.diagnosis.rules import RULES
from selflock.diagnosis.search.hypotheses import Free
from selflock.diagnosis.search.screen import Direction

BLOCKS, SAMPLES = 35, 29


def test_of_what_a_way_changes_that_is_left_which_neither_base_nor_begin_make_up_for(rng):
    base, begin, missing, noise = rng.standard_normal((4, BLOCKS, SAMPLES, 1))
    begin[2:] = 0.0
    jacobian = np.concatenate([base, begin, np.zeros_like(base)], -1).reshape(-1, 3)
    put = lambda entries: entries.reshape(BLOCKS, SAMPLES, -1)
    look = object.__new__(Looks)
    look.linear, look.base = SimpleNamespace(weights=np.ones((BLOCKS, SAMPLES))), SimpleNamespace(jacobian=jacobian)
    look.arranged = SimpleNamespace(put=put)

    def alone(columns, amount):
        way = Direction(None, {}, (Free("c", 0.0, -10.0, 10.0),), columns)
        way.amounts = np.array([amount])
        return look.alone(way)

    one, other = alone(missing, 0.1), alone(-3.0 * missing + 7.0 * base + 5.0 * begin, 2.0)
    assert np.linalg.norm(one) == pytest.approx(1.0) and one @ other == pytest.approx(-1.0, abs=1e-5)
    assert abs(one @ alone(noise, 1.0)) < 0.2
    assert not alone(2.0 * base - begin, 1.0).any()  # nothing but rounding is left


@pytest.mark.parametrize("steady", [False, True])
def test_of_many_roundings_those_that_look_best_are_simulated(monkeypatch, steady):
    """A thousand of them at each place of a loop that answers otherwise as it goes on took 100 s, and it was looked at three times."""
    place, count, best = Place(IN, "heater.power"), 300, RULES.naming.simulated
    rounding, offset = (Guess(PATH, law, "", (Insert("c", place, law),), ()) for law in ("quantisation", "offset"))
    trials = [Trial(offset, {"c.b": 1.0}), *(Trial(rounding, {"c.q": float(q)}) for q in range(count))]
    monkeypatch.setattr(looks_module.g, "paths", lambda scene, place: trials)
    look, simulated = object.__new__(Looks), []
    look.scene, look.ways = None, []
    look.responses = SimpleNamespace(steady=lambda place: steady)
    look._rounds = lambda guess: False

    def column(trial, whole=True):
        simulated.extend([trial.at] * whole)
        look.ways.append((SimpleNamespace(shape=trial.at, gain=-abs(trial.at.get("c.q", 0.0) - 150.2), whole=whole), trial.guess))

    look._column = column
    look._paths(place)
    nearest_of_all = {float(q) for q in sorted(range(count), key=lambda q: abs(q - 150.2))[:best]}
    assert simulated[0] == {"c.b": 1.0}
    assert len(simulated) == 1 + (count if steady else best)
    assert steady or {at["c.q"] for at in simulated[1:]} == nearest_of_all
    assert len(look.ways) == 1 + count  # all of them pay for chance


@pytest.mark.parametrize("sign", [1.0, -1.0])
def test_a_number_that_is_nothing_is_looked_for_as_far_as_it_is_felt(rng, sign):
    """A drag coefficient of 0 without ends was never asked for: what 1000 kg feel of it is no size that its FMU knows."""
    look = object.__new__(Looks)
    left, moves = rng.standard_normal((2, 200))
    look.base = SimpleNamespace(misfit=left)
    gain = sign * 10.0 ** rng.uniform(-4.0, 4.0)
    look._misfit = lambda guess, at: left + gain * at["car.drag"] * moves
    most = np.linalg.norm(left) / np.linalg.norm(gain * moves)
    assert look._felt("car.drag") == pytest.approx(most)
    look._misfit = lambda guess, at: left
    assert look._felt("car.drag") == 0.0
    look._misfit = lambda guess, at: None  # it breaks off
    assert look._felt("car.drag") == 0.0
