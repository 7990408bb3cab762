"""The summary after a run: peaks, energies, ends and limits, against closed forms."""

import numpy as np
import pytest

from selflock import master
from selflock.master import Part, Variable
from selflock.master.results import ROWS


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


@pytest.mark.parametrize("friction, locks", [(0.019, False), (0.02, False), (0.021, True)])
def test_a_gear_beyond_its_self_locking_limit_is_remarked_on(friction, locks):
    start = {"gear_ratio": 50.0, "friction_kinetic": friction, "friction_static": friction}
    data = {"run": {"stop": 0.002, "open_inputs": True}, "components": {"gear": {"fmu": "selflock:Reducer", "start": start}}}
    said = master.run(master.from_dict(data)).reached
    assert bool(said) == locks and (not locks or "gear locks itself: its friction, 0.021, is beyond the limit, 0.02" in said[0])
