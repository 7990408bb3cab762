"""Diagnosis of any FMU system: which component is off on its own measured inputs, and on what its error depends.

Nothing here knows what the FMUs are. Where the one to blame is of this package (`ours`), its effects are tried as well.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from ..data.gathered import gathered
from ..data.log import MeasuredRun
from ..data.origin import about
from ..data.rig import Rig
from ..errors import DataError
from ..judge.depends import depends
from ..judge.gain import blame, comparisons, measure
from ..judge.result import Diagnosis
from ..output.report import write
from ..output.traces import traces
from ..pipeline import hold_out as division
from ..pipeline.replay import Replay, comparison
from ..pipeline.run import diagnose_runs, gather
from ..residuals.blocks import Blocks
from ..residuals.experiment import Experiment
from ..residuals.mending import Mending, rms, sizes
from ..residuals.noise import of_bins
from ..residuals.residual import Compared, Residual
from ..rules import RULES
from ..search.kept import Kept
from .ours import as_drive
from .parts import Group, Parts
from .sanity import box


@dataclass(frozen=True)
class Simulated:
    """What a residual of a system computes from in one run: the measured run, and its group's outputs simulated on it."""

    run: MeasuredRun
    groups: dict[Group, dict[str, np.ndarray]]
    take: None = None  # all samples are simulated


class SystemExperiment(Experiment):
    """The runs of a log beside the replays of the components: a residual for each measured output."""

    def __init__(self, rig: Rig, parts: Parts, runs: list[MeasuredRun], whole: bool = False):
        super().__init__()
        self.rig, self.original, self.runs = rig, runs, runs
        logged = {name for name in runs[0].signals if name in parts.variables}
        self.group_of = _groups(rig, parts, logged, whole)
        outputs: dict[Group, list[str]] = {}
        for name, group in self.group_of.items():
            outputs.setdefault(group, []).append(name)
        self.channels = {  # each group once on each run, for all the outputs that it is compared in
            (i, ""): Simulated(run, {group: parts.replay(group, run, names) for group, names in outputs.items()})
            for i, run in enumerate(runs)
        }
        self.residuals = tuple(_residual(name, group, parts) for name, group in self.group_of.items())
        self.layout = Blocks(runs, False)

    def variables(self, residual: Residual, values: dict) -> dict[str, list[np.ndarray]]:
        """Every logged variable, the compared one as simulated, and the time."""
        found = {"time": [run.time - run.time[0] for run in self.runs]}
        for name in self.runs[0].signals:
            found[name] = [np.where(run.usable(name), run.signals[name], np.nan) for run in self.runs]
        return found | {residual.output: [simulated for simulated, _, _ in self.compare(residual, values)]}


def _residual(name: str, group: Group, parts: Parts) -> Residual:
    """The comparison of a measured output with that of the group that gives it."""

    def compute(values: dict, given: Simulated) -> Compared:
        return given.groups[group][name], given.run.signals[name], given.run.usable(name)

    reads = tuple(feed.channel for feed in group.feeds)
    return Residual("signal", name, group.members, reads, name, parts.variables[name].unit or "1", compute)


def _groups(rig: Rig, parts: Parts, logged: set[str], whole: bool) -> dict[str, Group]:
    """For each measured output the components that must run for it: from set-points alone, or on all measurements."""
    sources = {c for c, names in parts.inputs.items() if not names}
    causality = {name: variable.causality for name, variable in parts.variables.items()}
    given = {name for name in logged if parts.owner(name) in sources or (causality[name] == "input" and name not in parts.links)}
    outputs = [name for name in parts.variables if name in logged - given and causality[name] == "output"]
    if not outputs:
        raise DataError(
            f"{rig.path}: the columns hold no output of a component that is given something. Map a column to one, "
            f"such as {next((n for n, kind in causality.items() if kind == 'output'), 'component.output')}."
        )
    if whole:
        together = parts.group(sorted({parts.owner(name) for name in outputs}), given)
        return dict.fromkeys(outputs, together)
    return {name: parts.group([parts.owner(name)], logged) for name in outputs}


def prepare(rig: Rig) -> tuple[Rig, Parts]:
    """The rig with its system's units, and the system."""
    parts = Parts(rig)
    parts.check(column.signal for column in rig.columns)
    parts.check_units(rig.columns)
    return replace(rig, units={name: variable.unit for name, variable in parts.variables.items()}), parts


def replay_system(rig: Rig, log: str | Path, out: str | Path | None, anyway: bool = False) -> Replay:
    """The whole system from its set-points and each component alone on its measured inputs, over what was measured.

    anyway: also where the log and what the FMUs compute contradict each other.
    """
    rig, parts = prepare(rig)
    runs, faults = gathered(log, rig)
    folder = Path(out) if out else None
    if folder:
        folder.mkdir(parents=True, exist_ok=True)
    comparisons, plots = [], {}
    for whole in (False, True):
        experiment = SystemExperiment(rig, parts, runs, whole)
        if not whole:
            sanity = box(experiment, rig)
            sanity.refuse(rig, anyway)
        for residual in experiment.residuals:
            name = f"whole {residual.output}" if whole else residual.output
            comparisons.append(comparison(experiment, residual, {}, experiment.compare(residual, {}), name))
            plots[name] = traces(Mending(experiment, residual, {}, {}, np.ones(experiment.layout.count, bool)))
    result = Replay(comparisons, [f.row() for f in faults], folder, plots, sanity=sanity)
    result.write(rig)
    return result


def _name(
    rig: Rig, parts: Parts, shares: list[dict], logs, test, out: Path | None, tell, seed: int, kept: Kept | None
) -> Diagnosis | None:
    """The diagnosis of the component most to blame, where it is one of ours and a cause explains it."""
    component = shares[0]["component"] if shares else ""
    runs, _, _ = gather(rig, logs, test)
    drive = as_drive(parts, rig, component, set(runs[0].signals)) if component else None
    if drive is None:
        return None
    try:
        found = diagnose_runs(drive, *gather(drive, logs, test), out, tell, seed, shares, kept=kept)
    except DataError:  # the log has not what its law is to be compared with
        return None
    return found if found.verdict in ("explained", "ambiguous") else None


def diagnose_system(
    rig: Rig,
    logs: Sequence,
    test: Sequence,
    out: Path | None,
    tell: Callable,
    seed: int,
    kept: Kept | None = None,
    search: bool = True,
    anyway: bool = False,
) -> Diagnosis:
    """Blame and dependences; `unknown` where a component is off, `none` where what remains is noise."""
    rng = np.random.default_rng(seed)
    rig, parts = prepare(rig)
    runs, faults, held = gather(rig, logs, test)
    tell("replay of each component", 0.1)
    experiment = SystemExperiment(rig, parts, runs)
    sanity = box(experiment, rig)
    sanity.refuse(rig, anyway)
    train, names = division.split(experiment, runs, held)
    if out is not None:
        out.mkdir(parents=True, exist_ok=True)
    noise = np.array([_noise(experiment, residual) for residual in experiment.residuals])
    misfit, present = experiment.misfit({}, noise), experiment.present({})
    tell("what remains", 0.7)
    left = depends(experiment, misfit, present, {}, rng)
    level = sizes(experiment, misfit, present)
    seen = {d.residual for d in left}
    off = {name for name, size in level.items() if size > RULES.judge.excess or (size > RULES.pipeline.off_seen and name in seen)}
    left = [d for d in left if d.residual in off]
    residual = max(experiment.residuals, key=lambda c: (c.name in off, level[c.name]))
    mending = Mending(experiment, residual, {}, {}, ~train)
    gain = measure(mending, names, rng)
    shares = blame(experiment, misfit, present, []) if off else []
    remainder = {
        "significant": bool(off),
        "depends_on": list(dict.fromkeys(d.variable for d in left if d.residual == residual.name))
        or list(dict.fromkeys(d.variable for d in left)),
    }
    result = Diagnosis("unknown" if off else "none", [f.row() for f in faults], shares, [], gain, remainder)
    result.comparisons, result.sanity = comparisons(mending, gain), sanity
    named = _name(rig, parts, shares, logs, test, out, tell, seed, kept) if off and search else None
    if named is not None:
        return named
    result.extension["seed"] = seed
    result.about = about(rig, runs, held) | {"searched": search}
    if out is not None:
        result.folder = out
        result.write(out)
        tell("report", 0.9)
        write(result, mending, None, left, faults, out)
    return result


def _noise(experiment: SystemExperiment, residual: Residual) -> float:
    """Of a residual's bins, in its unit."""
    binned, count = experiment.binned(residual, {})
    size = rms([measured[good] for _, measured, good in experiment.compare(residual, {})])
    return max(of_bins(binned, count > 0, False, 1), RULES.pipeline.fine * size)
