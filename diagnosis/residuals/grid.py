"""The instants at which a run of a whole drive is simulated: those of its rows, and some between."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from ..data.differenced import lost
from ..data.log import VALID
from . import driven
from .channels import Channels
from .recorder import ticks


@dataclass(frozen=True, eq=False)
class Grid:
    """The instants at which a run is simulated: those of its rows, and some between."""

    time: np.ndarray  # s, from the first row on
    dt: np.ndarray  # s, to each from the one before
    asked: np.ndarray  # set-points of angle and speed, (2, instants)
    ahead: np.ndarray  # and in the middle of the step behind each
    powered: np.ndarray
    supply: np.ndarray  # V, of which a duty is commanded, else 0
    acts: np.ndarray  # 0 between the acts of a controller that acts row by row, else 1
    places: np.ndarray  # rad, of the load as measured, where no controller holds its angle

    @cached_property
    def usual(self) -> float:
        """The usual step, s."""
        return float(np.median(self.dt))

    @cached_property
    def longest(self) -> float:
        """The longest step, s."""
        return float(self.dt[1:].max(initial=1e-9))


def grid(ch: Channels) -> Grid:
    """Of a run, made once; set-points between two rows: see set_points."""
    found = ch.memory.get("grid")
    if found is None:
        found = ch.memory["grid"] = refined(ch, ch.setting.value(ch.prefix + "controller.sample_period", {}))
    return found


def refined(ch: Channels, period: float) -> Grid:
    """The rows and equal parts between them, the jumps of set-points, and the acts of a controller with a period of its own, s."""
    time = stamps(ch)
    steps = np.diff(time)
    parts = np.maximum(1, np.ceil(steps / ch.setting.whole_step - 1e-6)).astype(int)
    first = np.repeat(np.arange(len(steps)), parts)
    inside = np.arange(len(first)) - np.repeat(np.cumsum(parts) - parts, parts)
    even = np.append(time[first] + steps[first] * inside / parts[first], time[-1])
    jumps = driven.instants(time, ch)
    slow = period > np.median(np.diff(even))
    fine = _with(even, jumps, np.arange(period - ticks(period, ch), time[-1], period) if slow else np.zeros(0))
    asked = driven.asked(time, {}, ch)
    powered = ch.run.signals.get(VALID, np.ones(len(time)))[np.searchsorted(time, fine + 1e-9, side="right") - 1]
    dt = np.diff(fine, prepend=fine[0] - (fine[1] - fine[0]))
    volts = driven.supply(fine, time, {}, ch)
    return Grid(
        fine, dt, asked(fine), asked(ahead(fine, dt)), powered, volts, _acts(fine, time, ch), driven.places(fine, time, ch)
    )


def _acts(fine: np.ndarray, time: np.ndarray, ch: Channels) -> np.ndarray:
    """At which instants of a grid a controller acts: at all, or at the rows alone, and as often where rows are lost."""
    if not driven.row_by_row(ch) or driven.of(ch) == driven.VOLTAGE:
        return np.ones(len(fine))
    usual = float(np.median(np.diff(time)))
    missing = [np.arange(time[n] + usual, time[n + 1] - 0.5 * usual, usual) for n in np.flatnonzero(lost(time))]
    found = np.zeros(len(fine))
    found[np.minimum(np.searchsorted(fine, np.concatenate([time, *missing]) - 1e-9), len(fine) - 1)] = 1.0
    return found


def stamps(ch: Channels) -> np.ndarray:
    """Times of rows, s, from the first one on; what comes after the last row compared matters to none."""
    time = ch.run.time - ch.run.time[0]
    return time if ch.take is None else time[: ch.take[-1] + 1]


def ahead(fine: np.ndarray, dt: np.ndarray) -> np.ndarray:
    """The middle of the step behind each instant."""
    return fine + 0.5 * np.append(dt[1:], 0.0)


def _with(fine: np.ndarray, *more: np.ndarray) -> np.ndarray:
    """Instants and others among them: what happens at these would else happen at the next. Of two that hardly differ the later given stays."""
    step = float(np.median(np.diff(fine)))
    for when in more:
        when = when[(when > fine[0] + 1e-3 * step) & (when < fine[-1] - 1e-3 * step)]
        away = np.ones(len(fine), bool)
        near = np.searchsorted(fine, when)
        for beside in (near - 1, near):
            away[beside[abs(fine[beside] - when) < 1e-3 * step]] = False
        fine = np.sort(np.append(fine[away], when))
    return fine
