"""What is late, bent or turned round, looked at from the rig's own values: beside it the base may have found a valley of its own.

A sensor that is late is made up for by slower bodies: the base's numbers that fit best without it are far from those beside it, a fit
from there ends between both, and no linear look can say where they would be. What a rig says its numbers are is nearer. So it is where
a sensor is cut off for half of its rows: of two bodies in a row either may be the slow one, and the base chose the wrong one. Where a
command has the wrong sign the base is as slow and weak as it may be, and the fit of a sign from there ended at two fifths of the
loss, so that a scale of -1 was named instead of it. An event moves the base's numbers as well: at another place it is looked at from
those that fit beside it.
"""

from __future__ import annotations

from collections.abc import Collection, Sequence
from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np

from ..calibration.slopes import Forward
from ..rules import RULES
from . import guesses as g
from .guesses import Guess

if TYPE_CHECKING:
    from .looks import Looks
    from .round import Rivalled

LATE_OR_BENT = "delay", "lag", "rate limit", "saturation (high)", "saturation (low)", "dead zone"


def afresh(looks: Looks, laws: Sequence[str]) -> list[tuple[Guess, dict[str, float]]]:
    """Paths of these laws with where their fits start: those that leave least where the base's numbers make up for them, linearly."""
    problem, scene = looks.problem, looks.scene
    scene.played.extend(looks.inserts)
    places = np.array([n.place(n.start) for n in problem.free])
    at = problem.misfit(places)
    if at is None or not len(places):
        return []
    slopes = Forward(problem.misfit, problem.free)(places, at)
    back = np.linalg.pinv(slopes, rcond=RULES.naming.degenerate)
    best: dict[str, tuple[float, Guess, dict[str, float]]] = {}
    for trial in (trial for place in scene.places for trial in g.paths(scene, place) if trial.guess.law in laws):
        one = looks.trial(trial.guess)
        known = problem.values(places) | trial.at
        misfit = one.misfit(np.array([n.place(known[n.name]) for n in one.free]))
        if misfit is None:
            continue
        if not trial.guess.numbers and np.linalg.norm(misfit) >= np.linalg.norm(at):
            continue  # a sign that leaves more than none is none
        step = back @ misfit
        left = float(np.linalg.norm(misfit - slopes @ step))
        if left < best.get(trial.guess.label, (np.inf,))[0]:
            made_up = step if trial.guess.numbers else 0.0  # of a sign, which turns these slopes round, it is none
            best[trial.guess.label] = left, trial.guess, problem.values(np.clip(places - made_up, 0.0, 1.0)) | trial.at
    least = sorted(best.values(), key=lambda found: found[0])[: RULES.naming.of_path]
    return [(guess, start) for _, guess, start in least]


def elsewhere(looks: Looks, best: Rivalled, known: Collection[str] = ()) -> list[tuple[Guess, dict[str, float]]]:
    """An event at other places, at its times, with where its fits start: those that leave least from the base's numbers beside it.

    known: labels of what is fitted. A heat before a radiator moved a house's numbers so far that the look put the thermostat first.
    """
    problem, scene, values = looks.problem, looks.scene, best.values
    scene.played.extend(looks.inserts)
    places = np.array([n.place(values[n.name]) for n in problem.free])
    at = problem.misfit(places)
    if at is None:
        return []
    slopes = Forward(problem.misfit, problem.free)(places, at) if len(places) else np.zeros((len(at), 0))
    (one,), (a, *times), found = best.guess.inserts, best.guess.numbers, []
    for place in (place for place in scene.places if place != one.place):
        added, most, _ = next(g.shifts(scene, place))
        moved = replace(one, place=place)
        numbers = (replace(a, low=-most, high=most), *times)
        guess = replace(best.guess, label=g.words("event", added), inserts=(moved,), numbers=numbers)
        if guess.label in known:
            continue
        trial, step = looks.trial(guess), RULES.naming.unit * scene.spread(place)
        misfit = trial.misfit(np.array([n.place((values | {a.name: step})[n.name]) for n in trial.free]))
        if misfit is None:
            continue
        columns = np.column_stack([(misfit - at) / step, slopes])
        amounts = np.linalg.lstsq(columns, -at, rcond=RULES.naming.degenerate)[0]
        begun = problem.values(np.clip(places + amounts[1:], 0.0, 1.0)) | {n.name: values[n.name] for n in times}
        found.append((float(np.linalg.norm(at + columns @ amounts)), guess, begun | {a.name: float(amounts[0])}))
    return [(guess, start) for _, guess, start in sorted(found, key=lambda one: one[0])[: RULES.naming.of_path]]
