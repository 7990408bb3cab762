"""The experiment of one or more drives: what their channels allow to compare, smoothed as their noise asks for."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from functools import partial
from typing import Self

import numpy as np

from ..data.log import MeasuredRun
from ..data.rig import Rig, split
from ..data.signals import ANGLE_OF, MOVES, SIGNALS
from ..errors import DataError
from ..rules import RULES
from . import drive, memory
from .blocks import Blocks
from .channels import Channels, derivative
from .closing import command_missed, shaft
from .experiment import Experiment
from .kernels import kernels
from .recorder import counts
from .residual import Residual, residuals
from .setting import Setting
from .variables import Made
from .whole import WHOLE


class DriveExperiment(Experiment):
    """All runs of a measurement of drives under one rig. `sampled`: of long logs a part is simulated, as a fit needs it."""

    def __init__(self, rig: Rig, runs: list[MeasuredRun], sampled: bool = False):
        super().__init__()
        rules = RULES.residuals
        self.rig, self.steady, self.original = rig, rig.kind == "steady", runs
        self.seconds = rules.whole_fits  # of all runs of a whole drive, on which hypotheses are fitted
        self.runs, owner = points(runs, bool(rig.run)) if self.steady else (runs, None)
        total = sum(len(run) for run in self.runs)
        self.setting = Setting(rig, total, kernels(), dict.fromkeys(rig.drives, rules.usual_window))
        self.layout = Blocks(self.runs, self.steady, owner)
        few = (sampled or self.long) and total > rules.sampled_from * rules.samples and not self.steady and rig.simulate != WHOLE
        takes: list[np.ndarray | None] = [None] * len(self.runs)
        if few:
            long = max(rules.stretch, rules.stretch_left + self._asked())
            takes = [stretches(len(run), rules.samples / total, long) for run in self.runs]
        self.channels = self._channels(takes=takes)
        asked = not rig.loop and len(rig.drives) == 1 and not self.steady
        self.command_missed = command_missed([*self.channels.values()]) if asked else {}
        if at := shaft(self.command_missed):
            self.rig = rig = replace(rig, loop=at)
            self.setting = replace(self.setting, rig=rig)
            self.channels = self._channels(takes=takes)
        if not self.steady and rig.simulate != WHOLE:  # which simulates its recorder
            windows = {
                ch.prefix + name: rows * self.step
                for ch in (self.channels[0, prefix] for prefix in rig.drives)
                for name in ANGLE_OF
                if ch.has(name) and (rows := counts(name, ch)[1])
            }
            self.setting = replace(self.setting, windows=windows)
            self.channels = self._channels(takes=takes)
        self.residuals = tuple(
            residual
            for prefix in rig.drives
            for residual in residuals(self.channels[0, prefix])
            if not rig.only or residual.components == (rig.only,)
        )
        if not self.residuals:
            have = sorted({name for run in self.runs for name in run.signals})
            raise DataError(
                f"{rig.path}: the columns {', '.join(have)} allow no comparison. A log needs a motion and a torque, "
                "current or voltage, or set-points and a voltage; docs/rig.md lists what goes together."
            )
        if sampled and any(residual.kind == "drive" for residual in self.residuals):
            share = rules.samples_whole / total if total > rules.sampled_from * rules.samples_whole else None
            self.channels = self._channels(takes=[share and self.layout.firsts(i, share) for i in range(len(self.runs))])
        if sampled and rig.simulate == WHOLE:
            self.channels = self._channels(takes=self._first(self.seconds))
        smoothing = {
            prefix: self._smoothing(prefix) for prefix in rig.drives
        }  # of an hour's log by the same stretches everywhere
        self.setting = replace(self.setting, smoothing=smoothing)
        self.channels = self._channels(takes=None if sampled else [None] * len(self.runs))

    def _channels(
        self, setting: Setting | None = None, runs: list[MeasuredRun] | None = None, takes: list | None = None
    ) -> dict[tuple[int, str], Channels]:
        """Channels of all runs and drives, with another setting, of other runs, or with other samples taken."""
        setting = setting or self.setting
        if takes is None:
            takes = [self.channels[i, setting.rig.drives[0]].take for i in range(len(self.runs))]
        together = tuple(runs or self.runs)
        return {
            (i, prefix): Channels(run, prefix, setting, take, together)
            for i, (run, take) in enumerate(zip(together, takes))
            for prefix in setting.rig.drives
        }

    def _smoothing(self, prefix: str) -> int:
        """Samples: what the rig says, or the shortest window at which the acceleration's noise matters no more than the torque's."""
        rules = RULES.residuals
        gear = next((residual for residual in self.residuals if residual.name == prefix + "gear"), None)
        if gear is None or self.steady:
            return self.setting.smoothing[prefix]
        if self.rig.smoothing > 0.0:
            return self._asked()
        levels, step = {}, self.step
        for samples in (n for n in rules.windows if n == rules.windows[0] or n * step <= rules.longest_window):
            tried = self.but_with(replace(self.setting, smoothing={**self.setting.smoothing, prefix: samples}, balanced=False))
            steps, count = 0.0, 0
            for simulated, measured, good in tried.compare(gear, {}):
                e = (measured - simulated)[good]
                if len(e) > rules.window_samples:
                    steps, count = steps + float(np.median(abs(e - np.median(e)))) * len(e), count + len(e)
            # beyond what a double can be no window helps
            levels[samples] = steps / max(count, 1) if np.isfinite(steps) else np.inf
        return min(samples for samples, level in levels.items() if level <= rules.window_level * min(levels.values()))

    def _asked(self) -> int:
        """Samples of the smoothing window that the rig asks for; 1 where it asks for none."""
        if self.rig.smoothing <= 0.0:
            return 1
        return int(round(self.rig.smoothing / float(np.median(np.diff(self.runs[0].time))))) | 1

    def but_with(self, setting: Setting) -> Self:
        """The same residuals in another setting."""
        return self.but(setting=setting, channels=self._channels(setting))

    def whole(self) -> Self:
        """The same residuals at all samples; this one where it has them all."""
        if all(ch.take is None for ch in self.channels.values()):
            return self
        setting = replace(self.setting, whole_step=RULES.residuals.whole_step, shaft_step=RULES.residuals.shaft_step)
        return self.but(setting=setting, channels=self._channels(setting, takes=[None] * len(self.runs)))

    def glance(self, seconds: float) -> Self:
        """The same residuals over the first so many seconds of all runs, a whole drive in the longest steps that show it."""
        setting = replace(self.setting, whole_step=RULES.residuals.whole_look, shaft_step=RULES.residuals.shaft_look)
        return self.but(setting=setting, channels=self._channels(setting, takes=self._first(seconds)))

    def over(self, seconds: float) -> Self:
        """The same residuals over the first so many seconds of all runs, as hypotheses are fitted."""
        return self.but(seconds=seconds, channels=self._channels(takes=self._first(seconds)))

    def _first(self, seconds: float) -> list[np.ndarray | None]:
        """Rows of each run's first part, its share of so many seconds of all runs, evenly spread; None for all of them."""
        lasts = [run.time[-1] - run.time[0] for run in self.runs]
        share = min(1.0, seconds / max(sum(lasts), 1e-9))
        every = max(1, int(np.ceil(share * sum(map(len, self.runs)) / RULES.residuals.rows_whole)))
        found: list[np.ndarray | None] = []
        for run, long in zip(self.runs, lasts):
            last = int(np.searchsorted(run.time, run.time[0] + share * long, side="right"))
            found.append(np.arange(0, last, every) if every > 1 or last < len(run) else None)
        return found

    def excerpt(self) -> Self:
        """The same residuals at the same samples, computed from those of the log alone that lie about them; this one where that is little less.

        What has a long memory (heat, a distance, an angle that is integrated) is another in it: who looks at it compares.
        """
        rules, takes = RULES.residuals, [self.channels[i, self.rig.drives[0]].take for i in range(len(self.runs))]
        if any(take is None for take in takes):
            return self
        window = max(self.setting.smoothing.values())
        ahead = max(rules.excerpt_ahead / self.step, (rules.pressed_windows + 1) * window)
        rows = [_about(take, int(ahead), window, len(run)) for take, run in zip(takes, self.runs)]
        if sum(map(len, rows)) > rules.excerpt_share * sum(map(len, self.runs)):
            return self
        runs = [run.picked(some) for run, some in zip(self.runs, rows)]
        setting = replace(self.setting, samples=sum(map(len, rows)))
        channels = self._channels(setting, runs, [np.searchsorted(some, take) for some, take in zip(rows, takes)])
        for place, ch in channels.items():
            ch.whole = self.channels[place]
        return self.but(runs=runs, setting=setting, channels=channels, layout=self.layout.picked(rows))

    def head(self, samples: list[int]) -> Self:
        """The same blocks, residuals and smoothing over the first samples of each run."""
        runs = [run.head(n) for run, n in zip(self.runs, samples)]
        places = [np.arange(n) for n in samples]
        channels = self._channels(runs=runs, takes=[None] * len(runs))
        return self.but(runs=runs, channels=channels, layout=self.layout.picked(places))

    def recorded(self, runs: list[MeasuredRun]) -> Self:
        """The same residuals, blocks and smoothing over other recordings of the same runs."""
        return self.but(runs=runs, channels=self._channels(runs=runs))

    def finer(self, runs: list[MeasuredRun], parts: int) -> Self:
        """The same residuals over runs with `parts` samples where there was one; the smoothing lasts as long as it did."""
        finer = {prefix: (n * parts) | 1 if n > 1 else 1 for prefix, n in self.setting.smoothing.items()}
        setting = replace(self.setting, smoothing=finer)
        places = [np.repeat(np.arange(len(old)), parts)[: len(run)] for old, run in zip(self.runs, runs)]
        channels = self._channels(setting, runs, takes=[None] * len(runs))
        return self.but(runs=runs, setting=setting, channels=channels, layout=self.layout.picked(places))

    def window(self, residual: Residual) -> int:
        """Samples over which the motions that a residual is computed from are smoothed."""
        return 1 if self.steady else self.setting.smoothing[residual.prefix]

    @property
    def long(self) -> bool:
        """Whether its motions are too long for more than the first of them to be remembered, as of half an hour and more."""
        return self.setting.samples > RULES.residuals.motions_remembered

    def forget(self) -> None:
        """Let go of all motions and simulations: those that are asked for next are remembered in their place."""
        for ch in self.channels.values():
            for key in [key for key in ch.memory if key[0] == "motion" or key == WHOLE]:
                del ch.memory[key]
        if self.long:
            memory.give_back()

    def moves(self, residual: Residual, values: dict) -> list[tuple[np.ndarray, np.ndarray]]:
        """Speed of the input shaft and output torque of a residual's drive, for each run; empty where no motion is measured."""
        channels = [self.channels[i, residual.prefix] for i in range(len(self.runs))]
        if not all(any(ch.has(m) for m in MOVES) for ch in channels):
            return []
        both = [(ch, *drive.both(values, ch)) for ch in channels]
        return [(first.speed, drive.delivered(values, ch, second)) for ch, first, second in both]

    def variables(self, residual: Residual, values: dict) -> Mapping[str, list[np.ndarray]]:
        """Variables of a residual's drive, one array for each run: those that all runs have. Each is made when it is asked for."""
        channels, made = [self.channels[i, residual.prefix] for i in range(len(self.runs))], Made()
        if not self.steady:
            made["time"] = lambda: [run.time - run.time[0] for run in self.runs]
        if all(any(ch.has(m) for m in MOVES) for ch in channels):
            both = [drive.both(values, ch) for ch in channels]
            made["speed"] = lambda: [first.speed for first, _ in both]
            made["direction"] = lambda: [np.sign(first.speed) for first, _ in both]
            made["load"] = lambda: [drive.delivered(values, ch, second) for ch, (_, second) in zip(channels, both)]
            if not self.steady:
                made["acceleration"] = lambda: [first.acceleration for first, _ in both]
                made["position"] = lambda: in_turn([first.angle for first, _ in both])
                made["output position"] = lambda: in_turn([second.angle for _, second in both])
        measured = {"motor.current": "current", "motor.temperature": "temperature", "motor.supply_voltage": "supply voltage"}
        for name, label in measured.items():
            if label == residual.reading:  # as simulated: what is measured goes with its own noise
                made[label] = lambda: [simulated for simulated, _, _ in self.compare(residual, values)]
            elif all(ch.has(name) for ch in channels):
                made[label] = partial(_raw, channels, name)
        if all(ch.has("controller.angle_setpoint") for ch in channels) and not self.steady:
            made["set-point change"] = lambda: [
                derivative(ch.raw("controller.angle_setpoint"), np.cumsum(ch.dt)) for ch in channels
            ]
        for name in self.runs[0].signals:
            if split(name, self.rig.drives)[1] not in SIGNALS and all(name in run.signals for run in self.runs):
                made[name] = partial(_signals, self.runs, name)
        return made


def _raw(channels: list[Channels], name: str) -> list[np.ndarray]:
    return [ch.raw(name) for ch in channels]


def _signals(runs: list[MeasuredRun], name: str) -> list[np.ndarray]:
    return [run.signals[name] for run in runs]


def in_turn(angles: list[np.ndarray]) -> list[np.ndarray]:
    """Angles within a turn, where they go beyond one; else as they are, so that the ends of a travel remain its ends."""
    travel = max(np.nanmax(a) for a in angles) - min(np.nanmin(a) for a in angles)
    return angles if travel < 2 * np.pi else [np.mod(a, 2 * np.pi) for a in angles]


def stretches(n: int, share: float, length: int) -> np.ndarray:
    """Places of short stretches of so many samples, spread evenly over n, about this share of them."""
    length = min(length, n)
    count = max(1, int(n * share / length))
    firsts = np.linspace(0, max(0, n - length), count).astype(int)
    return np.unique((firsts[:, None] + np.arange(length)).ravel().clip(0, n - 1))


def _about(take: np.ndarray, ahead: int, behind: int, n: int) -> np.ndarray:
    """Places of n that are taken, or so many ahead of one that is, or behind it."""
    near = np.zeros(n + 1, int)
    np.add.at(near, np.maximum(take - ahead, 0), 1)
    np.add.at(near, np.minimum(take + behind + 1, n), -1)
    return np.flatnonzero(np.cumsum(near[:n]) > 0)


def points(runs: list[MeasuredRun], averaged: bool) -> tuple[list[MeasuredRun], np.ndarray]:
    """All steady-state points as one run, and to which run each belongs: means over trusted samples of runs, or rows."""
    names = list(runs[0].signals)
    if averaged:
        mean = lambda x: np.array([x.mean() if len(x) else np.nan])
        parts = [{name: mean(run.signals[name][run.usable(name)]) for name in names} for run in runs]
        good = [{name: np.isfinite(x) for name, x in part.items()} for part in parts]
        rows = [run.rows[:1] for run in runs]
    else:
        parts, rows = [run.signals for run in runs], [run.rows for run in runs]
        good = [{name: run.usable(name) for name in names} for run in runs]
    owner = np.repeat(np.arange(len(runs)), [len(r) for r in rows])
    join = lambda which: {name: np.concatenate([part[name] for part in which]) for name in names}
    return [
        MeasuredRun(runs[0].log, "", np.concatenate(rows), np.arange(len(owner), dtype=float), join(parts), join(good))
    ], owner
