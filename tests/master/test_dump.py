"""A system written as a file is the same when it is read again; outputs may have start values."""

import shutil
from dataclasses import asdict, replace
from pathlib import Path

import numpy as np
import pytest

from selflock import examples, master
from selflock.master.dump import save
from selflock.master.system import Bond, Component, Connection, Fault, Run, System


def plain(system):
    return {key: value for key, value in asdict(system).items() if key not in ("folder", "drives")}  # drives are components


@pytest.mark.parametrize("name", [name for name, path in examples.files().items() if "[components" in path.read_text()])
def test_the_examples_come_back(tmp_path, name):
    system = master.load(examples.files()[name])
    again = master.load(save(system, tmp_path / "again.toml", about="first line\nsecond line"))
    for one in (system, again):
        for component in one.components.values():
            if component.fmu and not component.fmu.startswith("selflock:"):
                component.fmu = str((one.folder / component.fmu).resolve())
            if component.manoeuvre:
                component.manoeuvre = str((one.folder / component.manoeuvre).resolve())
    assert plain(again) == plain(system)


def test_whatever_a_file_can_say_comes_back(tmp_path, hostile):
    system = System(
        hostile,
        'two\nlines \x7f and a "quote"',
        tmp_path / "elsewhere",
        Run(0.5, 2.0, 0.25, "jacobi", ["b c", "a"], ["a.*"], 0.5, True),
        {
            "a": Component("x/y.fmu", step=0.125, start={"deep.name": 1.5, "flag": True, "word": 'a"b\\'}, process=True),
            "b c": Component(part="module:Class", options={"list": [1, 2.0, "x"], "table": {"k": {"l": -1}}}),
        },
        {"a.u": Connection("b c.y", -2.0, 1e-9, False), "b c.u": Connection("a.x")},
        [Bond("a.t", "a.w", "shaft")],
        [Fault("a.u", "stuck", 0.1, value=3.0), Fault("a.x", "noise", 0.0, float("inf"), deviation=0.1, seed=3)],
    )
    again = master.load(save(system, tmp_path / "file.toml"))
    assert Path(again.folder, again.components["a"].fmu).resolve() == (tmp_path / "elsewhere/x/y.fmu").resolve()
    again.components["a"] = replace(again.components["a"], fmu="x/y.fmu")
    assert plain(again) == plain(system)


def test_what_has_no_words_in_a_file_is_refused(tmp_path):
    system = System(components={"a": Component(part="module:Class", options={"x": np.zeros(2)})})
    with pytest.raises(master.ResultError, match="cannot be written to a system file"):
        save(system, tmp_path / "file.toml")


def test_one_fmu_comes_back_as_a_system(native, tmp_path):
    (tmp_path / "elsewhere").mkdir()
    shutil.copy(native("ball"), tmp_path / "elsewhere" / "my.ball.fmu")
    system = master.load(save(master.load(tmp_path / "elsewhere/my.ball.fmu"), tmp_path / "file.toml"))
    assert system.components["ball"].fmu == "elsewhere/my.ball.fmu"
    table = master.run(system, {"ball.height": 2.0, "ball.gravity": 10.0}, stop=0.5).table
    assert table["ball.height"].iloc[-1] == pytest.approx(2.0 - 5.0 * 0.5**2)


def test_an_output_that_is_computed_takes_no_start_value(native, refused):
    system = master.load(native("relaxation"))
    refused(lambda: master.run(system, {"relaxation.flow": 1.0}), "an output is computed")
    assert master.run(system, {"relaxation.x": 3.0, "relaxation.rate": 0.0}, stop=0.01).table["relaxation.x"].iloc[-1] == 3.0
