"""A nominal value that is another where an effect acts is a number of that effect, whichever of the two was found first."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from selflock.diagnosis.residuals.whole import HOLD
from selflock.diagnosis.search.candidate import Candidate
from selflock.diagnosis.search.fit import Fit
from selflock.diagnosis.search.hypotheses import Free, Hypothesis
from selflock.diagnosis.search.selection import ForwardSelection
from selflock.diagnosis.search.step import Stage
from selflock.fmus.reducer.effects import EFFECTS

DAMPING = Hypothesis("reducer", "parameter", (Free("reducer.shaft_damping", 10.0, 1.0, 100.0),))
PLAY = Hypothesis("reducer", "backlash", (Free("reducer.backlash", 0.0, 0.0, 0.1),), takes=("reducer.shaft_damping",))
OTHER = Hypothesis("reducer", "parameter", (Free("reducer.shaft_stiffness", 1e4, 1e3, 1e5),))
OF_ANOTHER = replace(DAMPING, free=(replace(DAMPING.free[0], name="left.reducer.shaft_damping"),))


def test_a_cause_is_one_with_what_it_takes_and_with_nothing_else():
    assert PLAY.same_cause(DAMPING) and DAMPING.same_cause(PLAY) and PLAY.same_cause(PLAY)
    assert not PLAY.same_cause(OTHER) and not OTHER.same_cause(DAMPING) and not PLAY.same_cause(OF_ANOTHER)


class Problem:
    """What a selection asks of one."""

    base_free, nominal = (), {}

    def fit(self, free, start, *_):
        return Fit(tuple(free), dict(start), np.ones(4), np.ones((4, 1)), np.ones(4))

    def with_noise(self):
        return self

    def longer(self, base):
        return None

    def loss(self, misfit):
        return float(misfit @ misfit)

    @property
    def experiment(self):
        return self

    def whole(self):
        return self


class Search(ForwardSelection):
    """Which finds these, one after another, and then nothing."""

    def __init__(self, rng, order):
        super().__init__(Problem(), rng)
        self.ahead = list(order)

    def step(self, base, found, first=None):
        nothing = Candidate(Hypothesis("", "none", ()), base.free, base, np.ones((4, 1)))
        if not self.ahead:
            return Stage(nothing, [])
        one = self.ahead.pop(0)
        fitted = self.problem.fit((*base.free, *one.free), {**base.values, **{p.name: 0.5 * p.high for p in one.free}})
        return Stage(nothing, [], Candidate(one, one.free, fitted, np.ones((4, 1))))


@pytest.mark.parametrize("order", [(PLAY, DAMPING), (DAMPING, PLAY)], ids=["the effect first", "the value first"])
def test_what_an_effect_takes_is_told_with_it(rng, order):
    (cause,) = Search(rng, order).run().causes
    assert cause.hypothesis is PLAY
    assert {p.name for p in cause.free} == {"reducer.backlash", "reducer.shaft_damping"}


def test_a_play_takes_the_damping_of_its_flanks():
    assert next(e for e in EFFECTS if e.name == "backlash").takes == ("shaft_damping",)


def test_what_a_delay_has_of_a_controllers_own_stays_with_the_other_causes(rng):
    """A fit of a delay has no number of the controller's own beside it: what goes on from there without the delay keeps its own."""
    own, delay, started = Free(HOLD, 1e-3, 0.0, 2e-3), Free("controller.command_delay", 0.0, 0.0, 0.1), []

    class Late(Problem):
        base_free, nominal = (own,), {HOLD: 1e-3}

        def fit(self, free, start, *_):
            started.append(dict(start))
            return super().fit(free, start)

    search = Search(rng, [PLAY, OTHER])
    search.problem = Late()
    late = Problem().fit((delay,), {delay.name: 0.05})
    search.again = lambda *_: (search.problem, late)
    search.run(1)
    assert started[-2] == {HOLD: 1e-3} and started[-1].keys() >= {HOLD}  # found anew, and the cause beside
    beside = Problem().fit((own, *PLAY.free), {HOLD: 1e-3, "reducer.backlash": 0.01})
    search._deeper(beside, replace(late, values={delay.name: 0.05, "reducer.backlash": 0.02}))
    assert started[-1] == {HOLD: 1e-3, "reducer.backlash": 0.02}
