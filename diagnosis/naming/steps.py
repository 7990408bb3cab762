"""The steps of a system: as fine as its model needs, and rivals simulated in the rig's own where these are coarser.

What steps miss looks like a law or a lag. Fine ones cost, and a search simulates thousands of times. So what finer steps make of
the base is taken off the log once, and rivals are looked at and fitted beside that in the rig's own steps: what they change is
changed nearly alike in both. Who is believed is fitted again in the finer ones.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from ..calibration.fit import Rows, fit_from
from ..calibration.run import sizes
from ..calibration.slopes import Forward, beside
from ..rules import RULES
from .extended import Extended, Extending, Vanishing, vanished
from .places import Insert
from .round import Rivalled
from .whole import falls, learnt
from .work import Work


def fine_enough(work: Work, near: Extending, places: np.ndarray) -> tuple[Work, Extending, np.ndarray]:
    """Half the steps for as long as what the model makes of the log, fitted again, moves with them.

    What steps miss looks like a law or a lag. Where the step's error falls with the step, half of it is what half the step
    moves; what is moved by less than a share of the noise hides nothing. That is so whatever the log says: beside what is
    missing, and strong, neither leaves less but by chance. Beside an FMU that acts once a step, which is another one in half of
    them, they must also leave less; and where they leave less as they were, they are doubled again.
    """
    began, sloped = work, beside(near.misfit)
    while work.step > 1.5 * work.finest:
        other = _in_steps(work, near, places, 0.5, sloped)
        if other is None:
            break
        work, near, places = other
    while work.others and work is began and work.step < 0.75 * work.given_step:
        other = _in_steps(work, near, places, 2.0, Forward)  # its own slopes are those of the longest steps
        if other is None:
            break
        began, near, places = other
        work = began
    return work, near, places


def _in_steps(
    work: Work, near: Extending, places: np.ndarray, factor: float, sloped: type[Forward]
) -> tuple[Work, Extending, np.ndarray] | None:
    """The same in steps of another size, fitted again; None where that changes nothing that is seen."""
    stepped = work.in_steps(factor)
    other = replace(near)
    vars(other)["played"] = played = work.played_on(stepped.parts, near.runs, work.numbers)
    played.extend(work.inserts)
    end = fit_from(other, places, RULES.naming.effort, RULES.naming.ended, sloped, learnt(near.free))
    seen = _moved(near, near.values(places), other, other.values(end.places)) > RULES.naming.coarse
    better = seen and np.isfinite(end.loss) and (not work.others or end.loss < near.loss(near.misfit(places)))
    for unused in (near.played, work.played) if better else (other.played, stepped.played):
        unused.close()
    return (stepped, other, end.places) if better else None


def _moved(one: Extending, values: dict[str, float], other: Extending, others: dict[str, float]) -> float:
    """By how much two models differ in what is compared, in units of its noise, where most; 0 where one breaks off."""
    first, second = one.errors(values), other.errors(others)
    if first is None or second is None:
        return 0.0
    most = 0.0
    for name, parts in first.items():
        trusted = one.trusted[name]
        apart = np.concatenate([(a - b)[t] for a, b, t in zip(parts, second[name], trusted)])
        noise = max(one.floor(name, second[name]), RULES.pipeline.fine * one.played.spread(name))
        most = max(most, float(np.sqrt(np.mean(apart**2))) / noise if len(apart) and noise else 0.0)
    return most


def widened(near: Extending, winner: Rivalled, work: Work) -> tuple[Extending, np.ndarray]:
    """The problem in the work's own steps with what won beside it, fitted there."""
    assert isinstance(near.played, Extended)
    found = replace(near, numbers=winner.problem.numbers, acts=winner.problem.acts, units=winner.problem.units)
    vars(found)["played"] = near.played
    near.played.extend(work.inserts)
    ends = RULES.naming.effort, RULES.naming.ended
    if winner.problem.played is near.played:
        if not winner.rough:  # else what a better fit changes would be taken for what steps do
            return found, winner.end.places
        return found, fit_from(found, winner.end.places, *ends, Forward).places
    winner.problem.played.close()
    double = _doubled(work, found)
    places = fit_from(found, winner.end.places, *ends, beside(double.misfit), winner.slopes).places
    double.close()
    return found, places


Model = tuple[Work, Extending, dict[str, float]]
"""A work with a cause, the problem in its steps, and the values of that."""


def stepped(work: Work, near: Extending, rival: Rivalled) -> Model | None:
    """The model with a rival in the steps that it asks for; None where the work is in these.

    Beside something strong that is missing, what finer steps leave less of goes under.
    """
    assert isinstance(near.played, Extended)
    before, wider = near.played.inserts, work.with_also(rival.guess)
    other, model, places = fine_enough(wider, *widened(near, rival, wider))
    near.played.extend(before)
    return None if other is wider else (other, model, model.values(places))


def released(work: Work, near: Extending, base: tuple[Work, Extending], rival: Rivalled) -> Model | None:
    """The model with a rival in the steps that it asks for, where what acts once a step keeps the rig's: or in finer ones of all.

    Whether an FMU that only computes does so once in the rig's step, as a controller, or all the time, as a thermostat, a base that
    lacks something strong does not tell: its steps leave more or less by chance. Beside what explains most they do. base: in the
    rig's steps, where nothing keeps them.
    """
    kept = stepped(work, near, rival)
    if not work.keep or (other := stepped(*base, rival)) is None:
        return kept
    model = kept or (work.with_also(rival.guess), rival.problem, rival.values)
    less, left = (_sizes(problem, one.inserts, values) for one, problem, values in (other, model))
    return other if falls(less, left) and not falls(left, less) else kept


def _sizes(problem: Extending, inserts: Sequence[Insert], values: dict[str, float]) -> dict[str, float] | None:
    assert isinstance(problem.played, Extended)
    with problem.played.having(inserts):
        return sizes(problem, values, problem.rows)


def in_vanishing(work: Work, near: Extending, places: np.ndarray, found: dict[str, float]) -> np.ndarray:
    """The numbers as they would be in steps that vanish, where steps halved as often as they may be still move what was found.

    Numbers that were fitted in such steps make up for a part of what these miss, and beside what is taken off for that they leave
    more: a house's limit 1.7 times the noise for 1.3, and a second cause was looked for. found: with which it was found.
    """
    if work.step > 1.5 * work.finest:
        return places
    double, values = _doubled(work, near), near.values(places)
    if _moved(near, values, double, values) > RULES.naming.coarse:
        model, sloped = Vanishing.of(near, double), beside(double.misfit)
        there = np.array([np.clip(n.place(found.get(n.name, n.start)), 0.0, 1.0) for n in near.free])
        begun = min((places, there), key=lambda at: model.loss(model.misfit(at)))
        places = fit_from(model, begun, RULES.naming.effort, RULES.naming.ended, sloped, learnt(near.free)).places
    double.close()
    return places


def in_own_steps(work: Work, near: Extending, places: np.ndarray) -> Extending:
    """The problem in the rig's own steps, beside a log without what finer ones change of this model; itself where they are its own.

    Where the model is another one in the rig's, it is the one in the longest steps in which it is not.
    """
    values, fine, factor = near.values(places), None, work.given_step / work.step
    while factor > 1.5:
        fine = fine or _vanishing(work, near, near, values)
        if fine is None:
            break
        own = work.in_steps(factor)
        own.played.close()  # of all data; only the heads are asked for
        made = lambda runs, own=own: _on(replace(near, runs=runs), work.played_on(own.parts, runs, work.numbers, near.runs), near)
        coarse = made(near.runs)
        long = coarse.unrounded(values)
        coarse.close()
        if long is not None and not any(_large(fine[name], long[name], near.played.spread(name)) for name in fine):
            runs = []
            for i, run in enumerate(near.runs):
                moved = {name: run.signals[name] - (long[name][i] - fine[name][i]) for name in fine}
                runs.append(replace(run, signals=run.signals | moved))
            return made(runs)
        factor /= 2.0
    return near


def _vanishing(
    work: Work, near: Extending, model: Extending, values: dict[str, float], inserts: Sequence[Insert] = ()
) -> Rows | None:
    """What a model, with these corrections beside what was found, would leave of the log in steps that vanish."""
    double = _doubled(work, near)
    fine, twice = (_errors(one, model, values, inserts) for one in (near, double))
    double.close()
    return vanished(fine, twice)


def _doubled(work: Work, near: Extending) -> Extending:
    """The problem in steps twice as long."""
    doubled = work.in_steps(2.0)
    doubled.played.close()
    return _on(replace(near), work.played_on(doubled.parts, near.runs, work.numbers), near)


def _errors(problem: Extending, model: Extending, values: dict[str, float], inserts: Sequence[Insert]) -> Rows | None:
    """What a model leaves of a problem's log, in the steps of that."""
    assert isinstance(problem.played, Extended)
    theirs = _on(replace(problem, numbers=model.numbers, acts=model.acts), problem.played, problem)
    with problem.played.having((*problem.played.inserts, *inserts)):
        return theirs.unrounded(values)


def around(
    work: Work, near: Extending, own: Extending, rival: Rivalled, noise: dict[str, float], told: Extending | None = None
) -> Extending | None:
    """The problem in the rig's own steps beside a log without what finer ones change of a rival's model.

    What a rival changes is changed alike in both where it is little. Of a strong one the own steps miss a part that looks like a
    lag of it: among what comes near the rival that is taken off as it is there. None where it is what was taken off for the base,
    or for what the rival was before. told: beside the log of that.
    """
    fine = _vanishing(work, near, rival.problem, rival.values, rival.guess.inserts)
    long = _errors(own, rival.problem, rival.values, rival.guess.inserts)
    if fine is None or long is None:
        return None
    runs, more = [], 0.0
    for i, (run, mine) in enumerate(zip(near.runs, own.runs)):
        signals = {}
        for name, size in noise.items():
            simulated = [one.signals[name] - errors[name][i] for one, errors in ((run, fine), (mine, long))]
            signals[name] = run.signals[name] - (simulated[0] - simulated[1])
            apart = (signals[name] - (told or own).runs[i].signals[name])[near.trusted[name][i]]
            least = max(size, RULES.pipeline.fine * near.played.spread(name))
            more = max(more, float(np.sqrt(np.mean(apart**2))) / least if len(apart) and least else 0.0)
        runs.append(replace(run, signals=run.signals | signals))
    if more <= RULES.naming.coarse:
        return None
    return _on(replace(own, runs=runs), work.played_on(own.played.parts, runs, work.numbers, near.runs), own)


def _on(problem: Extending, played: Extended, near: Extending) -> Extending:
    assert isinstance(near.played, Extended)
    vars(problem)["played"] = played
    played.extend(near.played.inserts)
    return problem


def _large(fine: list[np.ndarray], long: list[np.ndarray], spread: float) -> bool:
    """Whether steps change so much of an output that the longer ones are another system."""
    apart = np.concatenate([a - b for a, b in zip(fine, long)])
    apart = apart[np.isfinite(apart)]
    return bool(len(apart)) and float(np.sqrt(np.mean(apart**2))) > RULES.naming.other_system * spread
