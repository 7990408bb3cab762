"""How far apart models are on a run that nobody recorded yet, in the comparisons and the noise of the diagnosis itself.

Each model in turn is the truth: the whole drive is simulated from the set-points, what it shows is the run's log, and all
models are compared with that as with any log. T-optimal (Atkinson and Fedorov 1975, Biometrika 62, 57): the distance of a
rival is what it leaves after its own numbers were fitted, here by one linear step. Where the truth is one of two models, the
energy that the other leaves more has mean d^2 and variance 4 d^2, in units of what the logs leave. The diagnosis asks for more
than none: a share of all that is compared where the two differ, of the logs that were there and of this run
(search.matters, search.candidate). With E that energy it says the right one with probability Phi((d - matters E / d) / 2).
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from scipy.special import ndtr

from ..data.log import MeasuredRun
from ..data.rig import Rig
from ..errors import DataError
from ..judge.models import OpenModel
from ..judge.together import recorded
from ..pipeline.run import whole_where_described
from ..residuals import driven, whole
from ..residuals.drive_experiment import DriveExperiment
from ..residuals.noise import of_samples
from ..residuals.setting import Setting
from ..rules import RULES
from ..search.problem import Problem


@dataclass(frozen=True)
class Scale:
    """What the logs say of each comparison of a diagnosis."""

    rig: Rig  # as the diagnosis asked it: by parts, or as a whole
    setting: Setting
    left: dict[str, float]  # of each residual, root mean square of what the best model leaves in a bin
    lasting: dict[str, float]  # bins that one error lasts for
    errors: dict[str, float]  # of each residual, errors in the logs that say something of their own: bins over what one lasts for
    step: float  # s, of the rows
    bin: float  # s, of a bin
    recorder: dict[str, float]  # how the logs were recorded
    channels: tuple[str, ...]  # of the logs
    noise: dict[str, float]  # of a row of each channel, in its unit: for a picture


def scale(rig: Rig, runs: list[MeasuredRun], best: OpenModel) -> Scale:
    """Of the logs that the diagnosis had. DataError where rig and logs describe no loop."""
    if what := driven.lacking(rig, set(runs[0].signals)):
        raise DataError(
            f"{rig.path}: a run is planned as set-points of the whole drive, which needs {what}. What to record is said in words "
            "by the diagnosis, beside the causes that cannot be told apart."
        )
    asked, _ = whole_where_described(rig, runs)
    experiment = DriveExperiment(asked, runs, sampled=True)
    ones = np.ones(len(experiment.residuals))
    every = np.ones(experiment.layout.count, bool)
    problem = Problem(experiment, every, (), (), {}, ones, ones, experiment.present(best.values)).with_noise_at(best.values)
    values = recorded(problem, best.values, {})
    left, lasting, own = {}, {}, {}
    for number, residual in enumerate(experiment.residuals):
        bins, count = experiment.binned(residual, values)
        errors, told = bins.ravel(), count.ravel() > 0
        rms = float(np.sqrt(np.mean(errors[told] ** 2))) if told.any() else 1.0
        left[residual.name] = max(rms, float(problem.noise[number]))
        lasting[residual.name] = _lasting(np.where(told, errors, 0.0))
        own[residual.name] = float(told.sum()) / lasting[residual.name]
    noted = {name: value for name, value in values.items() if name.startswith("recorder.")}
    step = float(np.median(np.diff(runs[0].time)))
    channels = tuple(runs[0].signals)
    noise = {
        name: of_samples([run.signals[name] for run in runs], [run.usable(name) & np.isfinite(run.signals[name]) for run in runs])
        for name in channels
        if name in whole.SHOWN
    }
    return Scale(asked, experiment.setting, left, lasting, own, step, step * experiment.layout.per_bin, noted, channels, noise)


def _lasting(errors: np.ndarray) -> float:
    """Twice the area under the correlation of neighbours up to where it first vanishes, less one; at least 1 (Sokal 1997)."""
    x = errors - errors.mean()
    power = float(x @ x)
    total = 1.0
    for lag in range(1, len(x) // 4):
        correlation = float(x[:-lag] @ x[lag:]) / max(power, 1e-300)
        if correlation <= 0.0:
            break
        total += 2.0 * correlation
    return total


@dataclass
class Planned:
    """A run that is to be recorded, as each model sees it."""

    time: np.ndarray
    angle: np.ndarray
    speed: np.ndarray
    outputs: list[dict[str, np.ndarray]]  # of each model, by channel, at these times
    distances: np.ndarray  # (truth, fitted), 0 on the diagonal
    asked: np.ndarray  # (truth, fitted), energy that a rival must leave more than the truth to be beaten

    @property
    def margins(self) -> np.ndarray:
        """By how many standard deviations a rival is expected to be beaten, (truth, fitted)."""
        d = np.maximum(self.distances, 1e-6)
        return 0.5 * (d - self.asked / d)

    @property
    def least(self) -> float:
        """Margin of the two that are hardest to tell apart."""
        return float(self.margins[~np.eye(len(self.distances), dtype=bool)].min(initial=np.inf))

    @property
    def worth(self) -> tuple[float, float]:
        """What is made as large as possible: the share of pairs decided, in hundredths, and of equal ones the hardest pair's margin.

        Where one pair cannot be told apart by any run the others are not given up for it.
        """
        return round(float(self.decided[~np.eye(len(self.distances), dtype=bool)].mean()), 2), self.least

    @property
    def decided(self) -> np.ndarray:
        """Probability that the diagnosis tells each pair rightly, (truth, fitted)."""
        return ndtr(self.margins)


def predicted(scale: Scale, models: list[OpenModel], time: np.ndarray, angle: np.ndarray, speed: np.ndarray) -> Planned:
    """What the models make of a run of these set-points, and how far apart they are."""
    asked = _run(scale, time, angle, speed)
    closed = DriveExperiment(replace(scale.rig, simulate=whole.WHOLE), [asked])
    closed = closed.but_with(replace(closed.setting, whole_step=RULES.residuals.whole_look))
    ch, count = closed.channels[0, ""], len(models)
    shown = [name for name in scale.channels if name in whole.SHOWN]
    outputs = [{name: whole.read(name, scale.recorder | model.values, ch) for name in shown} for model in models]
    distances, needed = np.zeros((count, count)), np.zeros((count, count))
    if not all(np.all(np.isfinite(x)) for one in outputs for x in one.values()):
        return Planned(time, angle, speed, outputs, np.full((count, count), np.nan), needed)
    for truth, seen in enumerate(outputs):
        run = replace(asked, signals={**asked.signals, **seen})
        experiment = DriveExperiment(scale.rig, [run])
        experiment = experiment.but_with(replace(experiment.setting, smoothing=scale.setting.smoothing))
        known = _told(experiment, scale, models[truth].values)
        for fitted, model in enumerate(models):
            if fitted == truth:
                continue
            at = _told(experiment, scale, model.values)
            apart = np.clip(at - known, -RULES.planning.broken, RULES.planning.broken)
            slopes = _slopes(experiment, scale, model, at)
            if slopes.shape[1]:
                apart = apart - slopes @ np.linalg.lstsq(slopes, apart, rcond=None)[0]
            distances[truth, fitted] = float(np.sqrt(apart @ apart))
            needed[truth, fitted] = RULES.search.matters * _compared(apart, experiment, scale)
    return Planned(time, angle, speed, outputs, distances, needed)


def _run(scale: Scale, time: np.ndarray, angle: np.ndarray, speed: np.ndarray) -> MeasuredRun:
    """A run with the logs' channels, in which everything measured stands where it is asked to be: a simulation begins there."""
    ratio = scale.setting.value("reducer.gear_ratio", {})
    stands = {
        "load.angle": angle,
        "load.speed": speed,
        "reducer.input_angle": ratio * angle,
        "reducer.input_speed": ratio * speed,
        "controller.angle_setpoint": angle,
        "controller.speed_setpoint": speed,
    }
    zero = np.zeros(len(time))
    signals = {name: stands.get(name, zero).copy() for name in scale.channels}
    return MeasuredRun("planned", "", np.arange(len(time)), time, signals)


def _told(experiment: DriveExperiment, scale: Scale, values: dict[str, float]) -> np.ndarray:
    """All bins of all channels, each in units of what the logs leave there, its weight as its errors last."""
    found = []
    for one in experiment.residuals:
        bins, count = experiment.binned(one, scale.recorder | values)
        unit = scale.left[one.name] * np.sqrt(_bins(experiment, scale, one.name))
        found.append(np.where(count > 0, bins, 0.0).ravel() / unit)
    return np.concatenate(found)


def _bins(experiment: DriveExperiment, scale: Scale, name: str) -> float:
    """Bins of a run that one error of a residual lasts for: those of a short run are shorter."""
    return scale.lasting[name] * max(1.0, scale.bin / (scale.step * experiment.layout.per_bin))


def _compared(apart: np.ndarray, experiment: DriveExperiment, scale: Scale) -> float:
    """The energy of what is compared where two models differ, of the run and the logs before it; as `apart` has that of the difference."""
    parts = np.split(apart, len(experiment.residuals))  # as many bins of each
    errors = np.array([len(part) / _bins(experiment, scale, one.name) for one, part in zip(experiment.residuals, parts)])
    shares = np.array([part @ part for part in parts]) / errors
    differ = shares >= min(RULES.search.apart, shares.max())  # one at least: else runs without a difference would ask for none
    before = np.array([scale.errors[one.name] for one in experiment.residuals])
    return float((errors + before)[differ].sum())


def _slopes(experiment: DriveExperiment, scale: Scale, model: OpenModel, at: np.ndarray) -> np.ndarray:
    """How a model's outputs go with its own numbers, (entries, numbers)."""
    columns = []
    for name, (low, high) in model.free.items():
        value = model.values[name]
        span = (high - low) if np.isfinite(high - low) else max(abs(value), 1.0)
        step = RULES.planning.difference * (span if value + RULES.planning.difference * span <= high else -span)
        column = (_told(experiment, scale, model.values | {name: value + step}) - at) / step
        if np.all(np.isfinite(column)) and np.any(column):
            columns.append(column / np.sqrt(column @ column))
    return np.stack(columns, 1) if columns else np.zeros((len(at), 0))


def within(planned: Planned, voltage: float, current: float) -> bool:
    """Whether no model needs more than these, V and A."""
    for outputs in planned.outputs:
        for name, most in (("controller.voltage", voltage), ("motor.voltage", voltage), ("motor.current", current)):
            x = outputs.get(name)
            if x is not None and not np.nanmax(abs(x)) <= most:
                return False
    return True
