"""The sanity box of a rig of FMUs: no law is known here, but the FMUs are. Each output is held against what its component computes.

Where the two are alike but for a factor, a sign or a zero that somebody slipped in, that is told before anything is judged.
"""

from __future__ import annotations

from math import pi

import numpy as np

from ..data.finding import Finding
from ..data.motions import near, number
from ..data.rig import Rig
from ..data.sanity import Box
from ..residuals.experiment import Experiment
from ..residuals.residual import Residual
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
        said, found = _held(residual, simulated, measured, rig)
        shows.append(said)
        findings += found
    return Box(tuple(shows), tuple(findings), {})


def _held(residual: Residual, simulated: np.ndarray, measured: np.ndarray, rig: Rig) -> tuple[str, list[Finding]]:
    """What an output is of its simulation, in words, and what is wrong where nothing but a slip makes it so."""
    rules, x, y = RULES.data, simulated - simulated.mean(), measured - measured.mean()
    times, zero = float(x @ y / (x @ x)), float(measured.mean() - simulated.mean())
    size = float(np.sqrt(y @ y))
    asis, left = (float(np.linalg.norm(y - factor * x)) / size for factor in (1.0, times))
    shows = f"{residual.output} = {times:.3g} times what {', '.join(residual.components)} computes"
    if left > rules.mended:  # the two are not alike
        return f"{residual.output} is not like what {', '.join(residual.components)} computes", []
    column = next((c.column for c in rig.columns if c.signal == residual.output), residual.output)
    name = f"column {column!r} ({residual.output})"
    inputs = ", ".join(residual.reads)
    where = f"look at its unit, at those of {inputs} and at the parameters of {', '.join(residual.components)}"
    if times < 0.0 and rules.mends * left < asis:
        text = f"{name} goes against what {', '.join(residual.components)} computes"
        return shows, [
            Finding(f"{text}: turn a sign, of it or of {inputs} (factor = -1.0 under [columns]).", True, (residual.output,))
        ]
    slip = next((what for factor, what in SLIPS if near(times, factor)), "")
    if not 1.0 / rules.gross < times < rules.gross and rules.mends * left < asis:
        much = f"{number(times)} times" if times > 1.0 else f"1/{number(1.0 / times)} times"
        text = f"{name} is {much} what {', '.join(residual.components)} computes"
        return shows, [Finding(f"{text}: {f'{slip}? ' if slip else ''}{where}.", True, (residual.output,))]
    if near(abs(zero), KELVIN, 1.0 + rules.known_slip) and residual.unit in ("K", "degC"):
        text = f"{name} lies {zero:+.4g} {residual.unit} from what {', '.join(residual.components)} computes"
        return shows, [Finding(f'{text}: K and degC exchanged? Write unit = "K" or "degC" for it, or for an input.', True, (residual.output,))]  # fmt: skip
    return shows, []
