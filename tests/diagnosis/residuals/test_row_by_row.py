"""A small controller that acts once in a row, and makes its speed of its angle by differences."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from selflock.diagnosis.data.faults import check
from selflock.diagnosis.data.log import MeasuredRun
from selflock.diagnosis.data.rig import LogColumn, Rig
from selflock.diagnosis.residuals import whole
from selflock.diagnosis.residuals.drive_experiment import DriveExperiment
from selflock.diagnosis.rules import RULES
from selflock.diagnosis.search import hypotheses
from selflock.diagnosis.search.problem import Problem

R, K, RATIO, ROTOR, INERTIA = 2.0, 0.02, 20.0, 2e-6, 4e-4
ROW, GAIN, DAMPS, COUNT = 0.01, 6.0, 0.15, 2.0 * np.pi / 4096
DRIVE = {
    "motor.resistance": R,
    "motor.inductance": 0.0,
    "motor.voltage_constant": K,
    "motor.torque_constant": K,
    "reducer.gear_ratio": RATIO,
    "reducer.friction_kinetic": 0.0,
    "reducer.shaft_inertia": ROTOR,
    "load.inertia": INERTIA,
}
PARAMETERS = DRIVE | {
    "controller.angle_gain": GAIN,
    "controller.speed_gain": DAMPS,
    "controller.release_time": 1e6,
    "controller.sample_period": ROW,
}


def experiment(rng, speed=None):
    """Rows of a stiff drive without friction, whose acts are held; exact between them. speed: of a log that has one, of its rows."""
    inertia, n, wave = ROTOR + INERTIA / RATIO**2, round(8.0 / ROW), rng.uniform(4.0, 5.0)
    rate = K * K / R / inertia
    time = ROW * np.arange(n)
    asked, rows = 1.5 * np.sin(wave * time), np.zeros((3, n))
    angle = fast = before = 0.0
    for row in range(n):
        u = GAIN * (asked[row] - angle) - DAMPS * (angle - before) / ROW
        before = angle
        rows[:, row] = u, angle, fast
        last, most = fast, u / K / RATIO
        fast = most + (fast - most) * np.exp(-rate * ROW)
        angle += ROW * most - (fast - last) / rate
    signals = {
        "controller.angle_setpoint": asked,
        "controller.speed_setpoint": np.zeros(n),
        "motor.voltage": rows[0] + 1e-3 * rng.standard_normal(n),
        "load.angle": COUNT * np.floor(rows[1] / COUNT),
    }
    if speed:
        signals["load.speed"] = speed(rows[2], rng)
    columns = tuple(LogColumn(name, name) for name in signals)
    rig = Rig(Path("rig.toml"), "bot", "forward", columns, PARAMETERS, time=LogColumn("time", "time"), simulate=whole.WHOLE)
    run = MeasuredRun("log.csv", "", np.arange(n), time, signals)
    check([run], rig)
    return DriveExperiment(rig, [run])


@pytest.mark.slow
def test_a_speed_that_a_controller_makes_by_differences_is_half_its_period_late(rng):
    bench = experiment(rng)
    asked = Problem.of(bench, np.ones(bench.layout.count, bool)).with_noise()
    fitted = asked.fit(asked.base_free, asked.nominal)
    assert fitted.values[whole.FILTER] == pytest.approx(0.5 * ROW, rel=0.2)
    assert asked.excess(fitted.values).max() < RULES.search.sound
    without = tuple(p for p in asked.base_free if p.name != whole.FILTER)
    prompt = asked.fit(without, asked.nominal | {whole.FILTER: 0.0})
    assert asked.excess(prompt.values).max() > RULES.search.sound


def test_a_controller_of_which_a_speed_is_logged_that_is_no_difference_sees_that(rng):
    bench = experiment(rng, lambda speed, rng: speed + 0.01 * rng.standard_normal(len(speed)))
    assert whole.FILTER not in {p.name for p in hypotheses.recorder(bench)}
