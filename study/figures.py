"""The study's figures 6 to 17 redrawn from our runs, and one more for its advice.

Figure 6, postures, is a picture; the others are data for the page's script (selflock.view.figures). One friction coefficient
has one colour in every figure; the windows in which the claims look are shaded the same.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
from matplotlib import rc_context
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from selflock.view.figures import axis, line, rule, window

from .claims import LIMIT, Curves, Runs
from .claims.drive import ELECTRIC, LONG_HOLD, MECHANICAL, duty
from .manoeuvre import DURATION, WINDOWS
from .turns import FRONT, REAR, motion

COLOURS = {0.0: "#2f6fae", 0.01: "#3c9a74", 0.02: "#d99a1c", 0.03: "#c2413a"}
ENDS = {"front": "#7a5ea8", "rear": "#1f7f93"}
INK = "#20262e"
STYLE: dict[Any, Any] = {  # of matplotlib's rcParams
    "font.size": 9.5,
    "axes.spines.top": False,
    "axes.spines.right": False,
    "axes.edgecolor": "#7b8490",
    "axes.labelcolor": INK,
    "xtick.color": "#4c5560",
    "ytick.color": "#4c5560",
    "axes.linewidth": 0.8,
    "lines.linewidth": 1.2,
    "lines.solid_joinstyle": "round",
    "legend.frameon": False,
    "legend.fontsize": 9,
    "figure.dpi": 200,
}
SETTLED = 0.5  # s; before that the robot settles on the ground
Plot = dict[str, Any]
MOMENTS = (1.0, 2.5, 3.0, 3.5, 5.0, 6.8, 7.2, 9.0)  # s, of the posture sequence


def draw_postures(postures: dict[float, dict], path: Path) -> Path:
    """The sequence of configurations as PNG."""
    with rc_context(STYLE):
        figure = Figure(figsize=(6.6, 2.3), layout="constrained")
        grid = figure.subplots(2, 4).ravel()
        times = np.array(sorted(postures))
        for axes, moment in zip(grid, MOMENTS):
            time = float(times[np.argmin(np.abs(times - moment))])
            sketch(axes, postures[time])
            axes.set_title(f"{time:.1f} s", fontsize=9, color=INK, pad=2)
        path.parent.mkdir(parents=True, exist_ok=True)
        figure.savefig(path)
    return path


def sketch(axes: Axes, posture: dict[str, np.ndarray]) -> None:
    """One posture in the side view, centred on the chassis."""
    x0 = posture["chassis"][:-1, 0].mean()
    axes.axhline(0, color="#7b8490", lw=1)
    axes.fill(*_seen(posture["chassis"], x0), facecolor="#d5dce3", edgecolor="#7b8490", lw=0.8)
    for end, colour in ENDS.items():
        axes.fill(*_seen(posture[f"{end}_track"], x0), facecolor="#ffffffcc", edgecolor=INK, lw=0.9)
        for wheel in ("sprocket", "idler"):
            axes.fill(*_seen(posture[f"{end}_{wheel}"][1:], x0), facecolor="none", edgecolor=colour, lw=0.8)
        axes.plot(*_seen(posture[f"{end}_holder"], x0), color=colour, lw=2.2)
    axes.set(xlim=(-0.62, 0.62), ylim=(-0.03, 0.5), aspect="equal")
    axes.axis("off")


def _seen(points: np.ndarray, x0: float) -> np.ndarray:
    return (points - (x0, 0.0)).T


def _over_time(label: str, unit: str, *curves: dict[str, Any]) -> Plot:
    """Curves over the manoeuvre's time, with the windows shaded and named; how high it is say the curves once the robot has
    settled on the ground."""
    shaded = [window(start, stop, name) for name, (start, stop) in WINDOWS.items()]
    return {"x": axis("time", "s"), "y": axis(label, unit, start=0.0, end=0.0, since=SETTLED), "marks": [*shaded, *curves]}


def _by_friction(label: str, unit: str, of: Callable[[Curves], np.ndarray], runs: dict[float, Curves]) -> Plot:
    curves = [line(run.time, of(run), f"μ = {mu:g}", COLOURS[mu]) for mu, run in sorted(runs.items())]
    return _over_time(label, unit, *reversed(curves))


def setpoints(runs: Runs) -> Plot:
    time, run, curves = np.linspace(0, DURATION, 1001), runs.dynamic[0.0], []
    for (end, colour), turns in zip(ENDS.items(), (FRONT, REAR)):
        desired = np.array([math.degrees(motion(turns, t).angle) for t in time])
        curves.append(line(time, desired, f"{end}, desired", colour, dash=2))
        curves.append(line(run.time, np.degrees(run[f"robot.{end}_angle"]), f"{end}, realised at μ = 0", colour))
    return _over_time("holder angle", "°", *curves)


def input_torque(mu: float) -> Callable[[Runs], Plot]:
    """Kinematic mode, one friction coefficient; the frictionless curve behind it for comparison."""

    def function(runs: Runs) -> Plot:
        run, base = runs.kinematic[mu], runs.kinematic[0.0]
        beside = [line(base.time, base.F, "μ = 0", COLOURS[0.0], thin=True)] if mu else []
        return _over_time("rear input torque", "N.m", *beside, line(run.time, run.F, f"μ = {mu:g}", COLOURS[mu]))

    return function


def output_torque(runs: Runs) -> Plot:
    curves = [
        line(run.time, run.P, f"μ = {mu:g}, {mode}", COLOURS[mu], dash=int(mode == "kinematic"), thin=True)
        for mode, mu, run in runs.each()
    ]
    return _over_time("rear output torque", "N.m", *curves)


def compared_kinematic(runs: Runs) -> Plot:
    return _by_friction("rear input torque", "N.m", lambda run: run.F, runs.kinematic)


def compared_dynamic(runs: Runs) -> Plot:
    return _by_friction("rear input torque", "N.m", lambda run: run.F, runs.dynamic)


def mechanical_power(runs: Runs) -> Plot:
    return _by_friction("rear mechanical power", "W", lambda run: run[MECHANICAL], runs.dynamic)


def electric_power(runs: Runs) -> Plot:
    return _by_friction("rear electric power", "W", lambda run: run[ELECTRIC], runs.dynamic)


def both_powers(runs: Runs) -> Plot:
    run = runs.dynamic[0.0]
    electric = line(run.time, run[ELECTRIC], "electric", COLOURS[0.0])
    return _over_time("rear motor's power", "W", electric, line(run.time, run[MECHANICAL], "mechanical", COLOURS[0.0], dash=1))


def advice(runs: Runs) -> Plot:
    levels = np.array(sorted(runs.sweep))
    hold, move = np.array([duty(runs.sweep[mu]) for mu in levels]).T
    marks = [
        rule(LIMIT, label="self-locking limit"),
        line(levels, hold, f"to hold configuration C for {LONG_HOLD:g} s", ENDS["front"], dash=1, dots=True),
        line(levels, move, "to move once (2–4 s, 6–8 s)", ENDS["rear"], dots=True),
        line(levels, hold + move, "both", "ink"),
    ]
    return {"x": axis("friction coefficient μ"), "y": axis("electric energy", "J", start=0.0), "marks": marks}


POSTURES = "The sequence of configurations. The robot drives to the right."
FIGURES = {
    7: (setpoints, "Angles of the track holders, desired and realised."),
    8: (input_torque(0.0), "Input torque without friction, kinematic mode."),
    9: (output_torque, "Output torque in all eight runs."),
    10: (input_torque(0.01), "Input torque with friction below the self-locking limit, kinematic mode."),
    11: (input_torque(0.02), "Input torque at the self-locking limit, kinematic mode."),
    12: (input_torque(0.03), "Input torque of a self-locking reducer, kinematic mode."),
    13: (compared_kinematic, "Input torques compared, kinematic mode."),
    14: (compared_dynamic, "Input torques compared, dynamic mode."),
    15: (mechanical_power, "Mechanical power of the motor, dynamic mode."),
    16: (electric_power, "Electric power, dynamic mode."),
    17: (both_powers, "Mechanical and electric power without friction, dynamic mode."),
    18: (advice, "What friction costs and saves: electric energy over the coefficient."),
}
