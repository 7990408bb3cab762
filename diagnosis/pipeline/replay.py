"""Replay: the nominal simulation on a measured log, compared in what a diagnosis judges; nothing of the drive is fitted, nothing judged.

Each component runs on its measured inputs, or the whole drive from its set-points; where the rig describes the whole and parts
are compared, both.

The reducer is the FMU itself, in kinematic mode: the measured motion is imposed on its input shaft, and on its output
shaft the angle at which its spring carries the known load. What it computes is drawn over what was measured, on one page.

What runs FMUs, what draws for a notebook and pandas, which points are told with, are loaded where they are needed: a replay is
to answer while one watches.
"""

from __future__ import annotations

import base64
import json
from collections.abc import Iterator
from dataclasses import asdict, dataclass, field
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from selflock.fmus.shown import printed

from ..data.gathered import gathered
from ..data.log import MeasuredRun, write_csv
from ..data.rig import Rig
from ..data.sanity import Box, box
from ..errors import DataError
from ..judge.together import asked, closed_loop, recorded
from ..output.traces import Plots, traces
from ..residuals.drive_experiment import DriveExperiment
from ..residuals.experiment import Experiment
from ..residuals.laws import check_names
from ..residuals.mending import Mending, rms
from ..residuals.noise import floor
from ..residuals.residual import RUNS, Residual
from ..residuals.whole import WHOLE
from ..search.instants import place_acts, place_jumps
from ..search.swings import place_swings
from .in_step import whole_where_described
from .replay_page import write

if TYPE_CHECKING:
    import pandas as pd


@dataclass
class Comparison:
    """One channel, measured and simulated."""

    name: str  # of the residual, as it is told
    output: str
    unit: str
    error: float  # root mean square
    relative: float  # to the root mean square of the measured values
    noise_floor: float
    components: list[str]
    over: float = 0.0  # s over which the change of an angle is compared that no controller holds
    winds: str = ""  # what the gear winds up, where that is compared: of which channels

    @property
    def compared(self) -> str:
        """What of the channel is compared, where it is not the channel itself."""
        return f"its change in {self.over:.3g} s" if self.over else self.winds


@dataclass
class Replay:
    """What `replay` returns. `points` has the error speed by speed where the log is one of steady-state points."""

    comparisons: list[Comparison]
    faults: list[dict]
    folder: Path | None
    plots: dict[str, Plots] = field(default_factory=dict)  # of each comparison, as data (selflock.view.figures)
    points: pd.DataFrame | None = None
    sanity: Box | None = None  # what log and rig of a drive say of each other
    page: Path | None = None

    def summary(self) -> str:
        """What log and rig say of each other, error of each channel, faults, and what to open, as text."""
        lines = self.sanity.lines() if self.sanity else []
        lines += [
            f"{c.winds or c.output}{f', {c.compared}' if c.over else ''} ({c.name}): error {c.error:.4g} {c.unit} rms, {100 * c.relative:.1f} % of the measured"
            + (f", noise floor {c.noise_floor:.2g}" if c.noise_floor else "")
            for c in self.comparisons
        ]
        if self.points is not None:
            lines.append(self.points.to_string(index=False, float_format=lambda v: f"{v:.4g}"))
        if self.faults:
            lines.append(
                f"{len(self.faults)} faults in the data, left out: "
                + "; ".join(
                    f"{f['kind']} {f['channel']} rows {f['first']} to {f['last']}" + (f" of run {f['run']}" if f["run"] else "")
                    for f in self.faults[:6]
                )
            )
        if self.page:
            lines.append(f"Open {self.page}")
        return "\n".join(lines)

    def __str__(self) -> str:
        return self.summary()

    def _repr_html_(self) -> str:
        """The summary and the first picture, for a notebook."""
        if not self.plots:
            return printed(self.summary())
        from ..output.figures import drawn

        title, plots = next(iter(self.plots.items()))
        data = base64.b64encode(drawn(plots, title)).decode()
        return f'{printed(self.summary())}<img style="max-width: 100%" alt="" src="data:image/png;base64,{data}">'

    def write(self, rig: Rig) -> None:
        """replay.json, points.csv and the page, to its folder."""
        if self.folder is None:
            return
        if self.points is not None:
            self.points.to_csv(self.folder / "points.csv", index=False, float_format="%.9g")
        sanity = self.sanity.row() if self.sanity else None
        told = {"sanity": sanity, "comparisons": [asdict(c) for c in self.comparisons], "faults": self.faults}
        (self.folder / "replay.json").write_text(json.dumps(told, indent=2) + "\n")
        self.page = write(self, rig, self.folder)


def replay_drive(rig: Rig, log: str | Path, out: str | Path | None, anyway: bool = False) -> Replay:
    """Each comparison of a drive with nominal parameters; the FMU files take the laws' places where there are any.

    anyway: also where log and rig contradict each other.
    """
    check_names(rig)
    runs, faults = gathered(log, rig)
    if not any(run.usable(*run.signals).any() for run in runs):
        raise DataError(
            f"{log}: no sample has all its channels sound. The faults: " + "; ".join(f"{f.kind} {f.channel}" for f in faults[:5])
        )
    sanity = box(rig, runs)
    sanity.refuse(rig, anyway)
    folder = Path(out) if out else None
    if folder:
        folder.mkdir(parents=True, exist_ok=True)
    comparisons, plots, points = [], {}, None
    for experiment, values in _experiments(rig, runs):
        for residual in experiment.residuals:
            compared = _by_fmu(experiment, residual, values, folder)
            comparisons.append(comparison(experiment, residual, values, compared))
            everywhere = np.ones(experiment.layout.count, bool)
            plots[residual.told] = traces(Mending(experiment, residual, values, values, everywhere), compared)
            if residual.kind == "gear" and experiment.steady:
                points = _points(experiment, residual, compared[0])
            if folder:
                write_csv(_table(experiment, compared), folder / f"{residual.told.replace(' ', '_')}.csv")
    result = Replay(comparisons, [f.row() for f in faults], folder, plots, points, sanity)
    result.write(rig)
    return result


def comparison(experiment: Experiment, residual: Residual, values: dict, compared: list, name: str = "") -> Comparison:
    """How far what was simulated is off, over all trusted samples. name: of the comparison, where it is not the residual's."""
    errors = [m - s for s, m, _ in compared]
    trusted = [good & np.isfinite(s) for s, _, good in compared]
    error = rms([x[t] for x, t in zip(errors, trusted)])
    size = rms([m[t] for (_, m, _), t in zip(compared, trusted)])
    noise = floor(experiment, residual, values, errors, trusted)
    relative = error / size if size else 0.0
    return Comparison(
        name or residual.told, residual.output, residual.unit, error, relative, noise, list(residual.components), residual.over,
        residual.quantity if residual.winds else "",
    )  # fmt: skip


def _experiments(rig: Rig, runs: list[MeasuredRun]) -> Iterator[tuple[DriveExperiment, dict[str, float]]]:
    """What a diagnosis of this log compares, with values beside the nominal ones; and the whole drive, where the rig describes it.

    A whole drive is read as its recorder read it, which is fitted: nothing of the drive is.
    """
    chosen, _ = whole_where_described(rig, runs)
    experiment = DriveExperiment(chosen, runs)
    parts = chosen.simulate != WHOLE
    if parts:
        yield experiment, {}
    if parts and not asked(chosen, experiment):
        return
    everything = np.ones(experiment.layout.count, bool)
    closed, problem = closed_loop(experiment, everything, {})
    anew = lambda: closed_loop(experiment, everything, {})[1]
    for place in (place_swings, place_jumps, partial(place_acts, anew=anew)):
        if place(closed, problem):
            closed, problem = closed_loop(experiment, everything, {})
    yield closed.whole(), recorded(problem, {}, {})


def _by_fmu(experiment: DriveExperiment, residual: Residual, values: dict, folder: Path | None):
    """A comparison with the component's FMU in the law's place."""
    if folder is None or residual.kind == "drive" or residual.kind not in RUNS:
        return experiment.compare(residual, values)
    from selflock.fmus.build import build

    from ..output.extend import starts, with_fmus

    part = RUNS[residual.kind]
    name = residual.prefix + part
    given = starts(part, name, {**experiment.rig.parameters, **values})
    path = build(part.capitalize(), folder / f"{name}.fmu", **given, **({"kinematic": True} if part == "reducer" else {}))
    theirs = with_fmus(experiment, {name: path}, residual)
    return (theirs or experiment).compare(residual, values)


def _points(experiment: DriveExperiment, residual: Residual, compared) -> pd.DataFrame:
    simulated, measured, good = compared
    speed = experiment.channels[0, residual.prefix].raw(
        "reducer.input_speed" if experiment.channels[0, residual.prefix].has("reducer.input_speed") else "load.speed"
    )
    import pandas as pd

    table = pd.DataFrame({"speed": speed, "measured": measured, "simulated": simulated, "error": measured - simulated})
    return table[good].sort_values("speed").reset_index(drop=True)


def _table(experiment: DriveExperiment, compared) -> dict[str, np.ndarray]:
    parts = [(np.full(len(run), run.name, object), run.time, m, s, good) for run, (s, m, good) in zip(experiment.runs, compared)]
    return dict(zip(("run", "time", "measured", "simulated", "trusted"), map(np.concatenate, zip(*parts))))
