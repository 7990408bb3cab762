"""The whole drive beside an answer that single parts gave: simulated from its set-points or its voltage, before and after the causes.

Parts run on measured inputs, and what is wrong with an input passes for a cause. In the closed loop nothing measured goes in
(residuals.whole), so that a cause which is none makes some channel worse there. How the log was recorded is not known, so what
recorders do is fitted with the values of the parts held, before and after alike, on the data that taught; errors are those of
the data that judge.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from ..data.rig import Rig
from ..residuals import whole
from ..residuals.drive_experiment import DriveExperiment
from ..residuals.experiment import Experiment
from ..residuals.mending import Mending
from ..rules import RULES
from ..search.fit import ended
from ..search.hypotheses import recorder
from ..search.problem import Problem


def asked(rig: Rig, experiment: Experiment) -> bool:
    """Whether single parts of a drive were compared whose loop is described."""
    return rig.simulate in ("", whole.PARTED) and not whole.undescribed(rig, set(experiment.runs[0].signals))


def together(experiment: DriveExperiment, train: np.ndarray, judged: np.ndarray, before: dict, after: dict) -> list[dict]:
    """Error (root mean square) of each measured channel of the whole drive before and after, beside its noise; `worse`: more than that explains.

    before, after: values of the parts. train, judged: blocks that what recorders do is fitted on, and those that are told of.
    """
    closed, problem = closed_loop(experiment, train, after)
    new = recorded(problem, after, {})
    old = recorded(problem, before, new)  # what is found behind the better model is where the search behind the other begins
    rows = []
    for residual in closed.residuals:
        was, now, noise = Mending(closed, residual, old, new, judged).levels()
        row = {"channel": residual.output, "unit": residual.unit, "before": was, "after": now, "noise_floor": noise}
        rows.append(row | {"worse": bool(now**2 - was**2 > noise**2)})
    return rows


def closed_loop(experiment: DriveExperiment, train: np.ndarray, values: dict) -> tuple[DriveExperiment, Problem]:
    """The same runs compared as a whole drive, and the problem of them with the noise that there is at these values of the parts."""
    closed = DriveExperiment(replace(experiment.rig, simulate=whole.WHOLE), experiment.runs, sampled=True)
    ones = np.ones(len(closed.residuals))
    return closed, Problem(closed, train, (), (), {}, ones, ones, closed.present(values)).with_noise_at(values)


def recorded(problem: Problem, values: dict, start: dict) -> dict:
    """Values of the parts, and of what recorders did as it fits best beside them; start: where the fit begins, where it is known."""
    free = recorder(problem.experiment)
    found, _ = ended(
        problem.misfit, values, free, {p.name: start.get(p.name, p.nominal) for p in free}, problem.rows, problem.loss_scale,
        RULES.search.effort_recorders, RULES.search.tolerances_whole, by_channel=True,
    )  # fmt: skip
    return values | found


def against(rows: list[dict]) -> str:
    """What the whole drive says against an answer, as a clause that names the channels; "" where nothing."""
    worse = [f"{r['channel']} ({r['before']:.3g} -> {r['after']:.3g} {r['unit']})" for r in rows if r["worse"]]
    return f"simulated as one, the whole drive gets worse in {', '.join(worse)}" if worse else ""
