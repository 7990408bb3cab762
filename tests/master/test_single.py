"""One FMU as a system: its default experiment, and a table of what goes into it."""

import math
import shutil

import numpy as np
import pandas as pd
import pytest

from selflock import master


@pytest.fixture
def forgetful(native, tmp_path):
    """An FMU alone in a folder; y = gain t + offset; its default experiment is 2 s in steps of 0.1 s."""
    return shutil.copy(native("forgetful"), tmp_path / "any name.fmu")


@pytest.fixture
def table(tmp_path):
    def write(text):
        (tmp_path / "u.csv").write_text(text)
        return tmp_path / "u.csv"

    return write


def test_it_runs_in_its_default_experiment(forgetful):
    result = master.run(forgetful, settings={"gain": 2.0, "forgetful.offset": 1.0})
    assert result.table["time"].to_numpy() == pytest.approx(np.arange(21) * 0.1)
    assert result.table["forgetful.y"].to_numpy() == pytest.approx(2.0 * result.table["time"].to_numpy() + 1.0)
    assert (result.table["forgetful.tolerance"] == 1e-5).all()


@pytest.mark.parametrize("stop, step, steps", [(5.0, None, 50), (0.25, None, 3), (1.0, 0.25, 4), (math.pi, None, 32)])
def test_the_step_goes_into_any_stop(forgetful, stop, step, steps):
    result = master.run(forgetful, stop=stop, step=step)
    assert result.steps == steps and result.table["time"].iloc[-1] == pytest.approx(stop)


def test_without_a_default_experiment(native):
    system = master.load(native("relaxation"))
    assert (system.run.start, system.run.stop, system.run.step) == (0.0, 1.0, 1e-3)


def test_a_wrong_name_is_told(forgetful, refused):
    refused(lambda: master.run(forgetful, settings={"gian": 2.0}), "forgetful has no variable gian", "Did you mean gain?")


def test_a_table_drives_its_inputs(forgetful, table):
    given = table("time,offset,count_in\n0,0,1\n1,10,2\n1,0,3\n1.5,5,4\n")
    taken = []
    result = master.run(
        forgetful,
        settings={"gain": 0.0},
        inputs=given,
        step=0.25,
        observe=lambda time, parts: taken.append(parts["forgetful"].get("count_in")),
    )
    # what a step is given is that of its start: straight between rows, a jump, and held behind the last row
    assert result.table["forgetful.y"].tolist() == pytest.approx([0.0, 0.0, 2.5, 5.0, 7.5, 0.0, 2.5, 5.0, 5.0])
    assert taken[1:] == [1, 1, 1, 1, 3, 3, 4, 4]  # a whole number is held


def test_a_tables_time_is_in_the_unit_that_it_says(native, tmp_path):
    def end(text):
        (tmp_path / "u.csv").write_text(text)
        return master.run(native("relaxation"), stop=1.0, step=0.01, inputs=tmp_path / "u.csv").table.iloc[-1]["relaxation.x"]

    plain = end("time,u\n0,1.5\n1,2.5\n")
    assert plain != 0.0 and end("time [ms];u [K]\n0;1,5\n1000;2,5\n") == pytest.approx(plain, rel=1e-12)


def test_a_table_of_a_system_and_in_parquet(system, native, tmp_path):
    pd.DataFrame({"time": [0.0, 1.0], "b.offset": [3.0, 3.0]}).to_parquet(tmp_path / "u.parquet")
    described = system(
        {"a": native("forgetful"), "b": native("forgetful")}, {"a.offset": "b.y"}, stop=1.0, step=0.1, order=["b", "a"]
    )
    result = master.run(described, settings={"a.count_in": 0, "b.count_in": 0}, inputs=tmp_path / "u.parquet")
    assert result.table["a.y"].iloc[-1] == pytest.approx(5.0)


def test_units_of_a_table_are_converted(system, table):
    described = system({"m": ("Mass", {"mass": 1.0})}, stop=1.0, step=0.1)
    result = master.run(described, inputs=table("time [s],m.force [kN]\n0,0.002\n"))
    assert result.table["m.v"].iloc[-1] == pytest.approx(2.0)


@pytest.mark.parametrize(
    "text, words",
    [
        ("t,offset\n0,1\n", ["`time`"]),
        ("time,offset\n", ["rows"]),
        ("time,offset\n0,1\n2,1\n1,1\n", ["time falls"]),
        ("time,offset\n0,high\n", ["offset", "no number"]),
        ("time,offset\n0,nan\n", ["offset", "no number"]),
        ("time,offst\n0,1\n", ["offst", "Did you mean offset?"]),
        ("time,count_in\n0,1.5\n", ["count_in", "not whole"]),
        ("time,count_in\n0,99999999999\n", ["count_in", "99999999999", "32 bits"]),
        ("time,y\n0,1\n", ["y is no input"]),
        ("time,gain\n0,1\n", ["gain is no input"]),
    ],
)
def test_a_table_that_is_none_is_told(forgetful, table, refused, text, words):
    refused(lambda: master.run(forgetful, inputs=table(text)), *words)


def test_an_input_has_one_source(system, native, table, refused):
    described = system({"a": native("forgetful"), "b": native("forgetful")}, {"b.offset": "a.y"}, open_inputs=True)
    refused(lambda: master.run(described, inputs=table("time,b.offset\n0,1\n")), "b.offset is connected to a.y")


@pytest.mark.parametrize("ending", ["csv", "parquet"])
@pytest.mark.parametrize(
    "columns, word",
    [
        ({"time": pd.to_datetime(["2026-01-01", "2026-01-02"]), "offset": [1.0, 2.0]}, "column time holds what is no number"),
        ({"time": pd.to_timedelta([0, 1], unit="s"), "offset": [1.0, 2.0]}, "column time holds what is no number"),
        ({"time": [0.0, 1.0], "offset": pd.to_datetime(["2026-01-01", "2026-01-02"])}, "column offset holds what is no number"),
    ],
)
def test_dates_and_spans_are_no_numbers(forgetful, tmp_path, refused, columns, word, ending):
    """They were taken as so many ns: the first row was held, or all rows passed in a nanosecond."""
    path, frame = tmp_path / f"u.{ending}", pd.DataFrame(columns)
    frame.to_csv(path, index=False) if ending == "csv" else frame.to_parquet(path)
    refused(lambda: master.run(forgetful, inputs=path), word)


@pytest.mark.parametrize(
    "times, words",
    [
        (
            (1_700_000_000, 1_700_000_005),
            "its times, 1700000000 to 1700000005 s, are all after the run's end at 0.8 s: its first row",
        ),
        ((-5, -1), "its times, -5 to -1 s, are all before the run's start at 0 s: its last row"),
        ((-5, 0), None),
        ((0.5, 9), None),
    ],
)
def test_a_table_that_is_not_there_during_the_run_is_noted(forgetful, table, times, words):
    result = master.run(forgetful, stop=0.8, step=0.1, inputs=table("time,offset\n{},1\n{},2\n".format(*times)))
    assert len(result.notes) == (words is not None) and all(words in note for note in result.notes)


@pytest.mark.parametrize("header", ["m.force [kN]", "m.force [kN] ", " m.force  [kN]\t", " m.force (kN) ", "m.force [ kN ]"])
def test_blanks_around_a_name_and_its_unit_are_none_of_theirs(system, table, header):
    """The input `m.force [kN] ` was there nowhere."""
    described = system({"m": ("Mass", {"mass": 1.0})}, stop=1.0, step=0.1)
    result = master.run(described, inputs=table(f"time [s] , {header}\n0,0.002\n"))
    assert result.table["m.v"].iloc[-1] == pytest.approx(2.0)


@pytest.mark.parametrize("unit", ["Hz", "1/min", "N.m"])
def test_a_unit_that_does_not_fit_is_mended_where_it_stands(system, table, refused, unit):
    """It was told as one of a connection, with what can be said there alone."""
    described = system({"t": ("Thermometer", {"kelvin": 0.0, "radians": 0.0})}, stop=1.0, step=0.1)
    said = refused(lambda: master.run(described, inputs=table(f"time,t.speed [{unit}]\n0,1\n")), "u.csv: column t.speed: ")
    assert "Write its numbers in rad/s" in said and "convert = false" not in said and "connections" not in said
