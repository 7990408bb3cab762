"""Spikes of an input that a system answers to, and those that a recorder made."""

import numpy as np
import oscillators
import pandas as pd
import pytest

from selflock.diagnosis import calibrate

COUNT, BLOWS = 1200, 6
OFF = {name: {"start": 1.3 * value, "low": 0.1 * value, "high": 10.0 * value} for name, value in oscillators.TRUTH.items()}


def spikes(rng):
    """Rows far apart, and from where stairs step, and what is struck there."""
    rows = 100 + 150 * np.arange(BLOWS) + rng.integers(10, 40, BLOWS)
    return rows, rng.uniform(300.0, 600.0, BLOWS) * rng.choice([-1.0, 1.0], BLOWS)


def corrupted(result):
    return sorted(fault["first"] for fault in result.faults if fault["channel"] == "oscillator.force")


@pytest.mark.slow
def test_blows_of_one_row_are_given_to_what_answers_them(tmp_path, native, rng):
    """They are all that moves it: without them nothing can be fitted."""
    (rows, sizes), force = spikes(rng), np.zeros(COUNT)
    force[rows] = sizes
    fmu = native("oscillator")
    log = oscillators.log(tmp_path / "log.csv", fmu, rng, force=force, noise=1e-3, count=COUNT)
    table = pd.read_csv(log)
    table.loc[rows[0] + 3, "position"] = np.nan
    table.to_csv(log, index=False)
    rig = oscillators.rig(
        tmp_path / "rig.toml", fmu, {f"oscillator.{name}": one for name, one in OFF.items()}, more='inputs = "held"'
    )
    result = calibrate(rig, [log], out=None, starts=1)
    assert corrupted(result) == []
    assert result.values == pytest.approx({f"oscillator.{name}": value for name, value in oscillators.TRUTH.items()}, rel=0.05)


@pytest.mark.slow
def test_spikes_that_nothing_answers_are_corrupted(tmp_path, native, rng):
    (rows, sizes), fmu = spikes(rng), native("oscillator")
    log = oscillators.log(tmp_path / "log.csv", fmu, rng, noise=1e-3, count=COUNT)
    table = pd.read_csv(log)
    table.loc[rows, "u"] += sizes
    table.to_csv(log, index=False)
    rig = oscillators.rig(
        tmp_path / "rig.toml", fmu, {f"oscillator.{name}": one for name, one in OFF.items()}, more='inputs = "held"'
    )
    result = calibrate(rig, [log], out=None, starts=1)
    assert corrupted(result) == rows.tolist()
    assert result.values == pytest.approx({f"oscillator.{name}": value for name, value in oscillators.TRUTH.items()}, rel=0.05)
