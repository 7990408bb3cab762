"""The way from a log to its files, once: a log made in closed form, so that the answer is known."""

import json

from typer.testing import CliRunner

import diagnosis
import master
from selflock.cli import app

from .test_bench import inverse


def test_a_wrong_friction_is_named_extended_and_its_gain_kept_by_the_fmu(tmp_path):
    inverse(tmp_path, friction=0.04, noise=2e-3)
    out = tmp_path / "out"
    result = diagnosis.diagnose(tmp_path / "rig.toml", [tmp_path / "log.csv"], out=out)
    data = json.loads((out / "diagnosis.json").read_text())
    assert result.exit_code == 0 and data["verdict"] in ("explained", "ambiguous")
    assert set(data) >= {"verdict", "faults", "blame", "causes", "gain", "remainder"}
    named = {f"{c['component']}.{c['effect']}" for c in data["causes"]} | {r for c in data["causes"] for r in c["indistinguishable_from"]}
    assert named & {"reducer.parameter", "reducer.load_dependent", "reducer.friction_kinetic", "reducer.wedge_angle", "reducer load_dependent"}
    assert data["gain"]["after"] < 0.6 * data["gain"]["before"] and data["gain"]["closed"] > 0.8
    promised, found = data["extension"]["promised"], data["extension"]["fmu"]
    assert abs(found - promised) < 0.01 * promised
    page = (out / "report.html").read_text()
    assert "<img" in page and "http://" not in page and "https://" not in page
    assert {"traces.png", "where.png", "contest.png", "missing.png", "parameters.toml", "extended.toml", "reducer.fmu"} <= {p.name for p in out.iterdir()}
    table = master.run(out / "extended.toml", stop=0.2).table
    assert len(table) > 100


def test_replay_by_the_command(tmp_path):
    inverse(tmp_path)
    out = tmp_path / "replay"
    answer = CliRunner().invoke(app, ["replay", str(tmp_path / "rig.toml"), str(tmp_path / "log.csv"), "-o", str(out)])
    assert answer.exit_code == 0, answer.output
    (row,) = json.loads((out / "replay.json").read_text())["comparisons"]
    assert row["error"] < 3e-5 and (out / "gear.png").exists() and (out / "reducer.fmu").exists()
