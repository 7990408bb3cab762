"""The noise floor of a comparison: the error that a simulation without any fault would still leave.

Noise is told from a fault by being new in every sample: differences of neighbours have it, slow errors hardly. Three
things hide it from such differences. A value held over several samples is one sample of noise: only changes count. A
quantised value at rest has the same rounding error again and again: the floor is at least that of rounding, a step /
sqrt(12). And a steady-state point has no neighbours in time: the halves of its run, or neighbours in speed, take their
place.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from ..data.values import resolution, rough
from ..rules import RULES
from . import drive, driven
from .dilution import about_mean, of_driving
from .drive_experiment import DriveExperiment
from .experiment import Experiment
from .propagated import of_inputs, of_means
from .recorder import written_step
from .residual import Residual
from .rounding import rounded, rounding
from .sheet import of_sheet
from .stepping import of_steps


def floor(experiment: Experiment, residual: Residual, values: dict, errors: list[np.ndarray], trusted: list[np.ndarray]) -> float:
    """Noise (standard deviation, in the residual's unit) of what a residual compares; `errors` are those with these values."""
    if experiment.steady:
        return of_points(experiment, residual, values)
    if residual.kind == "whole":
        of_loop, fast, _ = of_steps(experiment, residual, values)
        own = max(of_rows(errors, trusted), of_rounding(experiment, residual, values)[0], fast)
        formulas, driving = of_formulas(experiment, residual, values), of_driving(experiment, residual, values)[0]
        slow = formulas, driving, of_loop  # of which it has nothing
        return float(np.sqrt(own**2 + sum(x**2 for x in slow)))
    reach = experiment.reach(residual)
    measured = np.concatenate([run.signals[residual.output][run.usable(residual.output)] for run in experiment.runs])
    of_neighbours = of_samples(errors, trusted, reach, resolution(measured) if reach == 1 else 0.0)
    return max(of_neighbours, of_inputs(experiment, residual)[0]) if isinstance(experiment, DriveExperiment) else of_neighbours


def of_samples(
    errors: list[np.ndarray], trusted: list[np.ndarray], reach: int = 1, quantum: float = 0.0, every: bool = False
) -> float:
    """Noise of single samples: of changes from neighbour to neighbour, `reach` samples on, where smoothing ends.

    every: by all of them but outliers, where that is no more than what their median may be off by. Of 500 samples a median is off
    by 5 %, and held against its noise, noise alone is 8 % above it once in seventeen times; all together are off by 2 %. But what
    changes in some for another reason hides from the median alone.

    quantum: resolution of the measured channel. Rounding is taken as even over a step, its noise as quantum / sqrt(12)
    (Widrow 1956); where other noise dithers it the differences have it already.
    """
    rules = RULES.residuals
    steps = np.concatenate([(e[reach:] - e[:-reach])[t[reach:] & t[:-reach]] for e, t in zip(errors, trusted)])
    steps = abs(steps[steps != 0.0])
    if len(steps) <= rules.noise_samples:
        return 0.0
    usual = float(np.median(steps)) / rules.normal_median
    coarse = quantum > rules.coarse * usual  # differences are then a few multiples of the step, among which a median jumps
    if coarse or every:
        together = float(np.sqrt(np.mean(steps[steps <= rules.coarse_steps * max(usual, quantum)] ** 2)))
        usual = together if coarse else min(together, (1.0 + rules.noise_off * rules.noise_scatter / np.sqrt(len(steps))) * usual)
    return max(usual / np.sqrt(2.0), quantum / np.sqrt(12.0))


def of_rows(errors: list[np.ndarray], trusted: list[np.ndarray]) -> float:
    """Noise of rows about the mean of their neighbours: what a simulated whole leaves has no other that is as fast."""
    rules = RULES.residuals
    joined = np.sum(about_mean(errors, trusted) ** 2, axis=1) / (rules.near - 1)
    about = float(np.sqrt(np.mean(joined[joined <= np.quantile(joined, rules.near_tail)]))) if len(joined) else 0.0
    return max(about, of_rows_apart(errors, trusted))


def of_rows_apart(errors: list[np.ndarray], trusted: list[np.ndarray]) -> float:
    """Noise of rows that lie so far apart that no message stands behind two of them: by fourth differences, as `noise_of` has it.

    A table that goes straight between messages has noise that neighbours share, so that they vary less about their mean.
    """
    rules, found = RULES.residuals, [np.zeros(0)]
    apart = rules.leap_rows
    for e, t in zip(errors, trusted):
        if (n := len(e) - 4 * apart) > 0:
            there = np.stack([t[k * apart : k * apart + n] for k in range(5)]).all(0)
            found.append(rough(e, apart)[there])
    sizes = np.concatenate(found)
    return float(np.median(sizes)) / rules.normal_median if len(sizes) > rules.noise_samples else 0.0


def of_rounding(experiment: Experiment, residual: Residual, values: dict) -> tuple[float, float]:
    """What a whole drive's channel is off by its counts: root mean square of rows, and of bins."""
    layout, zeros = experiment.layout, np.array(RULES.residuals.zeros)
    rows, total, count = [], np.zeros((len(zeros), layout.count * layout.bins)), np.zeros(layout.count * layout.bins)
    for i, run in enumerate(experiment.runs):
        ch = experiment.channels[i, residual.prefix]
        errors = rounding(residual.output, values, ch, zeros)
        if errors is None:
            return 0.0, 0.0
        good, place = ch.taken(run.usable(residual.output)), ch.taken(layout.place[i])
        rows.append(np.mean(errors[:, good] ** 2, axis=1))
        binned = [layout.bin(place, error, good) for error in errors]
        total, count = total + [sums for sums, _ in binned], count + binned[0][1]
    bins = (total / np.maximum(count, 1))[:, count > 0]
    return float(np.sqrt(np.mean(rows))), float(np.sqrt(np.mean(bins**2)))


def of_written(experiment: Experiment, residual: Residual, values: dict) -> float:
    """What a compared command is off by the step in which its controller gives it: root mean square of bins.

    A PWM of few bits has nothing between two of its steps. Where a drive rests or creeps that is the same in row after row, so
    no difference of neighbours has it; it is computed of the command as it is simulated (as Widrow 1956 has it of counts).
    """
    ch = experiment.channels[0, residual.prefix]
    step = written_step(residual.output.removeprefix(residual.prefix), ch) if residual.kind == "controller" else 0.0
    if step <= 0.0:
        return 0.0
    parts = [(simulated, good & np.isfinite(simulated)) for simulated, _, good in experiment.compare(residual, values)]
    errors = [rounded(np.where(good, x, 0.0), step, np.array(RULES.residuals.zeros)) for x, good in parts]
    trusted = [good for _, good in parts]
    return float(np.sqrt(np.mean([of_means(experiment, residual, list(one), trusted) ** 2 for one in zip(*errors)])))


def of_formulas(experiment: Experiment, residual: Residual, values: dict) -> float:
    """What no formula, no step and no data sheet tells better, whatever the recorder: a share of the signal, or what that makes of it."""
    return max(of_signal(experiment, residual), of_sheet(experiment, residual, values))


def of_signal(experiment: Experiment, residual: Residual) -> float:
    """A share of the signal.

    Of the angle that is controlled as much as makes the controller's voltage by that share another; of a wind-up its own size,
    about its mean, is the signal.
    """
    if residual.reading == "input_angle" and experiment.channels[0, residual.prefix].has("load.angle"):
        parts = [(measured, good) for _, measured, good in experiment.compare(residual, {})]
        wound = np.concatenate([measured[good & np.isfinite(measured)] for measured, good in parts])
        return RULES.residuals.formulas * float(np.std(wound)) if len(wound) else 0.0
    if residual.reading.endswith("angle"):
        ch = experiment.channels[0, residual.prefix]
        if driven.of(ch) != driven.ANGLE:
            changes = [measured[good & np.isfinite(measured)] for _, measured, good in experiment.compare(residual, {})]
            return RULES.residuals.formulas * float(np.sqrt(np.mean(np.concatenate(changes) ** 2)))
        electric, gain = drive.electric(ch), ch.setting.value("controller.angle_gain", {})
        if not electric or gain <= 0.0:
            return 0.0
        gears = ch.setting.value("reducer.gear_ratio", {}) if residual.reading == "input_angle" else 1.0
        return RULES.residuals.formulas * float(np.sqrt(np.mean(ch.true(electric, {}) ** 2))) / gain * gears
    measured = np.concatenate([run.signals[residual.output][run.usable(residual.output)] for run in experiment.runs])
    if residual.reading == "supply_voltage":  # of which only what it falls by is told
        measured = measured - np.mean(measured)
    return RULES.residuals.formulas * float(np.sqrt(np.mean(measured**2))) if len(measured) else 0.0


def of_points(experiment: Experiment, residual: Residual, values: dict) -> float:
    """Noise of steady-state points: by the halves of their runs; of points that are rows, by their neighbours."""
    return _by_halves(experiment, residual, values) if experiment.rig.run else _by_neighbours(experiment, residual, values)


def _by_halves(experiment: Experiment, residual: Residual, values: dict) -> float:
    """A point is the mean of two halves, so its variance is a quarter of that of their difference."""
    place, errors, trusted = experiment.residuals.index(residual), [], []
    for odd in (0, 1):
        runs = []
        for run in experiment.original:
            mine = np.arange(len(run)) * RULES.residuals.half_stretches // len(run) % 2 == odd
            runs.append(replace(run, good={name: run.usable(name) & mine for name in run.signals}))
        half = DriveExperiment(experiment.rig, runs)
        ((simulated, measured, good),) = half.compare(half.residuals[place], values)
        errors.append(measured - simulated)
        trusted.append(good & np.isfinite(simulated))
    both = trusted[0] & trusted[1]
    return 0.5 * float(np.sqrt(np.mean((errors[0] - errors[1])[both] ** 2))) if both.any() else 0.0


def _by_neighbours(experiment: Experiment, residual: Residual, values: dict) -> float:
    """Each point against the straight line through its neighbours in speed, on the same side and under the same load.

    Gasser, Sroka and Jennen-Steinmetz (1986), Biometrika 73, 625.
    """
    ((simulated, measured, good),) = experiment.compare(residual, values)
    rules = RULES.residuals
    ch, error = experiment.channels[0, residual.prefix], measured - simulated
    first, second = drive.both(values, ch)
    load = drive.delivered(values, ch, second)
    kind = np.round(load / max(rules.load_alike * float(abs(load).max()), 1e-300))
    good = good & np.isfinite(simulated)
    off = []
    for group in set(zip(np.sign(first.speed[good]), kind[good])):
        mine = np.flatnonzero(good & (np.sign(first.speed) == group[0]) & (kind == group[1]))
        mine = mine[np.argsort(first.speed[mine], kind="stable")]
        x, e = first.speed[mine], error[mine]
        wide = x[2:] - x[:-2]
        after = np.where(wide > 0.0, (x[1:-1] - x[:-2]) / np.where(wide > 0.0, wide, 1.0), 0.5)  # weight of the point after
        off.append((e[1:-1] - (1.0 - after) * e[:-2] - after * e[2:]) / np.sqrt(1.0 + after**2 + (1.0 - after) ** 2))
    sizes = abs(np.concatenate(off)) if off else np.zeros(0)
    return float(np.median(sizes)) / rules.normal_median if len(sizes) >= rules.point_neighbours else 0.0


def of_bins(misfit: np.ndarray, present: np.ndarray, steady: bool, lag: int) -> float:
    """Noise of bins: from differences of near neighbours, `lag` bins apart, which what varies slowly does not reach."""
    rules = RULES.residuals
    lag = min(lag, max(1, misfit.shape[1] // 2))
    steps = (misfit[:, lag:] - misfit[:, :-lag])[present[:, lag:] & present[:, :-lag]]
    level = float(np.sqrt(np.mean(misfit[present] ** 2))) if present.any() else 0.0
    if steady or len(steps) < rules.bin_differences:
        steps = np.diff(misfit[present])
    noise = float(np.median(abs(steps))) / rules.normal_median / np.sqrt(2.0) if len(steps) else 0.0
    return max(noise, rules.least_noise * level, 1e-300)


def of_quiet_bins(misfit: np.ndarray, present: np.ndarray, lag: int) -> float:
    """Noise of the quieter blocks. Elsewhere a fast wave that is missing may pass for noise: neighbours differ by it.

    Of equally noisy blocks the quieter ones would seem so by chance; that is made good, with the spread of a median.
    """
    levels, counts, rules = [], [], RULES.residuals
    for r, p in zip(misfit, present):
        steps = (r[lag:] - r[:-lag])[p[lag:] & p[:-lag]]
        if len(steps) >= rules.bin_differences:
            levels.append(float(np.median(abs(steps))) / rules.normal_median / np.sqrt(2.0))
            # neighbours within the reach of smoothing are no new evidence
            counts.append(len(steps) / max(1.0, rules.tied * lag))
    if len(levels) < rules.quiet_blocks:
        return np.inf
    spread = rules.median_spread / np.sqrt(np.median(counts))
    return float(np.quantile(levels, rules.quiet_share)) / max(1.0 - rules.quiet_below * spread, rules.quiet_least)
