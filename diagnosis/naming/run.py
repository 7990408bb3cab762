"""From rig and logs to what the system lacks: the base fitted, rivals held against it, the best named, the system extended."""

from __future__ import annotations

import os
import time
from collections.abc import Callable, Sequence
from contextlib import ExitStack
from dataclasses import dataclass, field, replace
from functools import partial, reduce
from pathlib import Path
from typing import cast

import numpy as np

from ..calibration import told
from ..calibration.fit import End, fit, fit_from, remaining
from ..calibration.gaps import as_fed
from ..calibration.heard import heard, sentences
from ..calibration.numbers import Number, of_rig
from ..calibration.run import division, here, reached, sizes
from ..calibration.slopes import Forward
from ..data.rig import SMOOTH, Rig
from ..errors import DataError
from ..pipeline.run import gather
from ..residuals.blocks import Blocks
from ..rules import RULES
from ..search.kept import Kept
from ..systems.system import prepare
from .answer import told_of
from .asked import confirmed, leaves_less, told_apart
from .contest import Contest
from .extend import extend
from .extended import Extended, Extending
from .guesses import CURVE, KINDS, PARAMETER, begins
from .instead import curve_instead, one_alone
from .limit import Limit
from .notes import at_once, beyond
from .order import beside
from .outcome import Naming
from .page import write
from .round import Round
from .rows import followed, read_late, told_early, told_late
from .sampled import sampled
from .steps import Model, around, fine_enough, in_own_steps, in_vanishing, released, widened
from .whole import Whole, falls, fitted, helps, measured
from .work import Work, heads, later, without

PREFIX = "correction"


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
    enough: Limit | None = None,
) -> Naming:
    """The naming of what a rig's system lacks, as `calls.name` tells it. enough: whether time is up for looking further."""
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
    runs, faults, behind = as_fed(rig, parts, runs, numbers, faults)
    if out is not None:
        out.mkdir(parents=True, exist_ok=True)
    layout = Blocks(runs, False)
    rows = [np.ones(len(run), bool) for run in runs]
    with ExitStack() as opened:
        opened.callback((played := Extended(rig, parts, runs, numbers)).close)
        work = Work(rig, parts, runs, numbers, set(), rows, "", layout, played, parts.system.run.step, kept, opened=opened)
        work.judges, work.rows, work.words = division(work.problem(), held, [layout.block(i) for i in range(len(runs))])
        played.rounded = work.rounded
        enough = enough or Limit()
        found = _searched(work, tell, starts, seed, kinds, enough)
        with enough.answering():
            result = told_of(found, seed)
            result.faults, result.notes = [fault.row() for fault in faults], behind + result.notes
            result.effort["elapsed"] = time.monotonic() - begun
            if out is not None:
                near = lambda path: Path(os.path.relpath(path, out)).as_posix()
                logs_of = [run.source for i, run in enumerate(runs) if run.source and not held[i]]
                result.sources = {"rig": near(rig.path), "logs": list(dict.fromkeys(map(near, logs_of)))}
                tell("report", 0.95)
                extend(result, found.work, found.best, out)
                result.effort["elapsed"] = time.monotonic() - begun
                write(result, found, out)
    return result


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
    enough: Limit  # whether time is up
    stopped: bool = False  # by its time limit

    @property
    def named(self) -> list[Round]:
        """The rounds whose winners stand."""
        return [outcome for outcome in self.outcomes if outcome.winner is not None]

    def explains(self) -> bool:
        """Whether nothing more than noise is left, and that by one cause that has a name, or by none.

        What steps that are too long still leave beside the last of these is no more than noise where its round saw no more.
        """
        named = self.named
        if len(named) > 1 or any(one.winner is not None and one.winner.guess.kind == CURVE for one in named):
            return False
        return self.leaves_noise()

    def leaves_noise(self) -> bool:
        """The same, whatever it is that leaves no more."""
        best = self.best
        if best.taught is None:
            return False
        if self.outcomes and self.outcomes[-1].told:
            return True
        self.work.played.extend(self.work.inserts)
        noise = {name: floor for name, (_, floor) in remaining(best.problem, best.values).items()}
        return all(size <= RULES.search.left * noise[name] for name, size in best.taught.items())


def _searched(work: Work, tell: Callable, starts: int, seed: int, kinds: Sequence[str], enough: Limit) -> Search:
    tell("the base", 0.02)
    notes = _trust(work)
    asked = Asked(tell, np.random.default_rng(seed), kinds, enough, _as_given(work), notes)
    try:
        found = _rows_instead(asked, _causes(asked, work, starts, seed))
    except KeyboardInterrupt:
        if not enough.ends():
            raise
        found = asked.best(work)
    if found.outcomes and (still := found.outcomes[0].still):
        notes.append(f"no law that goes with {', '.join(still)} was asked for: it stands still in what was recorded")
    found.work.played.extend(found.work.inserts)
    notes += beyond(found) + at_once(found)
    if enough.cut:
        found.stopped = True
        count = sum(len(outcome.fitted) for outcome in found.outcomes)
        notes.append(
            f"the time limit came before all was held against the base: this is the best of {count} guesses that were fitted by "
            "then; with a longer one the same command goes on"
        )
    if found.work.step != work.given_step:
        notes.append(
            f"steps of {work.given_step:g} s are too long for this system, by what they leave: {found.work.step:g} s are taken"
        )
    return found


def _causes(asked: Asked, work: Work, starts: int, seed: int) -> Search:
    """The base, and what is found beside it: where an FMU acts once a step first in the steps that leave less, else with it in the rig's own."""
    work, near, places = _fitted_base(asked, work, starts, seed)
    asked.given = _as_given(work)
    work = replace(work, sampled=sampled(near, near.values(places)))
    asked.base = work, near, places
    finer = fine_enough(work, near, places)
    if not work.sampled:
        return _rounds(asked, *finer)
    own = partial(fine_enough, work.keeping(), near, places)
    if finer[0] is work:
        return _rounds(asked, *own())
    left, less = (sizes(problem, problem.values(at), problem.rows) for problem, at in ((near, places), finer[1:]))
    first = finer if (all_finer := falls(less, left) and not falls(left, less)) else own()
    found = _rounds(asked, *first)
    if asked.enough() or found.explains():
        return found
    second = own() if all_finer else finer
    if _as_much(found, *second[:2]):
        return found
    cast(Extended, second[1].played).extend(())
    other = _rounds(asked, *second)
    return _better(other, found) if all_finer else _better(found, other)


def _rows_instead(asked: Asked, found: Search) -> Search:
    """A search beside rows that were read late or early, where that alone leaves no more than all that was found: it is no cause.

    A current that was read a tenth of its row late leads what is simulated, as one that goes with the rate of its voltage.
    """
    if asked.enough() or asked.base is None or (read := read_late(found)) is None:
        return found
    work, base = read
    asked.notes += told_late(work.played.late, found.base, base)
    near = heads(work)
    near.fixed = asked.base[1].fixed
    asked.base = work, near, np.array([np.clip(n.place(base.values[n.name]), 0.0, 1.0) for n in near.free])
    return _rounds(asked, *asked.base)


def _as_much(found: Search, work: Work, near: Extending) -> bool:
    """Whether one curve leaves no more than noise, and in other steps no less: what could have a name there is none of these steps.

    Of a curve in a house all was looked at twice, for it is no name that explains. Two causes may be what wrong steps leave.
    """
    if len(found.named) != 1 or not found.leaves_noise():
        return False
    (winner,) = (outcome.winner for outcome in found.named)
    assert winner is not None
    there = fitted(work.with_also(winner.guess), found.best.values, near.fixed).taught
    return not falls(there, found.best.taught)


def _fitted_base(asked: Asked, work: Work, starts: int, seed: int) -> tuple[Work, Extending, np.ndarray]:
    """The heads of the runs with what the rig sets free fitted to them, where what was read before the step that computes it is compared behind that."""
    near = heads(work)
    if links := heard(near, {n.name: n.start for n in near.numbers}):
        asked.notes += sentences(links)
        near.played.close()
        near = heads(work := work.hearing(links))
    assert isinstance(near.played, Extended)
    places, told_of_base = _base(work, near, near.played, starts, seed)
    asked.notes += told_of_base
    if told := followed(near, near.values(places)):
        work.read_early(told)
        near.played.close()
        near = heads(work)
        assert isinstance(near.played, Extended)
        places, _ = _base(work, near, near.played, starts, seed)
        asked.notes += told_early(told)
    if later(work, near, near.values(places)):
        near.played.close()
        longer = heads(work, RULES.naming.glance_longer)
        longer.fixed = near.fixed
        near = longer
    return work, near, places


def _as_given(work: Work) -> Whole:
    """The system with the numbers that the rig has."""
    return measured(work, work.problem(), End(np.zeros(0), np.zeros(0), np.inf), {n.name: n.start for n in work.numbers})


@dataclass
class Asked:
    """What all searches of a naming have in common, and how far they came."""

    tell: Callable
    rng: np.random.Generator
    kinds: Sequence[str]
    enough: Limit
    given: Whole
    notes: list[str]
    base: tuple[Work, Extending, np.ndarray] | None = None  # fitted to heads, before anything else
    begun: list[Search] = field(default_factory=list)

    def best(self, work: Work) -> Search:
        """Of what was begun before time was up what leaves least; the base where nothing was, as it is given where not even that."""
        if not self.begun and self.base is not None:
            assert isinstance(self.base[1].played, Extended)
            self.base[1].played.extend(())
            _begun(*self.base, self)
        begun = self.begun or [Search(work, self.given, self.given, self.given, [], self.notes, work, self.enough)]
        return reduce(_better, begun)


def _rounds(asked: Asked, work: Work, near: Extending, places: np.ndarray, first: Round | None = None) -> Search:
    """One cause after another beside a base. Steps that hide or feign something are changed once the first is found.

    Where an FMU acts once a step that is asked only if the first leaves something: its period is what the rig says. first: a first
    round that was played, of which one rival alone is asked.
    """
    tell, kinds, enough = asked.tell, asked.kinds, asked.enough
    found, again, before = _begun(work, near, places, asked), 0 if first else RULES.naming.halved, None
    begin = work, near, places
    while len(found.named) < RULES.naming.rounds and len(found.outcomes) < 2 * RULES.naming.rounds:
        k, numbers = len(found.outcomes), near.numbers
        begin = begin if k else (work, near, places)
        prefix, known = PREFIX + (f"_{k + 1}" if k else ""), {n.variable for n in numbers}
        if found.outcomes and (last := found.outcomes[-1].winner) is not None:
            places = in_vanishing(work, near, places, last.values)
        own = in_own_steps(work, near, places)
        if found.outcomes and own.errors(own.values(places)) is None:
            break  # what was found breaks off here: nothing can be looked at beside it
        base = asked.base and asked.base[:2]
        smooth, told = work.rig.inputs == SMOOTH, None if own is near else partial(around, work, near, own)
        steps = partial(released, work, near, base) if k == 0 and again and base else None
        contest = Contest(own, places, prefix, _told(tell, k), smooth, known, kinds, enough, work.sampled, told, steps)
        contest.only, contest.before = found.outcomes[-1].only if found.outcomes else None, before
        outcome = first if first and k == 0 else contest.play(asked.rng)
        if contest.other is not None and contest.asker is not None:
            before = contest.asker.guess, (contest.other[2], contest.asker.values)
            found, work, near, places = _anew(asked, contest.other, numbers)
            again -= 1
            continue
        before = None
        found.outcomes.append(outcome)
        with enough.answering():
            wider = _chosen(found, outcome, near.fixed)
        if wider is None or outcome.winner is None or enough():
            break
        begun, (near, places) = places, widened(near, outcome.winner, wider)
        work = wider
        if not (work.others and found.explains()):
            work, near, places = fine_enough(wider, near, places)
        anew = work is not wider and k == 0 and again
        if anew and told is not None:
            plain = replace(work, inserts=(), found=[], acts={}), without(near, numbers)
            logs = in_own_steps(*plain, begun)
            anew = logs is plain[1] or not contest.stands(outcome, partial(around, *plain, logs), logs)
            cast(Extended, near.played).extend(work.inserts)
        if anew:  # found in steps that hide or feign something, it is looked for anew
            before = outcome.winner.guess, (near.values(places), outcome.winner.values)
            found, work, near, places = _anew(asked, (work, near, found.best.values), numbers)
            again -= 1
            continue
        if work is not wider or _ends_beyond(near, found.best.values, places):
            found.work, found.best = work, fitted(work, near.values(places), near.fixed)
            found.begins = replace(work, inserts=(), found=[], acts={})
            found.base = fitted(found.begins, found.base.values, near.fixed)
            work.played.extend(work.inserts)
        near, places = _needed(found, near, places)
        work = found.work
    if not enough():
        one_alone(found)
        curve_instead(found)
    return found if first else _number_first(found, asked, begin)


def _number_first(found: Search, asked: Asked, begin: tuple[Work, Extending, np.ndarray]) -> Search:
    """A search that leaves more than noise, or what begins with a number of an FMU that is off and leaves none with something beside it.

    Two causes of one size hide each other: what bends as both do together goes before either. A number is the commonest of all.
    """
    if asked.enough() or not found.outcomes or found.leaves_noise():
        return found
    round_ = found.outcomes[0]
    real = [r for r in round_.fitted if r.guess.kind == PARAMETER and r.candidate.chance <= RULES.search.significant]
    real = [r for r in real if all(r is not one.winner for one in found.outcomes)]
    for rival in real:
        cast(Extended, begin[1].played).extend(())
        other = _rounds(asked, *begin, replace(round_, order=[rival], winner=None, beside=[]))
        if len(other.named) > 1 and other.leaves_noise() and not helps(found.best, other.best):
            return other
    found.work.played.extend(found.work.inserts)
    return found


def _ends_beyond(near: Extending, values: dict[str, float], places: np.ndarray) -> bool:
    """Whether a fit to all that teaches ended in a valley from which the search's own, of these places, did not start.

    One of a limit began where coarser steps had it, and ended at a third more than the noise; a curve was believed in its place.
    """
    at = np.array([np.clip(n.place(values.get(n.name, n.start)), 0.0, 1.0) for n in near.free])
    return near.loss(near.misfit(at)) > (1.0 + RULES.search.matters) * near.loss(near.misfit(places))


def _anew(asked: Asked, model: Model, numbers: Sequence[Number]) -> tuple[Search, Work, Extending, np.ndarray]:
    """A search begun anew in the steps of a model with a cause, of which the base's numbers alone are taken, from its values on."""
    wider, near, values = model
    work, near = replace(wider, inserts=(), found=[], acts={}), without(near, numbers)
    places = np.array([np.clip(n.place(values.get(n.name, n.start)), 0.0, 1.0) for n in near.free])
    return _begun(work, near, places, asked), work, near, places


def _better(own: Search, finer: Search) -> Search:
    """Of a search in the rig's own steps and one in finer ones that which leaves less of what judges; else of fewer numbers."""
    more, less = helps(finer.best, own.best), helps(own.best, finer.best)
    count = lambda found: sum(not begins(n) for numbers in found.work.found for n in numbers)
    return finer if (more and not less) or (more == less and count(finer) < count(own)) else own


def _needed(found: Search, near: Extending, places: np.ndarray) -> tuple[Extending, np.ndarray]:
    """The search without what was found earlier and is not needed beside what was found later, by what made it believed then.

    Each cause is found beside what was known by then. One that stood for a part of what was found after it takes nothing away
    any more once that is there: without it, the rest fitted again, the data that judge are told as well.
    """
    for outcome in found.named[:-1]:
        winner = outcome.winner
        assert winner is not None
        fewer = found.work.but_for(winner.guess)
        less = fitted(fewer, found.best.values, near.fixed)
        if leaves_less((found.work, found.best), (fewer, less), winner.guess.kind):
            continue
        winner.candidate.doubt = "beside what was found later it lowers the error of what judges no more"
        outcome.winner, outcome.beside = None, []
        found.work, found.best = fewer, less
        gone = {n.name for n in winner.guess.numbers}
        near = without(near, [n for n in near.numbers if n.name not in gone], fewer.inserts)
        places = np.array([np.clip(n.place(less.values.get(n.name, n.start)), 0.0, 1.0) for n in near.free])
        places = fit_from(near, places, RULES.naming.effort, RULES.naming.ended, Forward).places
    found.work.played.extend(found.work.inserts)
    return near, places


def _begun(work: Work, near: Extending, places: np.ndarray, asked: Asked) -> Search:
    """A search in which nothing was found yet, its base fitted to all that teaches."""
    base = fitted(work, near.values(places), near.fixed)
    asked.begun.append(Search(work, asked.given, base, base, [], asked.notes, work, asked.enough))
    return asked.begun[-1]


def _chosen(found: Search, outcome: Round, fixed: dict[str, float]) -> Work | None:
    """The work with the most believed rival that the data that judge do not refuse; it is the round's winner."""
    outcome.winner = None
    tried = lambda rival: (wider := found.work.with_also(rival.guess), fitted(wider, rival.values, fixed))
    before = [] if found.enough() else confirmed(outcome, found.work, lambda rival: tried(rival)[1])
    asked = before + [one for one in outcome.order if one not in before][: RULES.naming.vetoed]
    for rival in outcome.order[:1] if found.enough() else asked:
        wider, after = tried(rival)
        if helps(after, found.best, rival.guess.kind):
            near = beside(rival, outcome.order, outcome.chance_level, outcome.base.errors.mean())
            rival, wider, after, refuted = told_apart((rival, wider, after), near, tried, found.enough())
            outcome.winner = rival
            outcome.beside = [r for r in near if r is not rival and r not in refuted]
            found.work, found.best = wider, after
            return wider
        rival.candidate.doubt = f"it does not lower the error of what judges by {100 * RULES.judge.help:.0f} %"
    return None


def _trust(work: Work) -> list[str]:
    """Whether FMUs can be reset, seen on the first run that teaches before anything is simulated; what is to be told of it."""
    problem, first = work.problem(), work.which[0]
    origin = np.array([n.place(n.start) for n in problem.free])
    start, middle = (problem.settings(problem.values(at))[first] for at in (origin, np.full(len(origin), 0.5)))
    word = work.played.trust(start, middle, first)
    return [word] if word else []


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
    quiet = told.silent(near, origin) if len(origin) else set()
    near.fixed |= {n.name: n.start for n in near.numbers if n.name in quiet}
    notes = [f"{name} changes nothing that is compared, and keeps its value" for name in sorted(quiet)]
    origin = np.array([n.place(n.start) for n in near.free])
    ends = fit(near, origin, starts if len(origin) else 1, seed, here, lambda what, share: None)
    places = reached(near, ends, "named").places
    if wrong := told.misread(near, {n.name: n.start for n in near.numbers}, near.values(places)):
        raise DataError(f"{near.runs[0].log}: {wrong[0]}.")
    return places, notes


def _told(tell: Callable, k: int) -> Callable[[str, float], None]:
    return lambda what, part: tell(f"cause {k + 1}: {what}", min(0.05 + 0.85 * (k + part) / RULES.naming.rounds, 0.9))
