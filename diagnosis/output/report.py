"""report.html: one self-contained page that says within a minute what is wrong, why, and what mending brings."""

from __future__ import annotations

import base64
from pathlib import Path

import numpy as np

from selflock.view import page

from ..data.faults import DataFault
from ..judge.depends import Dependence
from ..judge.result import Diagnosis
from ..judge.together import against
from ..residuals.mending import Mending
from ..search.selection import Selection
from . import figures, spectrum

SAYS = {
    "explained": "A cause was found.",
    "ambiguous": "A cause was found, but this log cannot tell it from another.",
    "contrary": "A cause was found, but the whole drive, simulated with it, speaks against it.",
    "unknown": "Something is missing in the simulation, but none of the known causes explains it.",
    "none": "Nothing is missing: what remains is noise.",
}


def write(
    result: Diagnosis, mending: Mending, outcome: Selection | None, left: list[Dependence], faults: list[DataFault], out: Path
) -> Path:
    """Draw the figures as PNG files and write the page that holds them; `outcome`: of a search, where there was one."""
    experiment, rng = mending.experiment, np.random.default_rng(1)
    pictures = {
        "traces": figures.traces(mending, out / "traces.png"),
        "where": figures.where(mending, result.gain.noise_floor, out / "where.png"),
        "spectrum": spectrum.draw(mending, result.gain.noise_floor, out / "spectrum.png"),
        "search": figures.search(outcome, out / "search.png") if outcome else None,
        "missing": figures.missing(mending, outcome, out / "missing.png", rng) if outcome and outcome.causes else None,
        "faults": figures.faults(experiment.original, faults, out / "faults.png"),
    }
    environment = page.environment("selflock.diagnosis.output", strict=False)
    environment.filters["estimate"] = estimate
    return page.write(
        out / "report.html",
        environment,
        "report.html.j2",
        rig=experiment.rig,
        result=result,
        says=SAYS["contrary" if result.causes and against(result.whole) else result.verdict],
        gain=result.gain,
        stages=result.rivals,
        left=left,
        faults=faults,
        pictures={k: base64.b64encode(p.read_bytes()).decode() for k, p in pictures.items() if p},
        sources={c.hypothesis.label: (c.hypothesis.summary, c.hypothesis.source) for c in (outcome.causes if outcome else [])},
    )


def estimate(number: dict) -> str:
    """A number with its unit, its 95 % interval where it has one, and whether it wants to leave its range."""
    factor, unit = {"s": (1e3, "ms"), "1": (100.0, "%")}.get(number["unit"], (1.0, number["unit"]))
    text = f"{factor * number['value']:.3g} {unit}"
    if number.get("low") is not None:
        text += f" ({factor * number['low']:.3g} to {factor * number['high']:.3g})"
    return text + ", at the end of its range" * bool(number.get("at_end"))
