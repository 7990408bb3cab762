"""From logs and a rig to the named cause: the whole way, step by step."""

from __future__ import annotations

import os
from collections.abc import Callable, Sequence
from dataclasses import replace
from functools import partial
from pathlib import Path

import numpy as np

from selflock.fmus.errors import BuildError

from ..data.faults import DataFault
from ..data.gathered import gathered
from ..data.log import MeasuredRun
from ..data.origin import about
from ..data.rig import Rig
from ..data.sanity import Box
from ..data.signals import VOLTAGES
from ..errors import DataError
from ..judge.gain import blame, comparisons
from ..judge.hunting import as_widely, hunts
from ..judge.models import models, nearest
from ..judge.recorded import recorded
from ..judge.result import Best, Diagnosis
from ..judge.rivals import rivals
from ..judge.time_step import finest, to_blame
from ..judge.together import against, asked, closed_loop, together
from ..judge.verdict import Judge, Judgement, named, of_runs, verdict
from ..output.extend import extend
from ..output.learnt import write_learnt
from ..output.report import write
from ..residuals.drive_experiment import DriveExperiment
from ..residuals.mending import Mending
from ..residuals.whole import PARTED, WHOLE, undescribed
from ..rules import RULES
from ..search.beside import beside_one_another
from ..search.instants import place_acts, place_again, place_jumps, place_ticks
from ..search.kept import Kept
from ..search.problem import Problem
from ..search.reach import told_of_supply, with_supply
from ..search.seen import leaves, places
from ..search.selection import ForwardSelection, Selection
from ..search.starts import correlated, told
from ..search.step import so_far
from ..search.swings import place_shaft, place_swings
from . import hold_out as division
from .in_step import whole_where_described

RECORDED = (
    "its parts on what was measured explain nothing that the whole drive bears out, nor the controller's voltage, which the whole drive "
    "makes as the log has it: the log was not taken in step with its controller"
)

COARSE = "part by part, on measured inputs, the step of the log may be too coarse, and the whole drive is simulated in finer ones"
LATE = (
    "part by part, sensors of several channels seem to lag, as where the command that they all follow acts late, which the whole drive is "
    "asked"
)
HUNTS = (
    "the drive hunts: with these causes it swings by itself, in a phase that no simulation from its set-points shares, "
    "so its parts are compared on what was measured"
)


def gather(rig: Rig, logs: Sequence, test: Sequence) -> tuple[list[MeasuredRun], list[DataFault], list[bool]]:
    """All runs, their faults, and which runs are held out."""
    if not logs:
        raise DataError("give at least one log: selflock diagnose RIG LOG.")
    given = [Path(path).resolve() for path in (*logs, *test)]
    for path in given:
        if given.count(path) > 1:
            raise DataError(
                f"{path}: is given twice. What judges must not have taught: give each log once, to learn from or as --test."
            )
    runs: list[MeasuredRun] = []
    faults: list[DataFault] = []
    held: list[bool] = []
    for path, is_test in [*((p, False) for p in logs), *((p, True) for p in test)]:
        found, told = gathered(path, rig)
        faults += told
        runs += found
        held += [is_test] * len(found)
    _refuse_unlike(runs)
    if rig.kind == "steady" and (points := sum(map(len, runs))) < RULES.data.shortest_log:
        raise DataError(
            f"{logs[0]}: has {points} points, which selflock replay compares; for a cause give {RULES.data.shortest_log} or more, "
            "at more speeds, in both directions or under another load."
        )
    division.refuse_useless(rig, runs, faults)
    return runs, faults, held


def _refuse_unlike(runs: list[MeasuredRun]) -> None:
    """Logs of which one has a channel that another has not: then other comparisons would be made of each."""
    first = runs[0]
    for run in runs[1:]:
        for name in sorted(set(first.signals) ^ set(run.signals)):
            having, lacking = (first, run) if name in first.signals else (run, first)
            raise DataError(
                f"{lacking.log}: there is no column {name!r}, which {having.log} has. Give logs with the same columns."
            )


def diagnose_runs(
    rig: Rig,
    runs: list[MeasuredRun],
    faults: list[DataFault],
    held: list[bool],
    out: Path | None,
    tell: Callable,
    seed: int,
    blamed: list[dict] | None = None,
    sanity: Box | None = None,
    kept: Kept | None = None,
    search: bool = True,
) -> Diagnosis:
    """The diagnosis of runs that are read and checked. held: which of them judge; sanity: what they and the rig say of each other.

    kept: where fits are kept as they end.
    search: for causes; else what is uncertain is fitted, and the answer is "none", or "unknown" where something is missing.
    blamed: the blame, where a whole of which this is a part has told it; then a cause is written, and nothing else is.
    """
    found = _diagnosed(rig, runs, faults, held, out, tell, seed, blamed, sanity, kept, search)
    assert found is not None, "only a second try, part by part, may end without an answer"
    return found


def _diagnosed(
    rig: Rig,
    runs: list[MeasuredRun],
    faults: list[DataFault],
    held: list[bool],
    out: Path | None,
    tell: Callable,
    seed: int,
    blamed: list[dict] | None,
    sanity: Box | None,
    kept: Kept | None,
    search: bool,
    other: tuple[str, str] = ("", ""),
) -> Diagnosis | None:
    """As diagnose_runs. other: how a drive is compared that was compared in another way, which explained nothing, and why.

    Of its parts then None unless their causes, none of them weak, make the whole hunt, and so say why it met no log; of the whole
    None unless it makes the voltage that was logged.
    """
    rng, given, apart = np.random.default_rng(seed), rig, other[0] == PARTED
    again = lambda *way: _diagnosed(given, runs, faults, held, out, tell, seed, blamed, sanity, kept, search, way)
    rig, why = (replace(rig, simulate=other[0]), other[1]) if other[0] else whole_where_described(rig, runs)
    supplied = with_supply(rig, runs)
    box = sanity and replace(sanity, made=(*sanity.made, *told_of_supply(rig, supplied)))
    rig = supplied
    if out is not None:
        out.mkdir(parents=True, exist_ok=True)  # a place that cannot be used is told before the work, not after it
    experiment, train, names, outcome = _searched(rig, runs, held, kept, rng, tell, search)
    judged = ~train
    for problem in (outcome.problem, outcome.searched):
        problem.experiment.forget()
    tell("gain" + so_far([c.hypothesis for c in outcome.causes]), 0.0)
    found = Judge(experiment, train, judged, names, rng).judge(outcome)
    _let_go(experiment, outcome)
    step, coarse, by_step = None, [], ""
    if rig.simulate != WHOLE:  # whose inputs are numbers, and whose steps are its own
        step = finest(experiment, found.mending.before, found.mending.after, judged)
    if step and step.explains and all(d.residual == step.residual for d in found.left):
        found, cause = to_blame(step, experiment, found, judged, names, rng)
        coarse, by_step = [cause], step.residual
    found.outcome = beside_one_another(found.outcome)
    _let_go(experiment, outcome)
    left, problem = found.left, outcome.problem
    causes = named(found.outcome) + coarse
    if found.reserve:
        for cause in causes:
            cause.doubts.append(found.reserve)
    answer = verdict(causes, left, found.outcome)
    shares = blamed
    if shares is None:
        base = found.outcome.base.misfit.reshape(problem.shape)
        shares = [] if answer == "none" else blame(problem.experiment, base, problem.present, found.outcome.causes, by_step)
    remainder = {"significant": bool(left), "depends_on": list(dict.fromkeys(d.variable for d in left))}
    result = Diagnosis(answer, [fault.row() for fault in faults], shares, causes, found.gain, remainder, step=step)
    result.extension["seed"] = seed
    result.about = about(rig, runs, held) | {"searched": search}
    result.sanity = box
    result.recorder = recorded(problem, found.outcome.final, why, given)
    result.correlations = correlated(found.outcome.final, problem.rows)
    result.uncertain = told(found.outcome.final, problem.asked, problem.endings, problem.rows, problem.blocks)
    if apart and not (causes and answer != "unknown" and not any(c.weak for c in causes) and _hunts(experiment, train, found)):
        return None
    if answer == "unknown" and search and rig.simulate == WHOLE != given.simulate and not other[0]:
        experiment.forget()
        if swings := again(PARTED, HUNTS):
            return swings

    def borne_out(mending: Mending) -> list[dict]:
        tell("the whole drive", 0.0)
        return together(experiment, train, judged, mending.before, mending.after)

    by_parts, contrary = asked(rig, experiment) and not apart, ""
    if found.outcome.causes and by_parts:
        result.whole = borne_out(found.mending)
        contrary = against(result.whole) if causes else ""
        if contrary:
            result.verdict = "ambiguous"
            for cause in causes:
                cause.doubts.append(contrary)
    if other[0] == WHOLE and not _voltage_told(outcome.problem, found.outcome.final.values, bool(causes)):
        return None
    too_coarse = any(cause.weak for cause in coarse)  # the whole has steps of its own
    doubted = (
        too_coarse
        or outcome.late_at_once
        or answer == "unknown"
        or result.verdict == "ambiguous"
        and (contrary or all(c.component != "controller" for c in causes))
    )
    if doubted and search and not (rig.simulate or other[0] or undescribed(rig, set(runs[0].signals))):
        if outcome.late_at_once or too_coarse:
            asks = LATE if outcome.late_at_once else COARSE
        elif _voltage_told(outcome.searched, outcome.base.values):
            asks = COARSE if outcome.within_rows else ""
        else:
            asks = RECORDED
        if asks:
            experiment.forget()
            if recorded_so := again(WHOLE, asks):
                return recorded_so
    # with draws of its own: what is written beside the answer does not change it
    beside = Judge(experiment, train, judged, names, np.random.default_rng([seed, 1]))
    extended = found
    if search and answer == "unknown" and (closest := beside.closest(found)):
        extended, doubt = closest
        result.best = Best(named(extended.outcome), extended.gain, doubt)
    if found.outcome.causes:
        result.models = models(found.outcome, [bool(cause.weak) for cause in causes])
    else:
        result.models = nearest(found.outcome, outcome.causes, extended.outcome if extended is not found else None)
    mending = replace(found.mending, experiment=experiment)  # told of all samples, whatever a finer step was told of
    _let_go(experiment, outcome)
    result.comparisons = comparisons(mending, found.gain)
    result.runs = of_runs(extended)
    result.rivals = rivals(found.outcome, np.random.default_rng([seed, 2]), found.free)
    if extended is not found and extended.outcome.causes and by_parts:
        result.whole = borne_out(extended.mending)
    if out is not None and (causes or blamed is None):
        result.folder = out
        result.sources = _sources(rig, runs, held, out)
        if extended.outcome.causes:
            tell("extended FMUs", 0.0)
            _let_go(experiment, outcome)
            whole = replace(extended.mending, experiment=experiment)
            try:
                result.extension |= extend(whole, out, [c.hypothesis for c in extended.outcome.causes])
            except BuildError as error:  # numbers of a fit that no FMU takes, as of a load without any inertia
                result.extension["not_written"] = str(error)
        if answer == "unknown" and (curve := write_learnt(experiment, found.mending.before, left, train, out)):
            result.extension["learnt"] = curve
        result.write(out)
        tell("report", 0.0)
        write(result, mending, found.outcome, left, faults, out)
    return result


def _searched(
    rig: Rig, runs: list[MeasuredRun], held: list[bool], kept: Kept | None, rng: np.random.Generator, tell: Callable, search: bool
) -> tuple[DriveExperiment, np.ndarray, list[str], Selection]:
    """The experiment of a rig and its runs, the blocks that teach, the names of what judges, and what was found.

    Where nothing tells at which shaft the controller's sensors are, with them where what is found leaves least.
    """
    experiment = DriveExperiment(rig, runs)
    train, names = division.split(experiment, runs, held)
    experiment.forget()  # an hour's motions, which the search makes for itself
    ask = partial(problem_of, runs=runs, held=held, train=train, kept=kept)
    seen_at = lambda place: DriveExperiment(replace(rig, loop=place), runs)
    where = places(experiment, lambda place: ask(seen_at(place))) if experiment.by_channel and not rig.loop else []

    def found_of(experiment: DriveExperiment) -> tuple[DriveExperiment, Selection]:
        experiment, problem = _asked(experiment, runs, ask)
        placed = partial(place_again, experiment, anew=partial(ask, experiment)) if experiment.by_channel else lambda *_: None
        selection = ForwardSelection(problem, rng, tell, again=placed)
        return experiment, selection.run() if search else selection.run(0)

    if len(where) < 2:
        experiment, outcome = found_of(seen_at(where[0]) if where else experiment)
        return experiment, train, names, outcome
    found: list[tuple[float, DriveExperiment, Selection, list[dict]]] = []
    for place in where:
        experiment, outcome = found_of(seen_at(place))
        left = leaves(outcome.searched, outcome.final.values, found[0][2].searched if found else outcome.searched)
        found.append((left, experiment, outcome, [dict(run.memory) for run in runs]))
        if outcome.searched.excess(outcome.final.values).max() <= _noise_left(bool(outcome.causes)):
            break
    _, experiment, outcome, memories = min(found, key=lambda one: one[0])
    for run, memory in zip(runs, memories):  # when its set-points jumped, as it was found there
        run.memory.clear()
        run.memory.update(memory)
    return experiment, train, names, outcome


def _asked(
    experiment: DriveExperiment, runs: list[MeasuredRun], ask: Callable[[DriveExperiment], Problem]
) -> tuple[DriveExperiment, Problem]:
    """An experiment and what is asked of it, with what belongs to a run where that was found to be."""
    rig, problem = experiment.rig, ask(experiment)
    anew = lambda: ask(experiment)
    for place in (place_swings, place_jumps, partial(place_acts, anew=anew), place_ticks) if experiment.by_channel else ():
        if place(experiment, problem):
            experiment = DriveExperiment(rig, runs)
            problem = anew()
    if experiment.by_channel and (shaft := place_shaft(experiment, problem)):
        experiment = DriveExperiment(replace(rig, parameters=rig.parameters | shaft), runs)
        problem = anew()
    return experiment, problem


def _let_go(experiment: DriveExperiment, outcome: Selection) -> None:
    """Of an hour's motions, which are in the memory for each experiment: who comes next asks for those that are needed."""
    if experiment.long:
        for one in (experiment, outcome.problem.experiment, outcome.searched.experiment):
            one.forget()


def _voltage_told(problem: Problem, values: dict, caused: bool = False) -> bool:
    """Whether what drives the motor is compared, and the drive with these values makes it as it was logged; `caused` with causes.

    Where the whole drive does and a controller on measured inputs does not, these inputs are not what that saw.
    """
    excess = problem.excess(values)
    told = [e for e, residual in zip(excess, problem.experiment.residuals) if residual.output in VOLTAGES]
    return bool(told) and max(told) <= _noise_left(caused)


def _noise_left(caused: bool) -> float:
    """Times its noise up to which nothing is missing of a channel; `caused` with causes."""
    return RULES.search.natural if caused else RULES.search.sound


def _hunts(experiment: DriveExperiment, train: np.ndarray, found: Judgement) -> bool:
    """Whether the causes found part by part make the whole drive hunt, as widely as the log does."""
    before, after = found.mending.before, found.mending.after
    closed, _ = closed_loop(experiment, train, after)
    return hunts(closed, after, [p for cause in found.outcome.causes for p in cause.free]) and as_widely(closed, before, after)


def _sources(rig: Rig, runs: list[MeasuredRun], held: list[bool], out: Path) -> dict:
    """Where rig and logs lie, seen from the folder of the results: it may be moved with them."""
    near = lambda path: Path(os.path.relpath(path, out)).as_posix()
    logs = {near(run.source): is_held for run, is_held in zip(runs, held) if run.source}
    return {"rig": near(rig.path), "logs": [p for p, h in logs.items() if not h], "test": [p for p, h in logs.items() if h]}


def problem_of(
    experiment: DriveExperiment, runs: list[MeasuredRun], held: list[bool], train: np.ndarray, kept: Kept | None = None
) -> Problem:
    """What teaches: whole runs where others are held out, else the blocks to train on."""
    apart = any(held) and not experiment.steady
    taught = DriveExperiment(experiment.rig, [run for run, h in zip(runs, held) if not (apart and h)], sampled=True)
    return Problem.of(taught, np.ones(taught.layout.count, bool) if apart else train, kept)
