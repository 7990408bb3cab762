"""What hunts is moved out of proportion; what follows its set-points is not, however strong or bent its law."""

from types import SimpleNamespace

import numpy as np
import pytest

from selflock.diagnosis.judge.hunting import as_widely, hunts
from selflock.diagnosis.search.hypotheses import Free
from selflock.fmus.effect import AMPLITUDE, ORDER

TIME = np.linspace(0.0, 10.0, 5000)
PLAY = Free("reducer.backlash", 0.0, 0.0, 1.0, role=AMPLITUDE)


def drive(moved):
    """Two channels of a drive, asked for nothing, by what a play of so much makes of the first."""
    trusted = np.ones(len(TIME), bool)
    share = lambda name, play: moved(play) if name == "speed" else 0.3 * moved(play)
    compare = lambda name, values: [(share(name, values["reducer.backlash"]), np.zeros(len(TIME)), trusted)]
    return SimpleNamespace(residuals=("speed", "voltage"), compare=compare)


@pytest.mark.parametrize(
    "moved, swings",
    [
        (lambda play: 50.0 * play * np.sin(3.0 * TIME), False),  # in proportion, however much
        (lambda play: play**3 * np.sin(3.0 * TIME), False),
        (lambda play: np.maximum(play - 0.3, 0.0) * np.sin(3.0 * TIME), False),  # from some amount on
        (lambda play: (play > 0.0) * np.sin(60.0 * TIME / (0.1 + play)), True),  # a swing that is slower the wider the play
    ],
)
def test_only_a_swing_of_its_own_is_moved_far_by_little(moved, swings):
    assert hunts(drive(moved), {"reducer.backlash": 0.5}, [PLAY]) == swings


def test_another_order_of_a_wave_is_another_wave():
    order = Free("reducer.backlash", 1.0, 1.0, 200.0, role=ORDER)
    assert not hunts(drive(lambda n: np.sin(n * 20.0 * TIME)), {"reducer.backlash": 7.0}, [order])


@pytest.mark.parametrize("wide", [0.3, 1.0, 3.0])
def test_a_swing_of_another_width_than_the_logs_is_not_why_it_is_not_met(wide, rng):
    """In any phase, and whatever a channel says that nothing moves."""
    ours, theirs = rng.uniform(0.0, 2.0 * np.pi, 2)
    trusted = np.ones(len(TIME), bool)
    swing = {"speed": 2.0, "voltage": 0.1, "supply": 0.0}

    def compare(name, values):
        simulated = values["reducer.backlash"] * wide * swing[name] * np.sin(11.0 * TIME + ours)
        return [(simulated, (swing[name] or 0.01) * np.sin(11.0 * TIME + theirs), trusted)]

    bench = SimpleNamespace(residuals=("speed", "voltage", "supply"), compare=compare)
    assert as_widely(bench, {"reducer.backlash": 0.0}, {"reducer.backlash": 1.0}) == (wide == 1.0)
