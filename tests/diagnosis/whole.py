"""What the whole drive, simulated from its set-points with an answer's values, leaves of a log: channel by channel."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np

from selflock.diagnosis.data.faults import check
from selflock.diagnosis.data.log import read
from selflock.diagnosis.data.rig import load
from selflock.diagnosis.residuals import drive, forward
from selflock.diagnosis.residuals.drive_experiment import DriveExperiment

COMPARED = {
    "voltage": ("controller.voltage", "voltage"),
    "current": ("motor.current", "current"),
    "output_torque": ("reducer.output_torque", "output_torque"),
    "motor_angle": ("reducer.input_angle", "input_angle"),
    "angle": ("load.angle", "angle"),
}
"""The plant's channel: the product's, and its row in a whole simulation."""


def errors(rig: Path, log: Path, values: dict[str, float]) -> dict[str, float]:
    """Error (root mean square) of each measured channel, and of the twist between two measured angles, whose zeros are free."""
    closed = replace(load(rig), simulate="closed")
    runs = read(log, closed)
    check(runs, closed)
    (channels,) = DriveExperiment(closed, runs).channels.values()
    simulated = forward.simulate(values, channels, True)
    off = {}
    for name, (signal, row) in COMPARED.items():
        if channels.has(signal):
            off[name] = np.where(
                channels.good(signal), channels.raw(signal) - drive.read(signal, simulated[row], values, channels), np.nan
            )
    if "motor_angle" in off:
        off["twist"] = off.pop("motor_angle") / channels.setting.value("reducer.gear_ratio", values) - off["angle"]
        off["twist"] -= np.nanmedian(off["twist"])
    return {name: float(np.sqrt(np.nanmean(e**2))) for name, e in off.items()}


def values(result: dict) -> dict[str, float]:
    """The values of an answer's causes, as a simulation takes them."""
    return {name: p["value"] for cause in result["causes"] for name, p in cause["parameters"].items()}
