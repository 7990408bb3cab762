"""report.html: one self-contained page that says within a minute what is wrong, why, and what mending brings."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from selflock.view import figures, page

from ..data.faults import DataFault
from ..judge.cause import Cause
from ..judge.depends import Dependence
from ..judge.result import Diagnosis
from ..judge.together import against
from ..residuals import driven
from ..residuals.mending import Mending
from ..search.selection import Selection
from . import pictures, spectrum
from .traces import traces

SAYS = {
    "explained": "A cause was found.",
    "ambiguous": "A cause was found, but this log cannot tell it from another.",
    "contrary": "A cause was found, but the whole drive, simulated with it, speaks against it.",
    "unknown": "Something is missing in the simulation, but none of the known causes explains it.",
    "none": "Nothing is missing: what remains is noise.",
}

LEFT_OVER = {  # what remains, by the variable it depends on
    "direction": "is another one way than the other",
    "speed": "goes with the speed",
    "load": "goes with the load that is carried",
    "acceleration": "goes with speeding up and slowing down",
    "position": "comes at places of the input shaft's turn",
    "output position": "pulls at places of the output's turn",
    "current": "goes with the current",
    "temperature": "goes with the temperature",
    "supply voltage": "goes with the voltage of the supply",
    "set-point change": "comes when set-points change",
    "time": "changes with time",
}
TOLD = 3  # dependences in the first lines
QUARTER = np.pi / 2.0
NEAR = np.radians(1.0)  # to a quarter of a turn: angles are mounted and counted no finer by eye


def write(
    result: Diagnosis, mending: Mending, outcome: Selection | None, left: list[Dependence], faults: list[DataFault], out: Path
) -> Path:
    """Write the page with its figures; `outcome`: of a search, where there was one."""
    experiment, noise = mending.experiment, result.gain.noise_floor
    found = outcome if outcome and outcome.causes else None
    drawn = figures.carried(
        {
            "missing": pictures.missing(mending, found, np.random.default_rng(1), left[0].variable if left else "")
            if found or result.verdict == "unknown"
            else None,
            "traces": traces(mending),
            "where": pictures.where(mending, noise),
            "spectrum": spectrum.plots(mending, noise),
            "faults": pictures.faults(experiment.original, faults),
        },
        least={"traces": 900, "where": 230, "spectrum": 420},
    )
    environment = page.environment("selflock.diagnosis.output", strict=False)
    environment.filters["estimate"] = estimate
    return page.write(
        out / "report.html",
        environment,
        "report.html.j2",
        drawn,
        rig=experiment.rig,
        result=result,
        says=SAYS["contrary" if result.causes and against(result.whole) else result.verdict],
        gain=result.gain,
        stages=result.rivals,
        left=left,
        faults=faults,
        drawn=set(drawn.get("figures", ())),
        next=following(result, not driven.lacking(experiment.rig, set(experiment.runs[0].signals))),
        dependences=dependences([left_over(name, experiment.rig.linear) for name in result.remainder["depends_on"]]),
        bars=pictures.search(outcome) if outcome else [],
        sources={c.hypothesis.label: (c.hypothesis.summary, c.hypothesis.source) for c in (outcome.causes if outcome else [])},
    )


def dependences(told: list[str]) -> str:
    """What is left goes with, the most of it first: a few in words, for what is left of a log without noise goes with everything."""
    each = list(dict.fromkeys(told))
    return "; ".join(each[:TOLD] + [f"and with {len(each) - TOLD} more, below"] * (len(each) > TOLD))


def left_over(name: str, linear: bool = False) -> str:
    """How what is left goes with a variable, in words."""
    if linear and name in ("position", "output position"):
        return "comes at places of its way"
    every = name.removeprefix("time, period ")
    return f"comes again every {every}" if every != name else LEFT_OVER.get(name, f"depends on {name}")


def following(result: Diagnosis, loop: bool = False) -> list[str]:
    """What to do next, sentences. loop: whether rig and logs describe a whole drive, of which a run can be planned."""
    said = [sentence for cause in result.causes for sentence in (convention(cause), cause.separate_by) if sentence]
    if result.verdict == "none":
        said.append("Nothing: the simulation is as good as this log can tell.")
    elif loop and len(result.models) > 1 and result.folder:
        rivals = "; ".join(model.label for model in result.models)
        said.append(f"selflock plan {result.folder} finds the run to record that tells apart: {rivals}.")
    if result.best:
        said.append("The best model is written with all else, to use or to doubt.")
    return list(dict.fromkeys(said))


def convention(cause: Cause) -> str:
    """Of a bias of an angle that is quarters of a turn: that nothing is wrong with the sensor."""
    for name, number in cause.parameters.items():
        quarters = round(number["value"] / QUARTER)
        if cause.effect == "bias" and number["unit"] == "rad" and quarters and abs(number["value"] - quarters * QUARTER) < NEAR:
            return (
                f"{name} is {90 * quarters:g}°: no fault of a sensor, but an angle that is counted from another zero. In the rig, "
                f"{-number['value']:+.5g} belongs to the offset of its column."
            )
    return ""


def estimate(number: dict) -> str:
    """A number with its unit, its 95 % interval where it has one, and whether it wants to leave its range."""
    factor, unit = {"s": (1e3, "ms"), "1": (100.0, "%")}.get(number["unit"], (1.0, number["unit"]))
    said = lambda key: page.number(factor * number[key], 3)
    text = f"{said('value')} {page.pretty(unit)}"
    if number.get("low") is not None:
        text += f" ({said('low')} to {said('high')})"
    return text + ", at the end of its range" * bool(number.get("at_end"))
