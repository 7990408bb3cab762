"""From logs and a rig to the named cause: the whole way, step by step."""

from __future__ import annotations

import secrets
from collections.abc import Callable, Sequence
from pathlib import Path

import numpy as np
from threadpoolctl import threadpool_limits

from . import blocks as division
from .bench import Bench
from .check import Fault, check
from .errors import DataError
from .gain import blame
from .laws import check_names
from .log import Run, read
from .result import Diagnosis
from .rig import Rig, load
from .select import Contest
from .step import finest, to_blame
from .verdict import Judge, named, verdict


@threadpool_limits.wrap(limits=1)  # the contest has threads of its own: BLAS's beside them only cost
def diagnose(
    rig: str | Path | Rig,
    logs: Sequence[str | Path],
    test: Sequence[str | Path] = (),
    out: str | Path | None = "out/diagnosis",
    progress: bool | Callable[[str, float], None] = False,
    seed: int | None = None,
) -> Diagnosis:
    """Name what the simulation of `rig` gets wrong on `logs`, extend it, measure the gain on `test` or held-out blocks.

    out: folder for diagnosis.json, report.html, figures and the extended FMUs; None writes nothing.
    progress: True draws a bar; a function is called with what is being done and how much of it is.
    seed: of the draws that measure chance; drawn when not given, and kept in the result.
    """
    rig = rig if isinstance(rig, Rig) else load(rig)
    out = Path(out) if out else None
    seed = secrets.randbits(32) if seed is None else seed
    with _teller(progress) as tell:
        if rig.system is not None:
            from .system import diagnose_system

            return diagnose_system(rig, logs, test, out, tell, seed)
        check_names(rig)
        tell("reading", 0.0)
        return diagnose_runs(rig, *gather(rig, logs, test), out, tell, seed)


def gather(rig: Rig, logs: Sequence, test: Sequence) -> tuple[list[Run], list[Fault], list[bool]]:
    """All runs, their faults, and which runs are held out."""
    if not logs:
        raise DataError("give at least one log: selflock diagnose RIG LOG.")
    given = [Path(path).resolve() for path in (*logs, *test)]
    for path in given:
        if given.count(path) > 1:
            raise DataError(
                f"{path}: is given twice. What judges must not have taught: give each log once, to learn from or as --test."
            )
    runs: list[Run] = []
    faults: list[Fault] = []
    held: list[bool] = []
    for path, is_test in [*((p, False) for p in logs), *((p, True) for p in test)]:
        found = read(path, rig)
        faults += check(found, rig)
        runs += found
        held += [is_test] * len(found)
    _refuse_unlike(runs)
    division.refuse_useless(rig, runs, faults)
    return runs, faults, held


def _refuse_unlike(runs: list[Run]) -> None:
    """Logs of which one has a channel that another has not: then other comparisons would be made of each."""
    first = runs[0]
    for run in runs[1:]:
        for name in sorted(set(first.signals) ^ set(run.signals)):
            having, lacking = (first, run) if name in first.signals else (run, first)
            raise DataError(
                f"{lacking.log}: there is no column {name!r}, which {having.log} has. Give logs with the same columns."
            )


def diagnose_runs(
    rig: Rig, runs: list[Run], faults: list[Fault], held: list[bool], out: Path | None, tell: Callable, seed: int,
    blamed: list[dict] | None = None,
) -> Diagnosis:  # fmt: skip
    """The diagnosis of runs that are read and checked. held: which of them judge.

    blamed: the blame, where a whole of which this is a part has told it; then a cause is written, and nothing else is.
    """
    rng = np.random.default_rng(seed)
    bench = Bench(rig, runs)
    train, names = division.split(bench, runs, held)
    if out is not None:
        out.mkdir(parents=True, exist_ok=True)  # a place that cannot be used is told before the work, not after it
    judged = ~train
    contest = contest_over(bench, runs, held, train, rng, tell)
    outcome = contest.run()
    tell("gain", 0.0)
    found = Judge(bench, contest, train, judged, names, rng).judge(outcome)
    step, coarse, by_step = finest(bench, found.before, found.after, judged), [], ""
    if step and step.explains and all(d.cut == step.cut for d in found.left):
        found, cause = to_blame(step, bench, found, judged, names, rng)
        coarse, by_step = [cause], step.cut
    before, after, left = found.before, found.after, found.left
    causes = named(contest, found.outcome) + coarse
    answer = verdict(causes, left, contest, found.outcome)
    shares = blamed
    if shares is None:
        base = found.outcome.base.residual.reshape(contest.shape)
        shares = [] if answer == "none" else blame(contest.bench, base, contest.present, found.outcome.causes, by_step)
    remainder = {"significant": bool(left), "depends_on": list(dict.fromkeys(d.variable for d in left))}
    result = Diagnosis(answer, [fault.row() for fault in faults], shares, causes, found.gain, remainder, step=step)
    result.extension["seed"] = seed
    if out is not None and (causes or blamed is None):
        from .extend import extend
        from .report import write

        result.folder = out
        if answer in ("explained", "ambiguous") and found.outcome.causes:
            tell("extended FMUs", 0.0)
            effects = [c.hypothesis for c in found.outcome.causes]
            result.extension |= extend(bench, found.cut, before, after, judged, out, effects)
        result.write(out)
        tell("report", 0.0)
        write(result, bench, contest, found.outcome, found.cut, before, after, train, left, faults, out)
    return result


def contest_over(
    bench: Bench, runs: list[Run], held: list[bool], train: np.ndarray, rng, tell=lambda *_: None, kind=Contest
) -> Contest:
    """The contest on what teaches: whole runs where others are held out, else the blocks to train on."""
    apart = any(held) and not bench.steady
    taught = Bench(bench.rig, [run for run, h in zip(runs, held) if not (apart and h)], sampled=True)
    return kind(taught, np.ones(taught.blocks, bool) if apart else train, rng, tell)


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
