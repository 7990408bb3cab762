"""Rigs and logs: what is read, and one message for each thing that is wrong."""

import numpy as np
import pandas as pd
import pytest
import scipy.io

import diagnosis
from diagnosis import rig as rigs
from diagnosis.laws import check_names
from diagnosis.log import read

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


def test_units_in_headers_and_runs_in_a_column(tmp_path):
    rig = rigs.load(write(tmp_path, 'run = "run"', ""))
    data = table().rename(columns={"m": "m [mN.m]"}).assign(run=["a"] * 60 + ["b"] * 40)
    data.to_csv(tmp_path / "log.csv", index=False)
    first, second = read(tmp_path / "log.csv", rig)
    assert (first.name, len(first), second.name, len(second)) == ("a", 60, "b", 40)
    assert first.signals["motor.torque"][0] == pytest.approx(6e-3)


@pytest.mark.parametrize(("change", "says"), [
    ({"unit": "kg"}, "cannot be 'N.m'"), ({"unit": "furlong"}, "motor.torque"), ({"parameter": "reducer.frction_kinetic"}, "friction_kinetic"),
    ({"parameter": "reducr.friction_kinetic"}, "reducer"), ({"head": 'colour = "red"'}, "colour"),
])
def test_a_wrong_rig_is_told_in_one_message(tmp_path, change, says):
    with pytest.raises(diagnosis.DataError, match=says) as caught:
        check_names(rigs.load(write(tmp_path, **change)))
    assert "rig.toml" in str(caught.value)


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


@pytest.mark.parametrize(("how", "says"), [
    ("column", "no column 'm'"), ("text", "line 8.*'5,3' is not a number"), ("backward", "line 52: time runs backward"), ("short", "too few"),
    ("ragged", "damaged"), ("empty", "empty"), ("header", "empty"),
])
def test_a_bad_log_is_told_in_one_message(tmp_path, how, says):
    rig = rigs.load(write(tmp_path))
    (tmp_path / "log.csv").write_text(_spoil(table(), how))
    with pytest.raises(diagnosis.DataError, match=says) as caught:
        read(tmp_path / "log.csv", rig)
    assert "log.csv" in str(caught.value)


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
