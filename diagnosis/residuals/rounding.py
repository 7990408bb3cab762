"""What the counts of encoders leave in a simulated whole drive: in what is read in counts, and in what a controller makes of them.

That is no white noise: a shaft that creeps keeps the same error for many rows, one that runs has a new one in each. So it is
computed, from the simulated angle itself.
"""

from __future__ import annotations

import numpy as np
from numpy.lib.stride_tricks import sliding_window_view

from ..rules import RULES
from . import driven
from .channels import Channels
from .grid import grid
from .recorder import commanded, counts
from .whole import DUTY, SHOWN, TURNS, differences, earlier, read, seen_by_controller, simulate


def rounding(name: str, values: dict, ch: Channels, zeros: np.ndarray) -> np.ndarray | None:
    """What a channel is off by its encoder's counts, (zeros, rows), the zero lying so many counts away; None where it has none."""
    if name == "reducer.input_angle":
        own = _of_angle(name, values, ch, zeros)
        other = _of_angle("load.angle", values, ch, 1.0 - zeros) if ch.has("load.angle") else None
        ratio = ch.setting.value("reducer.gear_ratio", values) if other is not None else 1.0
        both = [e for e in (None if own is None else own / ratio, None if other is None else -other) if e is not None]
        return sum(both[1:], both[0]) if both else None
    if name == "load.angle":
        return _of_angle(name, values, ch, zeros)
    if SHOWN[name] in ("voltage", DUTY, "current"):
        return _through_loop(SHOWN[name], values, ch, zeros) if sees_counts(ch) else None
    count, rows = counts(name, ch)
    if not rows:
        return None
    here, angle = grid(ch), simulate(values, ch)[TURNS[name]]
    return np.array(
        [differences(error, here.time, ch.run.time - ch.run.time[0], rows, ch) for error in rounded(angle, count, zeros)]
    )


def sees_counts(ch: Channels) -> bool:
    """Whether the controller is told the angle in the counts of the log, as its voltage shows: it steps where these do.

    At a count that comes alone the voltage steps by -angle_gain times the count, at the row of the count or the next, by which a
    controller has acted. Where the controller is told more than counts it does then what it does about that row anyway.
    """
    if "sees counts" not in ch.memory:
        ch.memory["sees counts"] = _steps_with_counts(ch)
    return ch.memory["sees counts"]


def _steps_with_counts(ch: Channels) -> bool:
    if driven.of(ch) != driven.ANGLE:
        return False
    rules, angle, command = RULES.residuals, seen_by_controller(ch)[0], commanded(ch)
    count = counts(angle, ch)[0] if command and ch.has(angle) else 0.0
    if count <= 0.0:
        return False
    beside, rows = rules.beside_count, 2 * rules.beside_count + 2
    good = ch.good(angle) & ch.good(command)
    if len(good) <= rows:
        return False
    turned, stepped = (sliding_window_view(np.diff(ch.raw(name)), rows) for name in (angle, command))
    near = sliding_window_view(good[1:] & good[:-1], rows).all(axis=1)
    at = turned[:, beside]
    alone = (abs(turned[:, [beside - 1, beside + 1]]) < 0.5 * count).all(axis=1)
    here = near & alone & (abs(at) > 0.5 * count) & (abs(at) < 1.5 * count)
    if here.sum() < rules.noise_samples:
        return False
    ratio = ch.setting.value("reducer.gear_ratio", {}) if angle.startswith("reducer") else 1.0
    beyond = lambda x: x[here, beside] + x[here, beside + 1] - 2.0 * np.delete(x[here], (beside, beside + 1), axis=1).mean(axis=1)
    asked, done = -ch.setting.value("controller.angle_gain", {}) / ratio * beyond(turned), beyond(stepped)
    if not (size := float(asked @ asked)):  # a controller of speed alone
        return False
    share = float(asked @ done) / size
    error = float(np.sqrt(np.sum((asked * (done - share * asked)) ** 2))) / size
    return share > max(rules.sees_counts, rules.sees_counts_errors * error)


def _through_loop(shown: str, values: dict, ch: Channels, zeros: np.ndarray) -> np.ndarray | None:
    """What a controller's voltage, and by it the current, is off by the counts that it sees.

    -angle_gain times their error, but for what the shaft follows: it turns with the voltage over speed_gain and voltage constant
    times ratio, so that an error that lasts longer than that over angle_gain is none of the voltage's (the pole of the loop
    without inertia or friction). The current follows the voltage with inductance over resistance.
    """
    from scipy.signal import lfilter  # a third of a second to load, for those whose controller sees counts

    angle = seen_by_controller(ch)[0]
    error = _of_angle(angle, values, ch, zeros)
    if error is None:
        return None
    of = lambda name: ch.setting.value(name, values)
    gain, ratio = of("controller.angle_gain"), of("reducer.gear_ratio")
    step = float(np.median(ch.taken_steps()[1:]))
    supply = np.mean(grid(ch).supply) or 1.0  # of which a duty is commanded
    follows = (of("controller.speed_gain") + of("motor.voltage_constant") * ratio / supply) / gain
    voltage = -gain * error / (ratio if angle.startswith("reducer") else 1.0)
    stays = np.exp(-step / follows)
    voltage = lfilter([1.0, -1.0], [1.0, -stays], voltage, zi=-voltage[:, :1])[0]
    if shown in ("voltage", DUTY):
        return voltage
    voltage = voltage * supply
    stays = np.exp(-step * of("motor.resistance") / max(of("motor.inductance"), 1e-12))
    return lfilter([1.0 - stays], [1.0, -stays], voltage) / of("motor.resistance")


def _of_angle(name: str, values: dict, ch: Channels, zeros: np.ndarray) -> np.ndarray | None:
    count, _ = counts(name, ch)
    if count <= 0.0:
        return None
    now = rounded(read(name, values, ch), count, zeros)
    if not driven.by_change(name, ch):
        return now
    return now - rounded(read(name, values, ch, np.maximum(earlier(name, ch), 0)), count, zeros)


def rounded(angle: np.ndarray, count: float, zeros: np.ndarray) -> np.ndarray:
    """Of an angle, (zeros, rows)."""
    zeros = np.asarray(zeros)[:, None]
    return count * (np.floor(angle / count + zeros) + 0.5 - zeros) - angle
