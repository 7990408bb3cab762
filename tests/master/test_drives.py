"""A drive as a unit of the system file is the same as its parts wired by hand."""

import pytest

from selflock import master
from selflock.master.errors import DescriptionError
from selflock.master.system import Connection, from_dict
from selflock.master.values import resolved


def file(**drive):
    """A system whose drive "lift" moves a weight."""
    return {
        "components": {"moves": {"manoeuvre": "moves.csv"}, "weight": {"fmu": "selflock:Load"}},
        "drives": {"lift": {"ratio": 50.0, "load": "weight"} | drive},
    }


def test_a_drive_becomes_its_parts_before_what_it_drives():
    system = from_dict(
        file(controller={"angle_gain": 100.0}, setpoint="moves", motor={"resistance": 0.3}, reducer={"friction_static": 0.02})
    )
    assert list(system.components) == ["moves", "lift_controller", "lift_motor", "lift_reducer", "weight"]
    assert system.components["lift_controller"].start == {
        "gear_ratio": 50.0, "angle_gain": 100.0, "friction_static": 0.02, "resistance": 0.3,
    }  # fmt: skip
    assert system.components["lift_reducer"].start["gear_ratio"] == 50.0
    assert system.connections == {
        "lift_controller.angle_setpoint": Connection("moves.angle"),
        "lift_controller.speed_setpoint": Connection("moves.speed"),
        "lift_controller.angle": Connection("lift_reducer.input_angle", 1 / 50),
        "lift_controller.speed": Connection("lift_reducer.input_speed", 1 / 50),
        "lift_controller.motor_speed": Connection("lift_reducer.input_speed"),
        "lift_controller.output_torque": Connection("lift_reducer.output_torque"),
        "lift_motor.voltage": Connection("lift_controller.voltage"),
        "lift_motor.speed": Connection("lift_reducer.input_speed"),
        "lift_reducer.motor_torque": Connection("lift_motor.torque"),
        "lift_reducer.output_angle": Connection("weight.angle"),
        "lift_reducer.output_speed": Connection("weight.speed"),
        "weight.torque": Connection("lift_reducer.output_torque"),
    }


def test_the_ratio_is_said_once_and_set_once():
    told = file(ratio="= ratio", controller={}, setpoint="moves")
    system = from_dict(told | {"values": {"ratio": 50.0}})
    system.values["ratio"] = 80.0
    found = resolved(system)
    assert {found.components[f"lift_{part}"].start["gear_ratio"] for part in ("controller", "reducer")} == {80.0}
    assert found.connections["lift_controller.angle"].factor == 1 / 80


def test_a_drive_is_like_another_but_for_what_it_says(tmp_path):
    told = file(motor={"resistance": 0.3, "inductance": 1e-3, "step": 1e-4})
    told["components"] = {"weight": {"fmu": "selflock:Load"}, "arm": {"fmu": "selflock:Load"}}
    told["drives"]["swing"] = {
        "like": "lift",
        "load": {"angle": "arm.angle", "speed": "arm.speed", "torque": "arm.torque"},
        "motor": {"resistance": 0.5},
    }
    system = from_dict(told)
    motor = system.components["swing_motor"]
    assert motor.step == 1e-4 and motor.start == {"resistance": 0.5, "inductance": 1e-3}
    assert system.connections["arm.torque"].source == "swing_reducer.output_torque"
    again = master.load(system.save(tmp_path / "plain.toml"))
    assert again.components == system.components and again.connections == system.connections and not again.drives


@pytest.mark.parametrize("side, value, factor", [("motor", "lift_reducer.input_angle", 1 / 50), ("load", "weight.angle", 1.0)])
def test_a_sensor_is_what_the_controller_sees(side, value, factor):
    system = from_dict(file(controller={}, setpoint="moves", sensor={"at": side, "resolution": 1e-3}))
    assert system.components["lift_sensor"].start == {"resolution": 1e-3}
    assert system.connections["lift_sensor.value"] == Connection(value)
    assert system.connections["lift_controller.angle"] == Connection("lift_sensor.reading", factor)


@pytest.mark.parametrize(
    "drive, words",
    [
        ({"ratoi": 3}, "has no key ratoi. Did you mean ratio"),
        ({"ratio": None}, "the gear's ratio is wanted here"),
        ({"ratio": -2.0}, "the gear's ratio is wanted here"),
        ({"ratio": "50"}, "the gear's ratio is wanted here"),
        ({"reducer": {"gear_ratio": 60.0}}, "the ratio is said once"),
        ({"setpoint": "moves"}, "there is no controller for it"),
        ({"sensor": {}}, "there is no controller for it"),
        ({"controller": {}}, "say what its controller follows"),
        ({"controller": {}, "setpoint": {"angle": "moves.angle"}}, "or each of them"),
        ({"controller": {}, "setpoint": "moves", "sensor": {"at": "gear"}}, "an encoder on its shaft"),
        ({"motor": 3.0}, "should be a table of start values"),
        ({"load": 3.0}, "or the begin of its variables"),
        ({"like": "lfit"}, "there is no such drive"),
        ({"like": "lift"}, "there is no such drive"),
        ({"motor": {"step": "fast"}}, "a number is wanted here"),
    ],
)
def test_slips_are_told(drive, words):
    with pytest.raises(DescriptionError, match=words):
        from_dict(file(**drive))


def test_what_is_there_already_is_told():
    told = file()
    told["components"]["lift_motor"] = {"fmu": "selflock:Motor"}
    with pytest.raises(DescriptionError, match="lift_motor, which is there already"):
        from_dict(told)
    told = file() | {"connections": {"lift_motor.speed": "weight.speed"}}
    with pytest.raises(DescriptionError, match=r"connects lift_motor.speed, and \[connections\] does, too"):
        from_dict(told)


@pytest.mark.slow
def test_it_runs_and_goes_into_an_ssp(tmp_path):
    from selflock.master.ssp import export

    told = file(motor={"voltage": 12.0}) | {"run": {"stop": 0.05}}
    del told["components"]["moves"]
    system = from_dict(told)
    result = master.run(system)
    assert result.table["weight.angle"].iloc[-1] != 0.0
    again = master.run(export(system, tmp_path / "lift.ssp"))
    assert (again.table["weight.angle"] == result.table["weight.angle"]).all()
