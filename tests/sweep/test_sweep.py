"""Sweeps of real systems: FMUs on workers, bad combinations, failed runs, reports."""

import math
import os
import re
import sys
import tempfile
from pathlib import Path

import numpy as np
import pandas as pd
import psutil
import pytest

from selflock import master
from selflock.fmus.errors import SelflockError
from selflock.sweep import SweepError, report, sweep
from selflock.sweep.analysis import pareto, sensitivity
from selflock.sweep.study import from_dict, read

MOTOR = """
[run]
stop = 0.01
step = 0.001
[components.motor]
fmu = "selflock:Motor"
[components.motor.start]
voltage = 12.0
speed = 0.0
inductance = 1e-3
"""
STUDY = """
system = "system.toml"
[vary.ohm]
set = "motor.resistance"
grid = { from = 0.5, to = 2.0, count = 5 }
[vary.km]
set = "motor.torque_constant"
values = [0.02, 0.03]
[record]
current = { final = "motor.current", unit = "A" }
torque = { max = "abs(motor.torque)", unit = "N.m" }
energy = { integral = "motor.electric_power", unit = "J" }
"""
BRITTLE = """
[run]
stop = 0.01
step = 0.001
[components.part]
part = "jobs:Brittle"
"""
LOADS = """
system = "system.toml"
table = true
[vary.load]
set = "part.load"
values = [0.5, 1.5, 0.75, 1.25]
[record]
y = { final = "part.y" }
"""


def write(folder: Path, system: str, study: str) -> Path:
    folder.mkdir(exist_ok=True)
    (folder / "system.toml").write_text(system)
    (folder / "study.toml").write_text(study)
    return folder / "study.toml"


@pytest.mark.slow
def test_the_same_bits_on_any_workers_and_the_closed_form(tmp_path, scheduler):
    file = write(tmp_path / "in", MOTOR, STUDY)
    ways = {"none": {"workers": 0}, "one": {"workers": 1}, "two": {"scheduler": scheduler}}
    results = {name: sweep(file, tmp_path / name, **way) for name, way in ways.items()}
    assert len({(tmp_path / name / "runs.parquet").read_bytes() for name in ways}) == 1
    table = results["two"].table
    assert len(table) == 10 and (table["status"] == "ok").all()
    expected = 12.0 / table["ohm"] * (1.0 - np.exp(-table["ohm"] / 1e-3 * 0.01))  # eq 16 at standstill
    np.testing.assert_allclose(table["current"], expected, rtol=1e-9)
    np.testing.assert_allclose(table["torque"], expected * table["km"], rtol=1e-9)
    assert "10 runs, 0 failed" in results["two"].summary()
    assert not [p for name in ways for p in (tmp_path / name).rglob("*.fmu")]


def test_the_order_of_runs_changes_no_bit(tmp_path):
    ohms = [0.5, 2.0, 1.0, 0.7]
    tables = []
    for name, order in (("there", ohms), ("back", ohms[::-1])):
        study = STUDY.replace("grid = { from = 0.5, to = 2.0, count = 5 }", f"values = {order}")
        table = sweep(write(tmp_path / name, MOTOR, study), tmp_path / f"out_{name}", workers=0).table
        tables.append(table.sort_values(["ohm", "km"])[["ohm", "km", "current", "torque", "energy"]].reset_index(drop=True))
    assert tables[0].equals(tables[1])


@pytest.mark.slow
def test_thousands_of_runs_neither_grow_nor_leave_anything(tmp_path):
    study = STUDY.replace("count = 5", "count = 150")
    before = set(os.listdir(tempfile.gettempdir()))
    sweep(write(tmp_path / "warm", MOTOR, STUDY), tmp_path / "first", workers=0)
    memory = psutil.Process().memory_info().rss
    sweep(write(tmp_path / "in", MOTOR, study), tmp_path / "out", workers=0)
    assert psutil.Process().memory_info().rss - memory < 30e6  # 300 runs; an instance made again each time is more
    new = {name for name in set(os.listdir(tempfile.gettempdir())) - before if name.startswith("selflock-")}
    assert not new


def test_a_failed_run_is_a_row_with_its_reason(tmp_path):
    result = sweep(write(tmp_path / "in", BRITTLE, LOADS), tmp_path / "out", workers=0, allow_code=True)
    assert result.table["status"].tolist() == ["ok", "failed", "ok", "failed"]
    assert "1.5 is too much" in result.table["reason"][1]
    assert re.search("2 failed: part answered Error: … is too much", result.summary())
    kept = pd.read_parquet(tmp_path / "out" / result.table["table"][0])
    assert kept["part.y"].iloc[-1] == 0.5
    assert master.read(tmp_path / "out" / result.table["table"][0])[1]["part.y"] == "N.m"
    page = report(tmp_path / "out").read_text()
    assert "Failed runs" in page and "is too much" in page


@pytest.mark.slow
def test_a_part_that_kills_its_worker(tmp_path):
    study = LOADS.replace("values = [0.5, 1.5, 0.75, 1.25]", "values = [0.5, 2.5, 0.75]")
    result = sweep(write(tmp_path / "in", BRITTLE, study), tmp_path / "out", workers=1, allow_code=True)
    assert result.table["status"].tolist() == ["ok", "failed", "ok"]
    assert "killed its worker" in result.table["reason"][1]


REDUCER = """
[run]
stop = 0.01
open_inputs = true
[components.reducer]
fmu = "selflock:Reducer"
"""
WEDGES = """
system = "system.toml"
[vary.mu]
set = ["reducer.friction_kinetic", "reducer.friction_static"]
values = [0.1, 0.6, 1.1]
[vary.r]
set = "reducer.gear_ratio"
values = [1.0, 2.0, 50.0]
[record]
f = { final = "reducer.input_torque" }
"""


def test_combinations_that_are_not_physical_are_counted_and_refused(tmp_path):
    with pytest.raises(SweepError, match="1 of 9 combinations are not physical, the first with mu = 1.1, r = 1"):
        sweep(write(tmp_path / "in", REDUCER, WEDGES), tmp_path / "out", workers=0)
    assert not (tmp_path / "out").exists()
    negative = WEDGES.replace("[0.1, 0.6, 1.1]", "[-0.1, 0.6]").replace("[1.0, 2.0, 50.0]", "[2.0, 50.0]")
    with pytest.raises(
        SweepError, match=r"2 of 4 combinations are not physical.*\n  \w+\.friction_\w+ = -0.1 is outside its range"
    ):
        sweep(write(tmp_path / "in", REDUCER, negative), tmp_path / "out", workers=0)


@pytest.mark.parametrize(
    "old, new, said",
    [
        ("motor.resistance", "motor.resistence", "Did you mean resistance"),
        ("motor.resistance", "engine.resistance", "no component engine"),
        ("motor.electric_power", "motor.power", "no variable power"),
        ("motor.electric_power", "motor.resistance", "does not change in a run"),
        ('system = "system.toml"', 'system = "nothing.toml"', "no system file"),
        ('"motor.resistance"', '"connections.motor.voltage.factor"', "no such connection"),
    ],
)
def test_names_that_are_not_there(tmp_path, old, new, said):
    with pytest.raises(SelflockError, match=said):
        sweep(write(tmp_path / "in", MOTOR, STUDY.replace(old, new)), tmp_path / "out", workers=0)
    assert not (tmp_path / "out").exists()


def test_another_study_does_not_get_into_a_folder(tmp_path):
    file = write(tmp_path / "in", MOTOR, STUDY)
    sweep(file, tmp_path / "out", workers=0)
    write(tmp_path / "in", MOTOR.replace("12.0", "24.0"), STUDY)
    with pytest.raises(SweepError, match="belongs to another study: it differs in system"):
        sweep(file, tmp_path / "out", workers=0)
    with pytest.raises(SweepError, match="differs in runs, study"):
        sweep(write(tmp_path / "in", MOTOR, STUDY.replace("0.03", "0.04")), tmp_path / "out", workers=0)
    sweep(write(tmp_path / "in", MOTOR, STUDY + "\n[report]\nhold_times = [1]\n"), tmp_path / "out", workers=0)  # its words may


@pytest.mark.slow
def test_the_report_draws_what_a_designer_looks_at(tmp_path):
    study = (
        STUDY
        + """
held = { value = "current * 12", unit = "W" }
[report]
friction = "ohm"
ratio = "km"
moving = { figure = "energy" }
holding = { figure = "held" }
hold_times = [0, 1]
pareto = { holding = "held", moving = "energy", torque = "torque" }
margins = { by = ["km"], figures = ["current"] }
"""
    )
    sweep(write(tmp_path / "in", MOTOR, study), tmp_path / "out", workers=0)
    page = report(tmp_path / "out").read_text()
    assert re.findall('data-figure="(\\w+)"', page) == ["duty_cycle", "chart", "pareto", "overview"]
    assert page.count('class="shares"') == 3  # what is left to limits, and shares of variance alone and with interactions
    assert not re.search(r"""(src|href)=["'](?!data:)""", page)
    with pytest.raises(SweepError, match="not the folder of a sweep"):
        report(tmp_path / "in")


def sampled(method: str, count: int):
    data = {
        "system": "none", "record": {"y": {"final": "m.y"}}, "sample": {"method": method, "count": count, "seed": 2},
        "vary": {name: {"range": [-math.pi, math.pi]} for name in ("a", "b", "c")},
    }  # fmt: skip
    study = from_dict(data, Path("study.toml"))
    p = study.parameters
    y = np.sin(p["a"]) + 7.0 * np.sin(p["b"]) ** 2 + 0.1 * p["c"] ** 4 * np.sin(p["a"])  # Ishigami and Homma 1990
    return study, p.assign(y=y, status="ok")


@pytest.mark.slow
def test_sobol_indices_of_ishigami():
    found, how = sensitivity(*sampled("saltelli", 2048))
    np.testing.assert_allclose(found["first"], [0.3139, 0.4424, 0.0], atol=0.03)
    np.testing.assert_allclose(found["total"], [0.5576, 0.4424, 0.2437], atol=0.03)
    assert "Sobol" in how
    found, _ = sensitivity(*sampled("sobol", 1024))
    np.testing.assert_allclose(found["first"], [0.3139, 0.4424, 0.0], atol=0.05)


def test_variance_on_a_grid_is_exact():
    data = {
        "system": "none",
        "record": {"y": {"final": "m.y"}},
        "vary": {"a": {"values": [0, 1, 2]}, "b": {"values": [0, 1]}},
    }
    study = from_dict(data, Path("study.toml"))
    p = study.parameters
    found, _ = sensitivity(study, p.assign(y=p["a"] + 2.0 * p["b"], status="ok"))
    share = (2.0 / 3.0) / (2.0 / 3.0 + 1.0)  # Var(a) = 2/3, Var(2 b) = 1
    np.testing.assert_allclose(found["first"], [share, 1.0 - share])
    np.testing.assert_allclose(found["total"], found["first"])
    product, _ = sensitivity(study, p.assign(y=(p["a"] - 1.0) * (p["b"] - 0.5), status="ok"))  # nothing but interaction
    np.testing.assert_allclose(product["first"], 0.0, atol=1e-12)
    np.testing.assert_allclose(product["total"], 1.0)


def test_pareto_front_against_its_definition():
    costs = np.array([[1, 5, 0], [2, 2, 0], [3, 3, 0], [5, 1, 0], [2, 2, 0], [2, 2, -1]], float)
    assert pareto(costs).tolist() == [True, False, False, True, False, True]


@pytest.mark.parametrize("name", ["friction_chart", "motor_choice"])
def test_the_examples_can_be_read(name):
    from selflock.sweep.check import check

    study = read(Path(__file__).parents[2] / "examples" / f"{name}.toml")
    study.settings, study.parameters = study.settings[:2], study.parameters[:2]
    check(study, master.load(study.system))


SHARED = """
[values]
mu = 0.1
r = 2.0
[run]
stop = 0.01
step = 0.001
open_inputs = true
[components.reducer]
fmu = "selflock:Reducer"
[components.reducer.start]
friction_kinetic = "= mu"
friction_static = "= mu"
gear_ratio = "= r"
"""


def test_a_value_of_the_system_varies_as_a_parameter_does(tmp_path):
    """Refused before the first run where what follows from it is not physical; else the same numbers, bit for bit."""
    by_value = WEDGES.replace('["reducer.friction_kinetic", "reducer.friction_static"]', '"mu"').replace(
        '"reducer.gear_ratio"', '"r"'
    )
    with pytest.raises(SweepError, match="1 of 9 combinations are not physical, the first with mu = 1.1, r = 1"):
        sweep(write(tmp_path / "a", SHARED, by_value), tmp_path / "out_a", workers=0)
    tables = []
    for name, study in (("b", WEDGES), ("c", by_value)):
        study = study.replace("[0.1, 0.6, 1.1]", "[0.1, 0.6]")
        tables.append(sweep(write(tmp_path / name, SHARED, study), tmp_path / f"out_{name}", workers=0).table)
    assert len(tables[0]) == 6 and (tables[0].f == tables[1].f).all() and (tables[0].r == tables[1].r).all()


@pytest.mark.slow
def test_an_fmu_that_crashes_at_initialization_is_a_row(tmp_path):
    sys.path.insert(0, str(Path(__file__).parents[1] / "native"))
    from pack import pack

    pack("teller", tmp_path / "in")
    system = (
        '[run]\nstop = 0.3\nstep = 0.1\nopen_inputs = true\n[components.t]\nfmu = "teller.fmu"\n[components.t.start]\nend = 5\n'
    )
    study = (
        'system = "system.toml"\n[vary.at]\nset = "t.ends_at"\nvalues = [9.0, -1.0, 8.0, -2.0]\n'
        '[record]\nlast = { final = "t.count_out" }\n'
    )
    found = sweep(write(tmp_path / "in", system, study), tmp_path / "out", workers=0).table
    assert found["status"].to_list() == ["ok", "failed", "ok", "failed"]
    assert all("a crash (SIGSEGV) at t = 0 s" in reason for reason in found["reason"][[1, 3]])
    assert found["last"].to_list()[::2] == [1, 1]


@pytest.mark.slow
@pytest.mark.skipif(sys.platform != "linux", reason="native FMUs of the tests are for Linux")
def test_a_strangers_fmu_is_isolated_in_a_sweep_too(tmp_path):
    """It tries to write 10 GiB, and says -1 where it could: only a process with limits refuses that."""
    sys.path.insert(0, str(Path(__file__).parents[1] / "native"))
    from pack import pack

    pack("hostile", tmp_path / "in")
    start = '[components.h.start]\ndeed = "large"\ntext = ""\n'
    system = f'[run]\nstop = 0.7\nstep = 0.1\nopen_inputs = true\n[components.h]\nfmu = "hostile.fmu"\n{start}'
    study = 'system = "system.toml"\n[vary.a]\nset = "h.deed"\nvalues = ["", "large"]\n[record]\nleast = { min = "h.y" }\n'
    found = sweep(write(tmp_path / "in", system, study), tmp_path / "out", workers=0, isolate=True).table
    assert found["status"].to_list() == ["ok", "ok"], found["reason"].to_list()
    assert found["least"].min() >= 0.0


@pytest.mark.parametrize("table", [False, True])
def test_figures_are_of_all_steps_whatever_rows_are_kept(tmp_path, table):
    """The energy of a motor's first 10 ms was that of a trapezoid over two rows."""
    study = f"table = {str(table).lower()}\n" + STUDY
    every = sweep(write(tmp_path / "a", MOTOR, study), tmp_path / "out a", workers=0).table
    some = sweep(
        write(tmp_path / "b", MOTOR.replace("step", "interval = 0.004\nstep"), study), tmp_path / "out b", workers=0
    ).table
    figures = ["current", "torque", "energy"]
    pd.testing.assert_frame_equal(some[figures], every[figures])
    if table:
        kept = pd.read_parquet(tmp_path / "out b" / some["table"].iloc[0])
        assert kept["time"].tolist() == pytest.approx([0.0, 0.004, 0.008, 0.01])


def test_an_interval_between_steps_is_refused_before_the_runs(tmp_path):
    file = write(tmp_path / "in", MOTOR.replace("step", "interval = 0.0015\nstep"), STUDY)
    with pytest.raises(SelflockError, match="interval.*not a whole number of steps"):
        sweep(file, tmp_path / "out", workers=0)


@pytest.mark.parametrize("window, words", [("to = 0.02", "ends at 0.02 s"), ("from = 0.02", "begins at 0.02 s")])
def test_a_window_beyond_the_end_of_the_system_s_own_run_is_refused(tmp_path, window, words):
    """It was cut without a word: an energy until then looked like one until its end."""
    file = write(tmp_path / "in", MOTOR, STUDY.replace('"motor.electric_power"', f'"motor.electric_power", {window}'))
    with pytest.raises(SweepError, match=f"energy: its window {words}, after the end of the run at 0.01 s"):
        sweep(file, tmp_path / "out", workers=0)
    inside = STUDY.replace('"motor.electric_power"', '"motor.electric_power", from = 0.0, to = 0.01')
    assert (sweep(write(tmp_path / "in", MOTOR, inside), tmp_path / "out", workers=0).table["status"] == "ok").all()
