"""A study file: what it lays out, and what it is told where it is wrong."""

from pathlib import Path

import numpy as np
import pandas as pd
import pytest

from selflock.sweep import SweepError
from selflock.sweep.record import figure, figures
from selflock.sweep.study import from_dict, read

RECORD = {"y": {"final": "motor.current"}}


def study(**tables):
    return from_dict({"system": "system.toml", "record": RECORD, **tables}, Path("study.toml"))


def test_a_grid_is_every_combination():
    made = study(vary={"a": {"values": [1, 2]}, "b": {"grid": {"from": 0.1, "to": 10.0, "count": 3, "spacing": "log"}}})
    assert made.parameters["a"].tolist() == [1, 1, 1, 2, 2, 2]
    np.testing.assert_allclose(made.parameters["b"], [0.1, 1, 10] * 2)


def test_a_latin_hypercube_has_one_point_in_each_slice():
    vary = {"a": {"range": [0.0, 1.0]}, "b": {"range": [-5.0, 5.0]}}
    made = study(vary=vary, sample={"method": "lhs", "count": 20, "seed": 3}).parameters
    for name, low, width in (("a", 0.0, 1.0), ("b", -5.0, 10.0)):
        assert sorted(np.floor((made[name] - low) / width * 20)) == list(range(20))
    again = study(vary=vary, sample={"method": "lhs", "count": 20, "seed": 3}).parameters
    other = study(vary=vary, sample={"method": "lhs", "count": 20, "seed": 4}).parameters
    assert made.equals(again) and not made.equals(other)


def test_a_sobol_sequence_fills_dyadic_boxes_evenly():
    made = study(
        vary={"a": {"range": [0.0, 1.0]}, "b": {"range": [0.0, 1.0]}},
        sample={"method": "sobol", "count": 64, "seed": 1},
    ).parameters
    counts, _, _ = np.histogram2d(made["a"], made["b"], bins=4, range=[[0, 1], [0, 1]])
    assert (counts == 4).all()


def test_samples_are_taken_at_each_point_of_a_grid():
    made = study(vary={"a": {"values": [1, 2, 3]}, "b": {"range": [0.0, 1.0]}}, sample={"method": "lhs", "count": 5, "seed": 0})
    assert len(made.parameters) == 15


def test_a_list_is_taken_as_it_is():
    made = study(vary={"a": {"set": "motor.resistance"}, "b": {}}, list=[{"a": 1, "b": 5}, {"a": 3, "b": 4}])
    assert made.settings == [{"motor.resistance": 1.0}, {"motor.resistance": 3.0}]
    assert made.parameters["b"].tolist() == [5.0, 4.0]


def test_choices_bring_constants_and_expressions_make_settings_of_them():
    made = study(
        set={"motor": {"resistance": "= 2 * ohm", "voltage": 24}},
        vary={"kind": {"choices": {"small": {"ohm": 3.0}, "large": {"ohm": 0.5, "motor.inductance": 1e-4}}}},
    )
    assert made.settings[0] == {"motor.resistance": 6.0, "motor.voltage": 24.0}
    assert made.settings[1] == {"motor.resistance": 1.0, "motor.voltage": 24.0, "motor.inductance": 1e-4}
    assert made.parameters["kind"].tolist() == ["small", "large"]


ONE = {"a": {"values": [1.0]}}


@pytest.mark.parametrize(
    "tables, said",
    [
        ({"vary": {}}, "nothing varies"),
        ({"vary": ONE, "recrod": {}}, "recrod is unknown"),
        ({"vary": {"a": {"values": []}}}, "values is empty"),
        ({"vary": {"a": {"range": [2.0, 1.0]}}}, "range = .* is empty"),
        ({"vary": {"a": {"grid": {"from": 0, "to": 1, "count": 0}}}}, "the count is 1 to"),
        ({"vary": {"a": {"values": [1], "range": [0, 1]}}}, "only one of values, range"),
        ({"vary": {"a": {"set": "motor.resistance"}}}, "needs one of"),
        ({"vary": {"a b": {"values": [1]}}}, "letters, digits"),
        ({"vary": {"a": {"range": [0, 1]}}}, r"need a \[sample\]"),
        ({"vary": ONE, "sample": {"method": "lhs", "count": 3}}, "there is none"),
        ({"vary": ONE, "record": {}}, "nothing is kept"),
        ({"vary": ONE, "record": {"y": {"median": "motor.current"}}}, "one of final"),
        ({"vary": ONE, "record": {"y": {"max": "motor.current", "from": 3, "to": 2}}}, "is empty"),
        ({"vary": ONE, "record": {"y": {"max": "motor.current", "from": 3}}, "stop": 2.0}, "after the end"),
        ({"vary": ONE, "record": {"y": {"max": "motor.current", "to": 3}}, "stop": 2.0}, "ends at 3 s, after the end"),
        ({"vary": ONE, "record": {"y": {"value": "b + 1"}}}, "b is no varied parameter"),
        ({"vary": ONE, "record": {"a": {"max": "motor.current"}}}, "has this name already"),
        ({"vary": {"a": {}}, "list": [{"a": 1, "b": 2}]}, "for nothing else"),
    ],
)
def test_what_is_wrong_is_said(tables, said):
    with pytest.raises(SweepError, match=said):
        study(**tables)


def test_a_file_that_is_not_there_or_no_toml(tmp_path):
    with pytest.raises(SweepError, match="cannot be read"):
        read(tmp_path / "none.toml")
    (tmp_path / "bad.toml").write_text("vary = [")
    with pytest.raises(SweepError, match="not valid TOML"):
        read(tmp_path / "bad.toml")
    (tmp_path / "bad.toml").write_text("vary = " + "[" * 100_000)
    with pytest.raises(SweepError, match="nested too deep"):
        read(tmp_path / "bad.toml")


def test_figures_against_closed_forms():
    time = np.linspace(0.0, 2.0, 2001)
    table = pd.DataFrame({"time": time, "m.y": np.sin(np.pi * time), "m.z": -3.0 * time})
    wanted = {
        "final": {"final": "m.z"}, "first": {"first": "m.z + 1"}, "low": {"min": "m.z", "to": 1.0},
        "high": {"max": "abs(m.z)"},
        "work": {"integral": "(m.y > 0) * m.y"}, "mean": {"mean": "m.z", "from": 1.0, "to": 2.0}, "rms": {"rms": "m.y"},
        "scaled": {"max": "k * m.z * time", "from": 1.0, "to": 1.0}, "sum": {"value": "work + 2 * k"},
    }  # fmt: skip
    got = figures([figure(name, one) for name, one in wanted.items()], table, {"k": 10.0})
    expected = {
        "final": -6.0, "first": 1.0, "low": -3.0, "high": 6.0, "work": 2.0 / np.pi, "mean": -4.5, "rms": np.sqrt(0.5),
        "scaled": -30.0, "sum": 2.0 / np.pi + 20.0,
    }  # fmt: skip
    assert got == pytest.approx(expected, rel=2e-6)


def test_an_expression_that_is_none():
    table = pd.DataFrame({"time": [0.0], "m.y": [1.0]})
    for expression in ("m.y +", "__import__('os')", "m.y.__class__"):
        with pytest.raises(SweepError):
            figures([figure("f", {"max": expression})], table, {})


@pytest.mark.parametrize("told, words", [
    ({"frictoin": "a"}, "frictoin: no chart has this role"),
    ({"friction": "mu"}, "no parameter and no figure 'mu'"),
    ({"pareto": {"moving": "y", "torque": "y"}}, r"write pareto = \{ holding = ..., moving = ..., torque = ... \}"),
    ({"moving": "y"}, r"write moving = \{ figure = ... \}"),
    ({"margins": {"by": ["a"], "figures": ["z"]}}, "no parameter and no figure 'z'"),
    ({"hold_times": [-1]}, r"write times in s"),
])  # fmt: skip
def test_a_role_that_no_chart_can_draw_is_told_before_the_runs(told, words):
    vary = {"a": {"values": [1, 2], "set": "motor.resistance"}}
    with pytest.raises(SweepError, match=words):
        study(vary=vary, report=told)
    roles = {
        "friction": "a",
        "ratio": 50,
        "hold_times": [0, 1.5],
        "moving": {"figure": "y", "time": 2.0},
        "holding": {"figure": "y"},
    }
    assert study(vary=vary, report=roles | {"margins": {"by": ["a"], "figures": ["y"]}}).report["ratio"] == 50
