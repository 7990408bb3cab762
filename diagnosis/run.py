"""From logs and a rig to the named cause: the whole way, step by step."""

from __future__ import annotations

import secrets
from dataclasses import replace
from pathlib import Path
from typing import Callable, Sequence

import numpy as np
from scipy.stats import norm
from threadpoolctl import threadpool_limits

from . import advice
from . import blocks as division
from .bench import Bench
from .candidate import Candidate
from .check import Fault, check
from .depends import QUIET, Dependence, depends
from .errors import DataError
from .gain import blame, improvement, measure
from .laws import check_names
from .log import Run, read
from .result import Cause, Diagnosis
from .rig import Rig, load
from .select import Contest, Outcome
from .stage import LATE
from .step import finest, to_blame

ENOUGH = 0.55
"""Share of the error above the noise floor that causes must close while something significant remains; else `unknown`."""

MANY, MUCH = 3, 0.35
"""So many causes, none of which takes this share of the error, nor the first as much as those after it: guesses."""

AHEAD = 0.05
"""Share of the error by which a free function of one variable, which may bend as it likes, must be better than causes."""

STILL = 0.2
"""Share of what causes leave that goes with a variable as strongly as if they had not touched it."""

HELP = 0.05
"""Share of the held-out error that causes must take away."""

EXCESS = 1.6
"""Error in units of the noise from which on something is missing, whether or not anything is seen to go with it."""


@threadpool_limits.wrap(limits=1)  # the contest has threads of its own: BLAS's beside them only cost
def diagnose(rig: str | Path | Rig, logs: Sequence[str | Path], test: Sequence[str | Path] = (), out: str | Path | None = "out/diagnosis",
             progress: bool | Callable[[str, float], None] = False, seed: int | None = None) -> Diagnosis:
    """Name what the simulation of `rig` gets wrong on `logs`, extend it, measure the gain on `test` or on held-out blocks.

    out: folder for diagnosis.json, report.html, figures and the extended FMUs; None writes nothing.
    progress: True draws a bar; a function is called with what is being done and how much of it is.
    seed: of the draws that measure chance; drawn when not given, and kept in the result.
    """
    rig = rig if isinstance(rig, Rig) else load(rig)
    if rig.system is not None:
        from .system import diagnose_system

        with _teller(progress) as tell:
            return diagnose_system(rig, logs, test, Path(out) if out else None, tell, secrets.randbits(32) if seed is None else seed)
    check_names(rig)
    with _teller(progress) as tell:
        tell("reading", 0.0)
        runs, faults, held = gather(rig, logs, test)
        return _diagnose(rig, runs, faults, held, Path(out) if out else None, tell, secrets.randbits(32) if seed is None else seed)


def gather(rig: Rig, logs: Sequence, test: Sequence) -> tuple[list[Run], list[Fault], list[bool]]:
    """All runs, their faults, and which runs are held out."""
    if not logs:
        raise DataError("give at least one log: selflock diagnose RIG LOG.")
    runs: list[Run] = []
    faults: list[Fault] = []
    held: list[bool] = []
    for path, is_test in [*((p, False) for p in logs), *((p, True) for p in test)]:
        found = read(path, rig)
        faults += check(found, rig)
        runs += found
        held += [is_test] * len(found)
    division.refuse_useless(rig, runs, faults)
    return runs, faults, held


def _diagnose(rig: Rig, runs: list[Run], faults: list[Fault], held: list[bool], out: Path | None, tell, seed: int) -> Diagnosis:
    rng = np.random.default_rng(seed)
    bench = Bench(rig, runs)
    train, names = division.split(bench, runs, held)
    contest = contest_over(bench, runs, held, train, rng, tell)
    outcome = contest.run()
    before = contest.absolute(outcome.base.values) | {k: v for k, v in contest.nominal.items() if k not in outcome.base.values}
    judged = ~train if (~train).any() else train

    def gained(outcome: Outcome):
        after = contest.absolute(outcome.final.values) if outcome.causes else before
        cut = max(bench.cuts, key=lambda c: improvement(bench, c, before, after, train)) if outcome.causes else _main(bench, outcome, contest)
        return after, cut, measure(bench, cut, before, after, judged, names, rng)

    nothing = replace(outcome, causes=[], kept=[], final=outcome.base)
    tell("gain", 0.0)
    after, cut, gain = gained(outcome)
    silent = gain.before < QUIET * gain.noise_floor  # held-out data without the error can refute nothing
    if outcome.causes and not silent and gain.after > (1.0 - HELP) * gain.before:  # what does not help there is no cause
        outcome = nothing
        after, cut, gain = gained(outcome)

    def dependences(values: dict) -> list[Dependence]:
        return depends(bench, bench.residual(values), bench.present(values), values, rng)

    left = dependences(after)
    if outcome.causes and left:
        missing = dependences(before)
        if (gain.closed < ENOUGH and not silent) or _guesses(outcome) or _outdone(bench, before, after, missing, left, len(outcome.causes)):
            outcome, left = nothing, missing or left
            after, cut, gain = gained(outcome)
    final = outcome.final.residual.reshape(contest.shape)
    causes = _causes(contest, outcome)
    verdict = _verdict(causes, left, _excess(contest, outcome))
    step = finest(bench, before, after, judged)
    if step and step.explains and all(d.cut == step.cut for d in left):
        causes, gain = to_blame(step, bench, causes, gain, before, judged, names, rng)
        verdict, left = "ambiguous" if any(c.indistinguishable_from for c in causes) else "explained", []
    base = outcome.base.residual.reshape(contest.shape)
    shares = [] if verdict == "none" else blame(contest.bench, base, final, contest.present, outcome.causes)
    remainder = {"significant": bool(left), "depends_on": list(dict.fromkeys(d.variable for d in left))}
    result = Diagnosis(verdict, [fault.row() for fault in faults], shares, causes, gain, remainder, step=step)
    result.extension["seed"] = seed
    if out is not None:
        out.mkdir(parents=True, exist_ok=True)
        from .extend import extend
        from .report import write

        result.folder = out
        if verdict in ("explained", "ambiguous") and outcome.causes:
            tell("extended FMUs", 0.0)
            result.extension |= extend(bench, cut, before, after, judged, out, [c.hypothesis for c in outcome.causes])
        result.write(out)
        tell("report", 0.0)
        write(result, bench, contest, outcome, cut, before, after, train, left, faults, out)
    return result


def contest_over(bench: Bench, runs: list[Run], held: list[bool], train: np.ndarray, rng, tell=lambda *_: None, kind=Contest) -> Contest:
    """The contest on what teaches: whole runs where others are held out, else the blocks to train on."""
    apart = any(held) and not bench.steady
    taught = Bench(bench.rig, [run for run, h in zip(runs, held) if not (apart and h)], sampled=True)
    return kind(taught, np.ones(taught.blocks, bool) if apart else train, rng, tell)


def _main(bench: Bench, outcome: Outcome, contest: Contest):
    """The cut that is off most; the gear's where none is."""
    r = outcome.base.residual.reshape(contest.shape)
    off = {c.name: np.sqrt(np.mean(r[:, contest.bench.slice(c)] ** 2)) > 1.3 for c in contest.bench.cuts}
    return max(bench.cuts, key=lambda c: (off[c.name], c.name.endswith("gear")))


def _excess(contest: Contest, outcome: Outcome) -> float:
    """What the final simulation leaves in the cut where it leaves most, in units of the noise."""
    r = np.where(contest.present, outcome.final.residual.reshape(contest.shape), np.nan)
    return max(float(np.sqrt(np.nanmean(r[:, contest.bench.slice(cut)] ** 2))) for cut in contest.bench.cuts)


def _guesses(outcome: Outcome) -> bool:
    """Whether many causes take a little of the error each, as guesses at something that is none of them do."""
    drops = [c.drop for c in outcome.causes]
    return len(drops) >= MANY and max(drops) < MUCH and drops[0] < sum(drops[1:])


def _outdone(bench: Bench, before: dict, after: dict, missing: list[Dependence], left: list[Dependence], causes: int) -> bool:
    """Whether a free function of one variable explains more than all causes together, and what these leave still goes with it.

    Not asked of steady-state points, which are too few to tell a law from a free function.
    """
    if bench.steady:
        return False
    energies = np.stack([(bench.residual(values) ** 2).sum(0) for values in (before, after)])
    for d in missing:
        cut = next(cut for cut in bench.cuts if cut.name == d.cut)
        if d.variable == cut.output.rpartition(".")[2]:  # a reading that goes with itself, as a coarse one does
            continue
        was, now = energies[:, bench.slice(cut)].sum(1)
        better = d.share > 1.0 - now / max(was, 1e-300) + (AHEAD if causes < MANY else 0.0)
        if better and any((e.variable, e.cut) == (d.variable, d.cut) and e.share >= STILL for e in left):
            return True
    return False


def _verdict(causes: list[Cause], left: list[Dependence], excess: float) -> str:
    """Nothing is missing only where what is left is noise."""
    if not causes:
        return "unknown" if left or excess > EXCESS else "none"
    return "ambiguous" if any(c.indistinguishable_from for c in causes) else "explained"


def _causes(contest: Contest, outcome: Outcome) -> list[Cause]:
    """Named causes with the values of the final fit of all of them."""
    if not outcome.causes:
        return []
    intervals = outcome.final.intervals(contest.rows, contest.blocks)
    values = contest.absolute(outcome.final.values)
    found = []
    for candidate, stage in zip(outcome.causes, outcome.kept):
        parameters = {}
        for p in candidate.free:
            low, high = intervals[p.name]
            if p.name.endswith(LATE):  # where within a sample something happened no log tells
                step = float(np.median(np.concatenate([ch.dt for ch in contest.bench.channels.values()])))
                low = max(p.low, min(low, outcome.final.values[p.name] - step))
                high = min(p.high, max(high, outcome.final.values[p.name] + step))
            shift = values[p.name] - outcome.final.values[p.name]
            determined = high - low < min(0.9 * (p.high - p.low), 4.0 * max(abs(outcome.final.values[p.name]), 1e-300))
            parameters[p.name] = {"value": values[p.name], "low": low + shift, "high": high + shift, "unit": p.unit, "determined": bool(determined)}
        rivals = [c.hypothesis.label for c in stage.tied]
        h = candidate.hypothesis
        found.append(Cause(h.component if h.component != "sensor" else "sensor", h.effect, parameters, _confidence(candidate, stage.candidates, stage.tied),
                           rivals, advice.separate(h, [c.hypothesis for c in stage.tied]), h.channel))
    return found


def _confidence(winner: Candidate, candidates: list[Candidate], tied: list[Candidate]) -> float:
    """That chance is not it, and that no rival but those named with it is better: over training blocks."""
    confidence = 1.0 - winner.chance
    for rival in candidates:
        if rival.fit is None or rival is winner or any(rival is t for t in tied) or len(rival.free) > len(winner.free):
            continue
        difference = rival.errors - winner.errors
        spread = difference.std(ddof=1) / np.sqrt(len(difference)) if len(difference) > 1 else 1.0
        confidence = min(confidence, float(norm.cdf(difference.mean() / max(spread, 1e-300))))
    return round(confidence / (1 + len(tied)), 4)


class _teller:
    """Progress: nothing, a function of the caller's, or a bar."""

    def __init__(self, progress):
        self.progress = progress

    def __enter__(self):
        if callable(self.progress):
            return self.progress
        if not self.progress:
            return lambda *_: None
        from rich.progress import BarColumn, Progress, TextColumn, TimeElapsedColumn

        self.bar = Progress(TextColumn("{task.description:32}"), BarColumn(), TimeElapsedColumn(), transient=True)
        self.bar.start()
        task = self.bar.add_task("", total=1.0)
        return lambda what, share: self.bar.update(task, description=what, completed=share)

    def __exit__(self, *_):
        if hasattr(self, "bar"):
            self.bar.stop()
