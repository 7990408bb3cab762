"""A number is said once: shared values, what follows from them, and a ratio that contradicts a gear."""

import pytest

from selflock import master
from selflock.master import dump
from selflock.master.values import given, resolved

GAINS = {"a": {"part": "small_parts:Gain", "start": {"u": 1.0, "gain": "= ratio"}},
         "b": {"part": "small_parts:Gain", "start": {"shift": "= 2 * ratio + more"}}}  # fmt: skip


def made(values, components=GAINS, factor="= 1 / ratio"):
    data = {"values": values, "run": {"stop": 0.002}, "components": components}
    system = master.from_dict(data | {"connections": {"b.u": {"from": "a.y", "factor": factor}}})
    system.allow_code = True
    return system


def ends(system, **settings):
    table = master.run(system, settings).table
    return table["a.y"].iloc[-1], table["b.y"].iloc[-1]


def test_one_setting_reaches_every_place():
    system = made({"ratio": 50.0, "more": "= ratio / 10"})
    assert ends(system) == (50.0, 1.0 + 105.0)
    assert ends(system, ratio=80) == (80.0, 1.0 + 168.0)
    assert ends(system, ratio="80", more="1") == (80.0, 1.0 + 161.0)  # as --set gives it
    system.values["ratio"] = 20
    assert ends(system) == (20.0, 1.0 + 42.0)
    assert ends(system, **{"a.gain": 7.0}) == (7.0, 7.0 / 20.0 + 42.0)  # a component's own value goes over it
    assert system.components["a"].start["gain"] == "= ratio"  # a run changes nothing


def test_a_saved_system_keeps_its_values(tmp_path):
    system = made({"ratio": 50.0, "more": "= ratio / 10"})
    again = master.load(dump.save(system, tmp_path / "saved.toml"), allow_code=True)
    assert again.values == system.values and resolved(again).connections == resolved(system).connections
    assert ends(again, ratio=80) == ends(system, ratio=80)


def test_truths_follow_too():
    system = made({"mu": 0.02, "ratio": 50.0, "locked": "= mu * ratio >= 1"}, factor=1.0)
    system.components["b"].start = {"shift": "= 3 * ratio"}
    assert resolved(system).values == {} and given(system, {"mu": 0.01})[0].values["mu"] == 0.01
    from selflock.master.values import numbers

    assert numbers(system)["locked"] is True and numbers(given(system, {"mu": 0.01})[0])["locked"] is False


@pytest.mark.parametrize(
    "values, words",
    [
        ({"ratio": "fifty", "more": 0}, ["[values] ratio = 'fifty'", "a number is wanted"]),
        ({"my ratio": 50.0}, ["my ratio", "letters, digits and _"]),
        ({"ratio": 50.0, "more": "= ration"}, ["[values] more", "no value ration", "Did you mean ratio?"]),
        ({"more": "= ratio", "ratio": 50.0}, ["[values] more", "no value ratio above it"]),
        ({"ratio": 0.0, "more": 1.0}, ["[connections] b.u factor", "1 / ratio", "division by zero"]),
        ({"ratio": "= __import__('os').system('x')", "more": 1.0}, ["[values] ratio", "has no place there"]),
    ],
)
def test_what_is_wrong_with_a_value_is_told(refused, values, words):
    refused(lambda: master.run(made(values)), *words)


def test_true_is_no_factor(refused):
    refused(
        lambda: master.run(made({"locked": True}, {}, "= locked")), '[connections] b.u factor = "= locked"', "true, no number"
    )


def test_a_misspelt_setting_is_told_with_the_nearest_value(refused):
    system = made({"ratio": 50.0, "more": 1.0})
    refused(lambda: master.run(system, {"ration": 80}), "ration is no value", "Did you mean ratio?")
    refused(lambda: master.run(system, {"ratio": "eighty"}), "ratio = 'eighty' is no number")
    refused(lambda: master.run(system, {"ratio": True}), "ratio = true is no number")


DRIVE = {
    "values": {"ratio": 50.0},
    "run": {"stop": 0.002, "open_inputs": True},
    "components": {
        "gear": {"fmu": "selflock:Reducer", "start": {"gear_ratio": "= ratio"}},
        "controller": {"fmu": "selflock:Controller", "start": {"gear_ratio": "= ratio"}},
    },
    "connections": {
        "controller.angle": {"from": "gear.input_angle", "factor": "= 1 / ratio"},
        "controller.motor_speed": "gear.input_speed",
    },
}


def test_a_ratio_that_contradicts_the_gear_is_told_with_both_names():
    system = master.from_dict(DRIVE)
    assert not master.run(system).notes and not master.run(system, {"ratio": 80}).notes
    result = master.run(system, {"gear.gear_ratio": 80})
    factor, own = result.notes
    assert "controller.angle = 0.02 · gear.input_angle" in factor and "gear.gear_ratio is 80" in factor
    assert "controller.gear_ratio is 50" in own and "gear.gear_ratio, to which it is connected, is 80" in own
    assert factor in result.summary() and "[values]" in factor


def test_a_value_beyond_its_range_is_told_by_what_was_set(refused):
    beyond = "[components.gear.start] gear.gear_ratio = -1.0 is outside its range: it must be at least 1e-06"
    refused(lambda: master.run(master.from_dict(DRIVE), {"ratio": -1}), beyond, '. It is "= ratio" with ratio = -1.')
    plain = master.from_dict(DRIVE)
    plain.components["gear"].start["gear_ratio"] = "= -3"
    refused(lambda: master.run(plain), '. It is "= -3".')


def test_two_gears_in_a_row_are_no_contradiction():
    system = master.from_dict(
        {
            "run": {"stop": 0.002, "open_inputs": True},
            "components": {
                "first": {"fmu": "selflock:Reducer", "start": {"gear_ratio": 5.0}},
                "second": {"fmu": "selflock:Reducer", "start": {"gear_ratio": 50.0}},
            },
            "connections": {"first.output_angle": "second.input_angle", "first.output_speed": "second.input_speed"},
        }
    )
    assert not master.run(system).notes
