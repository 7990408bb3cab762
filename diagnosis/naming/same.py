"""One thing by several names: models that do as well as each other and that no inputs tell apart.

An offset before a controller is one behind the sensor that it is told of, and a gain of its own that is off is a scale of what it is
given. Such names are no rivals: whoever is told one of them is told all. So those that stand beside a cause are simulated, and
fitted to it by one step, under inputs drawn within what the logs went through (plan.compared); those that then differ from it
by no more than hides in the noise are the same.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np

from ..calibration.fit import remaining
from ..data.log import MeasuredRun
from ..data.rig import SMOOTH, Rig
from ..rules import RULES
from ..systems.parts import Parts
from .plan import Open, compared, drawn, of_round, ranged

if TYPE_CHECKING:
    from .round import Round
    from .run import Search


def same(found: Search, outcome: Round, seed: int) -> list[str]:
    """What beside a round's winner is the same under another name, by label."""
    if not outcome.beside or found.enough():
        return []
    work = found.work
    everywhere = lambda one: replace(one, numbers=tuple(replace(n, run=None) for n in one.numbers))  # of an event: at its times
    models = [everywhere(one) for _, one in of_round(found, outcome)]
    work.played.extend(work.inserts)
    noise = {name: floor for name, (_, floor) in remaining(found.best.problem, found.best.values).items()}
    return alike(models, work.rig, work.parts, [work.runs[i] for i in work.which], noise, seed)


def alike(
    models: Sequence[Open], rig: Rig, parts: Parts, runs: Sequence[MeasuredRun], noise: dict[str, float], seed: int
) -> list[str]:
    """The labels of models that are the first by other names. noise: of each output, in its unit."""
    longest, rng = max(runs, key=len), np.random.default_rng(seed)
    time = longest.time[: RULES.naming.glance] - longest.time[0]
    channels = [name for name in longest.signals if name not in noise]
    ranges, _ = ranged({}, runs, channels)
    inputs = [drawn(rng, ranges, len(time), rig.inputs == SMOOTH) for _ in range(RULES.naming.tried)]
    inputs.append({name: longest.signals[name][: len(time)] for name in channels})
    least = lambda name: RULES.pipeline.fine * float(np.std(longest.signals[name]))
    units = {name: max(size, least(name)) or 1.0 for name, size in noise.items()}
    apart = compared(rig, parts, models, inputs, time, units, lambda *_: None)[:, 0]
    return [one.label for one, more in zip(models[1:], apart.T[1:]) if np.max(more) <= RULES.naming.coarse**2]
