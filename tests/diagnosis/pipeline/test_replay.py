"""Replay: a measured motion imposed on the reducer's FMU, against the wedge's closed forms; and the worm drive."""

import base64
import math
import os
import subprocess
import sys
from pathlib import Path

import numpy as np
import pandas as pd
import pytest
from lxml import html

from selflock import master
from selflock.diagnosis import replay
from selflock.diagnosis.data.gathered import gathered
from selflock.diagnosis.data.rig import load
from selflock.diagnosis.errors import DataError
from selflock.diagnosis.output import extend
from selflock.diagnosis.output.traces import BEFORE, MEASURED
from selflock.diagnosis.pipeline.in_step import whole_where_described
from selflock.diagnosis.pipeline.replay import Comparison, Replay
from selflock.diagnosis.residuals.drive_experiment import DriveExperiment
from selflock.view.figures import axis, line

from ..plant import bench

ROOT = Path(__file__).parents[3]
WORM = ROOT.parent / "shared" / "data" / "worm_drive" / "steady_state.csv"
RATIO, LEAD, FRICTION, LOAD = 40.0, 0.06, 0.10, 0.5  # self-locking; a load that resists positive motion, N.m
RIG = f"""
[rig]
name = "worm"
kind = "steady"
[columns]
"reducer.input_speed" = {{ column = "n", unit = "rpm" }}
"motor.torque" = {{ column = "m", unit = "mN.m" }}
[parameters]
"reducer.gear_ratio" = {RATIO}
"reducer.wedge_angle" = {LEAD}
"reducer.friction_kinetic" = {FRICTION}
"load.constant_torque" = {LOAD}
"""


def needed(speed):
    """F = P tan(alpha ± phi) at the lever of the worm, N.m."""
    side = math.atan(FRICTION) * np.sign(speed)
    return LOAD / (RATIO * math.tan(LEAD)) * np.tan(LEAD + side)


@pytest.fixture
def worm(tmp_path):
    """Rig and log of steady points whose measured torque is the closed form plus `more`, N.m."""

    def make(more=0.0):
        speed = np.array([n for n in range(-200, 201, 10) if n], float)
        table = pd.DataFrame({"time": np.arange(len(speed)) * 1.0, "n": speed, "m": 1e3 * (needed(speed) + more)})
        table.to_csv(tmp_path / "log.csv", index=False)
        (tmp_path / "rig.toml").write_text(RIG)
        return tmp_path / "rig.toml", tmp_path / "log.csv"

    return make


@pytest.mark.slow
def test_the_fmu_needs_the_torque_of_the_closed_form(worm, tmp_path):
    found = replay(*worm(), tmp_path / "out")
    assert found.points["simulated"].to_numpy() == pytest.approx(needed(found.points["speed"].to_numpy()), rel=1e-6)
    assert found.points["speed"].abs().max() == pytest.approx(200 * math.pi / 30)
    assert found.comparisons[0].relative < 1e-6


@pytest.mark.slow
def test_the_error_is_told_speed_by_speed(worm, tmp_path):
    found = replay(*worm(more=1e-3), tmp_path / "out")
    assert found.points["error"].to_numpy() == pytest.approx(1e-3, rel=1e-3)
    assert found.comparisons[0].error == pytest.approx(1e-3, rel=1e-3)
    assert "0.001 N.m rms" in found.summary()
    written = pd.read_csv(tmp_path / "out" / "points.csv")
    assert written["error"].to_numpy() == pytest.approx(1e-3, rel=1e-3)


@pytest.mark.slow
def test_table_and_picture_show_the_fmu(worm, tmp_path, monkeypatch):
    """Were the FMU's answers others, the table and the picture would be too."""
    honest = replay(*worm(), tmp_path / "honest")
    play = extend._play

    def doubled(path, before, names, inputs, dt, out):
        play(path, before, names, inputs, dt, out)
        for values in out:
            values *= 2.0

    monkeypatch.setattr(extend, "_play", doubled)
    other = replay(*worm(), tmp_path / "other")
    assert other.points["simulated"].to_numpy() == pytest.approx(2.0 * honest.points["simulated"].to_numpy())
    assert honest.page.read_bytes() != other.page.read_bytes()


def test_a_missing_column_is_named(worm, tmp_path):
    rig, log = worm()
    pd.read_csv(log).drop(columns="m").to_csv(log, index=False)
    with pytest.raises(DataError, match="there is no column 'm'"):
        replay(rig, log, tmp_path / "out")


@pytest.mark.parametrize("content", [b"", b"time,n,m\n", b"\x80\x81\x82\n" * 50, b"time,n,m\n" + b"1,2,three\n" * 50])
def test_a_log_that_is_none_is_told(worm, tmp_path, content):
    rig, log = worm()
    log.write_bytes(content)
    with pytest.raises(DataError, match="log.csv"):
        replay(rig, log, tmp_path / "out")


@pytest.mark.skipif(not WORM.exists(), reason=f"the measured worm drive is not there: {WORM}")
@pytest.mark.slow
def test_the_measured_worm_drive(tmp_path):
    """Constant friction misses what the measurement shows: more friction the slower, and more than the published 0.12."""
    found = replay(ROOT / "examples" / "rigs" / "worm_drive.toml", WORM, tmp_path)
    points = found.points
    assert len(points) == 46 and (np.sign(points["measured"]) == np.sign(points["speed"])).all()
    assert (points["error"] * np.sign(points["speed"]) > 0.0).all()
    slow = points[points["speed"].between(-0.5, 0.0)]["measured"].min()
    assert slow < points[points["speed"].between(-3.0, -1.0)]["measured"].min()
    assert found.page == tmp_path / "replay.html" and found.page.exists() and (tmp_path / "reducer.fmu").exists()


def test_a_notebook_shows_the_numbers_and_the_first_picture(hostile):
    told = Replay([Comparison(hostile, hostile, "N.m", 0.5, 0.1, 0.0, [])], [], None)
    tree = html.fragments_fromstring(told._repr_html_())
    assert [one.tag for one in tree] == ["pre"] and tree[0].xpath("string(.)") == str(told) and not tree[0].xpath("*")
    x = np.arange(3.0)
    axes = {"x": axis("time", "s"), "y": axis(hostile, "N.m")}
    told.plots = {hostile: [{**axes, "marks": [line(x, x, hostile, colour)]} for colour in (BEFORE, MEASURED)]}
    tree = html.fragments_fromstring(told._repr_html_())
    assert base64.b64decode(tree[1].get("src").removeprefix("data:image/png;base64,")).startswith(b"\x89PNG")


@pytest.fixture(scope="module")
def sound(tmp_path_factory):
    """Rig and log of the hidden plant with nothing missing; its rig describes the whole loop."""
    return bench.hide([], seed=10_002, duration=4.0).write(tmp_path_factory.mktemp("sound"))[:2]


@pytest.mark.slow
def test_parts_are_shown_and_beside_them_the_whole_drive_that_the_rig_describes(sound):
    rig = load(sound[0])
    parts = [residual.name for residual in DriveExperiment(rig, gathered(sound[1], rig)[0]).residuals]
    found = replay(*sound, None).comparisons
    whole = found[len(parts) :]
    assert [one.name for one in found[: len(parts)]] == parts
    assert {one.output for one in whole} >= {"controller.voltage", "motor.current", "load.angle"}
    assert all(one.error < 2.0 * one.noise_floor for one in whole)  # it is sound


@pytest.mark.slow
def test_it_compares_what_a_diagnosis_judges(sound, tmp_path):
    """A log that was not taken in step with its controller is judged as a whole drive, and is shown so."""
    (tmp_path / "rig.toml").write_text(sound[0].read_text() + '"controller.sample_period" = 0.0013\n')
    rig = load(tmp_path / "rig.toml")
    runs = gathered(sound[1], rig)[0]
    chosen, why = whole_where_described(rig, runs)
    assert chosen.simulate == "whole" and "period of its own" in why
    judged = [residual.told for residual in DriveExperiment(chosen, runs).residuals]
    assert [one.name for one in replay(rig.path, sound[1], None).comparisons] == judged


@pytest.mark.slow
def test_a_call_has_one_thread_of_blas_also_where_it_is_the_first_to_load_it():
    asked = (
        "from threadpoolctl import threadpool_info\n"
        "from selflock.diagnosis.calls import _narrow\n"
        "import sys\n"
        "assert 'scipy.linalg' not in sys.modules\n"
        "def call():\n"
        "    import scipy.linalg\n"
        "    print({one['num_threads'] for one in threadpool_info() if one['user_api'] == 'blas'})\n"
        "_narrow(call)()\n"
    )
    env = {**os.environ, "OPENBLAS_NUM_THREADS": "2", "MKL_NUM_THREADS": "2"}
    done = subprocess.run([sys.executable, "-c", asked], env=env, capture_output=True, text=True, check=True)
    assert done.stdout.strip() == "{1}"


def test_of_an_angle_that_no_controller_holds_its_change_is_said_to_be_compared(sound, tmp_path):
    kept = [
        line
        for line in sound[0].read_text().splitlines()
        if "_setpoint" not in line and not line.startswith('"controller.') or "controller.voltage" in line
    ]
    (tmp_path / "rig.toml").write_text("\n".join(kept).replace("[rig]", '[rig]\nsimulate = "whole"') + "\n")
    found = replay(tmp_path / "rig.toml", sound[1], tmp_path / "out")
    (angle,) = (one for one in found.comparisons if one.output == "load.angle")
    others = [one for one in found.comparisons if one is not angle]
    assert angle.over > 0.0 and not any(one.over for one in others)
    assert f"load.angle, its change in {angle.over:.3g} s (whole load.angle)" in found.summary()
    assert found.plots["whole load.angle"][0]["y"]["label"].startswith("change of load.angle in ")
    assert "so that it strays" in found.page.read_text()


def test_what_a_gear_winds_up_is_not_called_its_input_angle(tmp_path):
    """Of both angles the second is told beside the first: some µrad under the name of an angle of many turns."""
    examples = ROOT / "examples"
    master.run(examples / "arm.toml", stop=2.5, out=tmp_path / "log.csv")
    found = replay(examples / "rigs" / "arm_rig.toml", tmp_path / "log.csv", tmp_path / "out")
    (wound,) = (one for one in found.comparisons if one.winds)
    assert wound.name == "whole reducer.windup" and wound.output == "reducer.input_angle"
    words = "wind-up, reducer.input_angle / gear_ratio - load.angle"
    assert f"{words} (whole reducer.windup): error" in found.summary() and words in found.page.read_text()
    assert found.plots[wound.name][0]["y"]["label"] == words
    assert "whole reducer.input_angle" not in found.summary() + found.page.read_text()
    log, shown = (pd.read_csv(path) for path in (tmp_path / "log.csv", tmp_path / "out" / "whole_reducer.windup.csv"))
    there = log["arm_reducer.input_angle [rad]"] / 60.0 - log["arm_load.angle [rad]"]
    assert np.allclose(shown["measured"][shown["trusted"]], there[shown["trusted"]], atol=1e-9) and shown["trusted"].any()
