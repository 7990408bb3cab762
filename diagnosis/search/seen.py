"""Over which shafts a loop closes, where neither the rig nor the log's command says it.

A controller's sensors at the motor and at the load see two angles that differ by the wind-up and the play between them, and a drive
whose loop closes over the wrong ones looks like one with another shaft or motor. Where they are is tried with the drive as it is
described, and where that leaves more than noise with the causes that are found of it so: what leaves least is kept, and told.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

from ..data.rig import DUAL
from ..residuals import driven
from ..residuals.closing import dual, sensed, taken_at
from ..residuals.drive_experiment import DriveExperiment
from ..rules import RULES
from .problem import Problem


def places(experiment: DriveExperiment, at: Callable[[str], Problem]) -> list[str]:
    """Where the sensors may be, first with which the drive, as it is described, leaves least; none where that is no question.

    It is none where the drive leaves no more than noise. A command tells the load's from the motor's (closing.shaft), and whether
    they may be DUAL: then the first is that. at: the problem with its sensors at a place.
    """
    ch, told = next(iter(experiment.channels.values())), experiment.rig.loop
    now = taken_at(ch)
    may_be = lambda place: place != now and (not told or place == DUAL and dual(experiment.command_missed))
    others = [place for place in sensed(ch) if may_be(place)]
    if driven.of(ch) != driven.ANGLE or not others:
        return []
    problem = at(now).with_noise()
    fitted = problem.fit(problem.base_free, problem.nominal)
    if problem.excess(fitted.values).max() <= RULES.search.sound:
        return []
    left = {now: problem.loss(fitted.misfit)}
    for place in others:
        other = at(place).with_noise()
        left[place] = leaves(other, other.fit(other.base_free, other.nominal).values, problem)
    found = sorted(left, key=left.__getitem__)
    return found[:1] if told else found


def leaves(problem: Problem, values: dict, like: Problem) -> float:
    """The loss of a drive with these values, in units of the noise that another problem has of the same channels."""
    other = replace(problem, noise=like.noise, quiet=like.quiet, loss_scale=like.loss_scale)
    return other.loss(other.misfit(values))
