"""What a plan writes: the set-points as a log's columns, what each model expects of them, plan.json."""

from __future__ import annotations

import base64
import json
from pathlib import Path

import numpy as np

from selflock.view import page

from ..data.signals import SIGNALS
from ..output import figures
from .run import NextRun, table

COLOURS = ("#1f6fb2", "#c2571a", "#3a8a3a", "#7a4fa3", "#a33a5a", "#5a5a5a")


def write(plan: NextRun, out: Path) -> None:
    """plan.csv, plan.json, expected.png, report.html; the plan then knows them."""
    plan.folder = out
    table(plan).to_csv(out / "plan.csv", index=False, float_format="%.9g")
    (out / "plan.json").write_text(json.dumps(plan.data(), indent=2) + "\n")
    picture = base64.b64encode(expected(plan, out / "expected.png").read_bytes()).decode()
    made = page.environment("selflock.diagnosis.planning", strict=False)
    made.filters["num"] = lambda v: f"{v:.4g}"
    page.write(
        out / "report.html", made, "plan.html.j2", plan=plan, picture=picture,
        decided=plan.run.decided.tolist(), usual=plan.usual.decided.tolist(),
    )  # fmt: skip
    plan.files = ["plan.csv", "plan.json", "expected.png", "report.html"]


@figures.styled
def expected(plan: NextRun, path: Path) -> Path:
    """The set-point, and what each model expects of every channel beside the first one: where they part is what the run is for."""
    run, first = plan.run, plan.run.outputs[0]
    figure, axes = figures.subplots(len(first) + 1, 1, figsize=(9, 1.6 + 1.5 * len(first)), layout="constrained", sharex=True)
    axes[0].plot(run.time, run.angle, color=figures.MEASURED, label="set-point")
    axes[0].set_ylabel("set-point, rad")
    for axis, (name, x) in zip(axes[1:], first.items()):
        axis.axhspan(-plan.noise[name], plan.noise[name], color="#00000014", lw=0, label="noise of a row")
        for number, model in enumerate(plan.models):
            y = run.outputs[number][name] - x if number else np.zeros(len(x))
            axis.plot(run.time, y, color=COLOURS[number % len(COLOURS)], lw=0.9, label=model.label)
        axis.set_ylabel(f"{name}\nbeside the first, {SIGNALS[name][0] if name in SIGNALS else ''}", fontsize=8)
    axes[-1].set_xlabel("time, s")
    handles, labels = axes[1].get_legend_handles_labels()
    figure.legend(handles, labels, loc="outside lower center", ncols=min(3, len(labels)), fontsize=9)
    return figures.save(figure, path)
