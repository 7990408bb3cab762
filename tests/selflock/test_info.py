"""`selflock info`: what is in a file, a page for each kind; names of strangers stay words, and lists end."""

import re
import tempfile
import zipfile
from pathlib import Path

import pandas as pd
import pytest
from typer.testing import CliRunner

import selflock
from selflock import cli, master
from selflock.fmus.build import built
from selflock.fmus.errors import SelflockError
from selflock.info import LIMIT, info

ROOT = Path(__file__).parents[2]


def line(text, begin):
    return next(one for one in text.splitlines() if one.strip().startswith(begin))


def test_an_fmu_is_told_with_units_start_values_and_limits():
    text = info(built("Motor"))
    assert "FMU Motor, FMI 2.0 co-simulation" in text and "2 inputs" in text
    assert line(text, "resistance") == "  resistance = 0.6 Ohm, at least 0  resistance R of the armature winding"
    assert line(text, "torque").startswith("  torque N.m  ")


def test_a_system_is_told_with_what_is_connected_to_what():
    text = info(ROOT / "examples" / "bench.toml")
    assert "3 components, 5 connections" in text and "from 0 to 1 s in steps of 0.001 s" in text
    assert line(text, "output_angle") == "  output_angle rad <- weight.angle" and line(text, "mass") == "  mass = 5 kg"
    assert line(text, "voltage") == "  voltage = 24 V, held" and "  torque N.m -> gear.motor_torque" in text
    robot = info(ROOT / "study" / "robot.toml")
    assert line(robot, "ratio") == "  ratio = 50" and "  angle rad <- 0.02 · rear_reducer.input_angle" in robot


def test_folders_and_structures_of_others_are_told(native, tmp_path):
    folder = tmp_path / "unpacked"
    with zipfile.ZipFile(native("relaxation")) as archive:
        archive.extractall(folder)
    assert "unpacked: FMU Relaxation, FMI 2.0 co-simulation" in info(folder) and "2 outputs" in info(folder)
    osp = tmp_path / "OspSystemStructure.xml"
    osp.write_text(
        '<OspSystemStructure version="0.1"><EndTime>2</EndTime><Simulators><Simulator name="a" source="unpacked"/>'
        '<Simulator name="b" source="unpacked"/></Simulators><Connections><VariableConnection><Variable simulator="a" name="x"/>'
        '<Variable simulator="b" name="u"/></VariableConnection></Connections></OspSystemStructure>'
    )
    for path in (osp, tmp_path):
        assert "2 components, 1 connections" in info(path) and "from 0 to 2 s in steps of 0.1 s, jacobi" in info(path)
        assert "  u K <- a.x" in info(path)
    packed = master.ssp.export(osp, tmp_path / "s.ssp")
    with zipfile.ZipFile(packed) as archive:
        archive.extractall(tmp_path / "s")
    assert "  u K <- a.x" in info(tmp_path / "s" / "SystemStructure.ssd")


def test_an_ssp_is_told_as_the_system_in_it(tmp_path):
    from selflock.master.ssp import export

    system = master.load(ROOT / "examples" / "bench.toml")
    system.faults = []
    text = info(export(system, tmp_path / "b.ssp"))
    assert "3 components, 5 connections" in text and "motor_torque N.m <- motor.torque" in text
    assert "gear: resources/" in text and str(tempfile.gettempdir()) not in text  # not where it was unpacked


@pytest.mark.parametrize("ending", ["csv", "parquet"])
def test_a_result_is_told_by_its_columns(tmp_path, ending):
    path = tmp_path / f"r.{ending}"
    master.run(ROOT / "examples" / "bench.toml", stop=0.01, out=path)
    text = info(path)
    assert "table of 11 rows" in text and "from 0 to 0.01 s, a row every 0.001 s" in text
    assert re.fullmatch(r"  motor\.torque N\.m  0 to [\d.]+, at last [\d.]+", line(text, "motor.torque"))


def test_a_rig_is_told_with_what_would_be_assumed():
    text = info(ROOT / "examples" / "rigs" / "worm_drive.toml")
    assert 'rig worm drive, of kind "steady"' in text and "reducer.input_speed <- motor_speed (rad/s)" in text
    assert line(text, "reducer.friction_kinetic").endswith("= 0.12, refitted in [0.01, 1]")
    assert "would be assumed" in text and "reducer.shaft_stiffness = 20000 N.m/rad" in text
    servo = info(ROOT / "examples" / "rigs" / "xl330.toml")
    assert "controller.angle_gain" not in servo  # each log has its own


def test_a_study_is_told():
    text = info(ROOT / "examples" / "friction_chart.toml")
    assert "125 runs" in text and "varies: friction, ratio" in text


def test_names_of_strangers_stay_words_and_lists_end(tmp_path):
    hostile = "a\x1b[2J\n  forged = 1" + 500 * "x"
    pd.DataFrame({"time": [0.0, 1.0], hostile: [1.0, 2.0], **{f"c{k}": [0.0, 0.0] for k in range(LIMIT + 50)}}).to_parquet(
        tmp_path / "x.parquet"
    )
    said = CliRunner().invoke(cli.app, ["info", str(tmp_path / "x.parquet")])
    assert said.exit_code == 0 and "\x1b" not in said.output and "\\x1b[2J" in said.output
    assert not any(one.strip().startswith("forged") for one in said.output.splitlines())
    assert "… and 51 more; --all shows them" in said.output and max(map(len, said.output.splitlines())) < 200
    everything = CliRunner().invoke(cli.app, ["info", "--all", str(tmp_path / "x.parquet")]).output
    assert f"c{LIMIT + 49}  0 to 0" in everything


def test_no_code_of_a_system_is_run(tmp_path):
    (tmp_path / "mine.py").write_text("open('ran', 'w')")
    (tmp_path / "s.toml").write_text('[components.a]\npart = "mine:Part"\n[connections]\n"a.u" = "a.y"\n')
    text = info(tmp_path / "s.toml")
    assert "its variables are not known" in text and "u <- a.y" in text and not (tmp_path / "ran").exists()


@pytest.mark.parametrize(
    "name, content, words",
    [
        ("none.toml", None, "There is no file"),
        ("x.docx", b"x", "info tells of .fmu"),
        ("x.toml", b"\xff\xfe", "is no TOML"),
        ("x.toml", b"a = 1", "is no file of ours"),
        ("x.fmu", b"PK", "x.fmu"),
        ("x.ssp", b"zip?", "x.ssp"),
        ("x.parquet", b"PAR1", "is no table of results"),
        ("x.csv", b"", "is no table of results"),
        ("r.toml", b"[rig]\nkind = 'stedy'", "stedy"),
    ],
)
def test_a_wrong_file_is_told_in_a_sentence(tmp_path, name, content, words):
    if content is not None:
        (tmp_path / name).write_bytes(content)
    with pytest.raises(SelflockError, match=re.escape(words)):
        info(tmp_path / name)


@pytest.mark.parametrize(
    "call, given, words",
    [
        (selflock.run, "examples/rigs/emps.toml", "is a rig: selflock replay"),
        (selflock.run, "examples/friction_chart.toml", "is a sweep: selflock sweep"),
        (lambda path: selflock.sweep(path, "nowhere"), "examples/bench.toml", "is a system: selflock run"),
        (lambda path: selflock.replay(path, "log.csv", None), "examples/bench.toml", "is a system: selflock run"),
        (selflock.run, "docs/power.csv", "is a table: selflock view"),
        (lambda path: selflock.replay(path, ["log.csv"], None), "examples/rigs/emps.toml", "replay takes one log"),
        (lambda path: selflock.replay({"rig": path}, "log.csv", None), "", "a rig is a file, its path"),
        (
            lambda path: selflock.diagnose(path, [3.0], out=None),
            "examples/rigs/emps.toml",
            "logs are the paths of files: a float is none",
        ),
        (lambda path: selflock.diagnose(path, 3.0, out=None), "examples/rigs/emps.toml", "a float is none"),
        (lambda path: selflock.diagnose(path, "no.csv", out=None), "examples/rigs/emps.toml", "no.csv: there is no such log"),
        (
            lambda path: selflock.diagnose(path, "no.csv", out=None, max_time="1"),
            "examples/rigs/emps.toml",
            "'1' is no number of seconds",
        ),
    ],
)
def test_a_file_of_another_kind_is_told_with_its_command(call, given, words):
    with pytest.raises(SelflockError, match=re.escape(words)):
        call(ROOT / given)
