"""Rivals of a contest as tests need them: a law, a free curve, with what they leave of unseen blocks."""

from dataclasses import replace
from types import SimpleNamespace

import numpy as np

from selflock.diagnosis.calibration.numbers import Number
from selflock.diagnosis.naming.guesses import CURVE, LAW, Guess
from selflock.diagnosis.naming.places import IN, Insert, Place
from selflock.diagnosis.search.candidate import Candidate


def cause(name, amount, place="first.u", over="first.x", loss=0.1):
    """A rival that was fitted: a law of one number, and what it leaves of each of four blocks."""
    numbers = (Number(f"{name}.a", f"{name}.a", 0.0, -amount, amount),)
    guess = Guess(LAW, "cubic", name, (Insert(name, Place(IN, place), "cubic", False, over),), numbers)
    candidate = Candidate(guess.hypothesis, guess.free, None, np.full((4, 1), loss))
    return SimpleNamespace(guess=guess, candidate=candidate, values={})


def free_curve(place, over="first.x", loss=0.1, points=5):
    """A rival like `cause`, a curve of so many points."""
    rival = cause("curve", 1.0, place, over, loss)
    insert = replace(rival.guess.inserts[0], law="table", points=points)
    numbers = tuple(Number(f"curve.c{k}", f"curve.c{k}", 0.0, -1.0, 1.0) for k in range(points))
    guess = Guess(CURVE, "table", f"curve of {over} on {place}, {points}", (insert,), numbers)
    return SimpleNamespace(
        guess=guess, candidate=Candidate(guess.hypothesis, guess.free, None, np.full((4, 1), loss)), values={}, problem=rival
    )
