"""The study on the real robot: every claim, and what it leaves behind."""

import json
import re

import numpy as np
import pytest

from selflock.master import load, run
from selflock.study import runs
from selflock.study.claims import ROWS
from selflock.study.manoeuvre import DURATION, WINDOWS


@pytest.mark.slow
@pytest.mark.parametrize("number", sorted(ROWS))
def test_claim(result, number):
    claim = next(claim for claim in result.claims if claim.number == number)
    assert claim.holds, claim.measured


@pytest.mark.slow
def test_claims_are_written(result):
    written = json.loads((result.report.parent / "claims.json").read_text("utf-8"))
    assert [row["number"] for row in written] == list(range(1, 20))
    assert written == [json.loads(json.dumps(claim.as_dict())) for claim in result.claims]


@pytest.mark.slow
def test_report_needs_no_network(result):
    html = result.report.read_text("utf-8")
    assert not re.findall(r"""(?:src|href)\s*=\s*["'](?!data:|#)[^"']*""", html)
    assert "@import" not in html and "fetch(" not in html
    for claim in result.claims:
        assert f"<b>{claim.number}</b>" in html  # beside a figure


@pytest.mark.slow
def test_the_report_draws_its_figures(result):
    html = result.report.read_text("utf-8")
    assert set(re.findall(r'data-figure="figure_(\d+)"', html)) == {f"{number:02d}" for number in range(7, 19)}
    assert (result.report.parent / "figure_06.png").exists() and len(html) < 4e6


@pytest.mark.slow
def test_tables_have_the_whole_manoeuvre(result):
    for case in runs.cases():
        table, units = runs.read(result.report.parent / "runs" / f"{case.name}.parquet")
        assert table["time"].iloc[-1] == pytest.approx(DURATION)
        assert units["rear_reducer.output_torque"] == "N.m"
        assert table.notna().all().all()


@pytest.mark.slow
def test_the_system_file_runs_in_both_modes():
    table = run(runs.SYSTEM, stop=0.01).table
    for part in ("controller.voltage", "motor.torque", "reducer.output_torque"):
        assert f"front_{part}" in table and f"rear_{part}" in table
    imposed = {f"{end}_reducer.kinematic": True for end in ("front", "rear")}
    both = run(runs.SYSTEM, settings=imposed, stop=0.01).table
    alone = run(runs.system("kinematic"), settings={}, stop=0.01).table
    assert both["rear_reducer.output_torque"].tolist() == alone["rear_reducer.output_torque"].tolist()


@pytest.mark.slow
def test_twelve_instances_drive_the_robot_through_the_whole_manoeuvre():
    system = load(runs.SYSTEM.with_name("four_drives.toml"))
    assert sum(bool(component.fmu) for component in system.components.values()) == 12
    result = run(system)
    table = result.table
    assert table["time"].iloc[-1] == DURATION
    for end in ("front", "rear"):  # the holders follow, the sprockets keep their speed, and it rolls as fast as they turn
        assert (table[f"robot.{end}_angle"] - table[f"setpoints.{end}_angle"]).abs().max() < 0.05
        wheel = table[f"robot.{end}_sprocket_speed"][table["time"].between(1.0, 2.0)]
        assert wheel.mean() == pytest.approx(table["setpoints.sprocket_speed"].iloc[-1], rel=0.02)
    rolling = table[table["time"].between(1.0, 2.0)]
    assert rolling["robot.chassis_vx"].mean() == pytest.approx(-rolling["robot.rear_sprocket_speed"].mean() * 0.048, rel=0.03)
    rear = {name: table["rear_reducer.output_torque"][table["time"].between(*window)].mean() for name, window in WINDOWS.items()}
    for name in ("lift", "lower"):  # claim 5 holds here too: what is lifted is the holder's weight
        weight = table["robot.rear_gravity_moment"][table["time"].between(*WINDOWS[name])].mean()
        assert rear[name] == pytest.approx(weight, rel=0.1)
    assert rear["lift"] > 0.0 > rear["lower"] and rear["raise"] > 5.0 * rear["lift"]
    assert abs(result.energy["relative"]).max() < 1e-3


def test_parameters_are_told_with_unit_and_source():
    from selflock.study.report import parameters

    rows = {name: (value, unit, source) for name, value, unit, source in parameters(runs.SYSTEM.read_text("utf-8"))}
    assert rows["resistance"][:2] == ("0.299", "Ohm") and rows["rear_motor.inductance"][1] == "H"
    assert all(source for _, _, source in rows.values())
    assert "robot.chassis_mass" in rows


@pytest.mark.slow
def test_the_page_runs_its_own_script_and_no_other(result, harmless, browser):
    harmless(result.report, scripts=1)
    assert "μ = 0" in browser(result.report)  # written by the script: its hash is right


def test_a_finished_run_is_taken_as_it_is_by_the_same_study_alone(tmp_path, monkeypatch):
    case = runs.Case("standstill", 0, "kinematic", 0.0)
    path = tmp_path / f"{case.name}.parquet"
    result = run(runs.SYSTEM, stop=0.01, out=path)
    postures = {0.0: {"chassis": np.array([[0.1, 1 / 3], [2.0, 3e-17]])}}
    done = runs.Done(case, path, result.energy, postures, 0.25)
    runs._keep(done, "this study")
    monkeypatch.setattr(runs, "system", lambda mode: pytest.fail("it was run again"))
    again = runs.run_case(case, tmp_path, "this study")
    assert again.energy.equals(done.energy) and again.energy.index.equals(done.energy.index)
    assert (again.path, again.seconds) == (path, 0.25) and (again.postures[0.0]["chassis"] == postures[0.0]["chassis"]).all()
    assert runs._kept(case, tmp_path, "another") is None
    path.with_suffix(".json").write_bytes(path.with_suffix(".json").read_bytes()[:-1])  # torn
    assert runs._kept(case, tmp_path, "this study") is None
    path.unlink()
    assert runs._kept(case, tmp_path, "this study") is None
