"""The study's report: one HTML file that needs no network."""

from __future__ import annotations

import base64
import re
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
from PIL import Image

from selflock.master import load, read
from selflock.master.files import told
from selflock.vehicle import Robot
from selflock.view import page, shown, stages
from selflock.view.figures import carried
from selflock.view.sheet import Sheet

from .claims import Claim, Runs
from .figures import COLOURS, FIGURES, POSTURES
from .manoeuvre import DURATION, WINDOWS
from .runs import SYSTEM, Done

SAMPLE = 0.01  # s, of the moving robot and the curves under it
TORQUE = "rear_reducer.input_torque"
PHASES = [
    (0.0, 2.0, "both track holders point forward"),
    (2.0, 3.0, "the rear holder is lifted"),
    (3.0, 4.0, "the rear holder is lowered"),
    (4.0, 6.0, "front holder forward, rear holder backward"),
    (6.0, 8.0, "all holders press down and raise the platform"),
    (8.0, 10.0, "the platform stands on the tips"),
]


def write(path: Path, runs: Runs, claims: list[Claim], postures: Path, done: list[Done]) -> Path:
    """The report with everything inside: figures, claims, parameters, moving robot."""
    curves = {f"figure_{number:02d}": [function(runs)] for number, (function, _) in FIGURES.items()}
    return page.write(
        path,
        page.environment("selflock.study"),
        "report.html.j2",
        _motion(runs, next(one.path for one in done if one.postures)) | carried(curves, dict.fromkeys(curves, 600)),
        facts=runs.facts,
        claims=claims,
        postures=_embedded(postures),
        captions={6: POSTURES} | {number: caption for number, (_, caption) in FIGURES.items()},
        parameters=parameters(SYSTEM.read_text(encoding="utf-8")),
        step=load(SYSTEM).run.step,
        done=[(one.case.name, one.seconds, _worst_bond(one.energy)) for one in done],
    )


def _embedded(file: Path) -> dict:
    with Image.open(file) as image:
        width, height = image.size
    data = base64.b64encode(file.read_bytes()).decode()
    return {"data": data, "width": width // 2, "height": height // 2}


def _worst_bond(energy: pd.DataFrame) -> tuple[str, float, float]:
    """The connection whose coupling swallowed or made the most energy: its name, J, parts of what crossed it."""
    worst = energy.loc[energy["lost"].abs().idxmax()]
    return str(worst.name), float(worst["lost"]), float(worst["relative"])


def _motion(runs: Runs, moving: Path) -> dict[str, Any]:
    """What the moving robot and the input torques of the eight runs are drawn from."""
    time = np.arange(0.0, DURATION + SAMPLE / 2, SAMPLE)
    robot = stages.checked(told(moving)["drawings"]["robot"], "robot")
    table, units = read(moving)
    columns = {name: np.interp(time, table["time"], table[name]) for name in dict.fromkeys(stages.columns_of(robot))}
    sheets, choices = [Sheet("motion", time, columns, units, set())], []
    for mode, of in (("kinematic", runs.kinematic), ("dynamic", runs.dynamic)):
        curves = []
        for mu, run in sorted(of.items()):
            curves.append({"run": len(sheets), "name": TORQUE, "label": f"μ = {mu:g}", "colour": COLOURS[mu]})
            sheets.append(Sheet(f"{mode}, μ = {mu:g}", time, {TORQUE: np.interp(time, run.time, run.F)}, {TORQUE: "N.m"}, set()))
        choices.append({"label": mode, "curves": curves})
    return {
        "runs": shown.runs_of(sheets)[0],
        "stages": [{"label": "the robot", "of": [{"run": 0, **robot}]}],
        "choices": choices,
        "windows": list(WINDOWS.values()),
        "phases": PHASES,
        "plays": True,
        "again": True,
    }


def parameters(system: str) -> list[tuple[str, str, str, str]]:
    """Name, value, unit and source of every commented value in a system file, then the vehicle's own; twins only once."""
    found, component = [], ""
    for line in system.splitlines():
        if table := re.match(r"\[(?:values|components\.(\w+)|drives\.(\w+)\.(\w+))", line):
            component = f"{table[1] or f'{table[2]}_{table[3]}'}." if table[1] or table[2] else ""
        elif (entry := re.match(r"(\w+) = (\S+)\s+# (.+)", line)) and not component.startswith("front_"):
            unit, _, source = entry[3].partition("·")
            found.append((f"{component}{entry[1]}", entry[2].strip('"'), unit.strip(), source.strip()))
    named = {name for name, *_ in found}
    for variable in Robot.described:
        if variable.causality == "parameter" and f"robot.{variable.name}" not in named:
            found.append((f"robot.{variable.name}", _plain(variable.start), variable.unit, variable.description))
    return found


def _plain(value) -> str:
    return f"{value:g}" if isinstance(value, float) else str(value)
