"""What a naming answers: its verdict, causes with their numbers, errors, rivals and the free curve."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from typing import TYPE_CHECKING, Any

import numpy as np

from selflock.fmus.correction import law

from ..calibration import told
from ..calibration.fit import remaining
from ..calibration.numbers import label
from ..calibration.slopes import Slopes
from ..data.log import MeasuredRun
from ..judge.gain import closed
from ..rules import RULES
from .guesses import CURVE, EVENT, KINDS, begins, heights, points_of
from .outcome import Fitted, FreeCurve, NamedCause, NamedError, Naming
from .plan import open_models
from .round import Round
from .same import same

if TYPE_CHECKING:
    from .run import Search
    from .whole import Whole
    from .work import Work


TIMES = ("since", "until", "T")
"""Numbers of laws that are times: of an event, a delay, a lag."""


def told_of(found: Search, seed: int) -> Naming:
    work, best = found.work, found.best
    rng = np.random.default_rng(seed)
    numbers = _intervals(work, best)
    causes = [_cause(outcome, numbers, same(found, outcome, seed), work.runs) for outcome in found.named]
    last = found.outcomes[-1] if found.outcomes else None
    noise = {name: floor for name, (_, floor) in remaining(best.problem, best.values).items()}
    errors = [_error(name, found, noise[name], rng) for name in work.played.outputs]
    ratios = {name: size / noise[name] for name, size in (best.taught or {}).items() if noise[name]}
    if last and last.winner is None:  # of what stands by now
        ratios = last.ratios
    worst = max(ratios.values(), default=0.0)
    significant = bool(last.off.any()) if last and last.winner is None else worst > RULES.judge.excess
    verdict, why = _verdict(causes, worst, significant, _closed(errors, causes))
    if not found.outcomes:
        verdict, why = "unknown", "The time limit came before anything was held against the base"
    effort = work.played.effort
    rig = work.rig
    notes = [*work.parts.not_as_wired(work.played.group), *found.notes, *work.played.notes]
    if effort.runs and sum(effort.failed.values()) > RULES.naming.broken * effort.runs:
        ((reason, _),) = effort.failed.most_common(1)
        notes.append(f"{sum(effort.failed.values())} of {effort.runs} simulations broke off, most with: {reason}")
    notes += _unseen(verdict, errors)
    return Naming(
        verdict,
        why,
        rig.system.name if rig.system else "",
        rig.name,
        list(dict.fromkeys(work.runs[i].log for i in work.which)),
        work.words or "nothing: all that taught",
        causes,
        errors,
        _curve(found.outcomes[0]) if found.outcomes else None,
        {"significant": significant, "ratios": ratios},
        [_rivals(outcome) for outcome in found.outcomes],
        [one for name, one in numbers.items() if name in {n.name for n in work.numbers}],
        {**effort.told(), "elapsed": 0.0},
        notes=notes,
        seed=seed,
        stopped=found.stopped,
        step=work.step,
        models=open_models(found),
    )


def _unseen(verdict: str, errors: list[NamedError]) -> list[str]:
    """What the data that judge say against an answer that nothing is missing, as sentences."""
    if verdict != "none":
        return []
    off = {e.name: e.before / e.noise for e in errors if e.before is not None and e.before > RULES.judge.excess * e.noise > 0.0}
    return [
        f"{name} is off by {times:.2g} times the noise of the data that teach in those that judge: the former say too little of it"
        for name, times in off.items()
    ]


def _closed(errors: list[NamedError], causes: list[NamedCause]) -> float:
    """Share of the squares of an error above its noise that is gone, of the output of which most is; 1 where what is left is near noise.

    Of data that judge; what happened in the runs that teach is theirs.
    """
    most, share = 0.0, 1.0
    for e in errors:
        was, now = (e.taught_before, e.taught_after) if causes and causes[0].kind == EVENT else (e.before, e.after)
        if was is None or now is None or not e.noise or (gone := (was**2 - now**2) / e.noise**2) <= most:
            continue
        most, share = gone, closed(was, now, e.noise) if now > RULES.search.natural * e.noise else 1.0
    return share


def _verdict(causes: list[NamedCause], worst: float, significant: bool, share: float = 1.0) -> tuple[str, str]:
    if not causes:
        if worst > RULES.judge.excess:
            return "unknown", "Something is missing, and no rival predicts unseen data better than chance does"
        if significant:
            return (
                "none",
                f"What remains is {worst:.2g} times its noise, and no rival predicts unseen data better than chance does",
            )
        return "none", "Nothing is missing that these data could show"
    if causes[0].kind == CURVE:
        return "unknown", f"Something is missing that goes with {causes[0].over} at {causes[0].place}: a curve, and no named law"
    for cause in causes:
        if loose := next((n for n in cause.numbers if n.name == "a" and _holds_nothing(n)), None):  # laws call their amount so
            return "unknown", f"{cause.label} has a name, and the data do not tell how much of it there is: {loose}"
    if share < RULES.judge.enough_of_whole:
        return "unknown", f"What has a name closes {100.0 * share:.0f} % of the error, too little to be what is missing"
    if any(cause.beside for cause in causes):
        return "ambiguous", "What is missing has more than one name that does as well"
    if significant and worst > RULES.judge.excess:
        return "explained", f"Some of what is missing has a name: what remains is {worst:.2g} times its noise"
    return "explained", "What is missing has a name"


def _holds_nothing(number: Fitted) -> bool:
    """Whether the data do not tell a number from 0."""
    return number.low is None or number.high is None or number.low <= 0.0 <= number.high


def _intervals(work: Work, best: Whole) -> dict[str, Fitted]:
    """All numbers with their 95 % intervals, of what taught."""
    problem, end = best.problem, best.end
    own = {n.name for n in problem.numbers if n.run is not None}
    found = {name: Fitted(name, value, None, None, name in own, work.parts.unit(name)) for name, value in best.values.items()}
    if end.misfit is None or not problem.free:
        return found
    slopes = Slopes(problem.misfit, problem.free)  # to both sides, where those of the fit were to one
    end = replace(end, jacobian=slopes(end.places, end.misfit))
    labels = problem.blocks([work.layout.block(i) for i in range(len(work.runs))])
    errors, _, loose = told.errors(problem, end, labels)
    width = told.reach(labels, len(problem.free))
    for n, place, error, free in zip(problem.free, end.places, errors, loose):
        if not free:
            ends = n.at(max(0.0, place - width * error)), n.at(min(1.0, place + width * error))
            at_end = not RULES.calibrate.bound <= place <= 1.0 - RULES.calibrate.bound
            found[n.name] = replace(found[n.name], low=min(ends), high=max(ends), at_end=at_end)
    return found


def _cause(outcome: Round, numbers: dict[str, Fitted], same: list[str], runs: Sequence[MeasuredRun]) -> NamedCause:
    winner = outcome.winner
    assert winner is not None
    guess, c = winner.guess, winner.candidate
    first = guess.inserts[0] if guess.inserts else None
    known = law.BY_NAME[first.law] if first else None
    mine = []
    for n in guess.numbers:
        if not begins(n):
            name, told = n.name.replace(f"{first.name}.", "") if first else n.name, numbers[n.name]
            mine.append(replace(told, name=name, unit=told.unit or ("s" if first and name in TIMES else "")))
    gain = 1.0 - c.errors.mean() / max(outcome.base.errors.mean(), 1e-300)
    return NamedCause(
        guess.kind,
        guess.law,
        guess.label,
        first.place.variable if first else guess.label,
        first.place.where if first else "",
        first.goes_with if first else "",
        first.multiplies if first else False,
        known.formula if known else "value",
        mine,
        float(gain),
        c.chance,
        [r.guess.label for r in outcome.beside if r.guess.label not in same],
        same,
        _closer(outcome, same),
        [label(runs[i]) for i in dict.fromkeys(n.run for n in guess.numbers if n.run is not None and not begins(n))],
    )


def _closer(outcome: Round, same: list[str]) -> list[str]:
    """What has a name and leaves less than the winner with more numbers, best first, a few: the simplest is named, and may not be nature's."""
    ahead = outcome.fitted[: next((i for i, r in enumerate(outcome.fitted) if r is outcome.winner), 0)]
    told = {r.guess.label for r in outcome.beside} | {*same}
    named = [r.guess.label for r in ahead if r.guess.kind in KINDS and not r.candidate.doubt and r.guess.label not in told]
    return named[: RULES.naming.closer]


def _error(name: str, found: Search, noise: float, rng: np.random.Generator) -> NamedError:
    best, base = found.best, found.base
    low = high = None
    if name in best.blocks and len(best.blocks[name]) > 1:
        blocks = best.blocks[name]
        drawn = blocks[rng.integers(0, len(blocks), (RULES.judge.bootstraps, len(blocks)))].sum(1)
        low, high = map(float, np.quantile(np.sqrt(drawn[:, 0] / drawn[:, 1]), RULES.judge.interval))
    unit = found.work.parts.variables[name].unit
    pick = lambda sizes: None if sizes is None else sizes[name]
    return NamedError(name, unit, pick(base.held), pick(best.held), low, high, noise, pick(base.taught), pick(best.taught))


def _rivals(outcome: Round) -> dict[str, Any]:
    rows = [
        {
            "label": r.guess.label,
            "kind": r.guess.kind,
            "numbers": len(r.candidate.free),
            "loss": float(r.candidate.errors.mean()),
            "drop": r.candidate.drop,
            "gain": r.candidate.gain,
            "chance": r.candidate.chance,
            "doubt": r.candidate.doubt,
            "role": "named" if r is outcome.winner else "not to be told from it" if r in outcome.beside else "considered",
        }
        for r in outcome.fitted
    ]
    base = float(outcome.base.errors.mean())
    return {"base": base, "looked": outcome.looked, "chance_level": outcome.chance_level, "ratios": outcome.ratios, "rows": rows}


def _curve(outcome: Round) -> FreeCurve | None:
    """The free curve of a round: that of the winner's variable at its place, else the one that predicts most."""
    curves = [r for r in outcome.fitted if r.guess.kind == CURVE]
    winner = outcome.winner
    does = lambda r: (r.guess.place, r.guess.over, any(one.multiplies for one in r.guess.inserts))
    own = next((r for r in curves if winner is not None and does(r) == does(winner)), None)
    rival = own or outcome.curve
    if rival is None:
        return None
    table = rival.guess.inserts[0]
    names = [n.name for n in rival.guess.numbers]
    ways = np.array([[rival.guess.acts[name].get(y, 0.0) for name in names] for y in heights(table)])
    spread = np.array([n.high - n.low for n in rival.guess.numbers])
    free = [n.name for n in rival.problem.free]
    mine = [free.index(name) for name in names]
    covariance = rival.candidate.fitted.covariance(np.ones(len(rival.block), bool), rival.block)
    of_ways = covariance[np.ix_(mine, mine)] * np.outer(spread, spread)
    error = np.sqrt(np.maximum(np.einsum("ij,jk,ik->i", ways, of_ways, ways), 0.0))
    return FreeCurve(
        rival.guess.label,
        table.goes_with,
        str(table.place),
        table.multiplies,
        [float(x) for x in points_of(table)],
        [float(y) for y in ways @ np.array([rival.values[name] for name in names])],
        [float(e) for e in error],
        float(rival.candidate.errors.mean()),
        float(outcome.base.errors.mean()),
        own is not None or winner is None,
    )
