"""Rigs and logs: what is read, and one message for each thing that is wrong."""

from dataclasses import replace

import numpy as np
import pandas as pd
import pytest
import scipy.io

from selflock import diagnosis
from selflock.diagnosis.data import rig as rigs
from selflock.diagnosis.data.log import read
from selflock.diagnosis.pipeline.hold_out import split
from selflock.diagnosis.pipeline.run import gather
from selflock.diagnosis.residuals.drive_experiment import DriveExperiment
from selflock.diagnosis.residuals.laws import check_names

RIG = """
[rig]
kind = "inverse"
{head}
[columns]
"reducer.input_speed" = {{ column = "n", unit = "rpm", factor = -1.0 }}
"motor.torque" = {{ column = "m", unit = "{unit}" }}
[parameters]
"{parameter}" = 0.02
"""


def write(folder, head="", unit="mN.m", parameter="reducer.friction_kinetic"):
    path = folder / "rig.toml"
    path.write_text(RIG.format(head=head, unit=unit, parameter=parameter))
    return path


def table(n=100):
    t = np.arange(n) * 0.01
    return pd.DataFrame({"time": t, "n": 60.0 * np.sin(t), "m": 5.0 + np.cos(t)})


@pytest.mark.alike
@pytest.mark.parametrize("ending", ["csv", "parquet", "mat"])
def test_all_formats_give_the_same_si_signals(tmp_path, ending):
    rig, data = rigs.load(write(tmp_path)), table()
    path = tmp_path / f"log.{ending}"
    if ending == "csv":
        data.to_csv(path, index=False)
    elif ending == "parquet":
        data.to_parquet(path)
    else:
        scipy.io.savemat(path, {k: v.to_numpy()[:, None] for k, v in data.items()})
    (run,) = read(path, rig)
    np.testing.assert_allclose(run.signals["reducer.input_speed"], -data.n * 2 * np.pi / 60, rtol=1e-12)
    np.testing.assert_allclose(run.signals["motor.torque"], data.m * 1e-3, rtol=1e-12)


@pytest.mark.parametrize("began", ["load.angle", "controller.angle_setpoint"])
@pytest.mark.parametrize("behind", [3.0, 300.0])
def test_an_angle_that_begins_anew_is_in_the_turn_of_its_set_point(began, behind, tmp_path):
    """A log that is begun elsewhere than in the first turn: its drive would seem whole turns away from where it is asked to be.

    Most of a turn behind it, as its voltage tells.
    """
    t = np.arange(200) * 0.01
    wanted = np.degrees(-15.0 + 8.0 * np.sin(2.0 * t))
    turned = wanted - behind
    column = {"load.angle": "turned", "controller.angle_setpoint": "wanted"}
    rows = {"time": t, "turned": turned, "wanted": wanted, "u": np.full(len(t), -2.0 * np.radians(behind))}
    rows[column[began]] = np.mod(rows[column[began]], 360.0)
    wraps = lambda signal: ", wraps = 360.0" if signal == began else ""
    columns = [
        f'"{signal}" = {{ column = "{name}", unit = "deg", factor = -1.0{wraps(signal)} }}' for signal, name in column.items()
    ]
    columns += ['"controller.voltage" = "u"', "[parameters]", '"controller.angle_gain" = 2.0']
    (tmp_path / "rig.toml").write_text("\n".join(['[rig]\nkind = "forward"\n[columns]', *columns, ""]))
    pd.DataFrame(rows).to_csv(tmp_path / "log.csv", index=False)
    (run,) = read(tmp_path / "log.csv", rigs.load(tmp_path / "rig.toml"))
    off = run.signals["controller.angle_setpoint"] - run.signals["load.angle"]
    np.testing.assert_allclose(off, -np.radians(wanted - turned), atol=1e-9)


SETPOINT = '"controller.speed_setpoint" = { value = 30.0, unit = "deg/s" }'


def test_a_set_point_may_be_one_number(tmp_path):
    text = write(tmp_path).read_text()
    (tmp_path / "rig.toml").write_text(text.replace("[parameters]", f"{SETPOINT}\n[parameters]"))
    table().to_csv(tmp_path / "log.csv", index=False)
    (run,) = read(tmp_path / "log.csv", rigs.load(tmp_path / "rig.toml"))
    np.testing.assert_allclose(run.signals["controller.speed_setpoint"], np.radians(30.0), rtol=1e-12)


@pytest.mark.parametrize(
    "entry, says",
    [
        (SETPOINT.replace("controller.speed_setpoint", "motor.current"), "is for what is asked for alone"),
        (SETPOINT.replace("unit", "factor = 2.0, unit"), "leave out factor"),
        (SETPOINT.replace("30.0", '"x"'), "value"),
        (SETPOINT.replace("deg/s", "N.m"), "cannot be 'rad/s'"),
    ],
)
def test_what_is_measured_is_no_number(tmp_path, entry, says):
    text = write(tmp_path).read_text()
    (tmp_path / "rig.toml").write_text(text.replace("[parameters]", f"{entry}\n[parameters]"))
    with pytest.raises(diagnosis.DataError, match=says):
        rigs.load(tmp_path / "rig.toml")


def test_units_in_headers_and_runs_in_a_column(tmp_path):
    rig = rigs.load(write(tmp_path, 'run = "run"', ""))
    data = table().rename(columns={"m": "m [mN.m]"}).assign(run=["a"] * 60 + ["b"] * 40)
    data.to_csv(tmp_path / "log.csv", index=False)
    first, second = read(tmp_path / "log.csv", rig)
    assert (first.name, len(first), second.name, len(second)) == ("a", 60, "b", 40)
    assert first.signals["motor.torque"][0] == pytest.approx(6e-3)


@pytest.mark.parametrize(
    ("change", "says"),
    [
        ({"unit": "count"}, "'count' is not known"),
        ({"head": 'known = "load.*"'}, "known = 'load.\\*' is not a list"),
        ({"head": 'known = ["reducer.gear_ration"]'}, "gear_ratio"),
        ({"head": 'hold_out = "every 2nd run"'}, "every second run"),
        ({"head": 'simulate = "close"'}, "'open' or 'closed'"),
        ({"head": 'linear = "false"'}, "not true or false"),
        ({"head": 'effects = "a\\nerror: b"'}, r"effects 'a\\nerror: b': a name has no line breaks"),
        ({"head": 'drives = ["front_", "a\\tb"]'}, r"drives 'a\\tb': a name has no line breaks, tabs"),
        ({"head": '[uncertain]\n"reducer.\\ndrag_torque" = [0.0, 1.0]'}, r"'reducer.\\ndrag_torque': a name has no line"),
        ({"head": 'smoothing = "0.04 s"'}, "not a number"),
        ({"head": '[time]\nunits = "ms"'}, "unknown key of .time. 'units'"),
        ({"head": '[logs."a*"]\n"reducer.frction_kinetic" = 1.0'}, "friction_kinetic"),
        ({"head": "[logs]\na = 3"}, 'write .logs."a".'),
        ({"head": '[uncertain]\n"reducer.drag_torque" = [-2.0, -1.0]'}, "outside the range of drag_torque, .0, inf. N.m"),
        ({"head": '[uncertain]\n"reducer.drag_torque" = [0.0, inf]'}, "inf is not a number"),
        ({"head": '[uncertain]\n"sensor.motor.torqe.bias" = [0.0, 1.0]'}, "motor.torque"),
        ({"head": '[uncertain]\n"sensor.motor.torque.bais" = [0.0, 1.0]'}, "bias"),
        ({"parameter": "sensor.motor.torque.bias"}, "belongs in .columns."),
        ({"head": 'drives = ["front_"]'}, "no such component. The drives are front_"),
        ({"unit": "kg"}, "cannot be 'N.m'"),
        ({"unit": "furlong"}, "motor.torque"),
        ({"parameter": "reducer.frction_kinetic"}, "friction_kinetic"),
        ({"parameter": "reducr.friction_kinetic"}, "reducer"),
        ({"head": 'colour = "red"'}, "colour"),
    ],
)
def test_a_wrong_rig_is_told_in_one_message(tmp_path, change, says):
    with pytest.raises(diagnosis.DataError, match=says) as caught:
        check_names(rigs.load(write(tmp_path, **change)))
    assert "rig.toml" in str(caught.value)


@pytest.mark.parametrize(
    ("parameter", "value", "says"),
    [
        ("reducer.wedge_angle", "2.8625", r"2.8625 rad is outside the range of wedge_angle, \[0, 1.5\] rad"),
        ("motor.resistance", "-0.3", "outside the range"),
        ("load.inertia", "nan", "nan is not a number"),
        ("load.inertia", '"1"', "'1' is not a number"),
        ("motor.resistance.x", "1.0", "no 'resistance.x'"),
        ("motor.resistance", "true", "= true: resistance is a number in Ohm"),
        ("reducer.friction_kinetic", "false", "= false: friction_kinetic is a number"),
    ],
)
def test_a_value_that_its_fmu_would_refuse_is_told_before_the_work(tmp_path, parameter, value, says):
    path = write(tmp_path, parameter=parameter)
    path.write_text(path.read_text().replace("= 0.02", f"= {value}"))
    with pytest.raises(diagnosis.DataError, match=says) as caught:
        check_names(rigs.load(path))
    assert parameter in str(caught.value)


@pytest.mark.parametrize(
    ("columns", "says"),
    [
        ('"load.angle" = 3', "say which column"),
        ('load.speed = "n"', "stands in quotes"),
        ('"laod.angle" = "n"', "Did you mean 'load.angle'"),
        ('"Load.speed" = "n"', "Did you mean 'load.speed'"),
        ('"load.angle" = { column = "n", factor = "1/50" }', "factor = '1/50' is not a number"),
        ('"load.speed" = { column = "n", unit = "Hz" }', "names no angle"),
        ('"load.speed" = { column = "n", unit = "1/min" }', "rpm"),
    ],
)
def test_a_wrong_column_is_told(tmp_path, columns, says):
    path = write(tmp_path)
    path.write_text(path.read_text().replace("[columns]", "[columns]\n" + columns))
    with pytest.raises(diagnosis.DataError, match=says):
        rigs.load(path)


def _spoil(data: pd.DataFrame, how: str) -> str:
    if how == "column":
        return data.drop(columns="m").to_csv(index=False)
    if how == "text":
        return data.astype(object).assign(m=lambda d: d.m.where(d.index != 6, "5,3")).to_csv(index=False)
    if how == "backward":
        return data.iloc[[*range(50), *range(40, 100)]].to_csv(index=False)
    if how == "short":
        return data.head(7).to_csv(index=False)
    if how == "ragged":
        return data.to_csv(index=False) + "1,2,3,4,5\n"
    return "" if how == "empty" else "time,n,m\n"


@pytest.mark.parametrize(
    ("how", "says"),
    [
        ("column", "no column 'm'"),
        ("text", "line 8.*'5,3' is not a number"),
        ("backward", "line 52: time runs backward"),
        ("short", "too few"),
        ("ragged", "damaged"),
        ("empty", "empty"),
        ("header", "empty"),
    ],
)
def test_a_bad_log_is_told_in_one_message(tmp_path, how, says):
    rig = rigs.load(write(tmp_path))
    (tmp_path / "log.csv").write_text(_spoil(table(), how))
    with pytest.raises(diagnosis.DataError, match=says) as caught:
        read(tmp_path / "log.csv", rig)
    assert "log.csv" in str(caught.value)


def test_the_same_numbers_however_they_are_written(tmp_path):
    """Semicolons and decimal commas, tabs, units in parentheses, a byte order mark, time as an index or as a clock's."""
    rig, data = rigs.load(write(tmp_path, unit="")), table()
    named = data.rename(columns={"m": "m (mN.m)"})
    named.to_csv(tmp_path / "comma.csv", index=False)
    named.to_csv(tmp_path / "semicolon.csv", index=False, sep=";", decimal=",")
    named.to_csv(tmp_path / "tab.csv", index=False, sep="\t", encoding="utf-8-sig")
    named.set_index("time").to_parquet(tmp_path / "index.parquet")
    named.assign(time=pd.Timestamp("2026-01-01") + pd.to_timedelta(named.time, "s")).to_parquet(tmp_path / "clock.parquet")
    for name in ("comma.csv", "semicolon.csv", "tab.csv", "index.parquet", "clock.parquet"):
        (run,) = read(tmp_path / name, rig)
        np.testing.assert_allclose(run.time, data.time, atol=1e-9, err_msg=name)
        np.testing.assert_allclose(run.signals["motor.torque"], data.m * 1e-3, rtol=1e-9, err_msg=name)


def _written(data: pd.DataFrame, how: str, path):
    if how == "trailing":
        path.write_text("\n".join(line + ",7" * (i > 0) for i, line in enumerate(data.to_csv(index=False).splitlines())) + "\n")
    elif how == "binary":
        path.write_bytes(data.to_csv(index=False).encode() + bytes(8))
    elif how == "coarse":
        data.assign(time=data.time.round(1)).to_csv(path, index=False)
    elif how == "twice":
        data.assign(**{"m [N.m]": data.m}).rename(columns={"m": "m [mN.m]"}).to_csv(path, index=False)
    elif how == "contradicts":
        data.rename(columns={"m": "m [N.m]"}).to_csv(path, index=False)
    elif how == "short.mat":
        scipy.io.savemat(path, {"time": data.time.to_numpy(), "n": data.n.to_numpy(), "m": data.m.to_numpy()[:-1]})
    elif how == "struct.mat":
        scipy.io.savemat(path, {"s": np.array([[{"a": 1}]], object)})


@pytest.mark.parametrize(
    ("how", "says"),
    [
        ("trailing", "more values than the header has names"),
        ("binary", "not a text file"),
        ("coarse", "different times in 100 rows. Export it with more digits"),
        ("twice", "'m .mN.m.' and 'm .N.m.' are both 'm'"),
        ("contradicts", "contradicts the unit 'mN.m'"),
        ("short.mat", "'m' has 99 samples where others have 100"),
        ("struct.mat", "holds s"),
    ],
)
def test_an_export_that_would_be_misread_is_told(tmp_path, how, says):
    rig = rigs.load(write(tmp_path))
    path = tmp_path / (how if "." in how else "log.csv")
    _written(table(), how, path)
    with pytest.raises(diagnosis.DataError, match=says) as caught:
        read(path, rig)
    assert path.name in str(caught.value)


@pytest.mark.in_turn
def test_what_teaches_does_not_judge(tmp_path):
    rig, path = write(tmp_path), tmp_path / "log.csv"
    table(2000).to_csv(path, index=False)
    with pytest.raises(diagnosis.DataError, match="given twice"):
        diagnosis.diagnose(rig, [path], test=[tmp_path / ".." / tmp_path.name / "log.csv"], out=None)
    with pytest.raises(diagnosis.DataError, match="needs two runs"):
        diagnosis.diagnose(write(tmp_path, 'hold_out = "every second run"'), [path], out=None)


def test_a_log_at_rest_carries_no_diagnosis(tmp_path, rng):
    still = pd.DataFrame(
        {"time": np.arange(3000) * 1e-3, "n": 0.1 * rng.standard_normal(3000), "m": 20.0 + rng.standard_normal(3000)}
    )
    still.to_csv(tmp_path / "rest.csv", index=False)
    moving = table(3000).assign(n=lambda d: 60.0 * np.sin(5.0 * d.time), m=lambda d: 5.0 + rng.standard_normal(3000))
    moving.to_csv(tmp_path / "moving.csv", index=False)
    for logs, test in ((["rest.csv"], []), (["moving.csv"], ["rest.csv"])):
        with pytest.raises(diagnosis.DataError, match="rest.csv: .*record a motion"):
            diagnosis.diagnose(
                write(tmp_path), [tmp_path / name for name in logs], test=[tmp_path / name for name in test], out=None
            )


def test_logs_of_named_columns_must_be_alike(tmp_path):
    (tmp_path / "rig.toml").write_text('[rig]\nkind = "inverse"\nnamed = true\n')
    data = table(1000).rename(columns={"n": "reducer.input_speed", "m": "motor.torque"})
    data.to_csv(tmp_path / "a.csv", index=False)
    data.drop(columns="motor.torque").to_csv(tmp_path / "b.csv", index=False)
    with pytest.raises(diagnosis.DataError, match="b.csv: there is no column 'motor.torque', which a.csv has"):
        diagnosis.diagnose(tmp_path / "rig.toml", [tmp_path / "a.csv", tmp_path / "b.csv"], out=None)


@pytest.mark.parametrize(
    "wrong, right",
    [
        ("reducer.input_sped", "reducer.input_speed"),
        ("Motor.Torqe [N.m]", "motor.torque"),
        ("motor.sped [rpm]", "reducer.input_speed"),
    ],
)
def test_a_misspelt_name_is_not_left_out_without_a_word(tmp_path, wrong, right):
    (tmp_path / "rig.toml").write_text('[rig]\nkind = "inverse"\nnamed = true\n')
    data = table(1000).rename(columns={"n": "reducer.input_speed", "m": "motor.torque"}).rename(columns={right: wrong})
    data.to_csv(tmp_path / "a.csv", index=False)
    name = wrong.partition(" ")[0]
    with pytest.raises(diagnosis.DataError, match=f"a.csv: column '{name}' is no variable of the drive. Did you mean '{right}'"):
        gather(rigs.load(tmp_path / "rig.toml"), [tmp_path / "a.csv"], [])


@pytest.mark.parametrize("drives", ['["arm_"]', '["arm_", "leg_"]'])
def test_a_misspelt_name_is_told_with_the_prefix_of_its_drive(tmp_path, drives):
    (tmp_path / "rig.toml").write_text(f'[rig]\nkind = "inverse"\nnamed = true\ndrives = {drives}\n')
    data = table(1000).rename(columns={"n": "arm_reducer.input_sped [rad/s]", "m": "arm_motor.torque"})
    data.to_csv(tmp_path / "a.csv", index=False)
    with pytest.raises(
        diagnosis.DataError, match=r"Did you mean 'arm_reducer.input_speed'\? If it is another quantity, give it another name\.$"
    ):
        gather(rigs.load(tmp_path / "rig.toml"), [tmp_path / "a.csv"], [])


def test_what_a_run_tells_beside_its_signals_is_no_slip(tmp_path):
    """Of another unit it is another quantity, and beside what it is like it is not that."""
    (tmp_path / "rig.toml").write_text('[rig]\nkind = "inverse"\nnamed = true\n')
    data = table(1000).rename(columns={"n": "reducer.input_speed", "m": "motor.torque"})
    more = {"reducer.output_power [W]": 0.0, "motor.torques": 0.0, "reducer.friction_torque": 0.0, "gear.tooth": 1.0}
    data.assign(**more).to_csv(tmp_path / "a.csv", index=False)
    runs, _, _ = gather(rigs.load(tmp_path / "rig.toml"), [tmp_path / "a.csv"], [])
    assert set(runs[0].signals) == {"reducer.input_speed", "motor.torque"}


def test_samples_that_do_not_count_are_no_fault(tmp_path):
    data = table(3000).assign(n=lambda d: 60.0 * np.sin(5.0 * d.time), on=lambda d: (d.index % 1000 < 300).astype(int))
    data.to_csv(tmp_path / "log.csv", index=False)
    rig = rigs.load(write(tmp_path, 'valid = "on"'))
    runs, faults, _ = gather(rig, [tmp_path / "log.csv"], [])
    assert faults == [] and runs[0].usable("motor.torque").sum() == 900


@pytest.mark.parametrize("files", [1, 3])
def test_steady_rows_of_all_logs_are_points_and_a_single_run_is_one(tmp_path, files, rng):
    rig = rigs.load(write(tmp_path, unit="").parent / "rig.toml")
    rig = replace(rig, kind="steady")
    speeds = np.concatenate([np.linspace(-90.0, -10.0, 20), np.linspace(10.0, 90.0, 20)])
    paths = [tmp_path / f"{i}.csv" for i in range(files)]
    for path in paths:
        pd.DataFrame({"n": speeds, "m": rng.normal(5.0, 1.0, 40), "run": 1}).to_csv(path, index=False)
    runs, _, _ = gather(rig, paths, [])
    bench = DriveExperiment(rig, runs)
    assert bench.layout.count == 40 * files and (np.bincount(bench.layout.owner) == 40).all()
    with_runs = replace(rig, run="run")
    one = DriveExperiment(with_runs, gather(with_runs, paths[:1], [])[0])
    assert one.layout.count == 1 and one.runs[0].signals["motor.torque"] == pytest.approx(
        one.original[0].signals["motor.torque"].mean()
    )
    with pytest.raises(diagnosis.DataError, match="1 blocks to learn from"):
        split(one, one.original, [False])


def test_a_constant_channel_carries_no_diagnosis(tmp_path):
    table().assign(m=3.0).to_csv(tmp_path / "log.csv", index=False)
    with pytest.raises(diagnosis.DataError, match="column 'm'.*never changes"):
        diagnosis.diagnose(write(tmp_path), [tmp_path / "log.csv"], out=None)


def test_known_names_and_patterns_are_not_questioned(tmp_path):
    rig = rigs.load(write(tmp_path, 'known = ["load.*", "reducer.gear_ratio"]'))
    assert not rig.questioned("load.mass") and not rig.questioned("reducer.gear_ratio") and rig.questioned("reducer.preload")


def test_parameters_of_one_log(tmp_path):
    path = write(tmp_path)
    path.write_text(path.read_text() + '[logs."kp100*"]\n"controller.angle_gain" = 0.3\n')
    rig = rigs.load(path)
    assert rig.of_log("kp100_sin.csv") == {"controller.angle_gain": 0.3} and rig.of_log("kp200_sin.csv") == {}


def test_what_a_controller_is_told_of_its_drive_is_said_once(tmp_path):
    """Its ratio, and what of motor and gear it holds a load by, are the drive's, unless the rig says them of it."""
    drive = {"reducer.gear_ratio": 60.0, "reducer.wedge_angle": 0.05, "motor.resistance": 1.5, "motor.torque_constant": 0.04}
    given = drive | {"controller.angle_gain": 100.0, "controller.resistance": 1.2}
    path = tmp_path / "rig.toml"
    text = lambda values: "".join(f'"{name}" = {value}\n' for name, value in values.items())
    head = '[rig]\nkind = "forward"\n[columns]\n"motor.voltage" = "u"\n[parameters]\n'
    path.write_text(head + text(given))
    told = {"controller.gear_ratio": 60.0, "controller.wedge_angle": 0.05, "controller.torque_constant": 0.04}
    assert rigs.load(path).parameters == given | told
    path.write_text(head + text(drive))
    assert rigs.load(path).parameters == drive


@pytest.mark.parametrize(("more", "says"), [
    ('"motor.resistance" = 2,3', "line 7, .*: write a decimal point"),
    ('"motor.resistance" = 2.2', "line 7, .*: it stands there a second time"),
    ("[rig.more]\nname = “axis”", "line 8, .*: write straight quotes"),
    ("[rig.more]\nname = axis", "line 8, .*: text stands in quotes"),
])  # fmt: skip
def test_what_is_no_toml_is_told_by_what_people_write(tmp_path, more, says):
    head = '[rig]\nkind = "forward"\n[columns]\n"motor.voltage" = "u"\n[parameters]\n"motor.resistance" = 2.0\n'
    if "2,3" in more:
        head = head.replace('"motor.resistance"', '"motor.inductance"')
    (tmp_path / "rig.toml").write_text(head + more + "\n", encoding="utf-8")
    with pytest.raises(diagnosis.DataError, match=says):
        rigs.load(tmp_path / "rig.toml")


def test_one_column_is_not_two_quantities(tmp_path):
    (tmp_path / "rig.toml").write_text(
        '[rig]\nkind = "forward"\n[columns]\n"motor.voltage" = "u"\n"controller.voltage" = "u"\n"motor.current" = "u"\n'
    )
    with pytest.raises(diagnosis.DataError, match=r"'u' cannot be both motor.voltage \(V\) and motor.current \(A\)"):
        rigs.load(tmp_path / "rig.toml")
