"""The way from a log to its files, once: a log made in closed form, so that the answer is known."""

import json
import re

import numpy as np
import pandas as pd
import pytest
from typer.testing import CliRunner

from selflock import diagnosis, master
from selflock.cli import app
from selflock.diagnosis.data.rig import load
from selflock.diagnosis.errors import DataError
from selflock.diagnosis.output import extend
from selflock.diagnosis.pipeline.hold_out import split
from selflock.diagnosis.pipeline.run import gather
from selflock.diagnosis.residuals.drive_experiment import DriveExperiment
from selflock.diagnosis.residuals.kernels import kernels
from selflock.diagnosis.residuals.laws import parameters
from selflock.diagnosis.rules import RULES
from selflock.diagnosis.search import problem as ground
from selflock.fmus.errors import BuildError

from ..plant import recordings
from ..residuals.test_experiment import inverse


@pytest.mark.slow
def test_a_wrong_friction_is_named_extended_and_its_gain_kept_by_the_fmu(tmp_path, rng):
    inverse(tmp_path, rng, friction=0.04, noise=2e-3)
    out = tmp_path / "out"
    result = diagnosis.diagnose(tmp_path / "rig.toml", [tmp_path / "log.csv"], out=out)
    data = json.loads((out / "diagnosis.json").read_text())
    assert result.exit_code == 0 and data["verdict"] in ("explained", "ambiguous")
    assert set(data) >= {"verdict", "faults", "blame", "causes", "gain", "remainder"}
    named = {f"{c['component']}.{c['effect']}" for c in data["causes"]} | {
        r for c in data["causes"] for r in c["indistinguishable_from"]
    }
    assert named & {
        "reducer.parameter",
        "reducer.load_dependent",
        "reducer.friction_kinetic",
        "reducer.wedge_angle",
        "reducer load_dependent",
    }
    assert data["gain"]["after"] < 0.6 * data["gain"]["before"] and data["gain"]["closed"] > 0.8
    promised, found = data["extension"]["promised"], data["extension"]["fmu"]
    assert abs(found - promised) < 0.01 * promised
    (row,) = data["comparisons"]
    assert row["comparison"] == "gear" and row["after"] == data["gain"]["after"]
    assert row["share_after"] == row["after"] / row["signal"] < 0.6 * row["share_before"]
    assert "% of the signal, noise floor" in result.summary()
    first = data["rivals"][0]
    assert first["rows"][0]["elpd_diff"] == 0.0 and first["effective"] <= first["entries"]
    by_label = {row["label"]: row for row in first["rows"]}
    assert by_label["nothing more"]["elpd_diff"] < -3.0 * by_label["nothing more"]["dse"] < 0.0
    page = (out / "report.html").read_text()
    assert not data["sanity"]["contradictions"] and data["sanity"]["assumed"] and result.summary().startswith("Log against rig:")
    assert "What the log says against the rig" in page and "Assumed, for nobody gave it" in page
    assert "to the best" in page and "independent of their neighbours" in page
    assert all(f'<span class="mark {cause.mark}">{cause.mark}</span>' in page for cause in result.causes)
    assert all(cause["weak"] == told.weak for cause, told in zip(data["causes"], result.causes))
    assert "share of the signal" in page and "mean absolute error" in page
    assert {"missing", "traces", "where"} == set(re.findall('data-figure="(\\w+)"', page))
    assert "selflock run extended.toml" in page and "http://" not in page and "https://" not in page
    assert {"parameters.toml", "extended.toml", "reducer.fmu"} <= {p.name for p in out.iterdir()}
    table = master.run(out / "extended.toml", stop=0.2).table
    assert len(table) > 100


CLOSED = """
[rig]
kind = "forward"
simulate = "closed"
[columns]
"controller.angle_setpoint" = "setpoint"
"controller.voltage" = "voltage"
"load.angle" = "angle"
[parameters]
"reducer.shaft_stiffness" = 500.0
"reducer.shaft_damping" = 2.0
"load.inertia" = 0.15
"load.mass" = 1.0
"controller.angle_gain" = 60.0
"controller.release_time" = 1e9
"""


@pytest.mark.slow
def test_a_whole_drive_in_closed_loop_has_its_report(tmp_path, monkeypatch):
    """Two hypotheses alone, for each fit simulates the drive."""
    every = ground.vocabulary
    monkeypatch.setattr(
        ground, "vocabulary", lambda *given: [h for h in every(*given) if h.label in ("motor brush_drop", "load tilt")]
    )
    (tmp_path / "rig.toml").write_text(CLOSED)
    n, step = 3000, 4e-3
    time = np.arange(n) * step
    setpoint = 1.2 * np.sin(0.9 * time) + 0.4 * np.sin(2.3 * time)
    nature = load(tmp_path / "rig.toml").parameters | {"motor.brush_voltage": 3.0}
    laws = [parameters(part, part, nature) for part in ("controller", "motor", "reducer", "load")]
    nothing, out = np.zeros(n), np.zeros((8, n))
    kernels().whole(
        *laws, 1.0, np.ones(n), nothing, nothing, setpoint, np.gradient(setpoint, step), np.full(n, step), 8, np.zeros(4), out
    )
    angle = out[6] + 2e-4 * np.random.default_rng(3).standard_normal(n)
    pd.DataFrame({"time": time, "setpoint": setpoint, "voltage": out[0], "angle": angle}).to_csv(
        tmp_path / "log.csv", index=False
    )
    result = diagnosis.diagnose(tmp_path / "rig.toml", [tmp_path / "log.csv"], out=tmp_path / "out", seed=1)
    assert [cause.label for cause in result.causes] == ["motor brush_drop"], result.summary()
    assert result.gain.after < 0.5 * result.gain.before
    assert abs(result.extension["fmu"] - result.extension["promised"]) < 0.01 * result.extension["promised"]
    assert {"report.html", "motor.fmu"} <= {p.name for p in (tmp_path / "out").iterdir()}


@pytest.mark.slow
def test_replay_by_the_command(tmp_path, rng):
    inverse(tmp_path, rng)
    out = tmp_path / "replay"
    answer = CliRunner().invoke(app, ["replay", str(tmp_path / "rig.toml"), str(tmp_path / "log.csv"), "-o", str(out)])
    assert answer.exit_code == 0, answer.output
    (row,) = json.loads((out / "replay.json").read_text())["comparisons"]
    assert row["error"] < 3e-5 and (out / "replay.html").exists() and (out / "reducer.fmu").exists()


@pytest.mark.slow
def test_an_answer_that_no_fmu_takes_is_told_and_nothing_else_is_lost(tmp_path, rng, monkeypatch):
    inverse(tmp_path, rng, friction=0.04, noise=2e-3)

    def refuse(name, *given, **starts):
        raise BuildError(f"{name} cannot start with these values.")

    monkeypatch.setattr(extend, "build", refuse)
    result = diagnosis.diagnose(tmp_path / "rig.toml", [tmp_path / "log.csv"], out=tmp_path / "out")
    assert result.exit_code == 0 and "cannot start with these values" in result.summary()
    kept = json.loads((tmp_path / "out" / "diagnosis.json").read_text())
    assert kept["causes"] and "cannot start" in kept["extension"]["not_written"]
    assert "not all written" in (tmp_path / "out" / "report.html").read_text()


@pytest.mark.slow
def test_a_short_log_teaches_beside_a_long_one_that_judges(tmp_path):
    """It is cut into blocks of its own: by those of the long one it would have too few."""
    case = recordings.hide([], recordings.DEVELOPMENT + 300, duration=20.0)
    rig, train, test = case.write(tmp_path)
    case.logs[0][:400].to_csv(train, index=False, float_format="%.9g")
    rig = load(rig)
    runs, _, held = gather(rig, [train], [test])
    taught, _ = split(DriveExperiment(rig, runs), runs, held)
    assert 0 < taught.sum() < RULES.pipeline.fewest_blocks
    with pytest.raises(DataError, match="to learn from, too few to tell a cause"):
        short = [runs[0].head(100), runs[1]]
        split(DriveExperiment(rig, short), short, held)
