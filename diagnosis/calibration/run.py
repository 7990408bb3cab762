"""From rig and logs to the fitted numbers, and what the logs tell of them: the whole way, step by step."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np

from ..data.rig import EVERY_SECOND, Rig
from ..errors import DataError
from ..pipeline.run import gather
from ..residuals.blocks import Blocks
from ..residuals.mending import rms
from ..residuals.noise import of_samples
from ..rules import RULES
from ..search.kept import Kept
from ..systems.system import prepare
from . import told
from .fit import Calibrating, End, fit, fit_from, polished, remaining, spreads
from .gaps import as_fed
from .heard import as_measured, heard, sentences
from .numbers import label, of_rig
from .page import write
from .played import Played
from .result import Calibration, ChannelError, FittedNumber, pairs
from .slopes import Forward, Slopes

Spread = Callable[[Callable[[Any, Any], Any], list[Any], Any], list[Any]]
"""Calls function(context, item) for each item and gives the answers in their order: here, or on many processes."""


def here(function: Callable[[Any, Any], Any], items: list[Any], context: Any) -> list[Any]:
    """One after the other in this process."""
    return [function(context, item) for item in items]


def calibrate_system(
    rig: Rig,
    logs: Sequence,
    test: Sequence,
    out: Path | None,
    tell: Callable,
    starts: int | None,
    seed: int,
    spread: Spread,
    kept: Kept | None = None,
) -> Calibration:
    """The calibration of a rig's system, as `calls.calibrate` tells it."""
    if rig.system is None:
        raise DataError(
            f'{rig.path}: names no system to calibrate. Write [rig] system = "my.toml" (an .ssp or .fmu as well); what is '
            "uncertain of a drive is fitted by selflock diagnose."
        )
    starts = RULES.calibrate.starts if starts is None else starts
    if starts < 1:
        raise DataError(f"starts = {starts}: give at least one.")
    tell("reading", 0.0)
    rig, parts = prepare(rig)
    runs, faults, held = gather(rig, logs, test)
    numbers = of_rig(rig, parts, runs)
    runs, faults, behind = as_fed(rig, parts, runs, numbers, faults)
    if out is not None:
        out.mkdir(parents=True, exist_ok=True)  # a place that cannot be used is told before the work, not after it
    everything = [np.ones(len(run), bool) for run in runs]
    problem = Calibrating(rig, runs, numbers, list(range(len(runs))), everything, kept=kept)
    vars(problem)["played"] = Played(rig, parts, runs, numbers)
    try:
        result = _calibrated(problem, held, starts, seed, spread, tell)
        result.faults, result.notes = [fault.row() for fault in faults], behind + result.notes
        if out is not None:
            tell("report", 0.95)
            write(result, problem, out)
    finally:
        problem.close()
    return result


def _calibrated(problem: Calibrating, held: list[bool], starts: int, seed: int, spread: Spread, tell: Callable) -> Calibration:
    played, runs, numbers = problem.played, problem.runs, problem.numbers
    blocks = Blocks(runs, False)
    labels = [blocks.block(i) for i in range(len(runs))]
    judges, rows, words = division(problem, held, labels)
    everything = problem.rows
    problem.which = [i for i in range(len(runs)) if i not in judges]
    problem.rows = rows
    problem.fixed = {n.name: n.start for n in numbers if n.run in judges}
    given = {n.name: n.start for n in numbers}
    origin = np.array([n.place(n.start) for n in problem.free])
    problem.units = spreads(played)
    notes = _first_look(problem, origin)
    if links := heard(problem, problem.values(origin)):
        notes += sentences(links)
        problem.hear(as_measured(runs, links))
        played, runs = problem.played, problem.runs
    quiet = told.silent(problem, origin)
    problem.fixed |= {n.name: n.start for n in numbers if n.name in quiet}
    origin = np.array([n.place(n.start) for n in problem.free])
    tell("fits from several starts", 0.3)
    ends = fit(problem, origin, starts, seed, spread, tell)
    chosen = reached(problem, ends, "fitted")
    tell("the fit in units of what remains", 0.7)
    final = polished(problem, chosen)
    values = problem.values(final.places) | own(problem, judges, final)
    unseen = [everything[i] if i in judges else everything[i] & ~rows[i] for i in range(len(runs))]
    held_out = [sizes(problem, numbers, unseen) if words else None for numbers in (given, values)]
    if words and not judges:  # blocks were held out: now they may teach as well
        problem.rows = everything
        vars(problem).pop("trusted", None)
        final = polished(problem, final)
        values = problem.values(final.places)
    seen = [everything[i] & (i not in judges) for i in range(len(runs))]
    error = [sizes(problem, numbers, seen) for numbers in (given, values)]
    noise = {name: floor for name, (_, floor) in remaining(problem, values).items()}
    errors = [
        ChannelError(
            name,
            played.parts.variables[name].unit,
            before=_of(error[0], name),
            after=_of(error[1], name),
            noise=noise[name],
            spread=played.spread(name),
            samples=_count(problem.trusted[name]),
            held_out_before=_of(held_out[0], name),
            held_out=_of(held_out[1], name),
            judged=_count(problem.counted(range(len(runs)), unseen)[name]) if words else 0,
        )
        for name in played.outputs
    ]
    notes += told.misread(problem, given, values)
    found, like = _numbers(problem, final, values, quiet, labels)
    effort = played.effort
    return Calibration(
        problem.rig.system.name if problem.rig.system else "",
        problem.rig.name,
        list(dict.fromkeys(run.log for i, run in enumerate(runs) if i not in judges)),
        found,
        pairs([n.name for n in problem.free], like),
        errors,
        words,
        _starts(problem, ends, chosen),
        len(final.misfit) if final.misfit is not None else 0,
        {**effort.told(), "reasons": dict(effort.failed)},
        notes,
        seed=seed,
    )


def division(problem: Calibrating, held: list[bool], labels: list[np.ndarray]) -> tuple[set[int], list[np.ndarray], str]:
    """Which runs judge, which samples of the others teach, and that in words; "" where too little is there to hold out."""
    runs, count = problem.runs, 1 + int(labels[-1].max())
    judges = {i for i, is_held in enumerate(held) if is_held}
    if judges:
        words = ", ".join(dict.fromkeys(runs[i].log for i in sorted(judges)))
    elif problem.rig.hold_out == EVERY_SECOND and len(runs) > 1:
        judges, words = set(range(1, len(runs), 2)), EVERY_SECOND
    elif count >= RULES.pipeline.fewest_blocks:
        every = RULES.pipeline.every
        return set(), [block % every != every - 1 for block in labels], f"every {every}rd of {count} blocks"
    else:
        words = ""
    return judges, problem.rows, words


def _first_look(problem: Calibrating, origin: np.ndarray) -> list[str]:
    """What is wrong with the logs, or to be told of the FMUs, before anything is fitted."""
    played, rig = problem.played, problem.rig
    notes = []
    start = problem.settings(problem.values(origin))
    other = problem.settings(problem.values(np.full(len(origin), 0.5)))
    first = problem.which[0]
    if word := played.trust(start[first], other[first], first):
        notes.append(word)
    if played.untaken:
        raise DataError(f"{rig.path}: [calibrate] {played.untaken}. Leave it out, or narrow its range to what the FMU takes.")
    notes += played.notes
    step, rows = played.parts.system.run.step, float(np.median(np.diff(problem.runs[first].time)))
    if step > 1.5 * rows:
        notes.append(
            f"the system goes in steps of {step:g} s, and the log has a row every {rows:.4g} s: with step = {rows:.4g} under [rig] it is as fine"
        )
    notes += played.parts.not_as_wired(played.group)
    if played.still():
        channels = ", ".join(feed.channel for feed in played.group.feeds)
        if not _moving(problem):
            raise DataError(
                f"{problem.runs[first].log}: the inputs do not move ({channels}), nor does what is measured: nothing can be learnt "
                f"from it. Record a run in which they do, or map other columns in {rig.path.name}."
            )
        notes.append(f"no input moves in these logs ({channels}): only what the start values set in motion tells of the numbers")
    return notes


def _moving(problem: Calibrating) -> bool:
    """Whether any output changes by more than its noise."""
    played = problem.played
    for name in played.outputs:
        trusted = played.trusted(name, problem.which)
        values = [problem.runs[i].signals[name] for i in problem.which]
        spread = float(np.std(np.concatenate([v[t] for v, t in zip(values, trusted)])))
        if spread > RULES.calibrate.still * of_samples(values, trusted) and spread > 0.0:
            return True
    return False


def reached(problem: Calibrating, ends: list[End], asked: str) -> End:
    """The best of some fits. DataError where none came to an end: nothing can be `asked` then."""
    if not ends or not np.isfinite(ends[0].loss):
        raise DataError(
            f"{problem.rig.path}: the system breaks off wherever its numbers are tried, so nothing can be {asked}. Narrow the "
            f"ranges under [calibrate], or mend this first: {problem.played.last}"
        )
    return ends[0]


def own(
    problem: Calibrating, judges: set[int], final: End, sloped: type[Slopes] | type[Forward] = Slopes, learnt: bool = False
) -> dict[str, float]:
    """The numbers that runs which judge have of their own, fitted to these with all others as they were found.

    learnt: from slopes where the fit begins on they are learnt from its own steps.
    """
    found: dict[str, float] = {}
    for i in sorted(judges):
        mine = [n.name for n in problem.numbers if n.run == i]
        if not mine:
            continue
        shared = {name: value for name, value in problem.values(final.places).items() if name not in mine}
        alone = replace(problem, which=[i], fixed=shared)
        vars(alone)["played"] = problem.played
        origin = np.array([n.place(n.start) for n in alone.free])
        end = fit_from(alone, origin, RULES.calibrate.effort_end, sloped=sloped, known={} if learnt else None)
        found |= alone.values(end.places)
    return found


def sizes(problem: Calibrating, values: dict[str, float], counted: list[np.ndarray]) -> dict[str, float] | None:
    """The error of each output over the samples that count; None where a run breaks off."""
    which = [i for i, rows in enumerate(counted) if rows.any()]
    errors = problem.errors(values, which)
    if errors is None:
        return None
    trusted = problem.counted(which, counted)
    return {name: rms([e[t] for e, t in zip(errors[name], trusted[name])]) for name in errors}


def _count(rows: list[np.ndarray]) -> int:
    return int(sum(one.sum() for one in rows))


def _of(sizes: dict[str, float] | None, name: str) -> float | None:
    return None if sizes is None else sizes[name]


def _numbers(
    problem: Calibrating, final: End, values: dict[str, float], quiet: set[str], labels: list[np.ndarray]
) -> tuple[list[FittedNumber], np.ndarray]:
    """All numbers with what the logs tell of them, and the correlations of the free ones."""
    of_entry = problem.blocks(labels)
    errors, like, loose = told.errors(problem, final, of_entry)
    alike, width = told.together(problem, final), told.reach(of_entry, len(problem.free))
    order = {number.name: j for j, number in enumerate(problem.free)}
    rules, found = RULES.calibrate, []
    for n in problem.numbers:
        value, run = values[n.name], "" if n.run is None else label(problem.runs[n.run])
        plain = FittedNumber(n.name, n.variable, value, None, None, None, n.start, (n.low, n.high), n.unit, run)
        if n.name in quiet:
            found.append(replace(plain, silent=True, determined=False))
            continue
        if n.name not in order:  # of a run that judges
            found.append(plain)
            continue
        j, place = order[n.name], float(final.places[order[n.name]])
        error = float(errors[j])
        low, high = (0.0, 1.0) if loose[j] else (place - width * error, place + width * error)
        at_bound = "lowest" if place < rules.bound else "highest" if place > 1.0 - rules.bound else ""
        found.append(
            replace(
                plain,
                low=n.at(low),
                high=n.at(high),
                error=None if loose[j] else error * n.slope(place),
                determined=bool(not loose[j] and min(high, 1.0) - max(low, 0.0) < rules.undetermined),
                at_bound=at_bound,
                collinear_with=alike.get(n.name, []),
            )
        )
    return found, like


def _starts(problem: Calibrating, ends: list[End], best: End) -> list[dict[str, Any]]:
    def named(places: np.ndarray) -> dict[str, float]:
        return {n.name: n.at(place) for n, place in zip(problem.free, places)}

    return [
        {
            "start": named(end.start),
            "end": named(end.places),
            "loss": end.loss,
            "alike": bool(np.isfinite(end.loss) and np.all(abs(end.places - best.places) <= RULES.calibrate.alike)),
        }
        for end in ends
    ]
