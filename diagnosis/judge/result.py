"""The answer of a diagnosis, as diagnosis.json holds it."""

from __future__ import annotations

import json
from dataclasses import asdict, dataclass, field
from html import escape
from math import isfinite
from pathlib import Path
from typing import Any

from selflock.fmus.shown import one_line, printed, visible

from ..data.sanity import Box
from ..rules import RULES
from ..search.starts import Told
from .cause import Cause
from .gain import Gain
from .models import OpenModel
from .time_step import TimeStep


@dataclass
class Best:
    """The best model that the search found, where none is believed: its causes are no answer, its gain is measured."""

    causes: list[Cause]
    gain: Gain
    why: str  # it is not believed: a sentence without its subject

    def row(self) -> dict:
        """As diagnosis.json has it."""
        return {"causes": [c.row() for c in self.causes], "gain": asdict(self.gain), "why_not": self.why}

    def __str__(self) -> str:
        names, g = " and ".join(c.label for c in self.causes), self.gain
        return f"best model, not believed: {names}, {g.before:.4g} -> {g.after:.4g} {g.unit}; {self.why}"


EXIT = {"explained": 0, "ambiguous": 0, "none": 3, "unknown": 4}


@dataclass
class Diagnosis:
    """What `diagnose` returns. `folder` holds the report, the extended FMUs and everything else that was written."""

    verdict: str  # explained | ambiguous | unknown | none
    faults: list[dict]
    blame: list[dict]
    causes: list[Cause]
    gain: Gain
    remainder: dict
    folder: Path | None = None
    extension: dict = field(default_factory=dict)
    step: TimeStep | None = None  # what a finer step would change
    best: Best | None = None  # where nothing is believed
    uncertain: list[Told] = field(default_factory=list)  # what no data sheet says, as it was found
    correlations: list[dict] = field(default_factory=list)  # of fitted numbers that hang together: search.starts
    comparisons: list[dict] = field(default_factory=list)  # errors of all: judge.gain
    recorder: dict = field(default_factory=dict)  # what was assumed and estimated of it: judge.recorded
    whole: list[dict] = field(default_factory=list)  # errors of the whole drive, where parts were compared: judge.together
    rivals: list[dict] = field(default_factory=list)  # what competed in each step of the search: judge.rivals
    runs: list[dict] = field(default_factory=list)  # what belongs to a run: {log, run, parameter, value, low, high}
    sanity: Box | None = None  # what logs and rig of a drive say of each other
    models: list[OpenModel] = field(default_factory=list)  # the answer, and what these logs do not tell from it: judge.models
    sources: dict = field(default_factory=dict)  # rig and logs, as paths from `folder`
    about: dict = field(default_factory=dict)  # unit, date of recording, logs by their bytes, version: data.origin

    @property
    def exit_code(self) -> int:
        """Of `selflock diagnose`: 0 a cause, 3 nothing missing, 4 unknown."""
        return EXIT[self.verdict]

    @property
    def report(self) -> Path | None:
        """The page that was written, if any."""
        return self.folder / "report.html" if self.folder else None

    def data(self) -> dict:
        """What diagnosis.json holds: plain numbers, texts and lists; `rules`: those that it was made with."""
        found: dict[str, Any] = {
            "verdict": self.verdict,
            "faults": self.faults,
            "blame": self.blame,
            "causes": [c.row() for c in self.causes],
            "gain": asdict(self.gain),
            "remainder": self.remainder,
        }
        if self.about:
            found["about"] = self.about
        if self.sanity:
            found["sanity"] = self.sanity.row()
        if self.comparisons:
            found["comparisons"] = self.comparisons
        if self.correlations:
            found["correlations"] = self.correlations
        if self.uncertain:
            found["uncertain"] = [one.row() for one in self.uncertain]
        if self.recorder:
            found["recorder"] = self.recorder
        if self.runs:
            found["runs"] = self.runs
        if self.whole:
            found["whole"] = self.whole
        if self.rivals:
            found["rivals"] = self.rivals
        if self.models:
            found["models"] = [model.row() for model in self.models]
        if self.sources:
            found["sources"] = self.sources
        if self.best:
            found["best"] = self.best.row()
        if self.step:
            found["step"] = self.step.row()
        if self.extension:
            found["extension"] = self.extension
        found["rules"] = RULES.by_name()
        return _finite(found)

    def write(self, folder: Path) -> None:
        """Write diagnosis.json."""
        (folder / "diagnosis.json").write_text(json.dumps(self.data(), indent=2) + "\n")

    def summary(self) -> str:
        """The answer in a few lines of text."""
        lines = [*(self.sanity.lines() if self.sanity else []), f"Verdict: {self.verdict}"]
        for cause in self.causes:
            values = ", ".join(
                f"{name} = {p['value']:.4g} [{p['low']:.4g}, {p['high']:.4g}] {p['unit']}".rstrip()
                for name, p in cause.parameters.items()
            )
            lines.append(f"  cause, {cause.mark}: {cause.label}: {values}")
            if cause.indistinguishable_from:
                lines.append(f"    cannot be told from: {', '.join(cause.indistinguishable_from)}. {cause.separate_by}")
            if cause.weak:
                lines.append(f"    weak: {'; '.join(cause.weak)}")
        g = self.gain
        beside = [*filter(None, [g.relative]), f"noise floor {g.noise_floor:.3g} {g.unit}", f"closed {100 * g.closed:.0f} %"]
        lines.append(f"  {g.metric}, held out: {g.before:.4g} -> {g.after:.4g} {g.unit} ({', '.join(beside)})")
        if self.remainder["significant"]:
            lines.append(f"  what remains depends on: {', '.join(self.remainder['depends_on']) or 'nothing that was measured'}")
        if self.best:
            lines.append(f"  {self.best}")
        if learnt := self.extension.get("learnt"):
            change = f"{learnt['before']:.4g} -> {learnt['after']:.4g} {learnt['unit']} at the input shaft, held out"
            lines.append(f"  a curve and no cause: {learnt['file']}, a torque over {learnt['over']}, {change}")
        if self.step:
            lines.append(f"  {self.step}")
        for name in dict.fromkeys(row["parameter"] for row in self.runs):
            mine = [row for row in self.runs if row["parameter"] == name]
            each = [f"{row['value']:.4g} ({' '.join(filter(None, (row['log'], row['run'])))})" for row in mine]
            lines.append(f"  {name} of each run: {', '.join(each)}")
        lines += [f"  {sentence}" for one in self.uncertain for sentence in one.sentences()]
        if self.recorder.get("loop"):
            lines.append(f"  {self.recorder['loop']}")
        if self.faults:
            kinds = sorted({fault["kind"] for fault in self.faults})
            lines.append(f"  {len(self.faults)} faults in the data ({', '.join(kinds)}), left out of every fit")
        if "not_written" in self.extension:
            lines.append(f"  the extended FMUs are not all written: {self.extension['not_written']}")
        if self.report:
            lines.append(f"  open {self.report}")
        return "\n".join(map(one_line, lines))

    def __str__(self) -> str:
        return self.summary()

    def _repr_html_(self) -> str:
        """Verdict, causes with their numbers and the gain as tables, for a notebook; the whole summary below."""
        rows = "".join(
            f"<tr><td>{_text(cause.label)}</td><td>{_text(cause.mark)}</td><td>{_text(name)}</td>"
            + "".join(f'<td style="text-align: right">{p[key]:.4g}</td>' for key in ("value", "low", "high"))
            + f"<td>{_text(p['unit'])}</td></tr>"
            for cause in self.causes
            for name, p in cause.parameters.items()
        )
        head = "".join(f"<th>{word}</th>" for word in ("cause", "", "number", "value", "95 % from", "to", "unit"))
        table = f"<table><thead><tr>{head}</tr></thead><tbody>{rows}</tbody></table>" if rows else ""
        g = self.gain
        gain = f"{g.metric}, held out: {g.before:.4g} → {g.after:.4g} {g.unit}, noise {g.noise_floor:.3g}"
        more = f"<details><summary>all of it</summary>{printed(self.summary())}</details>"
        return f"<div><b>{_text(self.verdict)}</b>: {_text(gain)}{table}{more}</div>"


def _text(words: object) -> str:
    return escape(visible(words))


def _finite(value):
    """JSON has no infinities."""
    if isinstance(value, dict):
        return {k: _finite(v) for k, v in value.items()}
    if isinstance(value, (list, tuple)):
        return [_finite(v) for v in value]
    if isinstance(value, float) and not isfinite(value):
        return None
    if hasattr(value, "item"):
        return value.item()
    return value
