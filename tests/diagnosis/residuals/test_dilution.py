"""Noise of the voltage that drives an open loop: how much of it there is, and what it makes of the other channels."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from selflock.diagnosis.data.rig import load
from selflock.diagnosis.pipeline.run import gather
from selflock.diagnosis.residuals import dilution, whole
from selflock.diagnosis.residuals.drive_experiment import DriveExperiment

from ..plant import cascade


@pytest.fixture
def case(rng, monkeypatch):
    """A sound drive whose voltage is logged as the mean over each row, so that all noise on it is what a test puts there.

    Its motor has an angle: of an arm that hangs a speed alone describes no whole drive.
    """
    drawn = cascade.recorder
    exact = lambda rng: replace(drawn(rng), mean_voltage=True, channels=("u", "i", "n", "rotor"))
    monkeypatch.setattr(cascade, "recorder", exact)
    return cascade.hide([], cascade.DEVELOPMENT + int(rng.integers(10**6)), 4.0)


def experiment(case, folder, volts, rng):
    """Of the case's first log with so much white noise on its voltage, V."""
    folder.mkdir()
    logs = [log.assign(u=log["u"] + volts * rng.standard_normal(len(log))) for log in case.logs]
    rig, train, _ = replace(case, logs=logs).write(folder)
    rig = replace(load(rig), simulate=whole.WHOLE)
    return DriveExperiment(rig, gather(rig, train[:1], [])[0])


def of(bench, output):
    return next(r for r in bench.residuals if r.output == output)


def told(bench):
    """The fast current that is taken for noise of the voltage, A."""
    return dilution._of_current(bench, of(bench, "motor.current"), {})


def test_noise_of_the_voltage_is_found_in_the_current_and_carried_on_to_the_speed(case, rng, tmp_path):
    """What is said of both is by how much the simulation from the noisy voltage is another than that from the clean one."""
    volts = 0.05 * case.sheet["supply"]
    clean, noisy = (experiment(case, tmp_path / str(v), v, rng) for v in (0.0, volts))
    moved = {}
    for name in ("motor.current", "reducer.input_speed"):
        ((s0, _, g0),), ((s1, _, g1),) = (b.compare(of(b, name), {}) for b in (clean, noisy))
        good = g0 & g1
        moved[name] = dilution.fast([np.where(good, s1 - s0, 0.0)], [good]), float(np.sqrt(np.mean((s1 - s0)[good] ** 2)))
    assert told(noisy) == pytest.approx(moved["motor.current"][0], rel=0.25)
    assert told(clean) < 0.2 * told(noisy)
    fast, all_of_it = moved["reducer.input_speed"]
    slow, _ = dilution.of_driving(noisy, of(noisy, "reducer.input_speed"), {})
    assert slow == pytest.approx(np.sqrt(all_of_it**2 - fast**2), rel=0.5)


def test_noise_of_the_current_alone_is_none_of_the_voltage(case, rng, tmp_path):
    spread = 5.0 * float(case.logs[0]["i"].std())
    loud = replace(case, logs=[log.assign(i=log["i"] + spread * rng.standard_normal(len(log))) for log in case.logs])
    assert told(experiment(loud, tmp_path / "loud", 0.0, rng)) < 0.1 * spread
