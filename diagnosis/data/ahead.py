"""An angle that runs ahead of its set-point: no drive knows where it will be sent, so the two may be exchanged."""

from __future__ import annotations

import numpy as np

from ..rules import RULES
from .finding import Finding, Said
from .log import MeasuredRun
from .motions import RATIO, number

ASKED = "controller.angle_setpoint"


def exchanged(runs: list[MeasuredRun], prefix: str, said: Said, suspects: set[str]) -> list[Finding]:
    """A remark where the angle is some rows early, and the two go together better so."""
    angle = next((n for n in ("load.angle", "reducer.input_angle") if all(prefix + n in run.signals for run in runs)), "")
    if not angle or suspects & {ASKED, angle, RATIO, "time"} or not all(prefix + ASKED in run.signals for run in runs):
        return []
    run = max(runs, key=len).head(RULES.data.ahead_samples)
    rows = RULES.data.ahead_within
    if len(run) < 4 * rows or said.rig.kind == "steady":
        return []
    geared = said.value(RATIO) if angle.startswith("reducer") else 1.0
    sound = run.usable(prefix + ASKED, prefix + angle)
    goal, had = (np.where(sound, run.signals[prefix + name], np.nan) for name in (ASKED, angle))
    left = {late: _apart(goal, had / geared, late, rows) for late in range(-rows, rows + 1)}
    if not all(map(np.isfinite, left.values())) or not left[0]:
        return []
    best = min(left, key=left.__getitem__)
    if best > -RULES.data.ahead_rows or left[best] * RULES.data.ahead_mends > left[0]:
        return []
    early = -best * float(np.median(np.diff(run.time)))
    text = f"{said(angle)} runs {number(1e3 * early)} ms ahead of {said(ASKED)}, and no drive knows where it will be sent"
    return [Finding(f"{text}: they may be exchanged, then swap their columns.", False, (angle, ASKED))]


def _apart(goal: np.ndarray, had: np.ndarray, late: int, rows: int) -> float:
    """What an angle that is taken so many rows late leaves of its set-point's way, root mean square."""
    apart = had[rows + late : len(had) - rows + late] - goal[rows : len(goal) - rows]
    apart = apart[np.isfinite(apart)]
    return float(np.std(apart)) if len(apart) > rows else float("nan")
