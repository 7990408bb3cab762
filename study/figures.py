"""The study's figures 6 to 17 redrawn from our runs, and one more for its advice.

One friction coefficient has one colour in every figure; the windows in which the claims look are shaded the same.
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

from .claims import LIMIT, Curves, Runs
from .claims.drive import ELECTRIC, LONG_HOLD, MECHANICAL, duty
from .manoeuvre import DURATION, WINDOWS
from .turns import FRONT, REAR, motion

COLOURS = {0.0: "#2f6fae", 0.01: "#3c9a74", 0.02: "#d99a1c", 0.03: "#c2413a"}
ENDS = {"front": "#7a5ea8", "rear": "#1f7f93"}
FAINT, INK, SHADE = "#b8bec6", "#20262e", "#eef1f4"
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
MOMENTS = (1.0, 2.5, 3.0, 3.5, 5.0, 6.8, 7.2, 9.0)  # s, of the posture sequence


def draw(runs: Runs, postures: dict[float, dict], folder: Path) -> dict[int, tuple[Path, str]]:
    """All figures as PNG; by number: file and caption."""
    folder.mkdir(parents=True, exist_ok=True)
    drawn = {}
    with rc_context(STYLE):
        for number, (function, caption) in FIGURES.items():
            figure = function(runs, postures) if number == 6 else function(runs)
            path = folder / f"figure_{number:02d}.png"
            figure.savefig(path)
            drawn[number] = (path, caption)
    return drawn


def _canvas(ylabel: str, height: float = 3.0) -> tuple[Figure, Axes]:
    """Axes over the manoeuvre's time, with the windows shaded and named."""
    figure = Figure(figsize=(6.6, height), layout="constrained")
    axes = figure.subplots()
    for name, (start, stop) in WINDOWS.items():
        axes.axvspan(start, stop, color=SHADE, lw=0, zorder=0)
        axes.text(
            (start + stop) / 2,
            1.01,
            name,
            transform=axes.get_xaxis_transform(),
            ha="center",
            va="bottom",
            fontsize=7.5,
            color="#6a737d",
        )
    axes.axhline(0, color="#7b8490", lw=0.7, zorder=1)
    axes.set(xlim=(0, DURATION), xlabel="time in s", ylabel=ylabel, xticks=range(11))
    return figure, axes


def _legend(axes: Axes, ncols: int = 4) -> None:
    """Below the axes, filled row by row."""
    lines, labels = axes.get_legend_handles_labels()
    rows = -(-len(lines) // ncols)
    order = [row * ncols + column for column in range(ncols) for row in range(rows) if row * ncols + column < len(lines)]
    axes.figure.legend(
        [lines[k] for k in order],
        [labels[k] for k in order],
        loc="outside lower center",
        ncols=ncols,
        columnspacing=1.4,
        handlelength=1.6,
    )


def _frame(axes: Axes, *curves: np.ndarray) -> None:
    """Limits that show the curves whole, with the first instants (the robot settling on the ground) cut off."""
    low = min(0.0, *(float(curve.min()) for curve in curves))
    high = max(0.0, *(float(curve.max()) for curve in curves))
    room = 0.06 * (high - low) or 1.0
    axes.set_ylim(low - room, high + room)


def _settled(run: Curves, values: np.ndarray) -> np.ndarray:
    return values[run.time >= 0.5]


def _by_friction(ylabel: str, of: Callable[[Curves], np.ndarray], runs: dict[float, Curves]) -> Figure:
    figure, axes = _canvas(ylabel)
    for mu, run in sorted(runs.items()):
        axes.plot(run.time, of(run), color=COLOURS[mu], label=f"μ = {mu:g}", zorder=3 + mu)
    _frame(axes, *(_settled(run, of(run)) for run in runs.values()))
    _legend(axes)
    return figure


def postures(runs: Runs, postures: dict[float, dict]) -> Figure:
    figure = Figure(figsize=(6.6, 2.3), layout="constrained")
    grid = figure.subplots(2, 4).ravel()
    times = np.array(sorted(postures))
    for axes, moment in zip(grid, MOMENTS):
        time = float(times[np.argmin(np.abs(times - moment))])
        sketch(axes, postures[time])
        axes.set_title(f"{time:.1f} s", fontsize=9, color=INK, pad=2)
    return figure


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


def setpoints(runs: Runs) -> Figure:
    figure, axes = _canvas("holder angle in °")
    time = np.linspace(0, DURATION, 1001)
    run = runs.dynamic[0.0]
    for (end, colour), turns in zip(ENDS.items(), (FRONT, REAR)):
        axes.plot(
            time, [math.degrees(motion(turns, t).angle) for t in time], color=colour, lw=3.5, alpha=0.3, label=f"{end}, desired"
        )
        axes.plot(run.time, np.degrees(run[f"robot.{end}_angle"]), color=colour, label=f"{end}, realised at μ = 0")
    axes.set_yticks(range(-90, 271, 45))
    _legend(axes)
    return figure


def input_torque(mu: float):
    """Kinematic mode, one friction coefficient; the frictionless curve behind it for comparison."""

    def function(runs: Runs) -> Figure:
        figure, axes = _canvas("rear input torque in N·m")
        run, base = runs.kinematic[mu], runs.kinematic[0.0]
        if mu:
            axes.plot(base.time, base.F, color=FAINT, label="μ = 0")
        axes.plot(run.time, run.F, color=COLOURS[mu], label=f"μ = {mu:g}", zorder=3)
        _frame(axes, _settled(run, run.F), _settled(base, base.F))
        _legend(axes)
        return figure

    return function


def output_torque(runs: Runs) -> Figure:
    figure, axes = _canvas("rear output torque in N·m")
    for mode, mu, run in runs.each():
        dashes = (0, (4, 2)) if mode == "kinematic" else "-"
        axes.plot(run.time, run.P, color=COLOURS[mu], lw=0.9, label=f"μ = {mu:g}, {mode}", linestyle=dashes)
    _frame(axes, *(_settled(run, run.P) for _, _, run in runs.each()))
    _legend(axes)
    return figure


def compared_kinematic(runs: Runs) -> Figure:
    return _by_friction("rear input torque in N·m", lambda run: run.F, runs.kinematic)


def compared_dynamic(runs: Runs) -> Figure:
    return _by_friction("rear input torque in N·m", lambda run: run.F, runs.dynamic)


def mechanical_power(runs: Runs) -> Figure:
    return _by_friction("rear mechanical power in W", lambda run: run[MECHANICAL], runs.dynamic)


def electric_power(runs: Runs) -> Figure:
    return _by_friction("rear electric power in W", lambda run: run[ELECTRIC], runs.dynamic)


def both_powers(runs: Runs) -> Figure:
    figure, axes = _canvas("rear motor's power in W")
    run = runs.dynamic[0.0]
    axes.plot(run.time, run[ELECTRIC], color=COLOURS[0.0], label="electric")
    axes.plot(run.time, run[MECHANICAL], color=COLOURS[0.0], lw=1, linestyle=(0, (4, 2)), label="mechanical")
    _frame(axes, _settled(run, run[ELECTRIC]), _settled(run, run[MECHANICAL]))
    _legend(axes)
    return figure


def advice(runs: Runs) -> Figure:
    figure = Figure(figsize=(6.6, 3.0), layout="constrained")
    axes = figure.subplots()
    levels = np.array(sorted(runs.sweep))
    hold, move = np.array([duty(runs.sweep[mu]) for mu in levels]).T
    axes.axvline(LIMIT, color=FAINT, lw=1)
    axes.text(
        LIMIT,
        1.01,
        "self-locking limit",
        transform=axes.get_xaxis_transform(),
        ha="center",
        va="bottom",
        fontsize=8,
        color="#6a737d",
    )
    axes.plot(levels, hold, "o--", ms=3, color=ENDS["front"], label=f"to hold configuration C for {LONG_HOLD:g} s")
    axes.plot(levels, move, "o-", ms=3, color=ENDS["rear"], label="to move once (2–4 s, 6–8 s)")
    axes.plot(levels, hold + move, "-", color=INK, lw=1.6, label="both")
    axes.set(xlabel="friction coefficient μ", ylabel="electric energy in J", xlim=(0, levels[-1]), ylim=(0, None))
    _legend(axes, 3)
    return figure


FIGURES = {
    6: (postures, "The sequence of configurations. The robot drives to the right."),
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
