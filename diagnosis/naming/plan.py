"""The run to record next of a system of FMUs: inputs under which what a naming could not tell apart differs most.

Each model in turn is the truth: it is simulated under inputs drawn at random within what the logs went through, and every other
one is compared with that after its own numbers were fitted to it by one linear step. Taken are the inputs under which the pair
that is hardest to tell apart differs most (T-optimal, as planning.run for drives of ours).
"""

from __future__ import annotations

import json
from collections.abc import Callable, Mapping, Sequence
from dataclasses import asdict, dataclass, field, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
import pandas as pd
from scipy.interpolate import PchipInterpolator

from ..calibration.numbers import Number, of_rig
from ..calibration.slopes import Forward
from ..data.log import MeasuredRun
from ..data.rig import SMOOTH, Rig, suggest
from ..data.units import conversion
from ..errors import DataError
from ..pipeline.run import gather
from ..rules import RULES
from ..systems.parts import Parts
from ..systems.system import prepare
from .extended import Extended, Extending
from .guesses import EVENT, begins
from .places import Insert, Place

if TYPE_CHECKING:
    from .round import Rivalled, Round
    from .run import Search


@dataclass(frozen=True)
class Open:
    """A model between which and others a naming did not decide: its corrections, their numbers, and all values by variable."""

    label: str
    inserts: tuple[Insert, ...]
    numbers: tuple[Number, ...]
    acts: dict[str, dict[str, float]]
    values: dict[str, float]

    @classmethod
    def read(cls, told: dict[str, Any]) -> Open:
        """From what naming.json says. Raises what reading of what is none raises."""
        inserts = [
            Insert(**{**one, "place": Place(**one["place"]), "fixed": tuple((str(k), float(v)) for k, v in one["fixed"])})
            for one in told["inserts"]
        ]
        numbers = tuple(Number(**one) for one in told["numbers"])
        values = {str(name): float(value) for name, value in told["values"].items()}
        return cls(str(told["label"]), tuple(inserts), numbers, told["acts"], values)


def open_models(found: Search) -> list[dict[str, Any]]:
    """The models of the first cause that has others beside it, as naming.json has them; an event was of its own run alone."""
    outcome = next((one for one in found.named if one.beside and one.winner is not None), None)
    told = [] if outcome is None else [asdict(one) for rival, one in of_round(found, outcome) if rival.guess.kind != EVENT]
    return told[: RULES.planning.models] if len(told) > 1 else []


def of_round(found: Search, outcome: Round) -> list[tuple[Rivalled, Open]]:
    """The model of a round's winner, and those beside it."""
    assert outcome.winner is not None
    work, made = found.work.but_for(outcome.winner.guess), []
    for rival in (outcome.winner, *outcome.beside):
        wider, known = work.with_also(rival.guess), found.best.values | (rival.values if rival is not outcome.winner else {})
        every = [n for numbers in wider.found for n in numbers]
        of: dict[str, list[float]] = {}
        for n in (*work.numbers, *every):
            of.setdefault(n.variable, []).append(known.get(n.name, n.start))
        values = {name: float(np.mean(given)) for name, given in of.items()}
        begun = {n.variable: replace(n, name=n.variable, run=None) for n in every if begins(n)}  # in any run elsewhere
        own = (*(n for n in every if not begins(n)), *begun.values())
        made.append((rival, Open(rival.guess.label, wider.inserts, own, wider.acts, values)))
    return made


@dataclass
class NextInputs:
    """Inputs to record next. more, usual: (truth, other), by how many times the noise's energy the other leaves more; of another run
    like the logs the same."""

    rig: Rig
    labels: list[str]
    time: np.ndarray  # s
    inputs: dict[str, np.ndarray]
    more: np.ndarray
    usual: np.ndarray
    seed: int
    tried: int
    units: dict[str, str]
    again: bool = False  # whether these are the inputs of the longest log, which tell most
    folder: Path | None = None
    files: list[str] = field(default_factory=list)

    @property
    def decides(self) -> bool:
        """Whether every pair is told apart: the other leaves more by what a naming asks for."""
        return least(self.more) > RULES.search.matters

    def data(self) -> dict[str, Any]:
        """What plan.json holds."""
        matrices = {"more": self.more.tolist(), "usual_more": self.usual.tolist()}
        return {"models": self.labels, **matrices, "decides": self.decides, "tried": self.tried, "seed": self.seed}

    def summary(self) -> str:
        """In a few lines of text."""
        share = lambda matrix: f"{100.0 * least(matrix):.3g} %" if least(matrix) > 1e-4 else "nothing"
        lines = [f"A run of {self.time[-1]:.3g} s to tell apart: {'; '.join(self.labels)}"]
        told = f"of a wrong one remains at least {share(self.more)} of the noise's energy, under inputs like the logs' {share(self.usual)}"
        if self.decides:
            lines.append(f"  {told}")
        else:
            alike = [
                f"{a} and {b}"
                for i, a in enumerate(self.labels)
                for j, b in enumerate(self.labels)
                if i < j and min(self.more[i, j], self.more[j, i]) <= RULES.search.matters
            ]
            lines.append(f"  {told}: not enough. Under no inputs that were tried within these limits differ {'; '.join(alike)}")
        if self.again:
            lines.append(
                f"  none of the {self.tried} runs that were drawn tells more than the longest log's own inputs: these are planned"
            )
        if self.folder:
            lines.append(f"  inputs: {self.folder / 'plan.csv'}")
        return "\n".join(lines)

    def write(self, out: Path) -> None:
        """plan.csv, in the rig's own columns and units, and plan.json."""
        columns = {column.signal: column for column in self.rig.columns}
        table = {}
        for name, x in {"time": self.time, **self.inputs}.items():
            column = self.rig.time if name == "time" else columns[name]
            si = "s" if name == "time" else self.units.get(name, "")
            factor, offset = conversion(column.unit, si)
            unit = column.unit or si
            table[f"{column.column} [{unit}]" if unit else column.column] = (
                (x - column.offset) / column.factor - offset
            ) / factor
        pd.DataFrame(table).to_csv(out / "plan.csv", index=False, float_format="%.9g")
        (out / "plan.json").write_text(json.dumps(self.data(), indent=2, ensure_ascii=False) + "\n", encoding="utf-8")
        self.folder, self.files = out, ["plan.csv", "plan.json"]


def least(more: np.ndarray) -> float:
    """That of the pair which is hardest to tell apart."""
    return float(more[~np.eye(len(more), dtype=bool)].min())


def read(folder: Path) -> tuple[dict[str, Any], list[Open]]:
    """What naming.json of a folder says, and its models."""
    path = folder / "naming.json"
    try:
        told = json.loads(path.read_text(encoding="utf-8"))
        models = [Open.read(one) for one in told["models"]]
        told["sources"]["rig"], told["sources"]["logs"], told["step"] = (
            str(told["sources"]["rig"]), list(map(str, told["sources"]["logs"])), float(told["step"])
        )  # fmt: skip
        told["noise"] = {str(one["name"]): float(one["noise"]) for one in told["errors"]}
    except (ArithmeticError, AttributeError, LookupError, TypeError, ValueError, UnicodeDecodeError, RecursionError):
        raise DataError(
            f"{path}: is no result of a naming, is cut off, or an older selflock wrote it. Run selflock name again."
        ) from None
    if len(models) < 2:
        raise DataError(f"{path}: nothing does as well as its answer, so there is nothing to tell apart.")
    return told, models


def plan_system(
    folder: Path, told: dict[str, Any], models: Sequence[Open], rig: Rig, limits: Mapping[str, Any], seed: int, tell: Callable
) -> NextInputs:
    """The inputs that tell the models of a naming apart, as `calls.plan` tells it."""
    tell("reading", 0.0)
    rig, parts = prepare(rig)
    parts.system.run.step = told["step"]
    runs, _, _ = gather(rig, [folder / log for log in told["sources"]["logs"]], [])
    longest = max(runs, key=lambda run: float(run.time[-1] - run.time[0]))
    channels = [name for name in longest.signals if name not in told["noise"]]
    ranges, duration = ranged(limits, runs, channels)
    step = float(np.median(np.diff(longest.time)))
    time = step * np.arange(max(2, int(round(duration / step)) + 1))
    rng, rules = np.random.default_rng(seed), RULES.planning
    inputs = [drawn(rng, ranges, len(time), rig.inputs == SMOOTH) for _ in range(rules.drawn_inputs)]
    inputs.append({name: np.resize(longest.signals[name], len(time)) for name in channels})  # as they were: the last
    least_of = lambda name: RULES.pipeline.fine * float(np.std(longest.signals[name])) if name in longest.signals else 0.0
    noise = {name: max(size, least_of(name)) or 1.0 for name, size in told["noise"].items()}
    more = compared(rig, parts, models, inputs, time, noise, tell)
    inside = all(low <= inputs[-1][name].min() and inputs[-1][name].max() <= high for name, (low, high) in ranges.items())
    allowed = more if inside else more[:-1]
    if not np.isfinite(allowed).all((1, 2)).any():
        raise DataError(f"{rig.path}: no inputs within these limits could be simulated with every model. Narrow them.")
    best = int(np.argmax([least(one) if np.isfinite(one).all() else -1.0 for one in allowed]))
    given = {one for model in models for insert in model.inserts for one in (insert.over, insert.beside)}
    heard = {name: x for name, x in inputs[best].items() if name in parts.variables or name in given}  # else nobody would notice
    units = {name: parts.unit(name) for name in channels}
    labels = [model.label for model in models]
    return NextInputs(rig, labels, time, heard, more[best], more[-1], seed, rules.drawn_inputs, units, best == len(more) - 1)


def ranged(
    given: Mapping[str, Any], runs: Sequence[MeasuredRun], channels: Sequence[str]
) -> tuple[dict[str, tuple[float, float]], float]:
    """Ranges of the inputs, and the run's length, s: as far as the logs went where not given."""
    ranges = {}
    for name in channels:
        x = np.concatenate([run.signals[name][run.usable(name)] for run in runs])
        ranges[name] = float(x.min()), float(x.max())
    duration = max(float(run.time[-1] - run.time[0]) for run in runs)
    for name, text in given.items():
        try:
            ends = [float(one) for one in str(text).split(":")]
        except ValueError:
            ends = []
        if name == "duration" and len(ends) == 1 and 0.0 < ends[0] < np.inf:
            duration = ends[0]
        elif name in ranges and len(ends) == 2 and -np.inf < ends[0] <= ends[1] < np.inf:
            ranges[name] = ends[0], ends[1]
        elif name in ranges or name == "duration":
            how = "a number of seconds above 0" if name == "duration" else f"the lowest and the highest, as {name}=-1:1"
            raise DataError(f"limit {name} = {text}: give {how}.")
        else:
            raise DataError(f"limit {name!r} is none.{suggest(name, [*ranges, 'duration'])}")
    return ranges, duration


def drawn(rng: np.random.Generator, ranges: dict[str, tuple[float, float]], count: int, smooth: bool) -> dict[str, np.ndarray]:
    """Inputs drawn at random: levels held for a while, each for as long as any, in all of a range or a part; smooth: curves through them."""
    found = {}
    for name, (low, high) in ranges.items():
        hold = int(np.exp(rng.uniform(np.log(RULES.planning.held), np.log(max(RULES.planning.held + 1.0, count / 4.0)))))
        knots = np.arange(0, count + hold, hold)
        if rng.random() > RULES.planning.everywhere:
            low, high = np.sort(rng.uniform(low, high, 2))
        levels = rng.uniform(low, high, len(knots))
        rows = np.arange(count)
        found[name] = PchipInterpolator(knots, levels)(rows) if smooth else levels[rows // hold]
    return found


def compared(
    rig: Rig,
    parts: Parts,
    models: Sequence[Open],
    inputs: Sequence[dict[str, np.ndarray]],
    time: np.ndarray,
    noise: dict[str, float],
    tell: Callable,
) -> np.ndarray:
    """By how many times the noise's energy each model leaves more of each other: (inputs, truth, other); nan where one breaks off."""
    zeros = dict.fromkeys(noise, np.zeros(len(time)))
    runs = [MeasuredRun(f"planned {k + 1}", "", np.arange(len(time)), time, {**zeros, **one}) for k, one in enumerate(inputs)]
    numbers = of_rig(rig, parts, runs) if rig.wanted or rig.uncertain else ()
    played = Extended(rig, parts, runs, numbers)
    rows = [np.ones(len(time), bool)] * len(runs)
    told: list[list[tuple[np.ndarray, np.ndarray] | None]] = [[] for _ in runs]
    try:
        for m, model in enumerate(models):
            played.extend(model.inserts)
            for i in range(len(runs)):
                tell(f"runs drawn: {model.label}", 0.05 + 0.9 * (m + i / len(runs)) / len(models))
                problem = Extending(rig, runs, (*numbers, *model.numbers), [i], rows, acts=model.acts)
                vars(problem)["played"], problem.units = played, noise
                value = lambda n, of=model.values: float(np.clip(of.get(n.variable, n.start), n.low, n.high))
                problem.fixed = {n.name: value(n) for n in problem.numbers if n.run not in (None, i)}
                places = np.array([np.clip(n.place(value(n)), 0.0, 1.0) for n in problem.free])
                misfit = problem.misfit(places)
                told[i].append(None if misfit is None else (misfit, Forward(problem.misfit, problem.free)(places, misfit)))
    finally:
        played.close()
    found = np.full((len(runs), len(models), len(models)), np.nan)
    for i, of in enumerate(told):
        for j, truth in enumerate(of):
            for k, other in enumerate(of):
                if truth is not None and other is not None:
                    apart = other[0] - truth[0]
                    step = np.linalg.lstsq(other[1], -apart, rcond=RULES.naming.degenerate)[0]
                    found[i, j, k] = float(np.mean((apart + other[1] @ step) ** 2))
    return found
