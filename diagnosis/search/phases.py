"""What belongs to single runs, phases and zeros, as a fit frees it, and as it is found for runs that did not teach.

A hypothesis has the phase of its wave once, and so the contest counts it once. `Problem.fit` frees those of the other
runs with it. That is paid for where all else is: on blocks that a fit did not see, under phases of the other blocks of
their run; and chance draws have as many. A run that judges has a phase of its own, too, and nothing else could tell it.
By chance that takes the noise of one sample, of the hundreds that a run has; but a wave bends to any slow error a little
where its phase may be chosen. So whether a cause is believed is asked of blocks that its run's phase was not fitted to.

Zeros are no hypothesis: a drive whose runs begin anywhere is sound. They are free in every fit, the first included.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable
from dataclasses import replace
from math import tau

import numpy as np

from selflock.fmus.effect import OFFSET, PHASE

from ..data.log import MeasuredRun
from ..data.rig import split
from ..data.signals import ANGLE_OF, MOVES
from ..residuals.experiment import Experiment
from ..residuals.phase import name, parameter, relative
from ..rules import RULES
from .fit import fit, rho
from .hypotheses import Free


def marked(experiment: Experiment, free: Iterable[Free]) -> tuple[Free, ...]:
    """The same numbers; it is said which of them are another in each run."""
    return tuple(replace(p, of_run=p.role == PHASE and _of_runs(experiment, p)) for p in free)


def _of_runs(experiment: Experiment, p: Free) -> bool:
    """Whether each run has this phase for itself.

    Not where a run is one block alone: no other tells its phase where it is held out.
    """
    if experiment.steady:
        return False
    prefix, component = split(p.name.rpartition(".")[0], experiment.rig.drives)
    channels = [ch for (_, of), ch in experiment.channels.items() if of == prefix]
    several = np.bincount(experiment.layout.run_of).min() >= RULES.search.phase_blocks
    simulated = _simulated(experiment)  # from where a run begins, which an angle of the load tells for all that turns with it
    anywhere = lambda ch: not ch.has("load.angle") if simulated else relative(ch, component, p.shaft)
    return bool(several) and any(map(anywhere, channels))


def untold(experiment: Experiment, parameter: str, among: Iterable[int]) -> list[int]:
    """Those of the runs of whose log alone the rig does not tell this number."""
    return [i for i in among if parameter not in experiment.rig.of_log(experiment.runs[i].log)]


def zeros(experiment: Experiment, teach: Iterable[int]) -> list[Free]:
    """Where a load that gravity pulls at was at first, in each run that teaches, where speeds alone tell of its motion."""
    found = []
    for prefix in () if experiment.steady or _simulated(experiment) else experiment.rig.drives:
        angle = Free(f"{prefix}load.arm_angle", 0.0, -tau, tau, "rad", "angle of the arm where the run's own is 0", role=OFFSET)
        channels = [ch for (_, of), ch in experiment.channels.items() if of == prefix]
        measured = {move for move in MOVES for ch in channels if ch.has(move)}
        if not measured or not measured <= {*ANGLE_OF}:
            continue
        mine = [_alone(experiment, angle, i) for i in untold(experiment, angle.name, teach)]
        if mine and np.any(experiment.misfit({p.name: 1.0 for p in mine}) != experiment.misfit({p.name: 0.0 for p in mine})):
            found += mine
    return found


def _simulated(experiment: Experiment) -> bool:
    """Whether whole drives are, from where a run begins."""
    return any(residual.kind in ("drive", "whole") for residual in experiment.residuals)


def _alone(experiment: Experiment, p: Free, i: int) -> Free:
    """A number of run i alone. Twice round: a fit that starts anywhere in a turn meets no end of it."""
    mine, size = np.flatnonzero(experiment.layout.run_of == i), experiment.layout.bins * len(experiment.residuals)
    part = int(mine[0]) * size, (int(mine[-1]) + 1) * size
    return replace(p, name=name(experiment.runs[i], p.name), low=-tau, high=tau, part=part, of_run=False)


def beside(experiment: Experiment, free: Iterable[Free], teach: Iterable[int]) -> list[Free]:
    """The numbers of single runs that belong to these: of all runs that teach but the first, which has the wave's own."""
    return [_alone(experiment, p, i) for p in free if p.of_run for i in untold(experiment, p.name, teach)[1:]]


def best(
    loss: Callable[[dict[str, float]], np.ndarray], values: dict[str, float], runs: list[MeasuredRun], whose: str
) -> dict[str, float]:
    """The angles of these runs, by name, where each run's loss is least, all else as in `values`.

    loss: of values, of each of the runs. Of a simulation that is linear in the wave the squared error has two harmonics
    over such an angle, so that a few places tell all of it; of a law that is nearly linear they tell nearly all.
    """
    places = np.arange(RULES.search.phase_places) * tau / RULES.search.phase_places
    tried = np.array([loss(values | {name(run, whose): float(angle) for run in runs}) for angle in places])
    _, once, twice = np.fft.rfft(tried, axis=0)[:3, None] / len(places)
    fine = np.linspace(-np.pi, np.pi, RULES.search.phase_fine, endpoint=False)
    curve = (np.exp(1j * fine)[:, None] * once + np.exp(2j * fine)[:, None] * twice).real
    return {name(run, whose): float(fine[i]) for run, i in zip(runs, curve.argmin(0))}


def settled(
    experiment: Experiment,
    values: dict[str, float],
    free: Iterable[Free],
    taught: set[str],
    noise: np.ndarray,
    scale: float,
    seen: np.ndarray | None = None,
) -> dict[str, float]:
    """`values` with what belongs to runs that did not teach as these runs fit it best, all else as it is.

    free: of a fit. taught: keys of the runs that did. noise, scale: of each residual's bins, and where the loss turns.
    seen: blocks that they are fitted to; all.
    """
    asked = {parameter(p.name): replace(p, name=parameter(p.name)) for p in free if p.of_run or p.part}
    strangers = [i for i, run in enumerate(experiment.runs) if run.key not in taught]
    new = {whose: untold(experiment, whose, strangers) for whose in asked}
    flat = lambda v: experiment.misfit(v, noise).ravel()
    every = np.ones(experiment.layout.count, bool) if seen is None else seen
    rows = np.repeat(every, experiment.layout.bins * len(experiment.residuals))
    for whose in (whose for whose in asked if new[whose]):
        runs = [experiment.runs[i] for i in new[whose]]
        mine = lambda v, whose=whose: losses(experiment, flat(v) * rows, scale)[new[whose]]
        values = values | best(mine, values, runs, whose)
    alone = tuple(_alone(experiment, asked[whose], i) for whose in asked for i in new[whose])
    if not alone:
        return values
    return values | fit(flat, values, alone, values, rows, scale, RULES.search.effort_last).values


def losses(experiment: Experiment, misfit: np.ndarray, scale: float) -> np.ndarray:
    """Robust loss of each run."""
    loss = rho(misfit, scale) if np.isfinite(scale) else misfit**2
    return np.bincount(experiment.layout.run_of, loss.reshape(experiment.layout.count, -1).sum(1))
