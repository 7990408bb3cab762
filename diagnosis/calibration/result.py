"""What a calibration found: a report in the terminal, laid out as lmfit's, in a notebook, and as calibration.json."""

from __future__ import annotations

import json
import math
from collections.abc import Iterator
from dataclasses import asdict, dataclass, field
from itertools import combinations
from pathlib import Path
from statistics import NormalDist
from typing import Any

import numpy as np
import pandas as pd
from jinja2 import Environment

from selflock.fmus.shown import one_line
from selflock.view import page

from ..rules import RULES


@dataclass(frozen=True)
class FittedNumber:
    """A number and what the logs tell of it. low, high: its 95 % interval; both None where nothing changes with it."""

    name: str
    variable: str
    value: float
    low: float | None
    high: float | None
    error: float | None  # standard error; None where no data determine it
    start: float
    range: tuple[float, float]
    unit: str
    run: str = ""  # whose own it is
    silent: bool = False  # nothing that is compared changes with it
    determined: bool = True
    at_bound: str = ""  # lowest | highest
    collinear_with: list[str] = field(default_factory=list)

    def sentences(self) -> Iterator[str]:
        """What is doubtful about it, in words."""
        if self.silent:
            yield (
                f"{self.name} changes nothing that is compared: it keeps {self.value:.6g}. Is it read by what was measured? "
                "Some FMUs take it from another parameter"
            )
            return
        if self.at_bound and self.error is not None:  # of what nothing tells a fit may end anywhere
            end = self.range[0] if self.at_bound == "lowest" else self.range[1]
            yield f"{self.name} is at the {self.at_bound} value of its range, {end:.6g}: the range, or the model, may be wrong"
        if not self.determined:
            yield f"{self.name} is not determined by these logs: its 95 % interval is {self.low:.4g} to {self.high:.4g}"


@dataclass(frozen=True)
class ChannelError:
    """How far an output is from what was measured: root mean squares, in its unit."""

    name: str
    unit: str
    before: float | None  # with the numbers as they were given; None where that run broke off
    after: float | None
    noise: float  # of single samples
    spread: float  # standard deviation of what was measured
    samples: int  # that told the noise
    held_out_before: float | None = None
    held_out: float | None = None  # on data that taught nothing; None where there are none
    judged: int = 0  # samples of these

    @property
    def error(self) -> float | None:
        """What is left, on what is held out where that is."""
        return self.after if self.held_out is None else self.held_out

    @property
    def explained(self) -> float | None:
        """Share of the variance, on what is held out where that is."""
        return 1.0 - (self.error / self.spread) ** 2 if self.spread and self.error is not None else None

    @property
    def lacking(self) -> bool:
        """Whether more is left than noise, and than few samples make of it by chance.

        A root mean square of n samples scatters by 1 / sqrt(2 n) of itself, the noise, told by a median, by more
        (`noise_scatter`). The more samples, the nearer to the noise must the error be.
        """
        error, count = self.error, self.samples if self.held_out is None else self.judged
        if error is None or not (count and self.samples):
            return True
        scatter = math.hypot(RULES.residuals.noise_scatter / math.sqrt(self.samples), math.sqrt(0.5 / count))
        return error > (RULES.search.clean + NormalDist().inv_cdf(1.0 - RULES.judge.significant) * scatter) * self.noise

    def sentences(self) -> list[str]:
        """What an error says against the numbers."""
        error = self.error
        if error is None or not self.lacking or error <= RULES.judge.excess * self.noise:
            return []
        if self.spread <= RULES.judge.excess * self.noise:  # a level within one step of what was written
            return [
                f"{self.name} stands still in what was measured, and in the model moves by {error:.2g}: less than its steps nobody sees"
            ]
        if error > self.spread:
            return [
                f"{self.name} is off by more than what was measured of it varies: look at its column's unit and sign, and at what drives it"
            ]
        times = f"{self.name} is off by {error / self.noise:.2g} times its noise" if self.noise else f"{self.name} is off"
        return [
            f"{times}, of which the intervals know nothing: steps may be too long ([run] step, inputs), or something is missing (selflock name)"
        ]


@dataclass
class Calibration:
    """What `calibrate` returns. `values` by name; `table` for a look at all."""

    system: str
    rig: str
    logs: list[str]
    numbers: list[FittedNumber]
    correlations: list[dict[str, Any]]  # {first, second, correlation}, largest first
    errors: list[ChannelError]
    held_out: str  # what judged, in words
    starts: list[dict[str, Any]]  # {start, end, loss, alike}, best first
    samples: int
    effort: dict[str, Any]  # simulations, failed, reasons, fmu_steps, seconds, steps_per_second
    notes: list[str] = field(default_factory=list)
    faults: list[dict] = field(default_factory=list)
    seed: int = 0
    folder: Path | None = None
    files: list[str] = field(default_factory=list)

    @property
    def values(self) -> dict[str, float]:
        return {number.name: number.value for number in self.numbers}

    @property
    def table(self) -> pd.DataFrame:
        """A row for each number."""
        return pd.DataFrame([asdict(number) for number in self.numbers]).set_index("name")

    def doubts(self) -> list[str]:
        """All that should be known before the numbers are used."""
        together = dict.fromkeys(tuple(sorted([n.name, *n.collinear_with])) for n in self.numbers if n.collinear_with)
        alike = [f"{', '.join(names[:-1])} and {names[-1]} cannot be told from one another in these logs" for names in together]
        told = [number.sentences() for number in self.numbers] + [error.sentences() for error in self.errors]
        return [sentence for sentences in told for sentence in sentences] + alike + self.notes

    def says(self) -> str:
        """What was found, in a clause."""
        told = [n for n in self.numbers if not n.silent]
        sound = sum(n.determined and not n.at_bound and not n.collinear_with for n in told)
        count = len(self.numbers)
        if sound == count:
            return "The number was found" if count == 1 else f"All {count} numbers were found"
        return f"{sound or 'None'} of {count} numbers {'was' if sound == 1 else 'were'} found beyond doubt"

    def lacking(self) -> list[str]:
        """Outputs of which more is left than noise."""
        return [error.name for error in self.errors if error.lacking]

    def data(self) -> dict[str, Any]:
        """As calibration.json has it."""
        found = {key: value for key, value in asdict(self).items() if key not in ("folder", "files")}
        return {"calibration": 1} | found | {"doubts": self.doubts(), "rules": RULES.by_name()}

    def summary(self) -> str:
        """A report as lmfit's."""
        effort, fitted = self.effort, [n for n in self.numbers if not n.silent]
        alike = sum(start["alike"] for start in self.starts)
        lines = ["[[Model]]", f"    {self.system} on {', '.join(self.logs)}", "[[Fit Statistics]]"]
        rows = {
            "fitting method": f"least squares, robust, {len(self.starts)} starts, {alike} ended here",
            "simulations": f"{effort['simulations']}" + (f", {effort['failed']} failed" if effort["failed"] else ""),
            "FMU steps": f"{effort['fmu_steps']:.3g}, {effort['steps_per_second']:.2g} a second",
            "data points": self.samples,
            "variables": len(fitted),
        }
        lines += [f"    # {key:16} = {value}" for key, value in rows.items()]
        lines += [f"      failed {count} times: {reason}" for reason, count in effort["reasons"].items()]
        lines += [f"[[Errors]] (root mean squares; held out: {self.held_out or 'nothing'})"]
        width = max((len(e.name) for e in self.errors), default=0)
        for e in self.errors:
            before, after = ("failed" if size is None else f"{size:.4g}" for size in (e.before, e.after))
            held = "" if e.held_out is None else f", held out {e.held_out:.4g}"
            lines.append(f"    {e.name + ':':{width + 1}} {before} -> {after} {e.unit} (noise {e.noise:.2g}){held}")
        lines.append("[[Variables]]")
        width = max((len(n.name) for n in self.numbers), default=0)
        for n in self.numbers:
            unit = f" {n.unit}" if n.unit else ""
            lines.append(f"    {n.name + ':':{width + 1}} {spelt(n)}{unit} (init = {n.start:.6g})")
        if self.correlations:
            lines.append(f"[[Correlations]] (unreported correlations are < {RULES.calibrate.told_correlation:.3f})")
            pairs = [f"C({pair['first']}, {pair['second']})" for pair in self.correlations]
            width = max(map(len, pairs))
            lines += [f"    {name:{width}} = {pair['correlation']:+.4f}" for name, pair in zip(pairs, self.correlations)]
        if self.doubts():
            lines += ["[[Doubts]]", *(f"    {sentence}." for sentence in self.doubts())]
        if self.faults:
            lines.append("[[Data]]")
            lines.append(f"    {len(self.faults)} faults in the data, left out (calibration.json)")
        if self.folder:
            lines.append(f"Open {self.folder / 'report.html'}; the next run takes {self.folder / self.files[0]}")
        return "\n".join(map(one_line, lines))

    def __str__(self) -> str:
        return self.summary()

    def _repr_html_(self) -> str:
        """The tables, for a notebook."""
        return environment().get_template("tables.html.j2").render(result=self)

    def write(self, out: Path) -> Path:
        """calibration.json."""
        path = out / "calibration.json"
        path.write_text(
            json.dumps(finite(self.data()), indent=2, ensure_ascii=False) + "\n", encoding="utf-8", errors="backslashreplace"
        )
        return path


def spelt(n: FittedNumber) -> str:
    """A number with its standard error and its interval, as lmfit and as a paper have it."""
    if n.silent:
        return f"{n.value:.8g} (changes nothing)"
    if n.low is None:
        return f"{n.value:.8g} (fitted to what judges)"
    share = f" ({100.0 * n.error / abs(n.value):.2f}%)" if n.error is not None and n.value else ""
    error = f"{n.error:.3g}" if n.error is not None else "?"
    marks = [word for word, on in (("at bound", n.at_bound), ("not determined", not n.determined)) if on]
    return f"{n.value:.8g} +/- {error}{share}, 95 %: {n.low:.5g} to {n.high:.5g}" + "".join(f" [{mark}]" for mark in marks)


def finite(told: Any) -> Any:
    """Plain data without what JSON cannot say."""
    if isinstance(told, dict):
        return {key: finite(value) for key, value in told.items()}
    if isinstance(told, (list, tuple)):
        return [finite(value) for value in told]
    if isinstance(told, (float, np.floating)):
        return float(told) if math.isfinite(told) else None
    return told


def pairs(names: list[str], like: np.ndarray) -> list[dict[str, Any]]:
    """Correlations that are told, the largest first."""
    found = [
        {"first": names[i], "second": names[j], "correlation": float(like[i, j])}
        for i, j in combinations(range(len(names)), 2)
        if abs(like[i, j]) >= RULES.calibrate.told_correlation
    ]
    return sorted(found, key=lambda pair: -abs(pair["correlation"]))


def environment() -> Environment:
    """Where the pages' templates are; whatever is put into them is escaped."""
    return page.environment("selflock.diagnosis.calibration", strict=False)
