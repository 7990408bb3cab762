"""A gear whose output is held fast while its input is turned to and fro: the classic test of play and wind-up."""

from __future__ import annotations

import numpy as np

from ..errors import DataError
from ..rules import RULES
from .log import MeasuredRun
from .rig import Rig


def refuse_clamped(runs: list[MeasuredRun], rig: Rig) -> None:
    """DataError for a log whose output stands still while its input shaft winds up: no comparison of a drive is of that.

    What it tells, the stiffness of the shaft and the play, is in the sentence.
    """
    ratio = rig.parameters.get("reducer.gear_ratio", 0.0)
    if rig.kind == "steady" or rig.drives != ("",) or not ratio:
        return
    for run in runs:
        if not {"reducer.input_angle", "load.angle"} <= set(run.signals):
            continue
        good = run.usable("reducer.input_angle", "load.angle")
        if good.sum() < RULES.data.shortest_log:
            continue
        turned, held = run.signals["reducer.input_angle"][good], run.signals["load.angle"][good]
        way, left = (float(np.ptp(np.quantile(x, RULES.data.range_quantiles))) for x in (turned, held))
        if 0.0 < way < 2.0 * np.pi and left < RULES.data.clamped * way / ratio:
            names = {column.signal: column.column for column in rig.columns}
            raise DataError(
                f"{run.log}: column {names.get('load.angle', 'load.angle')!r} (load.angle) stands still while the input shaft turns to and fro by "
                f"{way:.3g} rad, {way / ratio:.3g} rad at the output: the output is clamped. A replay and a diagnosis ask what a motion takes, "
                f"and here is none.{_told(run, rig, good, turned / ratio - held, ratio)} Give what this test says as reducer.shaft_stiffness "
                "(and reducer.backlash) and take a log of a drive that moves."
            )


def _told(run: MeasuredRun, rig: Rig, good: np.ndarray, twist: np.ndarray, ratio: float) -> str:
    """Stiffness and play of a clamped gear, from its torque over its twist: slopes of both flanks, and the way between them."""
    torque = run.signals.get("motor.torque", run.signals.get("reducer.input_torque"))
    constant = rig.parameters.get("motor.torque_constant", 0.0)
    if torque is None and constant and "motor.current" in run.signals:
        torque = constant * run.signals["motor.current"]
    if torque is None:
        return ""
    load = torque[good] * ratio
    high = 0.3 * float(np.quantile(abs(load), RULES.data.range_quantiles[1]))
    slopes, zeros = [], []
    for side in (1.0, -1.0):
        flank = side * load > high
        if flank.sum() < RULES.data.fewest_pieces or np.ptp(twist[flank]) == 0.0:
            return ""
        slope, at = np.polyfit(load[flank], twist[flank], 1)  # the torque is what is given
        if slope <= 0.0:
            return ""
        slopes.append(float(slope))
        zeros.append(float(at))
    play = zeros[0] - zeros[1]
    return (
        f" Its torque over its twist says about {1.0 / np.mean(slopes):.3g} N.m/rad of stiffness at the output and {max(play, 0.0):.2g} rad of play, "
        "with the gear's friction left in both."
    )
