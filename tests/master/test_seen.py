"""The summary after a run: peaks, energies, ends and limits, against closed forms."""

from pathlib import Path

import numpy as np
import pytest

from selflock import master
from selflock.master import Part, Variable
from selflock.master.results import ROWS

BENCH = Path(__file__).parents[2] / "examples" / "bench.toml"


class Crank(Part):
    """Power t W, torque -3 sin(t) N.m, an angle of 2 t rad; a voltage of 10 t V, clipped."""

    described = (
        Variable("voltage_min", "V", -4.0, causality="parameter"),
        Variable("voltage_max", "V", 4.0, causality="parameter"),
        Variable("u", "", 0.0, causality="input"),
        Variable("power", "W", 0.0, causality="output", depends_on=()),
        Variable("torque", "N.m", 0.0, causality="output", depends_on=()),
        Variable("angle", "rad", 0.0, causality="output", depends_on=()),
        Variable("voltage", "V", 0.0, causality="output", depends_on=()),
    )

    def step(self, time, size):
        t, v = time + size, self.values
        v |= {"power": t, "torque": -3.0 * np.sin(t), "angle": 2.0 * t}
        v["voltage"] = float(np.clip(10.0 * t, v["voltage_min"], v["voltage_max"]))


def crank(**start):
    system = master.from_dict({"run": {"stop": 1.0, "open_inputs": True}, "components": {"crank": {"part": "test_seen:Crank"}}})
    system.components["crank"].start = start
    system.allow_code = True
    return system


@pytest.mark.parametrize("step, out", [(1e-3, None), (1e-4, "x.parquet"), (1e-3, "x.csv")])
def test_peaks_energy_ends_and_time_at_a_limit(step, out, tmp_path):
    result = master.run(crank(), step=step, out=tmp_path / out if out else None)
    assert (step == 1e-4) == (result.steps > 2 * ROWS)  # over the joints of blocks, too
    peaks = result.peaks
    assert peaks.integral["crank.power"] == pytest.approx(0.5, rel=1e-9)  # trapezoids are exact for t
    assert peaks.least["crank.torque"] == pytest.approx(-3.0 * np.sin(1.0)) and peaks.greatest["crank.torque"] == 0.0
    assert peaks["last"]["crank.angle"] == pytest.approx(2.0) and peaks.unit["crank.angle"] == "rad"
    (limit,) = result.reached
    assert limit.startswith("crank.voltage was at its limit, ±4 V, for ")
    assert float(limit.split()[-2]) == pytest.approx(0.6, abs=2 * step)
    text = result.summary()
    assert "crank: torque 2.524 N.m, power 1 W (0.5 J), angle at the end 2 rad (114.6 deg)" in text and limit in text


def test_no_limit_no_word():
    assert not master.run(crank(voltage_max=20.0)).reached


def motor(**start):
    data = {"run": {"stop": 0.5}, "components": {"motor": {"fmu": "selflock:Motor", "start": {"resistance": 0.6, **start}}}}
    return master.run(master.from_dict(data)).reached


def test_a_motor_at_its_stall_current_is_remarked_on():
    (text,) = motor(voltage=24.0, speed=0.0, inductance=0.03)  # R i = U (1 - exp(-t R/L)): at 95 % after 3.0 L/R
    assert text.startswith("motor stood at its stall current, 40 A at 24 V, for ")
    assert float(text.split()[-2]) == pytest.approx(0.5 - np.log(20.0) * 0.03 / 0.6, abs=2e-3)


@pytest.mark.parametrize("speed, inductance", [(400.0, 2e-4), (0.0, 0.1)])
def test_a_motor_that_turns_or_is_only_switched_on_is_not(speed, inductance):
    assert not motor(voltage=24.0, speed=speed, inductance=inductance)


@pytest.mark.parametrize(
    "static, kinetic, words",
    [
        (0.019, 0.019, None),
        (0.02, 0.02, None),
        (0.021, 0.021, "locks itself: its friction, 0.021, is beyond the limit, 0.02; its load cannot drive it"),
        (0.03, 0.025, "locks itself: its friction, 0.03 at rest and 0.025 sliding, is beyond the limit, 0.02"),
        (0.03, 0.01, "holds its load at rest: its static friction, 0.03, is beyond the limit, 0.02; once it moves its load can"),
        (0.01, 0.03, "stops its load: its kinetic friction, 0.03, is beyond the limit, 0.02; at rest its load can set it going"),
    ],
)
def test_a_gear_beyond_its_self_locking_limit_is_remarked_on(static, kinetic, words):
    """By the larger of both a gear that its load drives once it moves was one that it cannot drive."""
    start = {"gear_ratio": 50.0, "friction_kinetic": kinetic, "friction_static": static}
    data = {"run": {"stop": 0.002, "open_inputs": True}, "components": {"gear": {"fmu": "selflock:Reducer", "start": start}}}
    said = master.run(master.from_dict(data)).reached
    assert len(said) == (words is not None) and all(f"gear {words}" in one for one in said)


@pytest.mark.parametrize("kinetic, moves", [(0.025, False), (0.01, True)])
def test_what_is_said_of_a_moving_load_is_what_it_does(kinetic, moves):
    """A weight that is let down, and whose supply fails after 0.05 s: its kinetic friction stops it, or it falls on."""
    system = master.load(BENCH)
    system.faults[0].start = 0.05
    system.components["motor"].start |= {"voltage": -6.0}
    system.components["gear"].start |= {"friction_static": 0.03, "friction_kinetic": kinetic}
    result = master.run(system, stop=0.3)
    assert ("locks itself" in result.reached[0]) == (not moves)
    assert (result.peaks["last"]["weight.angle"] < -0.3) == moves  # it swings on its shaft at -0.05 rad, or is on its way
