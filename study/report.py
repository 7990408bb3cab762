"""The study's report: one HTML file that needs no network."""

from __future__ import annotations

import base64
import json
import re
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
from jinja2 import Environment, PackageLoader, StrictUndefined
from markupsafe import Markup
from PIL import Image

from selflock.fmus.shown import policy
from selflock.master import load
from selflock.vehicle import Robot

from .claims import Claim, Curves, Runs
from .figures import COLOURS, ENDS
from .manoeuvre import DURATION, WINDOWS
from .runs import POSTURE_EVERY, SYSTEM, Done

SAMPLE = 0.01  # s, of the curves under the moving robot
PHASES = [
    (0.0, 2.0, "both track holders point forward"),
    (2.0, 3.0, "the rear holder is lifted"),
    (3.0, 4.0, "the rear holder is lowered"),
    (4.0, 6.0, "front holder forward, rear holder backward"),
    (6.0, 8.0, "all holders press down and raise the platform"),
    (8.0, 10.0, "the platform stands on the tips"),
]

# What is drawn of a posture, back to front; widths in mm.
CHASSIS: dict[str, Any] = {"fill": "#d5dce3", "colour": "#8b95a0", "width": 3}
AT_EACH_END: dict[str, dict[str, Any]] = {
    "track": {"fill": "#ffffffd8", "colour": "#20262e", "width": 8, "links": True},
    "sprocket": {"wheel": True, "width": 4},
    "idler": {"wheel": True, "width": 4},
    "holder": {"width": 14},
}
LINES = {"chassis": CHASSIS} | {
    f"{end}_{what}": {"colour": colour} | style for end, colour in ENDS.items() for what, style in AT_EACH_END.items()
}


def write(path: Path, runs: Runs, claims: list[Claim], figures: dict[int, tuple[Path, str]], done: list[Done]) -> Path:
    """The report with everything inside: figures, claims, parameters, moving robot."""
    environment = Environment(
        loader=PackageLoader("selflock.study", "."), undefined=StrictUndefined, autoescape=True, trim_blocks=True
    )
    postures = next(one.postures for one in done if one.postures)
    data = json.dumps(_motion(runs, postures), separators=(",", ":")).replace("<", "\\u003c")
    script = f"const D = {data};\n{Path(__file__).with_name('report.js').read_text(encoding='utf-8')}"
    html = environment.get_template("report.html.j2").render(
        facts=runs.facts,
        claims=claims,
        figures={number: _embedded(file, caption) for number, (file, caption) in figures.items()},
        parameters=parameters(SYSTEM.read_text(encoding="utf-8")),
        step=load(SYSTEM).run.step,
        done=[(one.case.name, one.seconds, _worst_bond(one.energy)) for one in done],
        policy=Markup(policy(script)),
        script=Markup(script),
    )
    path.write_text(html, encoding="utf-8")
    return path


def _embedded(file: Path, caption: str) -> dict:
    with Image.open(file) as image:
        width, height = image.size
    data = base64.b64encode(file.read_bytes()).decode()
    return {"data": data, "width": width // 2, "height": height // 2, "caption": caption}


def _worst_bond(energy: pd.DataFrame) -> tuple[str, float, float]:
    """The connection whose coupling swallowed or made the most energy: its name, J, parts of what crossed it."""
    worst = energy.loc[energy["lost"].abs().idxmax()]
    return str(worst.name), float(worst["lost"]), float(worst["relative"])


def _motion(runs: Runs, postures: dict[float, dict]) -> dict:
    """What the moving robot needs: postures in whole mm from the chassis, input torques of the eight runs."""
    frames = []
    for _, posture in sorted(postures.items()):
        x = float(posture["chassis"][:-1, 0].mean())
        points = np.concatenate([_drawn(name, posture[name]) for name in LINES]) - (x, 0.0)
        frames.append([round(1000 * x), *np.rint(1000 * points).astype(int).ravel().tolist()])
    first = next(iter(postures.values()))
    lines = [{"n": len(_drawn(name, first[name])), **style} for name, style in LINES.items()]
    torque = {
        mode: [_sampled(run) for _, run in sorted(of.items())]
        for mode, of in (("kinematic", runs.kinematic), ("dynamic", runs.dynamic))
    }
    settled = np.concatenate([np.array(curve)[int(0.5 / SAMPLE) :] for curves in torque.values() for curve in curves])
    low, high = float(settled.min()), float(settled.max())
    room = 0.08 * (high - low)
    return {
        "duration": DURATION,
        "every": POSTURE_EVERY,
        "lines": lines,
        "frames": frames,
        "sample": SAMPLE,
        "torque": torque,
        "range": [low - room, high + room],
        "tick": _tick(high - low),
        "friction": sorted(runs.kinematic),
        "colours": [COLOURS[mu] for mu in sorted(runs.kinematic)],
        "windows": list(WINDOWS.values()),
        "phases": PHASES,
    }


def _drawn(name: str, points: np.ndarray) -> np.ndarray:
    """Of a wheel, its axis and one point of its rim."""
    return points[:2] if name.endswith(("sprocket", "idler")) else points


def _sampled(run: Curves) -> list[float]:
    return np.round(np.interp(np.arange(0, DURATION + SAMPLE / 2, SAMPLE), run.time, run.F), 4).tolist()


def _tick(span: float) -> float:
    """A round distance of about a fifth of the span."""
    power = 10.0 ** np.floor(np.log10(span / 5))
    return float(min((m * power for m in (1, 2, 5, 10)), key=lambda tick: abs(tick - span / 5)))


def parameters(system: str) -> list[tuple[str, str, str, str]]:
    """Name, value, unit and source of every commented value in a system file, then the vehicle's own; twins only once."""
    found, component = [], ""
    for line in system.splitlines():
        if table := re.match(r"\[(?:values|components\.(\w+))", line):
            component = f"{table[1]}." if table[1] else ""
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
