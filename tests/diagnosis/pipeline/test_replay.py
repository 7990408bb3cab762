"""Replay: a measured motion imposed on the reducer's FMU, against the wedge's closed forms; and the worm drive."""

import math
from pathlib import Path

import numpy as np
import pandas as pd
import pytest
from lxml import html

from selflock.diagnosis import replay
from selflock.diagnosis.errors import DataError
from selflock.diagnosis.output import extend
from selflock.diagnosis.pipeline.replay import Comparison, Replay

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
    picture = honest.figures[0]
    assert (tmp_path / "honest" / picture).read_bytes() != (tmp_path / "other" / picture).read_bytes()


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
    assert (tmp_path / "gear.png").exists() and (tmp_path / "reducer.fmu").exists()


def test_a_notebook_shows_the_numbers_and_the_first_picture(tmp_path, hostile):
    told = Replay([Comparison(hostile, hostile, "N.m", 0.5, 0.1, 0.0, [])], [], None)
    tree = html.fragments_fromstring(told._repr_html_())
    assert [one.tag for one in tree] == ["pre"] and tree[0].xpath("string(.)") == str(told) and not tree[0].xpath("*")
    (tmp_path / "gear.png").write_bytes(b"a picture")
    told.folder, told.figures = tmp_path, ["gear.png", "other.png"]
    tree = html.fragments_fromstring(told._repr_html_())
    assert tree[1].get("src") == "data:image/png;base64,YSBwaWN0dXJl"
