"""What the noise of the voltage that drives an open loop makes of each channel of a whole drive.

Between its rows nobody logged the voltage. A controller that acts several times there, on counts and noise, leaves an instant in
the row where the motor had the mean; the difference goes into the simulation, through the winding and on into the motion, where
it is slow and no noise of neighbours. How large it is the log tells: an error of what drives a simulation is in the simulated
current and, with the other sign, in what is left of the measured one, whereas noise of that measurement is in the latter alone
(regression dilution; Fuller 1987, Measurement Error Models, ch. 1). So the drive is simulated once more with white noise on its
voltage, of as much as makes the current's fast part that much another.

A mean that goes straight from row to row is smoother than the voltage was, and has none of what it lacks: the current shows nothing
of that (Berkson 1950, J. Am. Stat. Assoc. 45, 164). How much it is the rows tell by how far each lies from the line between its
neighbours (`between_rows`).
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np

from ..rules import RULES
from . import driven, memory
from .channels import Channels
from .propagated import changes, of_means

if TYPE_CHECKING:
    from .experiment import Experiment
    from .residual import Residual

CURRENT = "motor.current"


def about_mean(parts: list[np.ndarray], trusted: list[np.ndarray]) -> np.ndarray:
    """Deviations from the mean of as many neighbours as tell noise, (groups, `near`), of groups that are trusted throughout."""
    near, found = RULES.residuals.near, [np.zeros((0, RULES.residuals.near))]
    for x, t in zip(parts, trusted):
        n = len(x) // near
        x, t = (y[: n * near].reshape(n, near) for y in (x, t))
        x = x[t.all(1)]
        found.append(x - x.mean(1, keepdims=True))
    return np.concatenate(found)


def fast(parts: list[np.ndarray], trusted: list[np.ndarray]) -> float:
    """Root mean square of these deviations."""
    found = about_mean(parts, trusted)
    return float(np.sqrt(np.sum(found**2) / max(1, len(found) * (RULES.residuals.near - 1))))


def of_driving(experiment: Experiment, residual: Residual, values: dict[str, float]) -> tuple[float, float]:
    """Noise (root mean square) that a whole drive's channel has of the voltage that drives it, beyond what is fast: of rows, of bins.

    0 where set-points drive it.
    """
    ch = experiment.channels[0, residual.prefix]
    if residual.kind != "whole" or driven.of(ch) != driven.VOLTAGE:
        return 0.0, 0.0
    (slow, bins), (of_rows, of_bins) = _by_current(experiment, residual, values), _by_rows(experiment, residual, values)
    return max(slow, of_rows), max(bins, of_bins)


def _by_rows(experiment: Experiment, residual: Residual, values: dict[str, float]) -> tuple[float, float]:
    """What the voltage between its rows makes of a channel, beyond what is fast: of rows, of bins."""
    known = experiment.remembered("voltage between rows")
    if "volts" not in known:
        known["volts"] = between_rows([experiment.channels[i, residual.prefix] for i in range(len(experiment.runs))])
    if residual.name not in known:
        volts = known["volts"]
        known[residual.name] = made_by(experiment, residual, values, {driven.NOISE: volts}) if volts > 0.0 else (0.0, 0.0, 0.0)
    rows, _, bins = known[residual.name]
    return rows, bins


def between_rows(runs: Sequence[Channels]) -> float:
    """Root mean square, V, of what the mean voltage from row to row may be beside a straight line; 0 where it is held from each row on.

    Of a walk (jumps at any instants are one, too) a row lies off the line between its neighbours by σ² h / 2, h the step of the
    rows, by twice that off the line between rows twice as far, and a mean between two rows off the line between these by σ² h / 12.
    What is new in each row (a spike of a controller that acts oftener, noise of a measurement) lies off both by 3/2 of its
    variance, all of which is in the mean. Jumps that are placed by themselves tell nothing.
    """
    near, far = [np.zeros(0)], [np.zeros(0)]
    for ch in runs:
        if driven.row_by_row(ch):
            continue
        names = driven.inputs(ch)
        x, good = np.prod([ch.true(name, {}) for name in names], axis=0), np.stack([ch.good(name) for name in names]).all(0)
        time = driven.sent(ch.run.time, ch)
        steps = np.diff(time)
        usual = float(np.median(steps[steps > 0.0])) if np.any(steps > 0.0) else np.inf
        new = good & np.append(True, steps > RULES.data.uneven * usual)  # a message counts once
        at = np.flatnonzero(new & driven.between_jumps(ch))
        for rows, off in ((1, near), (2, far)):
            off.append(_off_lines(x[at], time[at], rows, (1.0 + RULES.data.uneven) * usual))
    one, two = (float(np.mean(joined**2)) if len(joined := np.concatenate(off)) else np.inf for off in (near, far))
    if not np.isfinite(one):
        return 0.0
    walked = 2.0 * min(max(two - one, 0.0), one)
    return float(np.sqrt(walked / 12.0 + (one - 0.5 * walked) / 1.5))


def _off_lines(x: np.ndarray, time: np.ndarray, rows: int, longest: float) -> np.ndarray:
    """How far each value lies off the line between those so many rows before and behind; without gaps, s, that are longer."""
    steps = np.diff(time)
    whole = np.convolve(steps < longest, np.ones(rows), "valid") == rows if len(steps) >= rows else np.zeros(0, bool)
    beside = whole[:-rows] & whole[rows:]
    before, behind = time[rows:-rows] - time[: -2 * rows], time[2 * rows :] - time[rows:-rows]
    line = (x[: -2 * rows] * behind + x[2 * rows :] * before) / np.maximum(before + behind, 1e-12)
    return (x[rows:-rows] - line)[beside]


def _by_current(experiment: Experiment, residual: Residual, values: dict[str, float]) -> tuple[float, float]:
    """What the fast current says of it, of rows, of bins; 0 where no current tells."""
    current = next((r for r in experiment.residuals if r.kind == "whole" and r.output == residual.prefix + CURRENT), None)
    if current is None:
        return 0.0, 0.0
    # each channel asks for it with the same values
    asked, key = experiment.remembered("current not measured"), frozenset(values.items())
    size = memory.kept(asked, key, lambda: _of_current(experiment, current, values), 1)
    if size <= 0.0:
        return 0.0, 0.0
    known = experiment.remembered("noise of what drives it")
    if "volts" not in known:
        known["volts"] = _volts(experiment, current, values, size)
    volts, made = known["volts"]
    if residual.name not in known:
        known[residual.name] = made_by(experiment, residual, values, {driven.NOISE: volts})
    rows, _, bins = known[residual.name]
    return rows * size / made, bins * size / made


def _of_current(experiment: Experiment, current: Residual, values: dict[str, float]) -> float:
    """The fast part of the simulated current that is not in the measured one, A.

    Noise of a voltage is in its rows all the time. What few rows have is an event, as where the flanks of a play meet that the
    simulation has not, and drives nothing.
    """
    simulated, measured, good = zip(*experiment.compare(current, values))
    runs = [experiment.channels[i, current.prefix] for i in range(len(experiment.runs))]
    trusted = [g & np.isfinite(s) & ch.taken(driven.between_jumps(ch)) for g, s, ch in zip(good, simulated, runs)]
    shown = about_mean([np.where(t, s, 0.0) for s, t in zip(simulated, trusted)], trusted)
    left = about_mean([np.where(t, m - s, 0.0) for s, m, t in zip(simulated, measured, trusted)], trusted)
    shared = -np.sum(left * shown, axis=1) / (RULES.residuals.near - 1)
    usual = min(np.mean(shared), np.quantile(shared, 1.0 - RULES.residuals.seldom)) if len(shared) else 0.0
    return float(np.sqrt(max(usual, 0.0)))


def _volts(experiment: Experiment, current: Residual, values: dict[str, float], size: float) -> tuple[float, float]:
    """Noise of the voltage, V, that makes about that much of the fast current, and how much, A."""
    volts = size * experiment.channels[0, current.prefix].setting.value(current.prefix + "motor.resistance", values)
    for _ in range(2):  # a winding lets through a part of it
        moved, trusted = _moved(experiment, current, values, {driven.NOISE: volts})
        made = fast(moved, trusted)
        if made <= 0.0:
            return volts, np.inf
        volts, last = volts * size / made, volts
    return last, made


def made_by(
    experiment: Experiment, residual: Residual, values: dict[str, float], more: dict[str, float]
) -> tuple[float, float, float]:
    """What more values make of a channel: of rows, beyond what is fast and what is fast, and of bins."""
    moved, trusted = _moved(experiment, residual, values, more)
    joined, quick = np.concatenate([x[t] for x, t in zip(moved, trusted)]), fast(moved, trusted)
    slow = max(float(np.mean(joined**2)) - quick**2, 0.0) if len(joined) else 0.0
    return float(np.sqrt(slow)), quick, of_means(experiment, residual, moved, trusted)


def _moved(
    experiment: Experiment, residual: Residual, values: dict[str, float], more: dict[str, float]
) -> tuple[list[np.ndarray], list[np.ndarray]]:
    """By how much each run of a comparison is another with more values, and where that can be trusted."""
    moved, trusted = changes(*(experiment.compare(residual, v) for v in (values, values | more)))
    return [np.where(t, x, 0.0) for x, t in zip(moved, trusted)], trusted
