"""Whether a drive hunts: a simulation from its set-points then meets no log, whatever is right in it.

A loop around a play, or one that is late, may swing by itself. Nothing asks for that motion, so its phase is nobody's:
where a number changes by little, the swing is as large as before and soon somewhere else. What a number does is then
not in proportion to it, as it is in a loop that follows its set-points: a hundredth more of it moves the drive by many
hundredths of what all of it does. Causes that make a loop swing say why a log was not met only where they make it swing as widely
as the log does: two swings of one size in any phase are apart by as much as either is wide.
"""

from __future__ import annotations

from collections.abc import Iterable

import numpy as np

from selflock.fmus.effect import PERIOD, SHAPES, STEP

from ..residuals.drive_experiment import DriveExperiment
from ..residuals.mending import rms
from ..rules import RULES
from ..search.hypotheses import Free


def hunts(experiment: DriveExperiment, values: dict[str, float], free: Iterable[Free]) -> bool:
    """Whether a whole drive under these values is moved out of all proportion by a little more of what `free` has of causes.

    Asked of how much there is of something, not of what it looks like: another order of a wave is another wave.
    """
    causes = [p for p in free if not p.of_recorder and p.role not in (*SHAPES, PERIOD, STEP) and p.name in values]
    little = RULES.judge.little_more
    without = values | {p.name: p.nominal for p in causes}
    more = values | {p.name: values[p.name] + little * (values[p.name] - p.nominal) for p in causes}
    shares = []
    for residual in experiment.residuals:
        here, none, further = (experiment.compare(residual, v) for v in (values, without, more))
        apart = lambda others, here=here: np.sqrt(sum(np.sum((a[0] - b[0])[a[2]] ** 2) for a, b in zip(here, others)))
        if (every := apart(none)) > 0.0:
            shares.append(apart(further) / every)
    return bool(shares) and float(np.median(shares)) > RULES.judge.hunts * little


def as_widely(experiment: DriveExperiment, before: dict[str, float], after: dict[str, float]) -> bool:
    """Whether causes move a whole drive from what it does without them as far as the log is from that, in the middle of its channels.

    Within `judge.as_widely` either way; channels that they do not move, such as a supply that was measured, say nothing.
    """
    shares = []
    for residual in experiment.residuals:
        runs = [*zip(*(experiment.compare(residual, values) for values in (before, after)))]
        moved = rms([(now[0] - was[0])[was[2] & now[2]] for was, now in runs])
        off = rms([(was[1] - was[0])[was[2] & now[2]] for was, now in runs])
        if moved > 0.0 and off > 0.0:
            shares.append(abs(float(np.log(moved / off))))
    return bool(shares) and float(np.median(shares)) <= np.log(RULES.judge.as_widely)
