"""`selflock rig init` on logs whose truth is known: a drive of closed forms, its columns renamed, rescaled and turned."""

import json
import re
from math import pi
from pathlib import Path

import numpy as np
import pandas as pd
import pytest
import scipy.io

from selflock import diagnosis
from selflock.diagnosis import DataError, rig_init
from selflock.diagnosis.begin.place import place
from selflock.diagnosis.begin.raw import read
from selflock.diagnosis.begin.words import read as word
from selflock.diagnosis.data import rig as rigs

DATA = Path(__file__).resolve().parents[4] / "shared" / "data"
RIGS = Path(__file__).resolve().parents[3] / "examples" / "rigs"
RATIO, R, K, DEG, RPM = 60.0, 1.5, 0.04, 180.0 / pi, 30.0 / pi
T = np.arange(6000) * 0.002


def drive(seed=3) -> dict[str, np.ndarray]:
    """Motion of three frequencies, friction and inertia at the motor's shaft, u = R i + k w: SI, all in one direction.

    The load follows its set-point 20 ms late; channels have noise of a thousandth, and counts.
    """
    rng = np.random.default_rng(seed)
    waves = ((0.9, 1.3, 0.1), (0.5, 3.1, 1.0), (0.1, 7.7, 2.0))
    goal = sum(a * np.sin(w * T + p) for a, w, p in waves)
    late = T - 0.02
    angle = sum(a * np.sin(w * late + p) for a, w, p in waves)
    speed = sum(a * w * np.cos(w * late + p) for a, w, p in waves)
    acceleration = sum(-a * w * w * np.sin(w * late + p) for a, w, p in waves)
    torque = 2e-5 * RATIO * acceleration + 0.02 * np.sign(speed) + 1e-4 * RATIO * speed
    current = torque / K
    found = {
        "time": T, "goal": goal, "angle": angle, "speed": speed, "motor_angle": RATIO * angle, "motor_speed": RATIO * speed,
        "torque": torque, "current": current, "voltage": R * current + K * RATIO * speed,
    }  # fmt: skip
    for name in ("angle", "speed", "motor_angle", "motor_speed", "torque", "current", "voltage"):
        found[name] = found[name] + 1e-3 * np.std(found[name]) * rng.standard_normal(len(T))
    return found


TRUTH = drive()
SIGNAL = {"goal": "controller.angle_setpoint", "angle": "load.angle", "speed": "load.speed", "motor_angle": "reducer.input_angle",
          "motor_speed": "reducer.input_speed", "torque": "motor.torque", "current": "motor.current", "voltage": "motor.voltage"}  # fmt: skip


def logged(path: Path, columns: dict[str, tuple[str, float]]) -> Path:
    """A log with these columns: name: (truth, factor)."""
    table = pd.DataFrame({name: TRUTH[what] * factor for name, (what, factor) in columns.items()})
    table.to_csv(path, index=False, float_format="%.8g")
    return path


def held_to(guess, columns: dict[str, tuple[str, float]], ratio: float | None = RATIO) -> None:
    """Each column is in its place, in the unit that makes it the truth; what is placed elsewhere or otherwise is a failure."""
    placed = {one.column: one for one in guess.taken.values()}
    for name, (what, factor) in columns.items():
        if what == "time":
            assert guess.raw.clock.column == name and guess.raw.clock.factor * factor == pytest.approx(1.0, rel=1e-6)
            continue
        assert name in placed, f"{name}: {guess.left.get(name)}"
        one = placed[name]
        assert one.signal == SIGNAL[what], (name, one)
        assert guess.scale(one.signal) * factor == pytest.approx(1.0, rel=0.02), (name, one)
    if ratio:
        assert guess.ratio and guess.ratio[0] == pytest.approx(ratio, rel=2e-3)


LOGS = {
    "SI": {"time": ("time", 1), "voltage": ("voltage", 1), "current": ("current", 1), "motor_speed": ("motor_speed", 1), "load_angle": ("angle", 1)},
    "German": {"Zeit [ms]": ("time", 1e3), "Sollwinkel [°]": ("goal", DEG), "Istwinkel [°]": ("angle", DEG),
               "Motordrehzahl [1/min]": ("motor_speed", RPM), "Motorstrom [mA]": ("current", 1e3), "Motorspannung [V]": ("voltage", 1)},
    "French": {"temps (s)": ("time", 1), "vitesse moteur (tr/min)": ("motor_speed", RPM), "couple moteur (Nm)": ("torque", 1),
               "position charge (deg)": ("angle", DEG)},
    "letters": {"t": ("time", 1), "u": ("voltage", 1), "i": ("current", 1), "w": ("motor_speed", 1), "phi": ("angle", 1)},
    "suffixes": {"t_us": ("time", 1e6), "motor_speed_rpm": ("motor_speed", RPM), "Ia [A]": ("current", 1), "u_mot": ("voltage", 1), "phi_deg": ("angle", DEG)},
    "Greek": {"t": ("time", 1), "ω_m": ("motor_speed", 1), "θ_l": ("angle", 1), "τ_m": ("torque", 1)},
    "degrees and rpm by their ratio": {"time_ms": ("time", 1e3), "motor_pos": ("motor_angle", DEG), "motor_vel": ("motor_speed", RPM), "I": ("current", 1)},
    "a column turned": {"t [s]": ("time", 1), "u [V]": ("voltage", 1), "i [A]": ("current", -1), "motor speed [rpm]": ("motor_speed", -RPM), "load angle [rad]": ("angle", 1)},
    "the voltage turned": {"t [s]": ("time", 1), "u [V]": ("voltage", -1), "i [A]": ("current", 1), "motor speed [rad/s]": ("motor_speed", 1), "load angle [rad]": ("angle", 1)},
    "the torque turned": {"t [s]": ("time", 1), "load velocity [rad/s]": ("speed", 1), "motor torque [mNm]": ("torque", -1e3), "motor velocity [rad/s]": ("motor_speed", 1)},
}  # fmt: skip


@pytest.mark.alike
@pytest.mark.parametrize("how", LOGS)
def test_columns_are_found_with_units_signs_and_ratio(how, tmp_path):
    columns = LOGS[how]
    ratio = RATIO if {"angle", "speed"} & {what for what, _ in columns.values()} else None
    held_to(place(read([logged(tmp_path / "log.csv", columns)])), columns, ratio)


def test_numbers_alone_find_the_motions_and_leave_the_rest_open(tmp_path):
    """Without any name: both angles, the speed that is the derivative of one, their ratio; that the current is one is not told."""
    matrix = np.column_stack([TRUTH[n] for n in ("time", "current", "motor_speed", "voltage", "motor_angle", "angle")])
    scipy.io.savemat(tmp_path / "log.mat", {"data": matrix})
    guess = place(read([tmp_path / "log.mat"]))
    held_to(guess, {"data.1": ("time", 1), "data.3": ("motor_speed", 1), "data.5": ("motor_angle", 1), "data.6": ("angle", 1)})
    assert not {"motor.current", "motor.voltage"} & set(guess.taken)
    assert (guess.taken["motor.torque"].column, guess.taken["motor.torque"].lacks) == (
        "data.2",
        "factor",
    )  # a torque but for its scale


@pytest.mark.slow
def test_counts_get_their_number_from_a_speed_that_has_a_unit(tmp_path):
    columns = {
        "Zeit;ms": ("time", 1e3),
        "Position actual value [inc]": ("motor_angle", 4000 / (2 * pi)),
        "Velocity actual value [rpm]": ("motor_speed", RPM),
    }
    table = pd.DataFrame({n: TRUTH[w] * f for n, (w, f) in columns.items()}).assign(
        **{"Torque actual value [%]": TRUTH["torque"] * 500}
    )
    table["Position actual value [inc]"] = table["Position actual value [inc]"].round()
    table.columns = ["Time [ms]", *table.columns[1:]]
    table.to_csv(tmp_path / "log.csv", index=False)
    guess = place(read([tmp_path / "log.csv"]))
    assert guess.taken["reducer.input_angle"].factor == pytest.approx(2 * pi / 4000, rel=1e-9)
    assert guess.taken["motor.torque"].lacks == "nominal"  # and no number is made up
    begun = rig_init([tmp_path / "log.csv"], tmp_path / "rig.toml")
    assert (
        "nominal" in begun.lacks
        and '# "motor.torque" = { column = "Torque actual value [%]", unit = "%", nominal = ? }' in begun.path.read_text()
    )


def test_a_motion_that_lacks_its_factor_is_one_all_the_same(tmp_path):
    """Counts of nobody knows how many a turn: the kind is told, and what is wanted."""
    table = {"t": T, "enc_counts": np.round(TRUTH["motor_angle"] * 4096 / (2 * pi)), "motor_voltage": TRUTH["voltage"]}
    pd.DataFrame(table | {"motor_current": TRUTH["current"]}).to_csv(tmp_path / "log.csv", index=False)
    begun = rig_init([tmp_path / "log.csv"], tmp_path / "rig.toml")
    assert begun.kind == "forward" and begun.lacks.startswith("factor of column 'enc_counts'")


@pytest.mark.slow
@pytest.mark.parametrize("whole", ["run", "experiment"])
def test_the_name_of_the_structure_that_all_are_in_claims_nothing(whole, tmp_path):
    held = {"t": T, "u": TRUTH["voltage"], "i": TRUTH["current"], "speed": TRUTH["motor_speed"]}
    scipy.io.savemat(tmp_path / "log.mat", {whole: held})
    begun = rig_init([tmp_path / "log.mat"], tmp_path / "rig.toml")
    assert begun.guess.raw.clock.column == f"{whole}.t" and begun.kind == "forward"
    assert {one.column for one in begun.guess.taken.values()} == {f"{whole}.{name}" for name in ("u", "i", "speed")}


def test_where_nobody_says_a_unit_the_drive_may_be_linear(tmp_path):
    pd.DataFrame({"t": T, "q": TRUTH["angle"], "f": TRUTH["torque"]}).to_csv(tmp_path / "log.csv", index=False)
    assert "# linear = true" in rig_init([tmp_path / "log.csv"], tmp_path / "rig.toml").path.read_text()
    logged(tmp_path / "said.csv", {"time": ("time", 1), "angle_deg": ("angle", DEG), "torque": ("torque", 1)})
    assert "linear" not in rig_init([tmp_path / "said.csv"], tmp_path / "said.toml").path.read_text()


def test_a_set_point_is_told_by_its_lead_where_no_name_says_it(tmp_path):
    rng = np.random.default_rng(5)
    angle = TRUTH["angle"] + 0.01 * rng.standard_normal(len(T))
    pd.DataFrame({"t": T, "angle_a": angle, "angle_b": TRUTH["goal"], "torque_motor": TRUTH["torque"]}).to_csv(
        tmp_path / "log.csv", index=False
    )
    guess = place(read([tmp_path / "log.csv"]))
    assert guess.taken["controller.angle_setpoint"].column == "angle_b" and guess.taken["load.angle"].column == "angle_a"


def test_an_angles_zero_comes_from_its_set_point(tmp_path):
    table = {"t": T, "goal_position": TRUTH["goal"] + 3.2, "position": TRUTH["angle"], "motor_torque": TRUTH["torque"]}
    pd.DataFrame(table).to_csv(tmp_path / "log.csv", index=False)
    assert place(read([tmp_path / "log.csv"])).taken["controller.angle_setpoint"].offset == pytest.approx(-3.2, abs=0.05)


def test_of_several_drives_one_is_taken_and_another_may_be_asked_for(tmp_path):
    other = np.roll(TRUTH["angle"], 700), np.roll(TRUTH["speed"], 700)
    table = {
        "timestamp": T + 1.7e9,
        "q_0": TRUTH["angle"],
        "dq_0": TRUTH["speed"],
        "tau_0": TRUTH["torque"],
        "q_1": 0.5 * other[0],
        "dq_1": 0.5 * other[1],
        "tau_1": TRUTH["torque"],
    }
    pd.DataFrame(table).to_csv(tmp_path / "log.csv", index=False)
    raw = read([tmp_path / "log.csv"])
    guess = place(raw)
    assert guess.taken["load.angle"].column == "q_0" and guess.raw.clock.unit == "s" and "--only" in " ".join(guess.notes)
    assert place(read([tmp_path / "log.csv"]), "_1").taken["load.angle"].column == "q_1"
    with pytest.raises(DataError, match="no column has that in its name"):
        place(raw, "_7")


def test_what_has_lost_its_sign_or_its_name_stays_a_gap(tmp_path):
    table = {
        "t": T,
        "speed_rpm": TRUTH["motor_speed"] * RPM,
        "current": abs(TRUTH["current"]),
        "pwm": abs(TRUTH["voltage"]) * 7.3,
        "load": TRUTH["torque"],
    }
    pd.DataFrame(table).to_csv(tmp_path / "log.csv", index=False)
    guess = place(read([tmp_path / "log.csv"]))
    assert set(guess.taken) == {"reducer.input_speed"}
    assert "lost its sign" in guess.left["current"] and "lost its sign" in guess.left["pwm"] and "not told" in guess.left["load"]
    pd.DataFrame({"u": TRUTH["voltage"], "y": TRUTH["angle"], "V1": TRUTH["current"]}).to_csv(tmp_path / "uy.csv", index=False)
    begun = rig_init([tmp_path / "uy.csv"], tmp_path / "rig.toml")
    assert not begun.kind and not begun.guess.taken and "no drive" in begun.summary()


@pytest.mark.parametrize("supply, signal, factor", [(None, "motor.voltage", 7.4 / 255), (7425.0, "motor.duty", 1.0 / 255)])
def test_a_command_of_a_small_controller_needs_what_is_all_of_it(supply, signal, factor, tmp_path):
    """Two wheels, each with a speed and a PWM of up to 255 that is called a command; a battery that stays as it is."""
    table = {"time": T * 1e3, "targetSpeed": 200.0 + 0.0 * T}
    for side, rows in (("left", 0), ("right", 700)):
        table[f"{side}Speed"] = np.roll(TRUTH["motor_speed"], rows)
        table[f"{side}Command"] = np.round(np.roll(TRUTH["voltage"], rows) / 7.4 * 255)
    table |= {"batteryVoltage": supply} if supply else {}
    pd.DataFrame(table).to_csv(tmp_path / "log.csv", index=False)
    begun = rig_init([tmp_path / "log.csv"], tmp_path / "rig.toml")
    assert begun.kind == "forward" and len(begun.guess.drives) == 2 and "factor of column" in begun.lacks
    side, one = begun.guess.drives[0], begun.guess.taken[signal]
    assert one.column == f"{side}Command" and one.lacks == "factor" and "such as 255" in one.why[-1]
    text = begun.path.read_text().replace(f'# "{signal}"', f'"{signal}"').replace("factor = ?", f"factor = {factor}")
    begun.path.write_text(text.replace('# "reducer.gear_ratio"', '"reducer.gear_ratio"'))
    found = diagnosis.replay(begun.path, tmp_path / "log.csv", out=None, anyway=True)
    assert all(np.isfinite(c.error) for c in found.comparisons) and found.comparisons


def test_a_commanded_torque_is_said_to_be_one(tmp_path):
    pd.DataFrame({"t": T, "speed_rpm": TRUTH["motor_speed"] * RPM, "torque_cmd_Nm": np.round(TRUTH["torque"], 2)}).to_csv(
        tmp_path / "log.csv", index=False
    )
    assert place(read([tmp_path / "log.csv"])).taken["motor.torque"].commanded


@pytest.mark.parametrize(
    ("scale", "unit", "start"),
    [(1.0, "s", 0.0), (1e3, "ms", 0.0), (1e6, "us", 0.0), (1.0, "s", 1.7e9), (1e3, "ms", 1.7e12), (1e9, "ns", 1.7e18)],
)
def test_the_times_unit_is_told_by_its_steps_or_by_1970(scale, unit, start, tmp_path):
    pd.DataFrame({"time": start + T * scale, "motor_speed": TRUTH["motor_speed"]}).to_csv(tmp_path / "log.csv", index=False)
    clock = read([tmp_path / "log.csv"]).clock
    assert (clock.column, clock.unit) == ("time", unit) and clock.factor == pytest.approx(1.0 / scale)


@pytest.mark.slow
def test_coarse_times_and_a_missing_time_are_said_in_the_rig(tmp_path):
    pd.DataFrame(
        {"time": np.floor(T / 0.02) * 0.02, "motor_speed": TRUTH["motor_speed"], "motor_torque": TRUTH["torque"]}
    ).to_csv(tmp_path / "coarse.csv", index=False)
    begun = rig_init([tmp_path / "coarse.csv"], tmp_path / "coarse.toml")
    assert rigs.load(begun.path).rows.spread and begun.compares
    scipy.io.savemat(tmp_path / "ts.mat", {"motor_speed": TRUTH["motor_speed"], "motor_torque": TRUTH["torque"], "Ts": 0.002})
    assert rigs.load(rig_init([tmp_path / "ts.mat"], tmp_path / "ts.toml").path).rows.step == 0.002
    pd.DataFrame({"motor_speed": TRUTH["motor_speed"], "motor_torque": TRUTH["torque"]}).to_csv(
        tmp_path / "none.csv", index=False
    )
    assert "step = ..." in rig_init([tmp_path / "none.csv"], tmp_path / "none.toml").lacks


def test_points_at_constant_speed_are_a_steady_rig(tmp_path, rng):
    speeds = np.concatenate([np.linspace(-90.0, -10.0, 8), np.linspace(10.0, 90.0, 8)])
    rows = [
        (f"p{k}", 0.01 * j, s + rng.normal(0, 0.1), 5e-3 * np.sign(s) + rng.normal(0, 1e-4))
        for k, s in enumerate(speeds)
        for j in range(50)
    ]
    pd.DataFrame(rows, columns=["run", "time", "motor_speed_rad_s", "motor_torque_Nm"]).to_csv(tmp_path / "log.csv", index=False)
    begun = rig_init([tmp_path / "log.csv"], tmp_path / "rig.toml")
    found = rigs.load(begun.path)
    assert found.kind == "steady" and found.run == "run" and begun.compares


@pytest.mark.slow
def test_the_rig_is_valid_says_what_is_assumed_and_is_never_overwritten(tmp_path, hostile):
    columns = LOGS["German"] | {hostile: ("torque", 1.0)}
    log = logged(tmp_path / "log.csv", columns)
    begun = rig_init([log], tmp_path / "rig.toml")
    text, found = begun.path.read_text(), rigs.load(begun.path)
    assert found.kind == "forward" and found.parameters["reducer.gear_ratio"] == pytest.approx(RATIO, rel=2e-3)
    for name, unit in (
        ("motor.resistance", "Ohm"),
        ("load.inertia", "kg.m2"),
        ("reducer.friction_kinetic", ""),
        ("controller.angle_gain", "V/rad"),
    ):
        line = next(line for line in text.splitlines() if line.startswith(f'# "{name}" = '))
        assert "data sheet" in line and unit in line
    assert re.search(rf"R i \+ k w says about {R:.1f}", text)  # beside the resistance
    table = begun.summary()
    assert "how sure" in table and "gear ratio 60" in table and str(begun.path) in table
    with pytest.raises(DataError, match="is there already, and is not overwritten"):
        rig_init([log], tmp_path / "rig.toml")
    filled = re.sub(r'# ("motor.resistance" = )\S+', rf"\g<1>{R}", text)
    filled = re.sub(r'# ("motor.(?:torque|voltage)_constant" = )\S+', rf"\g<1>{K}", filled)
    begun.path.write_text(filled)
    replayed = {c.name: c for c in diagnosis.replay(begun.path, log, out=None).comparisons}
    assert replayed["motor"].relative < 0.2 and replayed["twist"].relative < 0.01


@pytest.mark.parametrize(
    ("name", "quantity", "side", "role", "unit"),
    [
        ("Omega_m", "speed", "motor", "", ""),
        ("motor_speed_rpm", "speed", "motor", "", "rpm"),
        ("Ia [A]", "current", "", "", "A"),
        ("u_mot", "voltage", "motor", "", ""),
        ("goal_position", "angle", "", "setpoint", ""),
        ("Vel. actual value", "speed", "", "actual", ""),
        ("Sollwinkel", "angle", "", "setpoint", ""),
        ("Motorstrom [mA]", "current", "motor", "", "mA"),
        ("current position", "angle", "", "actual", ""),
        ("Current actual value", "current", "", "actual", ""),
        ("torque_enabled", "flag", "", "", ""),
        ("theta_dot", "speed", "", "", ""),
        ("X1_ActualPosition", "angle", "", "actual", ""),
        ("DC bus voltage (V)", "supply", "", "", "V"),
        ("Following error", "error", "", "", ""),
        ("u_a", "voltage", "", "", ""),
        ("U / V", "voltage", "", "", "V"),
        ("n_Motor in min⁻¹", "speed", "motor", "", "rpm"),
        ("omega rad/s", "speed", "", "", "rad/s"),
        ("velocidad salida", "speed", "", "", ""),
        ("consigne vitesse", "speed", "", "setpoint", ""),
        ("millis", "time", "", "", "ms"),
        ("ms_today", "time", "", "", "ms"),
        ("Sekunden", "time", "", "", "s"),
        ("us current", "current", "", "", ""),
        ("min speed", "speed", "", "", ""),
    ],
)
def test_names_claim(name, quantity, side, role, unit):
    found = word(name)
    assert (found.quantity, found.side, found.role, found.unit) == (quantity, side, role, unit)


# --- the four measured drives, from their raw logs, with what their data sheets say

pytestmark_data = pytest.mark.skipif(
    not DATA.exists(), reason="the measured data are not in ../shared/data (docs/measurements.md names their sources)"
)
MEASURED = {
    "emps": ("emps/DATA_EMPS.mat", {"load.angle": "qm", "controller.angle_setpoint": "qg", "motor.torque": "vir"}, "inverse"),
    "worm_drive": ("worm_drive/steady_state.csv", {"reducer.input_speed": "motor_speed", "motor.torque": "motor_torque"}, "steady"),
    "lead_screw": ("lead_screw/steady_state.csv", {"reducer.input_speed": "motor_speed", "motor.torque": "motor_torque"}, "steady"),
    "xl330": ("xl330/kp800_sin_sin.csv", {"load.angle": "angle", "load.speed": "speed", "motor.duty": "duty", "motor.supply_voltage": "supply_voltage",
                                          "controller.angle_setpoint": "goal_angle", "motor.temperature": "temperature"}, "forward"),
}  # fmt: skip


@pytestmark_data
@pytest.mark.parametrize("name", MEASURED)
@pytest.mark.slow
def test_a_measured_drive_needs_its_data_sheet_alone(name, tmp_path):
    """The same columns as in the rig that was written by hand; with its numbers the replay runs, and compares as that one does."""
    log, columns, kind = MEASURED[name]
    begun = rig_init([DATA / log], tmp_path / "rig.toml")
    assert {signal: one.column for signal, one in begun.guess.taken.items()} == columns and begun.kind == kind
    text, sheet = begun.path.read_text(), rigs.load(RIGS / f"{name}.toml")
    text = text.replace(
        '# "motor.torque" = { column = "vir", factor = ? }', '"motor.torque" = { column = "vir", factor = 35.15 }'
    )
    for parameter, value in sheet.parameters.items():
        assert f'# "{parameter}" = ' in text, parameter
        text = re.sub(rf'# ("{re.escape(parameter)}" = )\S+', rf"\g<1>{value!r}", text, count=1)
    begun.path.write_text(text)
    found, by_hand = (diagnosis.replay(path, DATA / log, out=None, anyway=True) for path in (begun.path, RIGS / f"{name}.toml"))
    same = {c.name: c.error for c in by_hand.comparisons}
    assert found.comparisons and all(np.isfinite(c.error) for c in found.comparisons)
    for comparison in found.comparisons:
        if comparison.name in same and kind != "forward":
            assert comparison.error == pytest.approx(same[comparison.name], rel=0.1)


@pytestmark_data
@pytest.mark.parametrize("log", ["silverbox/SNLS80mV.csv", "cascaded_tanks/dataBenchmark.csv"])
def test_what_is_no_drive_is_taken_for_none(log, tmp_path):
    begun = rig_init([DATA / log], tmp_path / "rig.toml")
    assert not begun.kind and not begun.guess.taken and 'system = "model.fmu"' in begun.path.read_text()


@pytest.mark.slow
def test_public_forms_are_read(tmp_path):
    """A servo's JSON with a header of single numbers, and a bus recorder's attributes of each channel."""
    rows = [
        {"timestamp": t, "position": a, "speed": s, "goal_position": g, "input_volts": 7.4, "torque_enable": True}
        for t, a, s, g in zip(T, TRUTH["angle"], TRUTH["speed"], TRUTH["goal"])
    ]
    (tmp_path / "servo.json").write_text(json.dumps({"kp": 800, "dt": 0.002, "entries": rows}))
    begun = rig_init([tmp_path / "servo.json"], tmp_path / "servo.toml")
    assert begun.kind == "forward" and 'simulate = "closed"' in begun.path.read_text() and "kp = 800" in begun.path.read_text()
    assert [c.split(" ")[0] for c in begun.compares] == ["load.angle"]
    head = [
        "Name\tTest",
        "Starttime\t133\t12.03.2026",
        "",
        "Name\tMain.fActPos\tName\tMain.fActVel\tName\tMain.fTrq",
        "Data-Type\tREAL64\tData-Type\tREAL64\tData-Type\tREAL64",
        "Unit\t°\tUnit\t°/s\tUnit\tNm",
    ]
    body = [
        f"{t:.3f}\t{a:.5f}\t{t:.3f}\t{s:.5f}\t{t:.3f}\t{m:.6f}"
        for t, a, s, m in zip(T * 1e3, TRUTH["angle"] * DEG, TRUTH["speed"] * DEG, TRUTH["torque"])
    ]
    head.insert(2, "SampleTime[ms]\t2\tGear ratio\t60")
    (tmp_path / "scope.csv").write_text("\n".join([*head, "", *body]), encoding="utf-8")
    guess = place(read([tmp_path / "scope.csv"]))
    assert any("Gear ratio; 60" in note for note in guess.raw.notes)
    assert {s: (one.column, one.unit) for s, one in guess.taken.items()} == {
        "load.angle": ("Main.fActPos [°]", "deg"), "load.speed": ("Main.fActVel [°/s]", "deg/s"), "motor.torque": ("Main.fTrq [Nm]", "N.m"),
    }  # fmt: skip


def test_an_encoder_that_is_set_anew_still_tells_its_speed_and_the_ratio(tmp_path):
    jumps = 3.0 * (T > 2.0) - 7.0 * (T > 7.0) + 0.5 * (T > 9.0)
    table = {
        "t [s]": T,
        "motor speed [rpm]": TRUTH["motor_speed"] * RPM,
        "load angle [rad]": TRUTH["angle"] + jumps,
        "load speed [rad/s]": TRUTH["speed"],
    }
    pd.DataFrame(table).to_csv(tmp_path / "log.csv", index=False)
    guess = place(read([tmp_path / "log.csv"]))
    assert guess.ratio and guess.ratio[0] == pytest.approx(RATIO, rel=2e-3) and guess.taken["load.angle"].sure == "sure"


@pytest.mark.slow
@pytest.mark.parametrize("ending", ["csv", "parquet"])
def test_a_run_s_result_is_placed_by_its_names(ending, tmp_path):
    """What the motor is given by the master leads what it came from by a row, and is no set-point; a manoeuvre is one."""
    from selflock.master import Variable
    from selflock.master.files import sink

    late = lambda x: np.append(x[0], x[:-1])
    columns = {
        "time": ("s", T), "moves.angle": ("deg", DEG * TRUTH["goal"]), "moves.angle_speed": ("deg/s", DEG * np.gradient(TRUTH["goal"], T)),
        "arm_motor.speed": ("rad/s", late(TRUTH["motor_speed"])), "arm_motor.current": ("A", TRUTH["current"]),
        "arm_motor.torque": ("N.m", TRUTH["torque"]), "arm_controller.voltage": ("V", TRUTH["voltage"]),
        "arm_reducer.input_angle": ("rad", TRUTH["motor_angle"]), "arm_reducer.input_speed": ("rad/s", TRUTH["motor_speed"]),
        "arm_reducer.friction_torque": ("N.m", 0.02 * np.sign(TRUTH["speed"])),
        "arm_load.angle": ("rad", TRUTH["angle"]), "arm_load.speed": ("rad/s", TRUTH["speed"]),
    }  # fmt: skip
    made = sink([Variable(name, unit) for name, (unit, _) in columns.items()], tmp_path / f"run.{ending}")
    for row in np.column_stack([x for _, x in columns.values()]):
        made.block[made.fill] = row
        made.fill += 1
        made.checked()
    made.close()
    guess = rig_init([tmp_path / f"run.{ending}"], tmp_path / "rig.toml").guess
    placed = {signal: one.column.partition(" ")[0] for signal, one in guess.taken.items()}
    assert placed.pop("reducer.input_speed") in ("arm_reducer.input_speed", "arm_motor.speed")
    assert placed == {
        "controller.angle_setpoint": "moves.angle", "controller.speed_setpoint": "moves.angle_speed",
        "motor.current": "arm_motor.current", "motor.torque": "arm_motor.torque", "motor.voltage": "arm_controller.voltage",
        "reducer.input_angle": "arm_reducer.input_angle", "load.angle": "arm_load.angle", "load.speed": "arm_load.speed",
    }  # fmt: skip
    assert guess.taken["controller.angle_setpoint"].unit == "deg" and guess.ratio[0] == pytest.approx(RATIO, rel=2e-3)
