"""Whether a log was taken in step with its controller: if not, a drive whose loop is described is compared as a whole."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from ..data.log import MeasuredRun
from ..data.rig import Rig
from ..data.signals import ANGLE_OF, MOVES
from ..residuals import drive, driven
from ..residuals.channels import Channels
from ..residuals.closing import ahead, unseen
from ..residuals.kernels import kernels
from ..residuals.recorder import counts, measured, noisy
from ..residuals.setting import Setting
from ..residuals.whole import WHOLE, undescribed
from ..rules import RULES


def whole_where_described(rig: Rig, runs: list[MeasuredRun]) -> tuple[Rig, str]:
    """The rig, asking for the whole drive in closed loop where it describes one and its log was not taken in step with it; and why.

    Component by component tells more where rows are even, the controller acts at each and gives its command as a number, and
    speeds are what they say: then measured inputs are as good as the outputs that follow from them. Of a controller that commands a
    duty its parts say nothing, nor of what a power stage makes of that.
    """
    run = runs[0]
    if rig.simulate:
        return rig, f'the rig asks for it (simulate = "{rig.simulate}")'
    if what := undescribed(rig, set(run.signals)):
        return rig, f"the rig and its log describe no whole loop, which needs {what}"
    if reasons := out_of_step(rig, runs):
        return replace(rig, simulate=WHOLE), f"the log was not taken in step with its controller: {'; '.join(reasons)}"
    return rig, (
        "nothing says that the log was not taken in step with its controller: "
        "its rows are even, no period is given, its voltage is a number without noise, no speed is made of counts"
    )


def out_of_step(rig: Rig, runs: list[MeasuredRun]) -> list[str]:
    """What says that a log was not taken in step with its controller; nothing where it may have been."""
    run = runs[0]
    setting = Setting(rig, len(run), kernels(), {"": RULES.residuals.usual_window})
    channels, steps = Channels(run, "", setting, beside=tuple(runs)), np.diff(run.time)
    found, usual = [], float(np.median(steps))
    if (period := rig.parameters.get("controller.sample_period", 0.0)) > 0.0:
        found.append(f"the rig gives the controller a period of its own, {1e3 * period:.4g} ms")
    uneven = float(np.median(abs(steps - usual)))
    if uneven > RULES.pipeline.even * usual:
        found.append(f"its rows are uneven, half of them by more than {100 * uneven / usual:.2g} % of the step")
    if not (electric := drive.electric(channels)):
        found.append("it has no voltage")
    elif (noise := measured(electric, channels)) > RULES.residuals.exact:
        found.append(f"{electric} was measured: it has noise of its own, {100 * noise:.2g} % of its spread")
    elif ahead(channels):
        found.append("its commands stand in the row before the one that they answer")
    elif name := unseen(channels):
        what = "noise that the log has of" if name.endswith("speed") else "counts in which the log has"
        found.append(f"{electric} does not step with the {what} {name}: its controller saw another sample")
    if driven.of(channels) != driven.VOLTAGE and electric == driven.DUTY:
        found.append(f"its controller commands {electric}, which no comparison of single parts has")
    if driven.of(channels) == driven.VOLTAGE and (names := [n for n in MOVES if channels.has(n) and noisy(n, channels)]):
        reads = "read" if names[1:] else "reads"
        found.append(f"it is in open loop, where nothing acts on what {' and '.join(names)} {reads}, noise and all")
    for speed in ANGLE_OF:
        if channels.has(speed) and (rows := counts(speed, channels)[1]):
            found.append(f"{speed} is a difference of counts over {rows} row{'s' * (rows > 1)}")
    return found
