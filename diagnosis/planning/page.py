"""What a plan writes: the set-points as a log's columns, what each model expects of them, plan.json."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np

from selflock.view import figures, page
from selflock.view.figures import axis, band, line

from ..data.signals import SIGNALS
from ..output.traces import MEASURED, Plots
from .run import NextRun, table


def write(plan: NextRun, out: Path) -> None:
    """plan.csv, plan.json, report.html; the plan then knows them."""
    plan.folder = out
    table(plan).to_csv(out / "plan.csv", index=False, float_format="%.9g")
    (out / "plan.json").write_text(json.dumps(plan.data(), indent=2) + "\n")
    drawn = figures.carried({"expected": expected(plan)}, least={"expected": 900})
    made = page.environment("selflock.diagnosis.planning", strict=False)
    page.write(
        out / "report.html", made, "plan.html.j2", drawn, plan=plan,
        decided=plan.run.decided.tolist(), usual=plan.usual.decided.tolist(),
    )  # fmt: skip
    plan.files = ["plan.csv", "plan.json", "report.html"]


def expected(plan: NextRun) -> Plots:
    """The set-point, and what each model expects of every channel beside the first one: where they part is what the run is for."""
    run, time = plan.run, axis("time", "s")
    plots = [{"x": time, "y": axis("set-point", "rad"), "marks": [line(run.time, run.angle, "", MEASURED)], "shares": "x"}]
    for name, x in run.outputs[0].items():
        around = np.full(len(run.time), plan.noise[name])
        marks = [band(run.time, -around, around, "noise of a row", "soft")]
        for number, model in enumerate(plan.models):
            marks.append(line(run.time, run.outputs[number][name] - x, model.label, number))
        over = axis(f"{name} beside the first", SIGNALS[name][0] if name in SIGNALS else "")
        plots.append({"x": time, "y": over, "marks": marks, "shares": "x"})
    return plots
