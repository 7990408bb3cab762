"""A diagnosis for each log of a fleet: as by itself, resumable, with where each comes from."""

import json

import pytest
from typer.testing import CliRunner

from selflock.cli import app
from selflock.diagnosis import diagnose_fleet
from selflock.sweep import map_runs

from ..residuals.test_experiment import inverse

UNCERTAIN = '\n[uncertain]\n"reducer.friction_kinetic" = [0.005, 0.1]\n'


@pytest.mark.slow
def test_each_log_has_its_answer_and_new_ones_join_in(tmp_path, rng):
    frictions = {"a/2026-05-01.csv": 0.03, "a/2026-06-01.csv": 0.04, "b/first.csv": 0.03}
    for path, friction in frictions.items():
        inverse(tmp_path, rng, friction=friction, noise=2e-3, n=1500)
        (tmp_path / "logs" / path).parent.mkdir(parents=True, exist_ok=True)
        (tmp_path / "log.csv").rename(tmp_path / "logs" / path)
    rig = tmp_path / "rig.toml"
    rig.write_text(rig.read_text() + UNCERTAIN)
    (tmp_path / "logs" / "b" / "empty.csv").write_text("")
    out, made = tmp_path / "out", []

    def spread(function, items, **more):
        return map_runs(lambda work, item: (made.append(item["log"]), function(work, item))[1], items, workers=0, **more)

    found = diagnose_fleet(rig, tmp_path / "logs", out, spread, search=False)
    assert sorted(made) == sorted([*frictions, "b/empty.csv"]) and found.exit_code == 2
    assert "3 of 4 logs of 2 units diagnosed" in found.summary() and "is empty (0 bytes)" in found.summary()
    for path, friction in frictions.items():
        told = json.loads((out / "logs" / path / "diagnosis.json").read_text())
        (number,) = told["uncertain"]
        assert number["low"] < friction < number["high"] or number["value"] == pytest.approx(friction, rel=0.02)
        about = told["about"]
        assert (about["unit"], about["searched"]) == (path[0], False) and len(about["logs"][0]["sha256"]) == 64
        assert about["told_by"] == ("file" if "first" in path else "name")
    assert about["recorded"] != ""
    (tmp_path / "logs" / "b" / "empty.csv").unlink()
    made.clear()
    inverse(tmp_path, rng, n=1500)
    (tmp_path / "log.csv").rename(tmp_path / "logs" / "b" / "2026-07-01.csv")
    rig.write_text(rig.read_text() + UNCERTAIN)
    again = diagnose_fleet(rig, tmp_path / "logs", out, spread, search=False)
    assert made == ["b/2026-07-01.csv"] and len(again.rows) == 4 and again.exit_code == 0


def test_slips_of_the_command_are_told(tmp_path):
    rig = str(tmp_path / "rig.toml")
    for words, told in (
        (["x.csv", "--fleet", str(tmp_path)], "finds its logs itself"),
        (["x.csv", "--workers", "2"], "give --fleet FOLDER"),
    ):
        answer = CliRunner().invoke(app, ["diagnose", rig, *words])
        assert told in str(answer.exception)
