"""The example of docs/system.md: our FMUs on a bench."""

from pathlib import Path

import pytest

from selflock import master

ROOT = Path(__file__).parents[2]


@pytest.fixture
def bench():
    return master.load(ROOT / "examples" / "bench.toml")


def test_the_page_shows_the_example():
    assert (ROOT / "examples" / "bench.toml").read_text() in (ROOT / "docs" / "system.md").read_text()


def test_the_gear_holds_the_weight_when_the_supply_fails(bench):
    table = master.run(bench).table.set_index("time")
    angle = table["weight.angle"]
    assert angle.iloc[300] > 0.5
    assert angle.iloc[400:].to_numpy() == pytest.approx(angle.iloc[-1], abs=0.02)
    assert bool(table["gear.stuck"].iloc[400:].all())


def test_a_back_drivable_gear_lets_it_fall(bench):
    bench.components["weight"].start["arm_angle"] = -0.5
    settings = {"gear.friction_kinetic": 0.002, "gear.friction_static": 0.002, "motor.voltage": 6.0}
    angle = master.run(bench, settings, stop=1.0).table["weight.angle"]
    assert abs(angle.iloc[1000] - angle.iloc[500]) > 0.2


@pytest.mark.alike
@pytest.mark.parametrize("own", [1.0, 0.5, 0.25])
def test_the_coupling_makes_little_energy_whatever_step_the_gear_has(bench, own):
    bench.components["gear"].step = own * bench.run.step
    energy = master.run(bench).energy
    assert energy["relative"].abs().max() < 0.005


@pytest.mark.alike
@pytest.mark.parametrize("control", ["power", "doubling"])
def test_step_control_finds_the_same_motion(bench, control):
    bench.faults, bench.run.stop = [], 0.2
    bench.components["gear"].step = 0.0
    bench.run.step = 1e-4
    fine = master.run(bench).table.iloc[-1]
    bench.run.step, bench.run.step_control, bench.run.tolerance = 0.01, control, 1e-2
    result = master.run(bench)
    assert result.table.iloc[-1]["weight.angle"] == pytest.approx(fine["weight.angle"], rel=5e-3)
    assert result.steps < 2000
