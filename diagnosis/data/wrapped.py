"""Angles that begin anew after a turn, or where their counter ends, and so jump where a shaft goes on."""

from __future__ import annotations

from collections.abc import Iterable
from math import pi

import numpy as np

from .finding import Finding, Said
from .log import MeasuredRun
from .signals import SPEED_OF

PERIODS = (360.0, 2.0 * pi, 1.0, 4096.0, 65536.0, 16384.0, 8192.0, 1024.0, 32768.0)  # degrees, rad, turns, counts


def period(x: np.ndarray, known: Iterable[float] = PERIODS) -> float:
    """That after which an angle begins anew, one of those known; 0 where it does not."""
    x = x[np.isfinite(x)]
    width = float(np.ptp(x)) if len(x) else 0.0
    steps = np.diff(x)
    jumps = steps[abs(steps) > 0.8 * width]
    usual = float(np.quantile(abs(steps), 0.9)) if len(steps) else 0.0
    if not len(jumps) or usual > 0.2 * width or len(jumps) > 0.1 * len(x):
        return 0.0
    return next((one for one in known if 0.9 * one < width <= 1.001 * one), 0.0)


def contradictions(runs: list[MeasuredRun], prefix: str, said: Said) -> list[Finding]:
    """Measured angles that jump by a turn: no shaft does, and whatever follows from their motion is wrong."""
    found = []
    for name in () if said.linear else SPEED_OF:
        if any(period(run.signals[prefix + name], (2.0 * pi,)) for run in runs if prefix + name in run.signals):
            text = f"{said(name)} jumps back by a turn where the shaft goes on: it begins anew there"
            mend = (
                "write beside its column what a turn is in its unit: wraps = 360.0 of degrees, 6.283185307 of rad, 1.0 of turns"
            )
            found.append(Finding(f"{text}. For its way, {mend}.", True, (name,)))
    return found
