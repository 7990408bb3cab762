"""What the outcome of a search is worth on data that it did not see: believed, or dropped for what else is missing."""

from __future__ import annotations

from dataclasses import dataclass, field, replace

import numpy as np

from selflock.fmus.effect import LATE

from ..residuals.experiment import Experiment
from ..residuals.mending import Mending, excess, most_mended, sizes
from ..residuals.phase import name, parameter
from ..residuals.residual import Residual
from ..rules import RULES
from ..search.candidate import Candidate, amount, pressed, worse
from ..search.fit import Fit
from ..search.freely import free_laws
from ..search.hypotheses import Free
from ..search.problem import Problem
from ..search.selection import Selection
from ..search.starts import collinear
from ..search.step import CHANCE
from . import advice
from .cause import Cause, doubts, weakening
from .depends import Dependence, depends
from .gain import Gain, measure
from .likely import confidence


@dataclass
class Judgement:
    """An outcome, without its causes where they were dropped, and what it brings."""

    outcome: Selection
    mending: Mending  # of the residual in which the gain is told: nominal, what is uncertain refitted; with the causes
    gain: Gain
    left: list[Dependence]  # with what the remainder goes
    free: list[Candidate] = field(default_factory=list)  # of a whole drive in which something is left, rivals of its causes
    dropped: Judgement | None = None  # with the causes that are not believed
    why: str = ""  # not

    @property
    def closes(self) -> str:
        """How much the causes close and that something is left, as a sentence without its subject."""
        return f"it closes {100 * self.gain.closed:.0f} % of the error above the noise floor, and what it leaves is no noise"

    @property
    def reserve(self) -> str:
        """What makes all causes of a whole drive weak, as a sentence; "" where nothing does."""
        if not (
            self.left and self.outcome.causes and self.gain.closed < RULES.judge.nearly and self.mending.residual.kind == "whole"
        ):
            return ""
        return self.closes


class Judge:
    """The data that judge: `judged` blocks, called `names`, of the whole `experiment`; `train` are those of the search."""

    def __init__(self, experiment: Experiment, train: np.ndarray, judged: np.ndarray, names: list[str], rng: np.random.Generator):
        self.experiment, self.rng = experiment, rng
        self.train, self.judged, self.names = train, judged, names

    def judge(self, outcome: Selection) -> Judgement:
        """Causes that do not help, that leave too much, or that a free function of one variable outdoes are dropped.

        What comes after the first is dropped one by one, the last first; else all are guesses.
        """
        problem, base = outcome.problem, outcome.base
        while len(outcome.causes) > 1 and (fewer := self._refuted(outcome)):
            outcome = fewer
        before = self._everywhere(problem, base) | {k: v for k, v in problem.nominal.items() if k not in base.values}
        nothing = replace(outcome, causes=[], kept=[], final=base)
        found = self._gained(outcome, before)
        # held-out data without the error can refute nothing
        silent = found.gain.before < RULES.judge.quiet * found.gain.noise_floor
        was, now, _ = self._levels(problem, base, outcome.final, found.mending) if outcome.causes else (0.0, 0.0, 0.0)
        if outcome.causes and not silent and now > (1.0 - RULES.judge.help) * was:
            why = f"it lowers the error of held-out data by less than {100 * RULES.judge.help:.0f} %"
            found = replace(self._gained(nothing, before), dropped=found, why=why)
        faint = self.experiment.by_channel and problem.excess(base.values).max() <= RULES.search.natural
        if found.outcome.causes and faint and not silent and found.gain.closed < RULES.search.closes:
            why = f"there is little to explain, and it closes {100 * found.gain.closed:.0f} % of that in held-out data"
            found = replace(self._gained(nothing, before), dropped=found, why=why)
        found.left = self._dependences(found.mending.after, found.mending.before if found.outcome.causes else None)
        remains = bool(found.left) or self._far_off(found)
        if remains and self.experiment.by_channel and outcome.stages:
            found.free = free_laws(outcome.searched, outcome.stages[0].base.fitted)
        if found.outcome.causes and remains:
            missing = self._dependences(before)
            why = self._doubted(found, missing, silent)
            if why:
                found = replace(
                    self._gained(nothing, before), left=missing or found.left, free=found.free, dropped=found, why=why
                )
        if not outcome.causes and not (self.experiment.by_channel or self.experiment.steady):
            found.left = _beyond_noise(found.left, problem, base)
        if not found.outcome.causes:
            found.left = [*_goes_with(found.free, outcome), *found.left]
        return found

    def _doubted(self, found: Judgement, missing: list[Dependence], silent: bool) -> str:
        """Why causes are not believed where something is left, as a sentence without its subject; "" where they are."""
        if (found.gain.closed < RULES.judge.enough or self._half_told(found)) and not silent:
            return found.closes
        if _guesses(found.outcome):
            return "several causes that take a little each are guesses"
        if why := next((why for law in found.free if (why := _ahead(law, found.outcome))), ""):
            return why
        if self.experiment.by_channel:  # a function of one channel's error is no rival of what goes through the whole loop
            return ""
        if self._stands_there(found, missing):
            return f"the error goes most with the {missing[0].variable}, and what it leaves still does"
        return "a free function of one variable explains more" if self._outdone(found, missing) else ""

    def closest(self, found: Judgement) -> tuple[Judgement, str] | None:
        """The best that the search has where nothing is believed: causes that were dropped, or what does best on blocks that it did not see; and why it is not believed.

        None where it does not lower the error of the data that judge either.
        """
        best, why, outcome = found.dropped, found.why, found.outcome
        if best is None:
            first = outcome.stages[0]
            fitted = [c for c in first.candidates if c.fit and c.doubt]  # best first; what beats chance before what does not
            if not fitted:
                return None
            candidate = next((c for c in fitted if c.doubt != CHANCE), fitted[0])
            final = outcome.problem.fit(candidate.fitted.free, dict(candidate.fitted.values), effort=8)
            best = self._gained(replace(outcome, causes=[candidate], kept=[first], final=final), found.mending.before)
            why = candidate.doubt
        return (best, why) if best.gain.after < best.gain.before else None

    def _refuted(self, outcome: Selection) -> Selection | None:
        """The outcome without the cause found last, where that lowers no error of the data that judge."""
        experiment, rest, problem = self.experiment, outcome.causes[:-1], outcome.problem
        without = problem.with_these(rest, outcome.final)
        old, new = (self._everywhere(problem, fit) for fit in (without, outcome.final))
        residual = most_mended(experiment, old, new, self.train)
        was, now, noise = self._levels(problem, without, outcome.final, Mending(experiment, residual, old, new, self.judged))
        silent = was < RULES.judge.quiet * noise  # data without the error can refute nothing
        if silent or now <= (1.0 - RULES.search.shows) * was:
            return None
        kept = outcome.kept[:-1]
        return replace(outcome, causes=rest, kept=kept, final=without, standing=kept[-1].winner)

    def _everywhere(self, problem: Problem, fit: Fit) -> dict:
        """Values of a fit as the laws have them, for all runs: what belongs to a run is found for those that judge, too."""
        return problem.settled(self.experiment, problem.absolute(fit.values), fit.free)

    def _levels(self, problem: Problem, before: Fit, after: Fit, mending: Mending) -> tuple[float, float, float]:
        """Error before and after, and noise, in what judges.

        What belongs to a run that judges is found on every second block and judged on the others, then the other way round.
        """
        experiment, fits = self.experiment, (before, after)
        if [mending.before, mending.after] == [problem.absolute(fit.values) for fit in fits]:
            return mending.levels()
        odd, found = np.arange(experiment.layout.count) % 2 == 1, []
        for half in (odd, ~odd):
            old, new = (problem.settled(experiment, problem.absolute(fit.values), fit.free, ~half) for fit in fits)
            found.append(Mending(experiment, mending.residual, old, new, self.judged & half).levels())
        was, now, noise = np.sqrt(np.mean(np.square(found), axis=0))
        return float(was), float(now), float(noise)

    def _gained(self, outcome: Selection, before: dict) -> Judgement:
        experiment, after = self.experiment, before
        if outcome.causes:
            after = self._everywhere(outcome.problem, outcome.final)
            residual = most_mended(experiment, before, after, self.train)
        else:
            residual = self._most_off(outcome)
        mending = Mending(experiment, residual, before, after, self.judged)
        return Judgement(outcome, mending, measure(mending, self.names, self.rng), [])

    def _dependences(self, values: dict, without: dict | None = None) -> list[Dependence]:
        """With what goes what these values leave; `without` the causes that they hold."""
        experiment = self.experiment
        found = depends(experiment, experiment.misfit(values), experiment.present(values), values, self.rng)
        if experiment.by_channel:  # what averages of many samples show no formula has
            off = excess(experiment, values, np.ones(experiment.layout.count, bool), without) > RULES.judge.excess
            found = [d for d in found if off[experiment.residuals.index(self._residual(d))]]
        return found

    def _far_off(self, found: Judgement) -> bool:
        """Whether something is missing beside the causes of a whole drive in what judges, whether or not anything is seen to go with it.

        As where there are none: else what closes little of an error would be all of its cause where that goes with nothing. Of what
        closes little no more is left, in the comparison that it mends most, than a law of the right name leaves.
        """
        if not (self.experiment.by_channel and found.outcome.causes):
            return False
        after, without = found.mending.after, found.mending.before
        return self._half_told(found) or bool(excess(self.experiment, after, self.judged, without).max() > RULES.judge.excess)

    def _half_told(self, found: Judgement) -> bool:
        """Whether causes of a whole drive leave more than a law of the right name does, and close less of the error than such a law does."""
        gain = found.gain
        off = gain.after > RULES.search.natural * gain.noise_floor
        return self.experiment.by_channel and off and gain.closed < RULES.judge.enough_of_whole

    def _most_off(self, outcome: Selection) -> Residual:
        """The residual that is off most; the gear's where none is."""
        off = {name: size if size > RULES.judge.off else 0.0 for name, size in _sizes(outcome.problem, outcome.base).items()}
        return max(self.experiment.residuals, key=lambda c: (off[c.name], c.kind == "gear"))

    def _residual(self, dependence: Dependence) -> Residual:
        return next(residual for residual in self.experiment.residuals if residual.name == dependence.residual)

    def _stands_there(self, found: Judgement, missing: list[Dependence]) -> bool:
        """Whether the error goes most with a place, and what causes leave of it still does: a stop, or an obstacle.

        The error of an angle says nothing of it: where a loop holds an angle under a load, it goes with itself.
        """
        most = lambda dependences: [(d.variable, d.residual) for d in dependences[:1]]
        return (
            found.gain.closed < RULES.judge.nearly
            and most(missing) == most(found.left)
            and missing[0].variable in ("position", "output position")
            and "angle" not in self._residual(missing[0]).reading
        )

    def _outdone(self, found: Judgement, missing: list[Dependence]) -> bool:
        """Whether a free function of a variable explains more than all causes, and what these leave still goes with it.

        Of many causes half of the error is enough: they have bent to it with as many numbers as a free function has.
        Not asked of steady-state points, which are too few to tell a law from a free function.
        """
        experiment, rules = self.experiment, RULES.judge
        if experiment.steady:
            return False
        r, left = experiment.misfit(found.mending.before), experiment.misfit(found.mending.after)
        energies = np.stack([(x**2).sum(0) for x in (r, left, left - r)])
        many = len(found.outcome.causes) >= rules.many
        for d in missing:
            residual = self._residual(d)
            if d.variable == residual.reading:  # it goes with itself, as a coarse one does
                continue
            was, now, moved = energies[:, experiment.slice(residual)].sum(1)
            still = any((e.variable, e.residual) == (d.variable, d.residual) and e.share >= rules.still for e in found.left)
            closed = 1.0 - now / max(was, 1e-300)
            claimed = moved > rules.ahead * was  # of a residual that the causes leave alone they say nothing
            if claimed and still and d.share > (min(closed, rules.half) if many else closed + rules.ahead):
                return True
        return False


def _ahead(law: Candidate, outcome: Selection) -> str:
    """Why a free law of a whole drive speaks against the causes, as a sentence without its subject; "" where it does not.

    It does where it predicts more of unseen blocks. One of a variable over which a cause acts itself may: nature's formula is
    not the cause's. Then the cause must explain much of what the free law does.
    """
    without, named = outcome.stages[0].base, outcome.standing
    if named is None or not worse(named, law, outcome.stages[-1].chance_level):
        return ""
    most = float((without.errors - law.errors).mean())
    share = float((without.errors - named.errors).mean()) / max(most, 1e-300)
    own = any(law.hypothesis.shown_over == cause.hypothesis.shown_over for cause in outcome.causes)
    if share >= (RULES.judge.formula if own else 1.0 - RULES.judge.ahead):
        return ""
    return f"it explains {100 * max(share, 0.0):.0f} % of what a {law.hypothesis.effect} does, which bends as the log asks"


def _goes_with(free: list[Candidate], outcome: Selection) -> list[Dependence]:
    """With what goes what is missing in a whole drive: the variable of the free law that predicts most of it."""
    if not free:
        return []
    best, (base, problem) = free[0], (outcome.stages[0].base, outcome.searched)
    level = outcome.stages[0].chance_level
    if not worse(base, best, level if np.isfinite(level) else 0.0):
        return []
    drop = (base.losses - best.losses).mean(0)
    share = float(drop.sum() / max(base.errors.mean(), 1e-300))
    if share < RULES.judge.half:
        return []
    return [Dependence(best.hypothesis.shown_over, problem.experiment.residuals[int(drop.argmax())].name, share, 0.0)]


def _beyond_noise(left: list[Dependence], problem: Problem, base: Fit) -> list[Dependence]:
    """Where no cause beat chance: what is left of residuals that are more than their noise, that of their inputs too.

    What the inputs are uncertain by, and by how little one is read after another, goes with what is computed of them.
    """
    off = _sizes(problem, base)
    return [d for d in left if off[d.residual] > RULES.judge.quiet]


def _guesses(outcome: Selection) -> bool:
    """Whether many causes take a little of the error each, as guesses at something that is none of them do."""
    drops = [c.drop for c in outcome.causes]
    return len(drops) >= RULES.judge.many and max(drops) < RULES.judge.much and drops[0] < sum(drops[1:])


def verdict(causes: list[Cause], left: list[Dependence], outcome: Selection) -> str:
    """Nothing is missing only where what is left is noise."""
    if causes:
        return "ambiguous" if any(c.indistinguishable_from for c in causes) else "explained"
    problem, final = outcome.problem, outcome.final
    off = problem.excess(final.values).max() if problem.by_channel else max(_sizes(problem, final).values())
    return "unknown" if left or off > RULES.judge.excess else "none"


def _sizes(problem: Problem, fit: Fit) -> dict[str, float]:
    return sizes(problem.experiment, fit.misfit.reshape(problem.shape), problem.present)


def named(outcome: Selection) -> list[Cause]:
    """Named causes with the values of the final fit of all of them."""
    if not outcome.causes:
        return []
    problem = outcome.problem
    intervals = outcome.final.intervals(problem.rows, problem.blocks)
    values = problem.absolute(outcome.final.values)
    step, (of_range, of_value) = problem.experiment.step, RULES.judge.determined
    together_with, ended = collinear(outcome.final, problem.rows), ended_in_base(outcome)
    found = []
    for candidate, stage in zip(outcome.causes, outcome.kept):
        parameters, spans = {}, {p.name: intervals[p.name] for p in candidate.free}
        for p in candidate.free:
            fitted = outcome.final.values[p.name]
            if p.role in LATE:  # where within a sample something happened no log tells
                low, high = spans[p.name]
                spans[p.name] = max(p.low, min(low, fitted - step)), min(p.high, max(high, fitted + step))
        doubted = doubts(candidate.free, outcome.final.values, spans)
        for p in candidate.free:
            fitted, (low, high) = outcome.final.values[p.name], spans[p.name]
            shift = values[p.name] - fitted
            parameters[p.name] = {
                "value": values[p.name],
                "low": low + shift,
                "high": high + shift,
                "unit": p.unit,
                "determined": bool(high - low < min(of_range * (p.high - p.low), of_value * max(abs(fitted), 1e-300))),
                "doubt": doubted.get(p.name, ""),
            }
        h, rivals = candidate.hypothesis, [c.hypothesis for c in stage.tied]
        sure, together, closest = confidence(candidate, stage, outcome.searched)
        amounts = [p.name for p in candidate.free if amount(p)]
        known = (
            {other for name in amounts for other in together_with.get(name, ())} if all(n in doubted for n in amounts) else set()
        )
        narrow = [p for p in ended if p.name in known]
        found.append(
            Cause(
                h.component,
                h.effect,
                parameters,
                sure,
                [rival.label for rival in rivals] + [advice.beyond(p) for p in narrow],
                " ".join(filter(None, [advice.separate(h, rivals), advice.widen(narrow)])),
                h.channel,
                weakening(candidate.free, doubted),
                closest,
                together,
            )
        )
    return found


def ended_in_base(outcome: Selection) -> list[Free]:
    """Uncertain values that ended where their ranges do before anything was found, but for 0: what is missing may be more of them."""
    values = outcome.base.values
    felt = [(p, values[p.name]) for p in outcome.problem.asked if p.name in values]
    return [p for p, value in felt if pressed(p, value) and (p.high if p.high - value < value - p.low else p.low) != 0.0]


def of_runs(found: Judgement) -> list[dict]:
    """What belongs to each run, fitted; or as it was found for a run that judges, without an interval."""
    outcome, (experiment, after) = found.outcome, (found.mending.experiment, found.mending.after)
    intervals = outcome.final.intervals(outcome.problem.rows, outcome.problem.blocks)
    rows = []
    for whose in dict.fromkeys(parameter(p.name) for p in outcome.final.free if p.of_run or p.part):
        for run in experiment.runs:
            fitted = next((n for n in (name(run, whose), whose) if n in after), "")
            if fitted and whose not in experiment.rig.of_log(run.log):
                low, high = intervals.get(fitted, (None, None))
                row = {"log": run.log, "run": run.name, "parameter": whose, "value": after[fitted], "low": low, "high": high}
                rows.append(row)
    return rows
