"""The sanity box of a rig of FMUs: no law is known here, but the FMUs are. Each output is held against what its component computes.

Where the two are alike but for a factor, a sign or a zero that somebody slipped in, that is told before anything is judged.
"""

from __future__ import annotations

from collections.abc import Sequence
from math import pi

import numpy as np

from ..data.finding import Finding
from ..data.motions import near, number
from ..data.rig import Rig
from ..data.sanity import Box
from ..residuals.experiment import Experiment
from ..rules import RULES

SLIPS = (  # measured over simulated, and what was read as what
    (1e3, "milli (mV, mA, mN.m) read as the unit itself"), (1e-3, "the unit itself read as milli (mV, mA, mN.m)"),
    (180.0 / pi, "degrees read as radians"), (pi / 180.0, "radians read as degrees"),
    (30.0 / pi, "rpm read as rad/s"), (pi / 30.0, "rad/s read as rpm"), (1e5, "Pa read as bar"), (1e-5, "bar read as Pa"),
)  # fmt: skip
KELVIN = 273.15


def box(experiment: Experiment, rig: Rig) -> Box:
    """What a log and the FMUs of its rig say of each other, each component on its measured inputs."""
    shows, findings = [], []
    for residual in experiment.residuals:
        compared = experiment.compare(residual, {})
        sound = [good & np.isfinite(s) & np.isfinite(m) for s, m, good in compared]
        simulated, measured = (np.concatenate([one[k][g] for one, g in zip(compared, sound)]) for k in (0, 1))
        if len(measured) < RULES.data.fewest_pieces or not np.ptp(measured) or not np.ptp(simulated):
            continue
        said, found = held(residual.output, residual.unit, residual.components, residual.reads, simulated, measured, rig)
        shows.append(said)
        findings += found
    return Box(tuple(shows), tuple(findings), {})


def held(
    output: str,
    unit: str,
    components: Sequence[str],
    reads: Sequence[str],
    simulated: np.ndarray,
    measured: np.ndarray,
    rig: Rig,
    gross: float = RULES.data.gross,
) -> tuple[str, list[Finding]]:
    """What an output is of what components simulate of it, in words, and what is wrong where nothing but a slip makes it so.

    unit: the output's; reads: the channels that the components are given; gross: the factor from which on it is a slip.
    """
    makers, inputs = ", ".join(components), ", ".join(reads)
    rules, x, y = RULES.data, simulated - simulated.mean(), measured - measured.mean()
    times, zero = float(x @ y / (x @ x)), float(measured.mean() - simulated.mean())
    size = float(np.sqrt(y @ y))
    asis, left = (float(np.linalg.norm(y - factor * x)) / size for factor in (1.0, times))
    shows = f"{output} = {times:.3g} times what {makers} computes"
    if left > rules.mended:  # the two are not alike
        return f"{output} is not like what {makers} computes", []
    column = next((c.column for c in rig.columns if c.signal == output), output)
    name = f"column {column!r} ({output})"
    where = f"look at its unit, at those of {inputs} and at the parameters of {makers}"
    if times < 0.0 and rules.mends * left < asis:
        text = f"{name} goes against what {makers} computes"
        return shows, [Finding(f"{text}: turn a sign, of it or of {inputs} (factor = -1.0 under [columns]).", True, (output,))]
    slip = next((what for factor, what in SLIPS if near(times, factor)), "")
    if not 1.0 / gross < times < gross and rules.mends * left < asis:
        much = f"{number(times)} times" if times > 1.0 else f"1/{number(1.0 / times)} times"
        text = f"{name} is {much} what {makers} computes"
        return shows, [Finding(f"{text}: {f'{slip}? ' if slip else ''}{where}.", True, (output,))]
    if near(abs(zero), KELVIN, 1.0 + rules.known_slip) and unit in ("K", "degC"):
        text = f"{name} lies {zero:+.4g} {unit} from what {makers} computes"
        return shows, [
            Finding(f'{text}: K and degC exchanged? Write unit = "K" or "degC" for it, or for an input.', True, (output,))
        ]
    return shows, []
