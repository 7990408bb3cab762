"""A manoeuvre as a table or as turns: the study's own is written as both, and comes out the same."""

import math

import numpy as np
import pytest

from selflock import master
from selflock.master import dump
from selflock.master.face import Part
from selflock.master.manoeuvre import Manoeuvre
from selflock.study.turns import Parameters, setpoints

CSV = """time, ramp, rear_angle [deg], front_angle [deg]
0, 0, 0, 0
2, 0, 0, 0
4, 0.1, 180, 0
6, 0, 180, 0
8, 0.1, 230, -50
"""
TOML = """
[rear_angle]
unit = "deg"
ramp = 0.1
turns = [{ from = 2.0, until = 4.0, to = 180.0 }, { from = 6.0, until = 8.0, to = 230.0 }]
[front_angle]
unit = "deg"
turns = [{ from = 6.0, until = 8.0, to = -50.0, ramp = 0.1 }]
"""
FILES = {"moves.csv": CSV, "moves.toml": TOML}


def part(folder, name, text):
    (folder / name).write_text(text)
    return Manoeuvre("m", folder / name)


def at(made, time):
    made.bind([], list(made.variables))
    made.at(time)
    return dict(zip(made.variables, made.y))


def test_columns_may_be_called_as_a_result_has_them(tmp_path):
    """So a planned run is given back to the simulation that it was planned for; another component's column is none of its own."""
    made = part(tmp_path, "moves.csv", "time [s],m.angle [deg],m.angle_speed [deg/s]\n0,0,0\n2,90,0\n")
    assert at(made, 1.0) == {"angle": 45.0, "angle_speed": 0.0}
    with pytest.raises(master.DescriptionError, match="'m.angle' is no name"):
        part(tmp_path, "both.csv", "time,angle [deg],m.angle [deg]\n0,0,0\n")
    with pytest.raises(master.DescriptionError, match="'other.angle' is no name"):
        part(tmp_path, "other.csv", "time,other.angle [deg]\n0,0\n")


@pytest.mark.parametrize("name", FILES)
def test_the_studys_manoeuvre_is_written_by_anybody(name, tmp_path):
    made = part(tmp_path, name, FILES[name])
    assert made.variables["rear_speed"].unit == "deg/s" and made.variables["rear_speed"].derivative_of == "rear_angle"
    for time in np.linspace(0.0, 10.0, 501):
        found, wanted = at(made, time), setpoints(Parameters(), time)
        for end in ("front", "rear"):
            assert math.radians(found[f"{end}_angle"]) == pytest.approx(getattr(wanted, f"{end}_angle"), abs=1e-12)
            assert math.radians(found[f"{end}_speed"]) == pytest.approx(getattr(wanted, f"{end}_speed"), abs=1e-12)


@pytest.mark.parametrize(
    "text", [CSV, TOML, "time,u [V],x_angle [rad]\n0,1,0\n2,3,4\n2,7,4\n3,7,5\n"], ids=["ramps", "turns", "lines"]
)
def test_a_stretch_is_what_each_of_its_times_tells_to_the_bit(text, tmp_path, rng):
    made = part(tmp_path, "m.toml" if "turns" in text else "m.csv", text)
    made.bind([], list(made.variables))
    times = np.sort(np.concatenate([rng.uniform(-1.0, 11.0, 400), np.arange(110) * 0.1]))
    np.testing.assert_array_equal(made.ahead(times), Part.ahead(made, times))


def test_without_ramps_rows_are_joined_by_straight_lines_and_two_of_one_time_are_a_jump(tmp_path):
    made = part(tmp_path, "m.csv", "time,u [V],x_angle [rad]\n0,1,0\n2,3,4\n2,7,4\n3,7,5\n")
    assert set(made.variables) == {"u", "x_angle", "x_speed"}  # of a voltage there is no speed
    assert at(made, -1.0) == {"u": 1.0, "x_angle": 0.0, "x_speed": 0.0}
    assert at(made, 0.5) == {"u": 1.5, "x_angle": 1.0, "x_speed": 2.0}
    assert at(made, 2.0)["u"] == 7.0 and at(made, 9.0) == {"u": 7.0, "x_angle": 5.0, "x_speed": 0.0}


def system(folder):
    (folder / "moves.csv").write_text("time, ramp, goal_angle [deg]\n0, 0, 0\n1, 0.2, 90\n")
    (folder / "s.toml").write_text(
        '[run]\nstop = 1.0\nopen_inputs = true\n[components.moves]\nmanoeuvre = "moves.csv"\n'
        '[components.controller]\nfmu = "selflock:Controller"\n[connections]\n'
        '"controller.angle_setpoint" = "moves.goal_angle"\n"controller.speed_setpoint" = "moves.goal_speed"\n'
    )
    return folder / "s.toml"


@pytest.mark.parametrize(
    "text",
    [
        "time;ramp;x_angle [deg]\n0;0;0\n1,5;0;30\n",  # as a spreadsheet of another country writes it
        "time\tramp\tx_angle [deg]\n0\t0\t0\n1.5\t0\t30\n",
        "time [ms], ramp [ms], x_angle (deg)\n0, 0, 0\n1500, 0, 30",
        "time [min], ramp, x_angle [deg]\n0, 0, 0\n0.025, 0, 30\n",
    ],
    ids=["semicolons", "tabs", "ms", "min"],
)
def test_it_is_written_as_spreadsheets_write_it(text, tmp_path):
    made = part(tmp_path, "m.csv", text)
    assert at(made, 0.75) == pytest.approx({"x_angle": 15.0, "x_speed": 20.0}) and at(made, 9.0)["x_angle"] == pytest.approx(30.0)


@pytest.mark.parametrize(
    "name, text, words",
    [
        ("m.csv", "time,arm_angle\n0,0\n1,80\n", "unit of arm_angle: write arm_angle .deg., or rad"),
        ("m.toml", "[arm_angle]\nstart = 80.0\n", 'unit of arm_angle: write unit = "deg" under .arm_angle.'),
    ],
)
def test_an_angle_has_a_unit(name, text, words, tmp_path):
    """80 of something would be 80 rad to who listens."""
    with pytest.raises(master.DescriptionError, match=words):
        part(tmp_path, name, text)


def test_a_time_that_nobody_knows_is_told(tmp_path):
    with pytest.raises(master.errors.ResultError, match="its time is in 'fortnights'; write it in s, ms"):
        part(tmp_path, "m.csv", "time [fortnights],u [V]\n0,1\n1,2\n")


def test_a_system_follows_its_manoeuvre_in_the_listeners_unit(tmp_path):
    loaded = master.load(system(tmp_path))
    loaded.run.record = ["controller.*", "moves.*"]
    table = master.run(loaded).table
    assert table["moves.goal_angle"].iloc[-1] == 90.0
    # a step is given what is asked for at its end, as of every source that is a function of time
    assert table["controller.angle_setpoint"].iloc[-1] == pytest.approx(math.pi / 2)
    mid = table[table.time.round(9) == 0.5].iloc[0]
    assert mid["moves.goal_angle"] == pytest.approx(45.0) and mid["moves.goal_speed"] == pytest.approx(90.0 / 0.8)
    assert mid["controller.speed_setpoint"] == pytest.approx(math.radians(90.0 / 0.8))


def test_it_is_saved_swept_and_not_exported(tmp_path, refused):
    from selflock.master.ssp import export
    from selflock.sweep.runs import Bench

    loaded = master.load(system(tmp_path))
    (tmp_path / "other").mkdir()
    again = master.load(dump.save(loaded, tmp_path / "other" / "t.toml"))
    assert again.components["moves"].manoeuvre == "../moves.csv" and len(master.run(again, stop=0.01).table) == 11
    bench = Bench(loaded, [], table=True)
    assert any(name.endswith(".csv") for name in bench.fmus) and len(bench.versions) == 2
    refused(lambda: export(loaded, tmp_path / "x.ssp"), "moves: a manoeuvre runs inside our master only")


@pytest.mark.parametrize(
    "name, text, words",
    [
        ("m.csv", "t,x\n0,1\n", ["a column `time`"]),
        ("m.csv", "time,x\n0,1\n-1,2\n", ["its time falls"]),
        ("m.csv", "time,x\n0,one\n", ["column x", "no number"]),
        ("m.csv", "time,ramp,x\n0,0,1\n1,0.6,2\n", ["a ramp of 0.6 s is longer than half of the turn from 0 until 1 s"]),
        ("m.csv", "time,my x\n0,1\n", ["'my x' is no name"]),
        ("m.csv", "time\n0\n", ["holds no set-point"]),
        ("m.toml", "[x]\nturn = []\n", ["[x] has no key turn", "Did you mean turns?"]),
        ("m.toml", "[x]\nturns = [{ from = 1, to = 2 }]\n", ["[x] turns: until is not given"]),
        ("m.toml", "[x]\nturns = [{ from = 1, until = 2, to = 'a' }]\n", ["to = 'a' is no number"]),
        (
            "m.toml",
            "[x]\nturns = [{ from = 1, until = 3, to = 1 }, { from = 2, until = 4, to = 2 }]\n",
            ["begins before that until 3 s"],
        ),
        ("m.toml", "x = 1\n", ["a set-point is a table, [x]"]),
        ("m.toml", "[x\n", ["not valid TOML"]),
    ],
)
def test_what_is_wrong_with_it_is_told(tmp_path, refused, name, text, words):
    refused(lambda: part(tmp_path, name, text), name, *words)


@pytest.mark.parametrize(
    "column, speed, per",
    [
        ("x_angle [rev]", "x_speed", "turn/s"),
        ("x_angle [mrad]", "x_speed", "mrad/s"),
        ("x [cm]", "x_speed", "cm/s"),
        ("x [m]", "x_speed", "m/s"),
        ("x [N.m]", None, None),
        ("x", None, None),
    ],
)
def test_whatever_is_an_angle_or_a_way_has_a_speed(column, speed, per, tmp_path):
    made = part(tmp_path, "m.csv", f"time,{column}\n0,0\n2,90\n")
    assert list(made.variables) == [column.split()[0]] + [speed] * (speed is not None)
    if speed:
        assert made.variables[speed].unit == per and at(made, 1.0)[speed] == pytest.approx(45.0)


def test_an_angle_in_a_unit_that_nobody_knows_is_refused(tmp_path):
    with pytest.raises(master.DescriptionError, match="nobody knows the unit quux of x_angle: write deg, rad or turn"):
        part(tmp_path, "m.csv", "time,x_angle [quux]\n0,0\n2,90\n")


def test_a_column_called_angle_is_the_set_point_that_a_drive_asks_for(tmp_path):
    """Its speed was there as `angle_speed` alone, and the drive asks for `speed`; older files name it as it was."""
    (tmp_path / "moves.csv").write_text("time,angle [deg]\n0,0\n2,90\n")
    data = {
        "run": {"stop": 0.01, "step": 0.001},
        "components": {"moves": {"manoeuvre": "moves.csv"}, "weight": {"fmu": "selflock:Load"}},
        "drives": {"lift": {"ratio": 50.0, "load": "weight", "controller": {}, "setpoint": "moves"}},
    }
    system = master.from_dict(data)
    system.folder = tmp_path
    system.run.record = ["moves.*", "lift_controller.speed_setpoint"]
    table = master.run(system).table
    assert {name for name in table if name.startswith("moves.")} == {"moves.angle", "moves.angle_speed"}
    assert table["lift_controller.speed_setpoint"].iloc[-1] == pytest.approx(np.pi / 4)
