"""Hidden drives of nature's own forms behind a recorder drawn at random; the counterpart of bench.py.

case = recordings.hide(["motor.brush_drop"], seed=10_007)
files = case.write(folder)                           rig.toml, train.csv, test.csv

Seeds from DEVELOPMENT on are for development. Those below judge: no rule may be chosen on them.
"""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from pathlib import Path
from zlib import crc32

import numpy as np
import pandas as pd

from . import causes, faults
from .bench import Case, Motion, merge, motion, nominal, strength_of
from .causes import Cause
from .drive import CHANNELS, SENSED, Drive, simulate
from .forms import nature
from .outside import MORE
from .recorder import DENSE, EXACT, FINE, Recorder, behind, draw
from .rig import rig

DEVELOPMENT = 10_000
JUDGED = 60.0  # s, the longest log that judges
UNSEEN = (*EXACT, "ambient", "time")


def _sampling(rng, d):
    """A period that is no multiple of the log's."""
    period = rng.uniform(0.008, 0.02)
    told = lambda s: dict(sampling=period)
    return Cause("controller", "sampling", told, extent=(1.0, 1.0), parameters=told)


DRAWS = causes.DRAWS | {"controller.sampling": _sampling} | MORE
LASTING = ("warm_up_time", "heating_time", "wear_distance", "loosened_time")


def dense(drive: Drive, plan: Motion) -> np.ndarray:
    """The plant's rows, every DENSE s; what its coarse sensors do is in them."""
    rows = simulate(drive, plan.angle, plan.speed, plan.ambient, DENSE, FINE, plan.start, FINE)
    for channel, step in zip(SENSED, drive.step):
        if step:
            rows[:, CHANNELS.index(channel)] = step * np.round(rows[:, CHANNELS.index(channel)] / step)
    return rows


@dataclass
class Reading:
    """What a recorder would write of a drive in each run if it were perfect."""

    tables: list[pd.DataFrame]

    @classmethod
    def of(cls, drive: Drive, plans: list[Motion], recorder: Recorder) -> Reading:
        return cls([recorder.read(dense(drive, plan), run) for run, plan in enumerate(plans)])


def seen(table: pd.DataFrame, ratio: float) -> dict[str, np.ndarray]:
    """Measured quantities: all channels, and the wind-up between two measured shafts, whose zeros are not known."""
    found = {name: table[name].to_numpy() for name in table if name not in UNSEEN}
    if "motor_angle" in found:
        twist = found["motor_angle"] / ratio - found["angle"]
        found["twist"] = twist - np.median(twist)
        found["motor_angle"] = found["motor_angle"] - np.median(found["motor_angle"])
    return found


def errors(log: pd.DataFrame, model: pd.DataFrame, ratio: float) -> dict[str, float]:
    """Error (root mean square) of a model's reading in each measured quantity."""
    ours, theirs = seen(model, ratio), seen(log, ratio)
    return {name: float(np.sqrt(np.mean((theirs[name] - ours[name]) ** 2))) for name in theirs}


SHOWN = ("current", "voltage", "twist", "output_torque")


def strength(without: Reading, with_it: Reading, noise: list[dict[str, float]], ratio: float, sensor: str = "") -> float:
    """Error without the true model over the error with it, in the quantity where it shows best and the run where least.

    Looked at: SHOWN, as in bench.ratio, for the motions behind a loop show little, and of a sensor's error its channel.
    """
    shown = []
    for before, after, floor in zip(without.tables, with_it.tables, noise):
        if not np.all(np.isfinite(after.to_numpy())):
            return np.inf
        off = errors(before, after, ratio)
        shown.append(max(np.sqrt(1.0 + (off[name] / floor[name]) ** 2) for name in off if name in (*SHOWN, sensor)))
    return float(min(shown))


@dataclass
class Recording(Case):
    """A hidden case and how it was recorded. `truth` and `base` (nothing hidden) have nature's forms, `sheet` tells none.

    floor, off: of the log that judges, the error that the true drive's simulation leaves in each quantity, and that of
    the drive with nothing hidden; both through the same recorder. forms: what the sheet's drive in the plant's plainest
    forms would leave of the latter, over the noise: above 1.3 nature's forms alone are more than a simple law can follow.
    """

    recorder: Recorder | None = None
    base: Drive | None = None
    logs: list[pd.DataFrame] = field(default_factory=list)
    floor: dict[str, float] = field(default_factory=dict)
    off: dict[str, float] = field(default_factory=dict)
    forms: float = 1.0

    @property
    def strong(self) -> bool:
        """Whether mending every one of its causes at least halves the held-out error."""
        return bool(self.ratios) and min(self.ratios) >= 2.0

    def write(self, folder: Path) -> tuple[Path, Path, Path]:
        """rig.toml, train.csv and test.csv: all that the product sees."""
        folder = Path(folder)
        folder.mkdir(parents=True, exist_ok=True)
        (folder / "rig.toml").write_text(rig(self.sheet, "forward", self.recorder.channels, _period(self.recorder)))
        for table, name in zip(self.logs, ("train.csv", "test.csv")):
            table.to_csv(folder / name, index=False, float_format="%.9g")
        return folder / "rig.toml", folder / "train.csv", folder / "test.csv"


def hide(
    names: list[str],
    seed: int,
    target: float | None = None,
    faulty: bool = False,
    recorder: Recorder | None = None,
    duration: float | None = None,
    longest: float = np.inf,
) -> Recording:
    """Hide causes by name (DRAWS; [] is none) so strongly that each raises the error `target` times; see bench.hide.

    Names and seed decide; `recorder`, the log's `duration` and its `longest` may be given.
    """
    rng = np.random.default_rng([seed, 10, crc32("+".join(names).encode())])
    sheet, base = nature(rng, nominal(rng))
    hidden = [DRAWS[name](rng, sheet) for name in names]
    needs = tuple(dict.fromkeys(c.what for c in hidden if c.component == "sensor"))
    needs += ("current",) * any(c.what == "current_curve" for c in hidden)
    recorder = recorder or draw(rng, needs, true_speeds=any("speed" in name for name in needs), duration=duration)
    recorder = replace(recorder, duration=min(recorder.duration, longest))
    base = behind(base, recorder)
    plans = [motion(rng, length, DENSE) for length in (recorder.duration, min(recorder.duration, JUDGED))]
    nothing = Reading.of(base, plans, recorder)
    noisy = [np.random.default_rng([seed, 11, run]) for run in range(2)]
    logs = [recorder.read(dense(base, plan), run, noisy[run]) for run, plan in enumerate(plans)]
    noise = [errors(log, clean, sheet.gear_ratio) for log, clean in zip(logs, nothing.tables)]
    truth, strengths, ratios = base, [], []
    for place, cause in enumerate(hidden):
        cause = hidden[place] = _lasting(cause, recorder.duration / 12.0)
        wanted = target or float(np.exp(rng.uniform(np.log(3.0), np.log(10.0))))
        sensor = cause.what if cause.component == "sensor" else ""
        ratio = lambda after: strength(nothing, Reading.of(after, plans, recorder), noise, sheet.gear_ratio, sensor)
        strengths.append(strength_of(cause, base, ratio, wanted))
        change = cause.change(strengths[-1])
        ratios.append(ratio(base._replace(**change)))
        truth = merge(truth, change)
    plain = Reading([recorder.read(dense(behind(sheet, recorder), plans[1]), 1)])
    forms = strength(Reading(nothing.tables[1:]), plain, noise[1:], sheet.gear_ratio)
    placed = None
    if hidden or faulty:
        true_rows = [dense(truth, plan) for plan in plans]
        noisy = [np.random.default_rng([seed, 12, run]) for run in range(2)]
        logs = [recorder.read(rows, run, noisy[run]) for run, rows in enumerate(true_rows)]
        best = recorder.read(true_rows[1], 1)
    else:
        best = nothing.tables[1]
    floor, off = (errors(logs[1], clean, sheet.gear_ratio) for clean in (best, nothing.tables[1]))
    if faulty:
        measured = tuple(name for name in recorder.channels if name not in UNSEEN and name not in ("voltage", "supply"))
        logs[0], placed = faults.spoil_recording(logs[0], rng, measured)
    return Recording(
        seed,
        sheet,
        truth,
        hidden,
        strengths,
        ratios,
        plans,
        faulty,
        placed,
        recorder=recorder,
        base=base,
        logs=logs,
        floor=floor,
        off=off,
        forms=forms,
    )


def misread(seed: int, anyhow: bool, longest: float = np.inf) -> tuple[str, pd.DataFrame, pd.DataFrame, list[dict]]:
    """A sound drive's log and the same with faults: rig, both tables, and what was put where.

    What `hide` with `faulty` gives as the log that teaches, at a third of the cost; `anyhow`: with the faults of spoil_anyhow.
    """
    rng = np.random.default_rng([seed, 10, crc32(b"")])
    sheet, base = nature(rng, nominal(rng))
    recorder = draw(rng)
    recorder = replace(recorder, duration=min(recorder.duration, longest))
    plans = [motion(rng, length, DENSE) for length in (recorder.duration, min(recorder.duration, JUDGED))]
    sound = recorder.read(dense(behind(base, recorder), plans[0]), 0, np.random.default_rng([seed, 12, 0]))
    measured = tuple(name for name in recorder.channels if name not in UNSEEN and name != "supply")
    if anyhow:
        log, placed = faults.spoil_anyhow(sound, np.random.default_rng([seed, 13]), measured)
    else:
        log, placed = faults.spoil_recording(sound, rng, tuple(name for name in measured if name != "voltage"))
    return rig(sheet, "forward", recorder.channels, _period(recorder)), sound, log, placed


def _period(recorder: Recorder) -> dict[str, float]:
    """A user knows a controller that is slower than his log."""
    return {"controller.sample_period": recorder.control} if recorder.control > recorder.step else {}


def _lasting(cause: Cause, times: float) -> Cause:
    """What takes its time takes it over the whole of a longer log."""
    longer = lambda s: {name: v * times if name in LASTING else v for name, v in cause.change(s).items()}
    return replace(cause, change=longer)
