"""From rig and logs to what the system lacks: the base fitted, rivals held against it, the best named, the system extended."""

from __future__ import annotations

import time
from collections.abc import Callable, Sequence
from contextlib import ExitStack
from copy import copy
from dataclasses import dataclass, field, replace
from pathlib import Path

import numpy as np

from ..calibration import told
from ..calibration.fit import End, fit, fit_from, spreads, units
from ..calibration.numbers import Number, of_rig
from ..calibration.run import division, here, own, reached, sizes
from ..calibration.slopes import Forward
from ..data.log import MeasuredRun
from ..data.rig import SMOOTH, Rig
from ..errors import DataError
from ..pipeline.run import gather
from ..residuals.blocks import Blocks
from ..residuals.mending import rms
from ..residuals.noise import of_samples
from ..rules import RULES
from ..search.kept import Kept
from ..systems.parts import Parts
from ..systems.system import prepare
from .answer import told_of
from .contest import Contest, Round, beside
from .extend import extend
from .extended import Extended, Extending, taken
from .guesses import CURVE, EVENT, KINDS, Guess
from .outcome import Naming
from .page import write
from .places import Insert

PREFIX = "correction"


@dataclass
class Work:
    """All that one naming goes on with."""

    rig: Rig
    parts: Parts
    runs: list[MeasuredRun]
    numbers: tuple[Number, ...]
    judges: set[int]
    rows: list[np.ndarray]
    words: str
    layout: Blocks
    played: Extended
    given_step: float  # of the system as the rig has it, s
    kept: Kept | None = None  # where fits are kept
    inserts: tuple[Insert, ...] = ()
    found: list[tuple[Number, ...]] = field(default_factory=list)  # numbers of what was found
    acts: dict[str, dict[str, float]] = field(default_factory=dict)
    opened: ExitStack = field(default_factory=ExitStack)  # systems that run, to be closed whatever happens

    def played_on(self, parts: Parts, runs: list[MeasuredRun], numbers: tuple[Number, ...]) -> Extended:
        """A system of one's own on these runs."""
        played = Extended(self.rig, parts, runs, numbers)
        played.effort = self.played.effort  # of all together
        self.opened.callback(played.close)
        return played

    @property
    def which(self) -> list[int]:
        return [i for i in range(len(self.runs)) if i not in self.judges]

    def problem(self) -> Extending:
        """The fit to all that teaches, with what was found so far."""
        self.played.extend(self.inserts)
        more = [n for numbers in self.found for n in numbers]
        found = Extending(self.rig, self.runs, (*self.numbers, *more), self.which, self.rows, kept=self.kept, acts=self.acts)
        found.fixed = {n.name: n.start for n in self.numbers if n.run in self.judges}
        vars(found)["played"] = self.played
        found.units = spreads(self.played)
        return found

    @property
    def step(self) -> float:
        """The system's step, s."""
        return self.parts.system.run.step

    def in_steps(self, factor: float) -> Work:
        """The same in steps of another size."""
        parts = copy(self.parts)
        parts.system = replace(parts.system, run=replace(parts.system.run, step=self.step * factor))
        return replace(self, parts=parts, played=self.played_on(parts, self.runs, self.numbers))

    def with_also(self, guess: Guess) -> Work:
        """The same with one more that was found; a run is counted among all, not among those that teach."""
        numbers = tuple(n if n.run is None else replace(n, run=self.which[n.run]) for n in guess.numbers)
        return replace(self, inserts=(*self.inserts, *guess.inserts), found=[*self.found, numbers], acts=self.acts | guess.acts)


def name_system(
    rig: Rig,
    logs: Sequence,
    test: Sequence,
    out: Path | None,
    tell: Callable,
    starts: int,
    seed: int,
    kinds: Sequence[str] = KINDS,
    kept: Kept | None = None,
) -> Naming:
    """The naming of what a rig's system lacks, as `calls.name` tells it."""
    if rig.system is None:
        raise DataError(
            f'{rig.path}: names no system. Write [rig] system = "my.toml" (an .ssp or .fmu as well); what a drive of ours lacks '
            "selflock diagnose names."
        )
    for kind in kinds:
        if kind not in KINDS:
            raise DataError(f"kinds: {kind!r} is none. There are: {', '.join(KINDS)}.")
    if starts < 1:
        raise DataError(f"starts = {starts}: give at least one.")
    begun = time.monotonic()
    tell("reading", 0.0)
    rig, parts = prepare(rig)
    runs, faults, held = gather(rig, logs, test)
    numbers = of_rig(rig, parts, runs) if rig.wanted or rig.uncertain else ()
    if out is not None:
        out.mkdir(parents=True, exist_ok=True)
    layout = Blocks(runs, False)
    rows = [np.ones(len(run), bool) for run in runs]
    with ExitStack() as opened:
        opened.callback((played := Extended(rig, parts, runs, numbers)).close)
        work = Work(rig, parts, runs, numbers, set(), rows, "", layout, played, parts.system.run.step, kept, opened=opened)
        work.judges, work.rows, work.words = division(work.problem(), held, [layout.block(i) for i in range(len(runs))])
        found = _searched(work, tell, starts, seed, kinds)
        result = told_of(found, seed)
        result.faults = [fault.row() for fault in faults]
        result.effort["elapsed"] = time.monotonic() - begun
        if out is not None:
            tell("report", 0.95)
            extend(result, found.work, found.best, out)
            result.effort["elapsed"] = time.monotonic() - begun
            write(result, found, out)
    return result


@dataclass
class Whole:
    """A model fitted to all that teaches, and its errors."""

    problem: Extending
    end: End
    values: dict[str, float]
    taught: dict[str, float] | None
    held: dict[str, float] | None
    blocks: dict[str, np.ndarray]  # of each output sums of squares and counts of the blocks that judge


@dataclass
class Search:
    """What a search went through, and where it ended."""

    work: Work
    given: Whole
    base: Whole
    best: Whole
    outcomes: list[Round]
    notes: list[str]
    begins: Work  # before anything was found


def _near(work: Work, most: int = RULES.naming.glance) -> Extending:
    """The heads of all runs that teach, of so many samples, on which guesses are looked at and compared."""
    total = sum(len(work.runs[i]) for i in work.which)
    share = min(1.0, most / total)
    runs = [work.runs[i].head(max(2, int(np.ceil(share * len(work.runs[i]))))) for i in work.which]
    place = {i: k for k, i in enumerate(work.which)}
    numbers = tuple(n if n.run is None else replace(n, run=place[n.run]) for n in work.numbers if n.run is None or n.run in place)
    played = work.played_on(work.parts, runs, numbers)
    rows = [work.rows[i][: len(run)] for i, run in zip(work.which, runs)]
    problem = Extending(work.rig, runs, numbers, list(range(len(runs))), rows, kept=work.kept)
    vars(problem)["played"] = played
    problem.units = spreads(played)
    return problem


def _searched(work: Work, tell: Callable, starts: int, seed: int, kinds: Sequence[str]) -> Search:
    near = _near(work)
    tell("the base", 0.02)
    assert isinstance(near.played, Extended)
    places, notes = _base(work, near, near.played, starts, seed)
    if _later(work, near, near.values(places)):
        near.played.close()
        longer = _near(work, RULES.naming.glance_longer)
        longer.fixed = near.fixed
        near = longer
    rng = np.random.default_rng(seed)
    nothing = End(np.zeros(0), np.zeros(0), np.inf)
    given = _measured(work, work.problem(), nothing, {n.name: n.start for n in work.numbers})
    work, near, places = _fine_enough(work, near, places)
    found, again = _begun(work, near, places, given, notes), RULES.naming.halved
    while len(found.outcomes) < RULES.naming.rounds:
        k, numbers = len(found.outcomes), near.numbers
        prefix, fitted = PREFIX + (f"_{k + 1}" if k else ""), {n.variable for n in numbers}
        outcome = Contest(near, places, prefix, _told(tell, k), work.rig.inputs == SMOOTH, fitted, kinds).play(rng)
        found.outcomes.append(outcome)
        wider = _chosen(found, outcome, near.fixed)
        if wider is None or outcome.winner is None:
            break
        near, places = outcome.winner.problem, outcome.winner.end.places
        assert isinstance(near.played, Extended)
        near.played.extend(wider.inserts)
        work, near, places = _fine_enough(wider, near, places)
        if work is wider:
            continue
        if k == 0 and again:  # it was found in steps that hide or feign something, so that it is looked for anew
            work, again = replace(work, inserts=(), found=[], acts={}), again - 1
            near = _without(near, numbers)
            places = np.array([np.clip(n.place(found.best.values.get(n.name, n.start)), 0.0, 1.0) for n in near.free])
            found = _begun(work, near, places, given, notes)
        else:
            found.work, found.best = work, _fitted(work, near.values(places), near.fixed)
            found.begins = replace(work, inserts=(), found=[], acts={})
    if still := found.outcomes[0].still:
        notes.append(f"no law that goes with {', '.join(still)} was asked for: it stands still in what was recorded")
    _curve_instead(found)
    found.work.played.extend(found.work.inserts)
    notes += _beyond(found)
    if found.work.step != work.given_step:
        notes.append(
            f"steps of {work.given_step:g} s are too long for this system, by what they leave: {found.work.step:g} s are taken"
        )
    return found


def _beyond(found: Search) -> list[str]:
    """What is to be told of a curve whose variable goes beyond what taught in what judges: nothing can be closed there."""
    winner, work = found.outcomes[0].winner, found.work
    if winner is None or winner.guess.kind != CURVE or not work.judges:
        return []
    table = winner.guess.inserts[0]
    low, high = (dict(table.fixed)[f"x{k}"] for k in (1, table.points))
    series = work.played.series(found.best.problem.settings(found.best.values), sorted(work.judges))
    parts = zip(series[table.over], series["time"], series[table.beside or table.over])
    x = np.concatenate([taken(one, time, table.taken, other) for one, time, other in parts])
    share = float(np.mean((x < low) | (x > high)))
    if share < RULES.naming.knots[1]:
        return []
    return [
        f"{table.goes_with} lies beyond what taught ({low:.4g} to {high:.4g}) in {100.0 * share:.0f} % of what judges: there the "
        "curve stays as at its last point, and says nothing. Let a log that teaches go as far"
    ]


def _without(near: Extending, numbers: Sequence[Number]) -> Extending:
    """A problem with these numbers alone, and without corrections."""
    found = replace(near, numbers=tuple(numbers), acts={})
    vars(found)["played"] = near.played
    assert isinstance(near.played, Extended)
    near.played.extend(())
    return found


def _begun(work: Work, near: Extending, places: np.ndarray, given: Whole, notes: list[str]) -> Search:
    """A search in which nothing was found yet, its base fitted to all that teaches."""
    base = _fitted(work, near.values(places), near.fixed)
    return Search(work, given, base, base, [], notes, work)


def _chosen(found: Search, outcome: Round, fixed: dict[str, float]) -> Work | None:
    """The work with the most believed rival that the data that judge do not refuse; it is the round's winner."""
    outcome.winner = None
    for rival in outcome.order[: RULES.naming.vetoed]:
        wider = found.work.with_also(rival.guess)
        after = _fitted(wider, rival.values, fixed)
        if _helps(after, found.best, rival.guess.kind):
            outcome.winner = rival
            outcome.beside = beside(rival, outcome.order, outcome.chance_level, outcome.base.errors.mean())
            found.work, found.best = wider, after
            return wider
        rival.candidate.doubt = f"it does not lower the error of what judges by {100 * RULES.judge.help:.0f} %"
    return None


def _curve_instead(found: Search) -> None:
    """Where a free curve leaves less of the data that judge than all that has a name together, it is the answer."""
    first, named = found.outcomes[0], any(outcome.winner for outcome in found.outcomes)
    if first.curve is None:
        return
    wider = found.begins.with_also(first.curve.guess)
    after = _fitted(wider, first.curve.values, first.curve.problem.fixed)
    if not _helps(after, found.best if named else found.base):
        return
    for outcome in found.outcomes:
        outcome.winner, outcome.beside = None, []
    first.winner = first.curve
    found.outcomes = [first]
    found.work, found.best = wider, after


def _fine_enough(work: Work, near: Extending, places: np.ndarray) -> tuple[Work, Extending, np.ndarray]:
    """Half the steps for as long as what the model makes of the log, fitted again, moves with them, and leaves no more.

    What steps miss looks like a law or a lag. Where the step's error falls with the step, half of it is what half the step
    moves; what is moved by less than a share of the noise hides nothing. Where steps were halved that leave less as they
    were, as of an FMU that acts once a step, they are doubled again.
    """
    least, began = work.given_step / 2.0**RULES.naming.halved, work
    while work.step > 1.5 * least:
        other = _in_steps(work, near, places, 0.5)
        if other is None:
            break
        work, near, places = other
    while work is began and work.step < 0.75 * work.given_step:
        other = _in_steps(work, near, places, 2.0)
        if other is None:
            break
        began, near, places = other
        work = began
    return work, near, places


def _in_steps(work: Work, near: Extending, places: np.ndarray, factor: float) -> tuple[Work, Extending, np.ndarray] | None:
    """The same in steps of another size, fitted again; None where that changes nothing that is seen, or leaves more."""
    stepped = work.in_steps(factor)
    other = replace(near)
    vars(other)["played"] = played = work.played_on(stepped.parts, near.runs, work.numbers)
    played.extend(work.inserts)
    end = fit_from(other, places, RULES.naming.effort, RULES.naming.ended, Forward)
    seen = _moved(near, near.values(places), other, other.values(end.places)) > RULES.naming.coarse
    better = seen and end.loss < near.loss(near.misfit(places))
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
        noise = max(float(of_samples(second[name], trusted)), RULES.pipeline.fine * one.played.spread(name))
        most = max(most, float(np.sqrt(np.mean(apart**2))) / noise if len(apart) and noise else 0.0)
    return most


def _base(work: Work, near: Extending, played: Extended, starts: int, seed: int) -> tuple[np.ndarray, list[str]]:
    """The numbers that the rig sets free, fitted to the heads of the runs; what is to be told of them."""
    origin = np.array([n.place(n.start) for n in near.free])
    if near.misfit(origin) is None and not len(origin):
        raise DataError(f"{work.rig.path}: the system breaks off: {played.last}")
    if played.still():
        raise DataError(
            f"{near.runs[0].log}: no input moves in this log, so that what is missing cannot be told from what is fitted. Record a "
            f"run in which they do, or map other columns in {work.rig.path.name}."
        )
    first, other = (near.settings(near.values(at))[0] for at in (origin, np.full(len(origin), 0.5)))
    notes = [word] if (word := played.trust(first, other, 0)) else []
    quiet = told.silent(near, origin) if len(origin) else set()
    near.fixed |= {n.name: n.start for n in near.numbers if n.name in quiet}
    notes += [f"{name} changes nothing that is compared, and keeps its value" for name in sorted(quiet)]
    origin = np.array([n.place(n.start) for n in near.free])
    ends = fit(near, origin, starts if len(origin) else 1, seed, here, lambda what, share: None)
    return reached(near, ends, "named").places, notes


def _later(work: Work, near: Extending, values: dict[str, float]) -> bool:
    """Whether what lies behind the heads of the runs leaves more than they do: something happens there."""
    if all(len(run) == len(work.runs[i]) for i, run in zip(work.which, near.runs)):
        return False
    problem = work.problem()
    errors = problem.errors(values)
    if errors is None:
        return False
    for name, parts in errors.items():
        sizes_of = []
        for behind in (False, True):
            part = lambda x, run, behind=behind: x[len(run) :] if behind else x[: len(run)]
            chosen = [part(e, run)[part(t, run)] for e, t, run in zip(parts, problem.trusted[name], near.runs)]
            sizes_of.append(rms(chosen) if any(len(e) for e in chosen) else 0.0)
        if sizes_of[1] > RULES.naming.later * sizes_of[0]:
            return True
    return False


def _told(tell: Callable, k: int) -> Callable[[str, float], None]:
    share = 0.85 / RULES.naming.rounds
    return lambda what, part: tell(f"cause {k + 1}: {what}", 0.05 + share * (k + part))


def _unseen(work: Work) -> list[np.ndarray]:
    """Samples that judge, of each run; all where nothing is held out."""
    every = [np.ones(len(run), bool) for run in work.runs]
    if not work.words:
        return every
    return [every[i] if i in work.judges else every[i] & (not work.judges) & ~work.rows[i] for i in range(len(work.runs))]


def _fitted(work: Work, values: dict[str, float], fixed: dict[str, float]) -> Whole:
    """What was found so far, fitted to all that teaches, from these values on."""
    problem = work.problem()
    known = {n.name for n in problem.numbers}
    problem.fixed |= {name: value for name, value in fixed.items() if name in known}
    places = np.array([np.clip(n.place(values.get(n.name, n.start)), 0.0, 1.0) for n in problem.free])
    problem.units = units(problem, problem.values(places))
    end = fit_from(problem, places, RULES.calibrate.effort_start, RULES.calibrate.ended_start)
    return _measured(work, problem, end, problem.values(end.places) | own(problem, work.judges, end))


def _measured(work: Work, problem: Extending, end: End, values: dict[str, float]) -> Whole:
    unseen = _unseen(work)
    taught = [work.rows[i] & (i not in work.judges) for i in range(len(work.runs))]
    which = [i for i, rows in enumerate(unseen) if rows.any()]
    errors = problem.errors(values, which)
    blocks: dict[str, np.ndarray] = {}
    if errors is not None:
        trusted = problem.counted(which, unseen)
        for name, parts in errors.items():
            squares = np.concatenate([e[t] ** 2 for e, t in zip(parts, trusted[name])])
            label = np.concatenate([work.layout.block(i)[t] for i, t in zip(which, trusted[name])])
            blocks[name] = np.stack([np.bincount(label, squares), np.bincount(label)], -1)[np.unique(label)]
    return Whole(problem, end, values, sizes(problem, values, taught), sizes(problem, values, unseen), blocks)


def _helps(after: Whole, before: Whole, kind: str = "") -> bool:
    """Whether some output's error on the data that judge falls by enough; an event's on its own run, where it was."""
    new, old = (after.taught, before.taught) if kind == EVENT else (after.held, before.held)
    if new is None or old is None:
        return new is not None
    return any(new[name] < (1.0 - RULES.judge.help) * old[name] for name in new)
