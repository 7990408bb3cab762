"""What a calibration writes: its page, calibration.json, the table for a rig, and the system with the fitted values."""

from __future__ import annotations

from collections.abc import Sequence
from copy import deepcopy
from pathlib import Path
from typing import Any

import numpy as np
from markupsafe import Markup

from selflock.master import ssp
from selflock.master.dump import save as save_system
from selflock.master.dump import toml
from selflock.master.errors import DescriptionError, ResultError
from selflock.view import figures, page
from selflock.view.figures import axis, line

from ..output.traces import AFTER, BEFORE, MEASURED, Plots
from .fit import Calibrating
from .numbers import label
from .result import Calibration, FittedNumber, environment

ROWS, COLUMNS = 6, 3  # outputs and runs that are drawn


def write(result: Calibration, problem: Calibrating, out: Path) -> Path:
    """All files of a calibration; `result` then knows them."""
    result.folder = out
    result.files = [path.name for path in (_system(result, problem, out), _table(result, out)) if path is not None]
    result.files += [result.write(out).name, "report.html"]
    plots = traces(result, problem)
    judged = {label(run) for i, run in enumerate(problem.runs) if i not in problem.which}
    first = next(
        (plot for plot in plots if plot["title"] in judged), plots[0]
    )  # one picture leaves room on a phone's first screen
    more = plots if len(plots) > 1 else None
    drawn = figures.carried({"first": [first], "traces": more}, least={"first": 400, "traces": 400})
    tables = Markup(environment().get_template("tables.html.j2").render(result=result, page=True))
    return page.write(out / "report.html", environment(), "report.html.j2", drawn, result=result, tables=tables, more=more)


def _shared(result: Calibration) -> list[FittedNumber]:
    return [number for number in result.numbers if not number.run]


def _system(result: Calibration, problem: Calibrating, out: Path) -> Path | None:
    """The system with what all runs have in common, as a file for `selflock run`; an SSP stays one."""
    parts = problem.played.parts
    system = deepcopy(parts.system)
    values = problem.rig.parameters | {n.variable: n.value for n in _shared(result) if not n.silent}
    for name, value in values.items():
        if name in parts.shared:  # in all that follows from it already
            continue
        component, variable = system.split(name, "parameters")
        system.components[component].start[variable] = value
    try:
        if parts.path.suffix.lower() in (".ssp", ".ssd") or parts.path.is_dir():
            return ssp.export(system, out / "calibrated.ssp")
        about = f"{result.rig}: numbers fitted to {', '.join(result.logs)}"
        return save_system(system, out / "calibrated.toml", "\n".join(about.splitlines()))
    except (DescriptionError, ResultError) as error:
        result.notes.append(f"no system with the fitted values could be written: {error}")
        return None


def _table(result: Calibration, out: Path) -> Path:
    """The fitted values as a rig takes them, those of single logs under [logs]."""
    lines = ["# For a rig. Behind each value its 95 % interval.", "[parameters]"]
    lines += [_line(number) for number in _shared(result)]
    for run in dict.fromkeys(number.run for number in result.numbers if number.run):
        lines += ["", f"[logs.{toml(run)}]", *(_line(number) for number in result.numbers if number.run == run)]
    path = out / "parameters.toml"
    path.write_text("\n".join(lines) + "\n", encoding="utf-8", errors="backslashreplace")
    return path


def _line(number: FittedNumber) -> str:
    about = "changes nothing" if number.silent else "" if number.low is None else f"{number.low:.6g} to {number.high:.6g}"
    return f"{toml(number.variable)} = {number.value!r}" + f"  # {about}" * bool(about)


def traces(result: Calibration, problem: Calibrating) -> Plots:
    """Measured and simulated over time, with the numbers as they were given and as they were found; all of a run zoom together."""
    played, which = problem.played, _drawn(problem)
    before = problem.errors({n.name: n.start for n in problem.numbers}, which)
    after = problem.errors(result.values, which)
    plots = []
    for name in played.outputs[:ROWS]:
        for column, i in enumerate(which):
            run, over = problem.runs[i], axis(name, played.parts.variables[name].unit)
            marks = measured(run.time, run.signals[name], played.trusted(name, [i])[0])
            for errors, words, colour in ((before, "as given", BEFORE), (after, "calibrated", AFTER)):
                if errors is not None:
                    marks.append(line(run.time, run.signals[name] - errors[name][column], words, colour))
            plots.append({"title": label(run), "x": axis("time", "s"), "y": over, "marks": marks, "shares": label(run)})
    return plots


def measured(time: np.ndarray, x: np.ndarray, good: np.ndarray) -> list[dict[str, Any]]:
    """What was measured, where it counts, as marks."""
    return [line(time, np.where(good, x, np.nan), "measured", MEASURED)]


def _drawn(problem: Calibrating) -> Sequence[int]:
    """Some runs: those that judge are among them."""
    count = len(problem.runs)
    if count <= COLUMNS:
        return range(count)
    others = [i for i in range(count) if i not in problem.which][: COLUMNS - 1]
    return sorted([*problem.which[: COLUMNS - len(others)], *others])
