"""`selflock rig init` where nobody says what matters: the names of columns, the unit of the time, the volts of a supply."""

import re
from math import pi

import numpy as np
import pandas as pd
import pytest

from selflock import diagnosis
from selflock.diagnosis import DataError, rig_init
from selflock.info import info
from selflock.master import ResultError
from selflock.master.files import read

DEG = 180.0 / pi
ROWS = 50


def motion(rows=ROWS, step=0.02):
    """Time in s, what is asked for, angle of the load and torque of a motor: a toy's, some rows long."""
    t = step * np.arange(rows)
    angle = 0.8 * np.sin(5.0 * t)
    speed = 4.0 * np.cos(5.0 * t)
    return t, angle, speed, 0.02 * np.sign(speed) - 2e-4 * 60.0 * 20.0 * np.sin(5.0 * t)


@pytest.fixture
def bare(tmp_path):
    """A log of four columns, of which nobody says anything: ms, what is asked for, degrees, percent of a supply."""
    t, angle, speed, _ = motion()
    columns = 1e3 * t, np.round(DEG * angle * 1.01), np.round(DEG * angle), np.round(20.0 * speed)
    np.savetxt(tmp_path / "toy.csv", np.column_stack(columns), delimiter=",", fmt="%g")
    return tmp_path / "toy.csv"


def test_a_log_without_names_says_how_to_give_them(bare, tmp_path):
    with pytest.raises(DataError) as told:
        rig_init([bare], tmp_path / "toy.toml")
    text = str(told.value)
    assert "has no line with the names of its columns" in text and "the time is column 1" in text
    assert "3 (-46 to 46)" in text and not (tmp_path / "toy.toml").exists()
    names = re.search(r"--columns '(.*)'\.$", text)[1].split(",")
    assert len(names) == 4
    begun = rig_init([bare], tmp_path / "toy.toml", columns=names)  # as it is told
    placed = {signal: (one.column, one.unit) for signal, one in begun.guess.taken.items()}
    assert placed == {
        "controller.angle_setpoint": ("2", "deg"), "load.angle": ("3", "deg"), "motor.voltage": ("4", "V"),
    }  # fmt: skip
    assert begun.guess.raw.clock.unit == "ms" and begun.kind == "forward" and begun.compares


def test_a_duty_beside_no_supply_waits_for_its_volts(bare, tmp_path):
    begun = rig_init(bare, tmp_path / "toy.toml", columns="time [ms], -, motor angle [deg], motor duty [%]")
    line = next(line for line in begun.path.read_text().splitlines() if '"motor.voltage" = ' in line)
    assert (
        line.startswith('# "motor.voltage" = { column = "4", unit = "%", nominal = ? }')
        and "nominal of column '4'" in begun.lacks
    )
    assert '"2"' not in begun.path.read_text().replace("column '2'", "")  # it does not matter
    begun.path.write_text(begun.path.read_text().replace(line, line.removeprefix("# ").replace("?", "9.0")))
    assert diagnosis.replay(begun.path, bare, out=None, anyway=True).comparisons


@pytest.mark.parametrize("name", ["data100", "data20."])
def test_a_file_without_an_ending_is_a_text(bare, name, tmp_path):
    bare.rename(tmp_path / name)
    begun = rig_init(tmp_path / name, tmp_path / "toy.toml", columns="time [ms], -, motor angle [deg], motor duty [%]")
    assert begun.kind == "forward" and "log of 50 rows" in info(tmp_path / name)
    (tmp_path / name).write_bytes(b"\0\1\2")
    with pytest.raises(DataError, match="is not a text file"):
        rig_init(tmp_path / name, tmp_path / "other.toml")


def test_a_few_rows_are_said_to_be_few(bare, tmp_path):
    begun = rig_init(bare, tmp_path / "toy.toml", columns="time [ms], -, load angle [deg], load speed [deg/s]")
    assert any("of 9 pieces, which are too few to tell" in why for why in begun.guess.taken["load.angle"].why)


def test_a_duty_that_is_another_one_each_time_the_clock_begins_anew_tells_runs_apart(tmp_path):
    """A motor's steps, one behind the other in a file: the duty is a channel all the same."""
    rows = []
    for duty in (-100, -60, -20, 20, 60, 100):
        t = 0.006 * np.arange(150)
        speed = 11.0 * duty * (1.0 - np.exp(-t / 0.11))
        rows.append(np.column_stack([np.full(150, duty), t, speed, 11.0 * duty * (t - 0.11 * (1.0 - np.exp(-t / 0.11)))]))
    np.savetxt(tmp_path / "steps.csv", np.concatenate(rows), delimiter=", ", fmt="%.6g")
    begun = rig_init(
        tmp_path / "steps.csv", tmp_path / "rig.toml", columns="motor duty [%], time [s], motor speed [deg/s], motor angle [deg]"
    )
    guess = begun.guess
    assert guess.raw.run == "1" and len(guess.raw.columns.parts) == 6
    assert guess.taken["motor.voltage"].column == "1" and guess.taken["reducer.input_angle"].sure == "sure"
    begun.path.write_text(
        begun.path.read_text().replace('# "motor.voltage"', '"motor.voltage"').replace("nominal = ?", "nominal = 9.0")
    )
    assert {c.output for c in diagnosis.replay(begun.path, tmp_path / "steps.csv", None, anyway=True).comparisons} >= {
        "reducer.input_speed"
    }


def test_as_many_names_as_columns(bare, tmp_path):
    with pytest.raises(DataError, match=r"has 4 columns \(1, 2, 3, 4\), and --columns names 2"):
        rig_init([bare], tmp_path / "toy.toml", columns=["time [ms]", "load angle [deg]"])
    with pytest.raises(DataError, match="names none"):
        rig_init([bare], tmp_path / "toy.toml", columns=["-"] * 4)


def test_a_matrix_whose_numbers_tell_a_drive_is_written_with_a_word_on_its_names(tmp_path):
    t = 0.002 * np.arange(6000)
    waves = ((0.9, 1.3, 0.1), (0.5, 3.1, 1.0), (0.1, 7.7, 2.0))
    angle, speed = sum(a * np.sin(w * t + p) for a, w, p in waves), sum(a * w * np.cos(w * t + p) for a, w, p in waves)
    np.save(tmp_path / "log.npy", np.column_stack([t, angle, speed]))
    begun = rig_init([tmp_path / "log.npy"], tmp_path / "rig.toml")
    assert begun.kind and any("--columns 'time [ms], goal angle" in note for note in begun.guess.notes)
    assert "--columns" in begun.path.read_text()


@pytest.mark.parametrize("ending", ["csv", "txt"])
def test_info_and_results_tell_that_a_table_has_no_names(bare, tmp_path, ending):
    bare.rename(tmp_path / f"x.{ending}")
    text = info(tmp_path / f"x.{ending}")
    assert "log of 50 rows, 4 columns, which it has no names for" in text and "\n  3  -46 to 46, at last" in text
    assert f"selflock rig init {tmp_path / f'x.{ending}'} --columns" in text
    if ending == "csv":
        with pytest.raises(ResultError, match="its first line is one of numbers"):
            read(tmp_path / "x.csv")


def test_words_alone_are_no_log(tmp_path):
    (tmp_path / "x.txt").write_text("hello world\nthis is text\nand this\n")
    with pytest.raises(DataError, match="holds no column of numbers, but 'hello world'"):
        rig_init(tmp_path / "x.txt", tmp_path / "x.toml")
    assert "rig init" not in info(tmp_path / "x.txt") and not (tmp_path / "x.toml").exists()


def test_what_is_no_utf_8_is_told_as_that(tmp_path):
    (tmp_path / "x.csv").write_bytes("Prüfstand;1\n\nZeit [ms];Winkel\n1;2\n".encode("cp1252"))
    with pytest.raises(ResultError, match="it is no UTF-8 text. What a recorder wrote selflock info"):
        read(tmp_path / "x.csv")


@pytest.mark.slow
def test_info_tells_of_what_a_drive_exports(tmp_path):
    (tmp_path / "x.csv").write_text("Kopf;1\n\nZeit [ms];Winkel [°]\n" + "".join(f"{k},0;{k},5\n" for k in range(20)))
    text = info(tmp_path / "x.csv")
    assert "log of 20 rows, 2 columns\n" in text and "  Winkel [°]  0.5 to 19.5, at last 19.5" in text


@pytest.mark.parametrize(
    "said, unit, factor",
    [
        ("U/min", "rpm", 30.0 / pi),
        ("u/min", "rpm", 30.0 / pi),
        ("Umdr/min", "rpm", 30.0 / pi),
        ("U/s", "turn/s", 0.5 / pi),
        ("Grad/s", "deg/s", DEG),
    ],
)
def test_what_people_call_a_unit_is_read_as_it_was_placed(said, unit, factor, tmp_path):
    """An enzyme's unit per minute to who takes them at their word."""
    _, angle, speed, torque = motion(300)
    table = {
        "time [s]": 0.02 * np.arange(300),
        f"n_Mot [{said}]": factor * speed,
        "Winkel [Grad]": DEG * angle,
        "Moment [Nm]": torque,
    }
    pd.DataFrame(table).to_csv(tmp_path / "log.csv", index=False)
    begun = rig_init([tmp_path / "log.csv"], tmp_path / "rig.toml")
    one = begun.guess.taken.get("reducer.input_speed") or begun.guess.taken["load.speed"]
    assert one.unit == unit
    assert begun.compares, begun.lacks
    begun.path.write_text(begun.path.read_text().replace(f'unit = "{unit}"', 'unit = "mm/s"'))
    with pytest.raises(DataError, match="contradicts the unit 'mm/s'|cannot be"):
        diagnosis.replay(begun.path, tmp_path / "log.csv", out=None)


@pytest.mark.parametrize(
    "step, unit, other, lasts",
    [
        (1.0, "ms", "s", "0.299 s"),
        (2.0, "ms", "s", "0.598 s"),
        (1000.0, "us", "ms", "0.299 s"),
        (20.0, "ms", "", ""),
        (0.01, "s", "", ""),
    ],
)
def test_a_time_that_may_be_in_another_unit_is_said_to(step, unit, other, lasts, tmp_path):
    _, angle, _, torque = motion(300)
    table = {"time": step * np.arange(300), "load_angle": angle, "motor_torque": torque}
    pd.DataFrame(table).to_csv(tmp_path / "log.csv", index=False)
    begun = rig_init([tmp_path / "log.csv"], tmp_path / "rig.toml")
    assert begun.guess.raw.clock.unit == unit and f'unit = "{unit}"' in begun.path.read_text()
    notes = [note for note in begun.guess.notes if "nobody says the unit of the time" in note]
    assert len(notes) == bool(other)
    if other:
        assert f"the log lasts {lasts}" in notes[0] and f'write unit = "{other}" under [time]' in begun.path.read_text()


@pytest.mark.parametrize("scale, unit", [(1.0, "s"), (1e3, "ms"), (1.0 / 60.0, "min")])
def test_an_angle_and_its_speed_say_the_times_unit_where_its_steps_say_another(scale, unit, tmp_path):
    """A slow drive, a row every second or two."""
    t = 1.5 * np.arange(400)
    table = {
        "time": scale * t, "load angle [rad]": np.sin(0.05 * t), "load speed [rad/s]": 0.05 * np.cos(0.05 * t),
        "motor torque [N.m]": 0.1 * np.sign(np.cos(0.05 * t)),
    }  # fmt: skip
    pd.DataFrame(table).to_csv(tmp_path / "log.csv", index=False)
    begun = rig_init([tmp_path / "log.csv"], tmp_path / "rig.toml")
    clock = begun.guess.raw.clock
    assert clock.unit == unit and clock.factor == pytest.approx(1.0 / scale) and "say that it is" in clock.why
    assert not any("nobody says the unit of the time" in note for note in begun.guess.notes)


def test_what_is_no_drive_is_in_seconds_where_nobody_says_a_unit(tmp_path, rng):
    table = {"time": np.arange(0.0, 600.0, 2.0), "heater": rng.uniform(size=300), "oven": 20.0 + rng.uniform(size=300)}
    pd.DataFrame(table).to_csv(tmp_path / "log.csv", index=False)
    begun = rig_init([tmp_path / "log.csv"], tmp_path / "rig.toml")
    assert not begun.kind and 'unit = "s"' in begun.path.read_text()
    assert any("s was taken, so that the log lasts 598 s" in note for note in begun.guess.notes)


def test_a_dozen_points_at_constant_speed_are_replayed_and_too_few_for_a_cause(tmp_path):
    speeds = np.array([-1500, -1200, -900, -600, -300, -100, 100, 300, 600, 900, 1200, 1500])
    table = {"Drehzahl Motor [1/min]": speeds, "Moment Motor [mNm]": 8.0 * np.sign(speeds) + 0.004 * speeds}
    pd.DataFrame(table).to_csv(tmp_path / "points.csv", index=False, sep=";", decimal=",")
    begun = rig_init(tmp_path / "points.csv", tmp_path / "rig.toml")
    text = begun.path.read_text()
    assert begun.kind == "steady" and "need none" in text and "# step" not in text
    begun.path.write_text(text + '"reducer.gear_ratio" = 20.0\n"load.constant_torque" = 0.3\n')
    text = begun.path.read_text().replace("# [uncertain]", "")
    begun.path.write_text(text)
    result = diagnosis.replay(begun.path, tmp_path / "points.csv", None)
    assert len(result.points) == 12 and [c.name for c in result.comparisons] == ["gear"]
    with pytest.raises(DataError, match="has 12 points, which selflock replay compares; for a cause give 30 or more"):
        diagnosis.diagnose(begun.path, tmp_path / "points.csv", out=None)
    pd.DataFrame(table).head(4).to_csv(tmp_path / "few.csv", index=False)
    with pytest.raises(DataError, match="has 4 points, too few to tell anything. Give a log of at least 6, in both directions"):
        diagnosis.replay(begun.path, tmp_path / "few.csv", None)


def test_a_log_of_an_hour_tells_its_ratio_and_units_too(tmp_path, rng):
    """Of whole motions in a 400th of it nothing was left."""
    t = 0.06 * np.arange(60_000)
    waves = ((0.9, 2.0 * pi * 2.0 / 9.0, 0.1), (0.4, 2.0 * pi * 5.0 / 9.0, 1.0))  # 400 times 9 s
    angle, speed = sum(a * np.sin(w * t + p) for a, w, p in waves), sum(a * w * np.cos(w * t + p) for a, w, p in waves)
    noisy = lambda x: x + 2e-3 * np.std(x) * rng.standard_normal(len(x))
    table = {"t [s]": t, "Motordrehzahl [1/min]": noisy(60.0 * 30.0 / pi * speed), "Lastwinkel [°]": noisy(DEG * angle)}
    pd.DataFrame(table | {"motor torque [N.m]": noisy(0.1 * np.sign(speed))}).to_parquet(tmp_path / "log.parquet")
    guess = rig_init(tmp_path / "log.parquet", tmp_path / "rig.toml").guess
    assert guess.ratio and guess.ratio[0] == pytest.approx(60.0, rel=5e-3)
    assert {s: one.sure for s, one in guess.taken.items()}["load.angle"] == "sure"
