"""What was a traceback or a hang once, each by the smallest file that showed it: one message, or an answer."""

import json
import math
import os
import zipfile

import inputs
import numpy as np
import pandas as pd
import pytest

from selflock import master
from selflock.diagnosis import plan, replay, rig_init, track
from selflock.diagnosis.data.rig import load as load_rig
from selflock.diagnosis.tracking.logs import logs_of
from selflock.fmus.build import built
from selflock.fmus.effect_file import read_folder
from selflock.fmus.errors import SelflockError
from selflock.info import info
from selflock.master.errors import DescriptionError
from selflock.master.system import from_dict
from selflock.master.units import conversion
from selflock.sweep.record import evaluate
from selflock.sweep.study import read as read_study
from selflock.view import view

DIGITS = "9" * 400


def log(cell=None, run="0", names="time,speed,torque,run"):
    rows = [f"{0.01 * k},{(-1) ** (k // 40) * 20.0},{0.1 * (-1) ** (k // 40)},{run if k % 3 else '0'}" for k in range(240)]
    if cell:
        rows[100] = cell
    return "\n".join([names, *rows]) + "\n"


@pytest.mark.parametrize("number", [DIGITS, "1" + "0" * 5000, "[" * 3000 + "]" * 3000])
def test_numbers_and_brackets_without_end_in_toml(tmp_path, number):
    path = tmp_path / "x.toml"
    for text, read in (
        (f"[run]\nstep = {number}\n", master.load),
        (f"[rig]\nname = {number}\n", lambda path: replay(path, "log.csv", None)),
        (f"system = {number}\n", read_study),
        (f"x = {number}\n", info),
    ):
        path.write_text(text)
        with pytest.raises(SelflockError, match="64 bits|digits|nested too deep"):
            read(path)


@pytest.mark.parametrize(
    "line",
    [
        "stop = [1]",
        'set = "a"',
        "vary.ohm.set = true",
        "vary.ohm.set = [1.0]",
        "vary.ohm.grid = 3",
        "vary.ohm.range = 3",
        'vary.ohm.grid = { from = "a", to = 1, count = 2 }',
        "vary.ohm.grid = { from = 0, to = 1, count = 2147483648 }",
        "vary.ohm.choices = { a = 1 }",
        "record = 3",
        "record.y = { final = 'a.b', from = [] }",
        "sample.seed = 1e300",
        "list = [1]",
    ],
)
def test_what_is_no_table_text_or_number_in_a_sweep(tmp_path, line):
    (tmp_path / "x.toml").write_text(f'{line}\nsystem = "x.toml"\n')
    with pytest.raises(SelflockError, match="wanted here|write grid|write range|name a variable"):
        read_study(tmp_path / "x.toml")


@pytest.mark.parametrize("value", ["12:00:00", "2026-05-31", "2026-05-31T12:00:00Z"])
def test_a_time_of_day_in_a_sweep(tmp_path, value):
    vary = '[vary.ohm]\nset = "motor.resistance"\nvalues = [1.0]\n'
    (tmp_path / "s.toml").write_text(f'system = "x.toml"\ntable = true\nset = {{ "motor.voltage" = {value} }}\n{vary}')
    with pytest.raises(SelflockError, match="a date or a time of day"):
        read_study(tmp_path / "s.toml")


def test_more_samples_than_anybody_waits_for(tmp_path):
    text = 'system = "x"\ntable = true\n[vary.a]\nrange = [0.0, 1.0]\n[sample]\nmethod = "lhs"\ncount = 2147483648\n'
    (tmp_path / "x.toml").write_text(text)
    with pytest.raises(SelflockError, match="count"):
        read_study(tmp_path / "x.toml")
    (tmp_path / "x.toml").write_text(
        'system = "x"\ntable = true\n' + "".join(f"[vary.{a}]\ngrid = {{ from = 0, to = 1, count = 2000 }}\n" for a in "ab")
    )
    with pytest.raises(SelflockError, match="4000000 runs"):
        read_study(tmp_path / "x.toml")


@pytest.mark.slow
@pytest.mark.parametrize(
    "text", [log(run=""), log("1.0,1e300,0.1,0"), log(f"1.0,{DIGITS},0.1,0"), log(f"{DIGITS},1,0.1,0"), log("1.0")]
)
def test_cells_of_a_log(tmp_path, text):
    (tmp_path / "rig.toml").write_text(inputs.RIG)
    (tmp_path / "log.csv").write_text(text)
    try:
        replay(tmp_path / "rig.toml", tmp_path / "log.csv", None)
    except SelflockError as error:
        assert "log.csv" in str(error)


def a_motion(folder, beyond):
    """A log of a motion with a whole stretch of such speeds, and its rig."""
    time = [0.001 * k for k in range(1500)]
    speed = [60.0 * math.sin(3.0 * t) for t in time]
    torque = [math.copysign(0.1, w) for w in speed]
    speed[700:706] = 6 * [beyond]
    pd.DataFrame({"time": time, "speed": speed, "torque": torque}).to_csv(folder / "log.csv", index=False)
    (folder / "rig.toml").write_text(inputs.RIG.replace('run = "run"\n', ""))
    return folder / "rig.toml", folder / "log.csv"


@pytest.mark.parametrize("beyond", [1e300, -1e308])
def test_speeds_beyond_any_measurement(tmp_path, beyond):
    (found,) = [fault for fault in replay(*a_motion(tmp_path, beyond), None).faults if fault["kind"] == "non-finite"]
    assert (found["first"], found["last"], found["channel"]) == (700, 705, "reducer.input_speed")


def test_a_refusal_of_an_fmu_on_a_log_is_one_message(tmp_path):
    from selflock.diagnosis.output.extend import GEAR, _play

    with pytest.raises(
        SelflockError, match="Reducer.fmu has no result at t = 0 s of the log for imposed_angle = 0, imposed_speed = inf"
    ):
        _play(
            built("Reducer"),
            {"kinematic": True},
            GEAR,
            [np.array([0.0]), *3 * [np.array([math.inf])]],
            np.zeros(1),
            [np.zeros(1)],
        )


def test_empty_cells_of_the_column_that_tells_runs_apart(tmp_path):
    (tmp_path / "rig.toml").write_text(inputs.RIG)
    (tmp_path / "log.csv").write_text(log(run=""))
    with pytest.raises(SelflockError, match="line 3, column 'run' is empty, and in 160 lines in all"):
        replay(tmp_path / "rig.toml", tmp_path / "log.csv", None)


def test_two_columns_of_one_name(tmp_path):
    (tmp_path / "x.csv").write_text("time [s],a.b,a.b\n0.0,1.0,2.0\n")
    with pytest.raises(SelflockError, match="'a.b' is there twice"):
        info(tmp_path / "x.csv")


@pytest.mark.parametrize("old, new", [(b'start="1.0"', b'start="Real"'), (b'unit="V"', b'unit="input"')])
def test_attributes_of_an_fmu(tmp_path, old, new):
    path = tmp_path / "x.fmu"
    with zipfile.ZipFile(built("Motor")) as good, zipfile.ZipFile(path, "w") as bad:
        for name in good.namelist():
            content = good.read(name)
            if name == "modelDescription.xml":
                assert old in content
                content = content.replace(old, new, 1)
            bad.writestr(name, content)
    try:
        info(path)
    except SelflockError as error:
        assert "modelDescription.xml" in str(error)


def test_an_expression_that_is_a_list():
    with pytest.raises(SelflockError, match="is a list, and no value"):
        evaluate("[1, 2]", pd.DataFrame({"a": [0.0, 1.0, 2.0]}))


@pytest.mark.parametrize("power", ["rpm99999999", "min99999", "m**(-99999999)", "rpm^99^9^9", "m**(9)**99"])
def test_powers_without_end_in_a_unit(power):
    with pytest.raises(SelflockError, match="nobody knows the unit"):
        conversion(f"N.{power}", "degC")


@pytest.mark.parametrize("name", ["a\0b.csv", "a\0b.parquet"])
def test_a_zero_byte_in_the_name_of_a_file(tmp_path, name):
    with pytest.raises(SelflockError):
        master.run(built("Motor"), {"speed": 0.0}, stop=0.01, step=0.001, out=str(tmp_path / name))
    with pytest.raises(SelflockError):
        master.read(tmp_path / name)
    with pytest.raises(SelflockError):
        read_study(tmp_path / "a\0b.toml")
    with pytest.raises(SelflockError):
        read_folder(tmp_path / "a\0b")


def test_a_key_of_dots_without_end(tmp_path):
    (tmp_path / "x.toml").write_text(".".join("a" * 20_000) + " = 1\n")
    with pytest.raises(SelflockError, match="dots in a row"):
        master.load(tmp_path / "x.toml")
    (tmp_path / "x.toml").write_text(f"[run]\nstep = [{', '.join(['0.5'] * 500)}]\n")  # numbers have dots, too
    with pytest.raises(SelflockError, match="step"):
        master.load(tmp_path / "x.toml")


def test_steps_that_nobody_can_count(tmp_path):
    (tmp_path / "x.toml").write_text(inputs.MOTOR.replace("step = 0.001", "step = 5e-324"))
    with pytest.raises(SelflockError, match="beyond any number of steps"):
        master.run(tmp_path / "x.toml")


@pytest.mark.parametrize("step", [-5e-324, -1.0, 5e-324])
def test_steps_of_a_component_that_nobody_can_count(tmp_path, step):
    (tmp_path / "x.toml").write_text(inputs.MOTOR.replace("[components.motor]", f"[components.motor]\nstep = {step}", 1))
    with pytest.raises(SelflockError, match="step"):
        master.run(tmp_path / "x.toml")


@pytest.mark.skipif(not hasattr(os, "mkfifo"), reason="no pipes have names here")
@pytest.mark.parametrize("ending", ["toml", "csv", "parquet", "fmu", "ssp", "xml", "py"])
def test_what_has_no_end_is_not_waited_for(tmp_path, ending):
    """A pipe or a device, as an archive or a link can hold them; before, the first was waited for and the second read for ever."""
    pipe, device = tmp_path / f"pipe.{ending}", tmp_path / f"device.{ending}"
    os.mkfifo(pipe)
    device.symlink_to("/dev/zero")
    asks = {"toml": [master.load, load_rig, read_study], "csv": [master.read], "parquet": [master.read]}
    asks["py"] = [lambda path: read_folder(path.parent)]
    with inputs.bounded():
        for path in (pipe, device):
            for ask in asks.get(ending, [master.load]):
                with pytest.raises(SelflockError, match="a device or a pipe"):
                    ask(path)


def diagnosed(folder, **changes):
    """A diagnosis.json, two of whose models are open, with some of it changed."""
    model = {"label": "a", "values": {"load.mass": 2.0}, "free": {"load.mass": [1.0, 3.0]}}
    number = {"name": "n", "unit": "kg", "value": 1.0, "low": 0.5, "high": 2.0}
    about = {"recorded": "2026-01-01", "unit": "u", "rig": "r", "told_by": "name", "version": "1", "logs": []}
    told = {"verdict": "ambiguous", "causes": [], "sources": {"rig": "rig.toml", "logs": []}, "models": [model, model]}
    told |= {"about": about, "uncertain": [number]}
    for path, value in changes.items():
        *way, last = (int(word) if word.isdigit() else word for word in path.split("__"))
        place = told
        for word in way:
            place = place[word]
        place[last] = value
    (folder / "diagnosis.json").write_text(json.dumps(told))


@pytest.mark.parametrize(
    "change",
    [
        {"sources__rig": 5}, {"sources__logs": 5}, {"sources__logs": ["\0"]}, {"models": 5}, {"models__0": 5},
        {"models__0__free": []}, {"models__0__free__load.mass": {"a": 1, "b": 2}}, {"models__0__free__load.mass": [5, 1]},
        {"models__0__values__load.mass": None}, {"models__0__values__load.mass": 10**400}, {"models__0__values": {"load.mass": math.nan}},
    ],
)  # fmt: skip
def test_an_answer_that_no_diagnosis_gave_is_not_planned_from(tmp_path, change):
    diagnosed(tmp_path, **change)
    with pytest.raises(SelflockError, match="diagnosis.json"):
        plan(tmp_path, out=None)


@pytest.mark.parametrize("change", [{"uncertain__0__value": 10**400}, {"about__recorded": 5}, {"causes": [{"effect": []}]}])
def test_an_answer_that_no_diagnosis_gave_is_not_tracked(tmp_path, change):
    diagnosed(tmp_path)
    assert "1 diagnoses" in track(tmp_path, None).summary()
    diagnosed(tmp_path, **change)
    with pytest.raises(SelflockError, match="diagnosis.json"):
        track(tmp_path, None)
    (tmp_path / "diagnosis.json").write_text("[" * 100_000 + "]" * 100_000)
    with pytest.raises(SelflockError, match="diagnosis.json"):
        track(tmp_path, None)


def test_long_names_of_columns_take_no_longer_than_their_length(tmp_path):
    """By patterns that go back, 200 000 brackets were 1e10 steps, in C, where not even Ctrl-C is heard."""
    long = " [" * 100_000
    (tmp_path / "x.csv").write_text(f"time,a [m],b{long}\n0.0,1.0,2.0\n1.0,2.0,3.0\n")
    table, units = master.read(tmp_path / "x.csv")
    assert list(table) == ["time", "a", "b" + long] and units["a"] == "m"
    with inputs.bounded():
        view(tmp_path / "x.csv")
    with pytest.raises(SelflockError, match="a column's name has 200001 characters"):
        rig_init([tmp_path / "x.csv"], tmp_path / "rig.toml")


def test_a_pattern_of_stars(tmp_path):
    (tmp_path / "u").mkdir()
    (tmp_path / "u" / ("a" * 200 + ".csv")).write_text("")
    with pytest.raises(SelflockError, match="4 times at most"):
        logs_of(tmp_path, "{unit}/" + "*a" * 25 + "{date}.csv")


@pytest.mark.parametrize("key", ["components", "connections", "bonds", "faults", "drives", "values", "run", "system"])
def test_what_is_no_table_in_a_system(key):
    for value in (1.5, "x", ["x"]):
        with pytest.raises(DescriptionError, match=f"{key}.*table"):
            from_dict({key: value})
