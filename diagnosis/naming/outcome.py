"""What a naming found: in the terminal, and as naming.json."""

from __future__ import annotations

import json
from collections.abc import Iterator
from dataclasses import asdict, dataclass, field
from math import ceil, log10
from pathlib import Path
from typing import Any

from selflock.fmus.shown import one_line, printed

from ..calibration.result import finite
from ..rules import RULES
from .guesses import EVENT

EXIT = {"explained": 0, "ambiguous": 0, "none": 3, "unknown": 4}
READS_AS = {  # laws that feed what an FMU gives back to what it is given, in words of mechanics
    "cubic": "a cubic stiffness, where the variable is a position: a restoring force over position",
    "quadratic": "a stiffness that differs by side, where the variable is a position",
    "drag": "a drag of the square, where the variable is a speed",
    "Coulomb": "Coulomb friction, where the variable is a speed",
    "Stribeck": "Stribeck friction, where the variable is a speed",
    "Dahl": "a hysteresis, as of bristles",
    "LuGre": "friction of bristles, where the variable is a position",
    "Bouc-Wen": "a hysteresis",
    "first order": "one more state of first order, as a thermal mass",
    "limit": "a limit: beyond it something is taken away, as by an overflow",
    "limit below": "a limit from below, as a stop",
    "dead band": "stops to both sides, or a play; with a near -1, and added to what it goes with, a limit to both sides",
    "overflow": "an overflow: beyond its limit a surplus leaves the one and goes on to the other",
}


@dataclass(frozen=True)
class Fitted:
    """A number of a cause: low, high are its 95 % interval; None where the data do not determine it."""

    name: str
    value: float
    low: float | None
    high: float | None
    each_run: bool = False  # one of a run alone
    unit: str = ""  # of a variable of an FMU, where that says one
    at_end: bool = False  # of the range in which it was looked for: it may be more

    def __str__(self) -> str:
        unit = f" {self.unit}" if self.unit else ""
        if self.low is None or self.high is None:
            return f"{self.name} = {self.value:.4g} [not determined]{unit}"
        apart, size = self.high - self.low, max(abs(self.low), abs(self.high))
        digits = 4 if not 0.0 < apart < size else min(max(4, ceil(log10(size / apart)) + 2), 9)  # as many as tell the ends apart
        end = " (at the end of the range in which it was looked for)" if self.at_end else ""
        return f"{self.name} = {self.value:.{digits}g} [{self.low:.{digits}g}, {self.high:.{digits}g}]{unit}{end}"


@dataclass
class FreeCurve:
    """A free curve of one variable, learnt from the data: heights with standard errors, straight between its points."""

    label: str
    over: str
    place: str
    multiplies: bool
    x: list[float]
    y: list[float]
    error: list[float]
    loss: float  # mean loss on unseen blocks
    base: float  # that of the model without it
    of_answer: bool  # whether it goes with what the answer does, where that does, and is no rival of it
    beyond: str = "as at the last of them beyond"


@dataclass
class NamedCause:
    """One thing that was found."""

    kind: str  # parameter | path | event | law | curve
    law: str
    label: str
    place: str  # component.variable
    where: str  # in | out | read
    over: str
    multiplies: bool
    formula: str
    numbers: list[Fitted]
    gain: float  # share of the mean loss of unseen blocks that it takes away
    chance: float
    beside: list[str] = field(default_factory=list)  # what does as well with as few numbers, and other inputs may tell apart
    same: list[str] = field(default_factory=list)  # the same by other names: no inputs tell them apart
    closer: list[str] = field(default_factory=list)  # what leaves less with more numbers, too little less to be believed for it
    runs: list[str] = field(default_factory=list)  # of an event: in which it was

    def sentence(self) -> str:
        """In words."""
        feeds_back = self.kind == "law" and self.where == "in" and self.over.split(".")[0] == self.place.split(".")[0] != ""
        reads = f" ({READS_AS[self.law]})" if self.law in READS_AS and feeds_back and not self.multiplies else ""
        return f"{self.label}{reads}"


@dataclass
class NamedError:
    """An output's root mean square errors, in its unit: held out, or where nothing is, on all data."""

    name: str
    unit: str
    before: float | None
    after: float | None
    low: float | None  # 95 % interval of `after`, over blocks
    high: float | None
    noise: float
    taught_before: float | None = None
    taught_after: float | None = None


@dataclass
class Naming:
    """What `name` returns."""

    verdict: str  # explained | ambiguous | unknown | none
    why: str  # a sentence
    system: str
    rig: str
    logs: list[str]
    held_out: str
    causes: list[NamedCause]
    errors: list[NamedError]
    curve: FreeCurve | None
    remainder: dict[str, Any]  # {significant, ratios: of error to noise}
    rivals: list[dict[str, Any]]  # of each round {base, rows: [{label, kind, numbers, loss, drop, chance, doubt}]}
    numbers: list[Fitted]  # of the base, fitted with what was found
    effort: dict[str, Any]
    extension: dict[str, Any] = field(default_factory=dict)
    faults: list[dict] = field(default_factory=list)
    notes: list[str] = field(default_factory=list)
    seed: int = 0
    stopped: bool = False  # by its time limit, before all was held against the base
    step: float = 0.0  # of the system, s, as it was taken
    models: list[dict[str, Any]] = field(default_factory=list)  # between which it did not decide (naming.plan)
    sources: dict[str, Any] = field(default_factory=dict)  # rig and logs, as paths from `folder`
    folder: Path | None = None
    files: list[str] = field(default_factory=list)

    @property
    def exit_code(self) -> int:
        return EXIT[self.verdict]

    def data(self) -> dict[str, Any]:
        """As naming.json has it."""
        found = {key: value for key, value in asdict(self).items() if key not in ("folder", "files")}
        return {"naming": 1} | found | {"rules": RULES.by_name()}

    def write(self, out: Path) -> Path:
        path = out / "naming.json"
        text = json.dumps(finite(self.data()), indent=2, ensure_ascii=False)
        path.write_text(text + "\n", encoding="utf-8", errors="backslashreplace")
        return path

    def next(self) -> Iterator[str]:
        """What to do with the answer, in sentences."""
        if self.stopped:
            yield "Its time was up before all was held against the base: the same command with more time goes on with the fits that it has"
        if self.verdict == "none":
            yield "Nothing that these logs show is missing: the calibrated numbers suffice"
        for cause in self.causes:
            if cause.beside:
                yield f"{cause.label} and {' and '.join(cause.beside)} do alike in these logs: record a run in which they would differ (selflock plan looks for one)"
            if cause.kind == "parameter":
                yield f"{cause.place} is off: give it under [parameters] of the rig, or let it be fitted under [calibrate]"
        if self.verdict == "unknown" and self.curve is not None:
            yield f"Look for what depends on {self.curve.over} and acts on {self.curve.place}: the curve shows how much it is"
        if self._remains:
            yield "What remains is more than noise: look at the errors over time below"

    @property
    def _remains(self) -> bool:
        """Whether more than noise remains beside an answer; of `none` its own sentence says so."""
        return bool(self.remainder.get("significant")) and self.verdict != "none"

    def lines(self) -> Iterator[str]:
        yield f"Verdict: {self.verdict}. {self.why}"
        for cause in self.causes:
            yield f"  {cause.kind}: {cause.sentence()}"
            yield (
                f"    {cause.formula}: {', '.join(map(str, cause.numbers))}"
                if cause.kind != "curve"
                else "    a curve, and no cause: see the report"
            )
            if cause.kind == EVENT:
                yield f"    it was in {' and '.join(cause.runs)}: of other runs it lowers no error"
            if cause.same:
                yield f"    the same by other names, whatever inputs within the range of these logs: {', '.join(cause.same)}"
            if cause.beside:
                yield f"    cannot be told from: {', '.join(cause.beside)}"
            if cause.closer:
                yield f"    with more numbers a little less is left by: {', '.join(cause.closer)}"
        if whole := [number for number in self.numbers if not number.each_run]:
            yield f"  fitted with it: {', '.join(map(str, whole))}"
        event = any(cause.kind == EVENT for cause in self.causes)
        for e in self.errors:
            ends = "" if e.low is None or e.high is None else f" [{e.low:.4g}, {e.high:.4g}]"
            before, after = ("failed" if size is None else f"{size:.4g}" for size in (e.before, e.after))
            taught = ""
            if event and e.taught_before is not None and e.taught_after is not None:  # where it was, and nowhere else
                taught = f"; where it taught {e.taught_before:.4g} -> {e.taught_after:.4g}"
            yield (
                f"  {e.name}, held out ({self.held_out}): {before} -> {after}{ends} {e.unit}".rstrip()
                + f"{taught} (noise of what taught {e.noise:.2g})"
            )
        if self._remains:
            worst, times = max(self.remainder["ratios"].items(), key=lambda one: one[1], default=("", 0.0))
            yield f"  what remains is more than noise, most of {worst}, {times:.2g} times it"
        if self.extension:
            told = self.extension
            if "fmu" in told:
                agrees = "agrees" if told["agrees"] else "does not agree"
                yield f"  {told['system']} run again on {told['log']}: error of {told['output']} {told['fmu']:.4g}, promised {told['promised']:.4g}: it {agrees}"
        yield from (f"  {note}." for note in self.notes)
        yield f"  {self.effort['simulations']} simulations, {self.effort['steps_per_second']:.2g} FMU steps a second, {self.effort['elapsed']:.0f} s"
        if self.folder:
            yield f"  open {self.folder / 'report.html'}"

    def summary(self) -> str:
        return "\n".join(map(one_line, self.lines()))

    def __str__(self) -> str:
        return self.summary()

    def _repr_html_(self) -> str:
        return printed(self.summary())
