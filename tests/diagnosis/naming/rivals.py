"""Rivals of a contest as tests need them: a law, a free curve, with what they leave of unseen blocks."""

from dataclasses import replace
from types import SimpleNamespace

import numpy as np

from selflock.diagnosis.calibration.numbers import Number
from selflock.diagnosis.naming import near
from selflock.diagnosis.naming.guesses import CURVE, LAW, Guess
from selflock.diagnosis.naming.order import far
from selflock.diagnosis.naming.places import IN, Insert, Place
from selflock.diagnosis.search.candidate import Candidate
from selflock.diagnosis.search.screen import Direction

ARRANGED = SimpleNamespace(deviations=lambda misfit: misfit, quieter=lambda noise, misfit: 1.0, noise=lambda noise, misfit: noise)
"""What is compared, in units of its noise, which is the same beside any rival."""


def cause(name, amount, place="first.u", over="first.x", loss=0.1):
    """A rival that was fitted: a law of one number, and what it leaves of each of four blocks."""
    numbers = (Number(f"{name}.a", f"{name}.a", 0.0, -amount, amount),)
    guess = Guess(LAW, "cubic", name, (Insert(name, Place(IN, place), "cubic", False, over),), numbers)
    candidate = Candidate(guess.hypothesis, guess.free, None, np.full((4, 1), loss))
    return SimpleNamespace(guess=guess, candidate=candidate, values={}, end=SimpleNamespace(loss=loss, misfit=None))


def free_curve(place, over="first.x", loss=0.1, points=5):
    """A rival like `cause`, a curve of so many points."""
    rival = cause("curve", 1.0, place, over, loss)
    insert = replace(rival.guess.inserts[0], law="table", points=points)
    numbers = tuple(Number(f"curve.c{k}", f"curve.c{k}", 0.0, -1.0, 1.0) for k in range(points))
    guess = Guess(CURVE, "table", f"curve of {over} on {place}, {points}", (insert,), numbers)
    return SimpleNamespace(
        guess=guess, candidate=Candidate(guess.hypothesis, guess.free, None, np.full((4, 1), loss)), values={}, problem=rival
    )


def looks(ways, parts=None):
    """A look that saw these, each as (gain, guess), and of each what is left of it beside the base: a column of its own."""
    units = np.eye(len(ways))
    made = [(Direction(None, {}, (), np.zeros((1, 1, 0)), gain=gain), guess) for gain, guess in ways]
    of = {id(way): unit for (way, _), unit in zip(made, units)}
    parts = parts or SimpleNamespace(links={}, variables={}, owner=lambda name: name.partition(".")[0])
    scene, exact = SimpleNamespace(parts=parts), lambda way, guess: None
    return SimpleNamespace(ways=made, scene=scene, alone=lambda way: of[id(way)], of=of, simulated=exact)


def fits(*guesses):
    """Rivals that were fitted, the best first."""
    return [SimpleNamespace(guess=guess, candidate=SimpleNamespace(errors=np.ones(2))) for guess in guesses]


def asked(found, first, look):
    """Labels of what is asked beside the best of these."""
    away = lambda guess: far(guess, look.scene.parts, {"controller"})
    return [guess.label for _, guess in near.beside_best(fits(*found), first, look, away)]


def a_law(name, place, over, count=0, kind=LAW):
    """A law of so many numbers."""
    numbers = tuple(Number(f"c.{k}", f"c.{k}", 0.0, -1.0, 1.0) for k in range(count))
    word = "curve" if kind == CURVE else name
    return Guess(kind, name, f"{word} of {over} on {place}", (Insert("c", Place(IN, place), name, False, over),), numbers)
