"""From a diagnosis to the run that would decide it: its models simulated on many runs, the one that tells them apart kept."""

from __future__ import annotations

import json
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from math import isfinite
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd

from selflock.fmus.place import DOCUMENT, ending
from selflock.view.page import probability as told

from ..data.log import MeasuredRun
from ..data.rig import LogColumn, Rig, load, suggest
from ..data.signals import SIGNALS
from ..data.units import conversion
from ..errors import DataError
from ..judge.models import OpenModel
from ..pipeline.run import gather
from ..rules import RULES
from .moves import Design, Limits, setpoint
from .rivals import Planned, Scale, predicted, scale, within

LIMITS = ("angle", "speed", "acceleration", "voltage", "current", "duration")
SETPOINTS = ("controller.angle_setpoint", "controller.speed_setpoint")


@dataclass
class NextRun:
    """A run to record: set-points, what each model expects of it, and how surely it tells them apart.

    distances: (truth, fitted), in units of what the logs leave; usual: those of the logs' own set-points over the same time.
    """

    rig: Rig
    models: list[OpenModel]
    limits: Limits
    run: Planned
    usual: Planned
    noise: dict[str, float]  # of a row of the logs, by channel
    seed: int
    tried: int
    folder: Path | None = None
    files: list[str] = field(default_factory=list)

    @property
    def probability(self) -> float:
        """That the pair which is hardest to tell apart is told rightly."""
        return float(self.run.decided[~np.eye(len(self.models), dtype=bool)].min())

    @property
    def usual_probability(self) -> float:
        """The same of another run of the old kind."""
        return float(self.usual.decided[~np.eye(len(self.models), dtype=bool)].min())

    def data(self) -> dict[str, Any]:
        """What plan.json holds."""
        limits = {name: value for name, value in vars(self.limits).items() if np.isfinite(value)}
        return {
            "models": [model.row() for model in self.models],
            "limits": limits,
            "probability": self.probability,
            "usual_probability": self.usual_probability,
            "distances": self.run.distances.tolist(),
            "usual_distances": self.usual.distances.tolist(),
            "tried": self.tried,
            "seed": self.seed,
        }

    def summary(self) -> str:
        """In a few lines of text."""
        lim = self.limits
        lines = [f"A run of {lim.duration:.3g} s to tell apart: {'; '.join(model.label for model in self.models)}"]
        sure = (
            "enough to record it"
            if self.probability >= RULES.planning.decided
            else "no run within these limits that was tried is sure to"
        )
        lines.append(
            f"  it is decided rightly with a probability of {told(self.probability)} in the hardest case ({sure}), "
            f"by another run like the logs, as long, {told(self.usual_probability)}"
        )
        lines.append(
            f"  angle {lim.low:.4g} to {lim.high:.4g} rad, speed up to {lim.speed:.4g} rad/s, acceleration up to {lim.acceleration:.4g} rad/s2"
        )
        if self.folder:
            lines.append(
                f"  set-points: {self.folder / 'plan.csv'}; what each model expects of them: {self.folder / 'report.html'}"
            )
        return "\n".join(lines)


def opened(folder: Path, rig: Path | None) -> tuple[dict, Rig]:
    """What was written to a diagnosis's folder, and its rig: where it lay, or where it is said to lie now."""
    told = _diagnosis(folder)
    path = rig or folder / told["sources"]["rig"]
    if not path.exists():
        raise DataError(f"{path}: the rig of this diagnosis is not there any more. Give it: --rig.")
    found = load(path)
    if found.system is not None:
        raise DataError(f"{path}: describes a system of FMUs. A run is planned for a drive of ours alone.")
    if fixed := [column.signal for column in found.columns if column.value is not None]:
        raise DataError(
            f"{path}: {', '.join(fixed)} is one number in this rig; a run is planned for controllers that follow a speed, too."
        )
    return told, found


def plan_run(
    folder: Path, told: dict, rig: Rig, limits: Mapping[str, str | float], out: Path | None, seed: int, tell: Callable
) -> NextRun:
    """The plan for a diagnosis that was written to `folder`, as `calls.plan` tells it."""
    if out is not None:
        out.mkdir(parents=True, exist_ok=True)  # a place that cannot be used is told before the work, not after it
    tell("reading", 0.0)
    models = told["models"]
    runs, _, _ = gather(rig, [folder / log for log in told["sources"]["logs"]], [])
    tell("what the logs leave", 0.05)
    known = scale(rig, runs, models[0])
    return _searched(rig, known, models, _limits(limits, runs), runs, seed, tell)


def open_models(told: dict, path: Path) -> None:
    """Refuse where nothing is open."""
    if told.get("verdict") == "none":
        raise DataError(f"{path}: nothing is missing in this drive that its logs could show, so there is nothing to tell apart.")
    models = told.get("models")
    if not isinstance(models, list) or len(models) < 2:
        raise DataError(
            f"{path}: its answer stands alone: nothing does as well, and no cause of it is weak. There is nothing to tell apart."
        )


def _model(told: dict[str, Any]) -> OpenModel:
    """Raises what reading of what is none raises."""
    values = {str(name): float(value) for name, value in told["values"].items()}
    free = {str(name): (float(low), float(high)) for name, (low, high) in told["free"].items()}
    if not all(map(isfinite, values.values())) or not all(name in values and low <= high for name, (low, high) in free.items()):
        raise ValueError
    return OpenModel(str(told["label"]), values, free)


def _diagnosis(folder: Path) -> dict:
    """What diagnosis.json says, its models made."""
    path = folder / "diagnosis.json"
    if not path.is_file():
        raise DataError(
            f"{folder}: holds no diagnosis.json and no naming.json. Give the folder that selflock diagnose or selflock name wrote to (-o)."
        )
    try:
        told = json.loads(ending(path, DOCUMENT).read_text(encoding="utf-8"))
        verdict = told["verdict"]
    except (ValueError, KeyError, TypeError, UnicodeDecodeError, RecursionError):
        raise DataError(f"{path}: is no result of a diagnosis, or is cut off. Run selflock diagnose again.") from None
    if verdict not in ("explained", "ambiguous", "unknown", "none"):
        raise DataError(f"{path}: verdict {verdict!r} is none that is known. Run selflock diagnose again.")
    open_models(told, path)
    try:
        if not all(isinstance(one, str) and "\0" not in one for one in (told["sources"]["rig"], *told["sources"]["logs"])):
            raise ValueError
        told["models"] = [_model(model) for model in told["models"]]
    except (ArithmeticError, AttributeError, LookupError, TypeError, ValueError):
        raise DataError(
            f"{path}: does not say its rig, logs and models; an older selflock wrote it. Run selflock diagnose again."
        ) from None
    return told


def _limits(given: Mapping[str, str | float], runs: list[MeasuredRun]) -> Limits:
    """Those given, the others as far as the logs went."""
    for name in given:
        if name not in LIMITS:
            raise DataError(f"limit {name!r} is none.{suggest(name, LIMITS)}")
    angles = np.concatenate([run.signals[SETPOINTS[0]] for run in runs])
    rates = [np.gradient(run.signals[SETPOINTS[0]], run.time) for run in runs]
    speed = float(np.quantile(np.abs(np.concatenate(rates)), 0.999))
    hard = np.concatenate([np.abs(np.gradient(rate, run.time)) for rate, run in zip(rates, runs)])
    low, high = float(angles.min()), float(angles.max())
    if "angle" in given:
        parts = str(given["angle"]).split(":")
        low, high = (_limit("angle", part, "write it as angle=-1:1, rad") for part in parts) if len(parts) == 2 else (1.0, 0.0)
        if not low < high:
            raise DataError(f"limit angle = {given['angle']}: write the lowest and the highest, as angle=-1:1, rad.")
    longest = max(float(run.time[-1] - run.time[0]) for run in runs)
    longest = min(RULES.planning.longest, max(RULES.planning.shortest, longest))
    own = {
        "speed": speed,
        "acceleration": float(np.quantile(hard[hard > 0.0], 0.999)) if (hard > 0.0).any() else 1.0,
        "duration": longest,
    }
    numbers = {name: _limit(name, given[name], "give a number above 0, SI") for name in LIMITS[1:] if name in given}
    for name, value in numbers.items():
        if not 0.0 < value < np.inf:
            raise DataError(f"limit {name} = {value:g}: give a number above 0, SI.")
    if not (low < high and (numbers.get("speed") or own["speed"]) > 0.0):
        raise DataError("the logs' set-points do not move, so they tell no limits. Give --limits angle=LOW:HIGH and speed=….")
    return Limits(low, high, **{**own, **numbers})


def _limit(name: str, value: str | float, how: str) -> float:
    try:
        return float(value)
    except ValueError:
        raise DataError(f"limit {name} = {value}: is not a number; {how}.") from None


def _searched(
    rig: Rig, known: Scale, models: list[OpenModel], limits: Limits, runs: list[MeasuredRun], seed: int, tell: Callable
) -> NextRun:
    rng, rules = np.random.default_rng(seed), RULES.planning

    def seen(design: Design) -> Planned | None:
        found = predicted(known, models, *setpoint(design, limits, known.step))
        return found if within(found, limits.voltage, limits.current) else None

    kept: list[tuple[tuple[float, float], Design, Planned]] = []

    def take(design: Design) -> None:
        found = seen(design)
        if found is not None and np.isfinite(found.least):
            kept.append((found.worth, design, found))
            kept.sort(key=lambda one: one[0], reverse=True)
            del kept[rules.kept :]

    total = rules.drawn + rules.changed
    for number in range(rules.drawn):
        tell("runs drawn", 0.1 + 0.85 * number / total)
        take(Design.draw(rng))
    if not kept:
        raise DataError(
            f"{rig.path}: no run within these limits could be simulated with the voltage and the current that are allowed. Widen them."
        )
    for number in range(rules.changed):
        tell("the best of them changed", 0.1 + 0.85 * (rules.drawn + number) / total)
        take(kept[int(rng.integers(len(kept)))][1].mutated(rng))
    usual = _usual(known, models, limits, runs)
    return NextRun(rig, models, limits, kept[0][2], usual, known.noise, seed, total)


def _usual(known: Scale, models: list[OpenModel], limits: Limits, runs: list[MeasuredRun]) -> Planned:
    """The set-points of the longest log, over as long as the plan takes; from its start again where it is shorter."""
    run = max(runs, key=lambda run: float(run.time[-1] - run.time[0]))
    time = np.arange(int(round(limits.duration / known.step)) + 1) * known.step
    length = float(run.time[-1] - run.time[0])
    angle = np.interp(np.minimum(time, length), run.time - run.time[0], run.signals[SETPOINTS[0]])
    return predicted(known, models, time, angle, np.gradient(angle, time))


def table(plan: NextRun) -> pd.DataFrame:
    """The set-points as the rig's own columns name them, in their units: what the drive is fed is read again as it is."""
    columns = {column.signal: column for column in plan.rig.columns}
    found = {_header(plan.rig.time, "s"): _back(plan.run.time, plan.rig.time, "s")}
    for name, x in zip(SETPOINTS, (plan.run.angle, plan.run.speed)):
        if name in columns or name == SETPOINTS[0]:
            column = columns.get(name, LogColumn(name, name))
            found[_header(column, SIGNALS[name][0])] = _back(x, column, SIGNALS[name][0])
    return pd.DataFrame(found)


def _header(column: LogColumn, si: str) -> str:
    return f"{column.column} [{column.unit or si}]"


def _back(x: np.ndarray, column: LogColumn, si: str) -> np.ndarray:
    factor, offset = conversion(column.unit, si)
    return ((x - column.offset) / column.factor - offset) / factor
