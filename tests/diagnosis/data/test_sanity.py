"""Typical slips in a rig or a log: each is told in a sentence that names it, and what is right passes.

The log is of a drive by closed forms, eq 2 to 20: a motion, the torque of a wedge gear that it needs, the voltage of a motor.
"""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pandas as pd
import pytest

from selflock.diagnosis import DataError, replay
from selflock.diagnosis.data import rig as rigs
from selflock.diagnosis.data.faults import check
from selflock.diagnosis.data.log import read
from selflock.diagnosis.data.sanity import box

from ..plant import bench

ROOT = Path(__file__).resolve().parents[3]
DATA = ROOT.parent / "shared" / "data"
RATIO, R, KE, INERTIA, WEIGHT, MU = 60.0, 2.0, 0.05, 1e-4, 4.905, 0.01
COLUMNS = {
    "controller.angle_setpoint": ("goal", "rad"), "motor.voltage": ("u", "V"), "motor.current": ("i", "A"),
    "reducer.input_speed": ("n", "rad/s"), "load.angle": ("phi", "rad"), "motor.torque": ("m", "N.m"), "load.speed": ("w", "rad/s"),
}  # fmt: skip
PARAMETERS = {
    "motor.resistance": R, "motor.voltage_constant": KE, "motor.torque_constant": KE, "reducer.gear_ratio": RATIO,
    "reducer.friction_kinetic": MU, "reducer.shaft_inertia": INERTIA, "load.inertia": 0.01, "load.mass": 2.0, "load.arm": 0.25,
}  # fmt: skip
FORWARD = ("controller.angle_setpoint", "motor.voltage", "motor.current", "reducer.input_speed", "load.angle", "load.speed")
INVERSE = ("motor.torque", "reducer.input_speed", "load.angle")


def table(step=0.004, lasting=20.0):
    """Moves to and fro with noise of sensors, and what they take."""
    rng = np.random.default_rng(3)
    t = np.arange(0.0, lasting, step)
    phi = 0.8 * np.sin(1.1 * t) + 0.3 * np.sin(2.9 * t + 1.0)
    w = 0.88 * np.cos(1.1 * t) + 0.87 * np.cos(2.9 * t + 1.0)
    a = -0.968 * np.sin(1.1 * t) - 2.523 * np.sin(2.9 * t + 1.0)
    pull = WEIGHT * np.cos(phi) + (0.01 + 2.0 * 0.25**2) * a
    alpha, rubs = np.arctan(1.0 / RATIO), np.arctan(MU)
    m = pull * np.where(pull * w > 0.0, np.tan(alpha + rubs), np.tan(alpha - rubs)) + INERTIA * RATIO * a
    i = m / KE
    u = R * i + KE * RATIO * w
    noisy = lambda x, sigma: x + sigma * rng.standard_normal(len(t))
    return pd.DataFrame(
        {"time": t, "goal": phi, "u": noisy(u, 0.02), "i": noisy(i, 0.02), "n": noisy(RATIO * w, 0.2),
         "phi": noisy(phi, 1e-4), "m": noisy(m, 1e-3), "w": noisy(w, 5e-3)}
    )  # fmt: skip


LOG = table()


def written(kind="forward", channels=None, head="", **changes):
    """A rig's text: parameters by component__name, columns by their own name."""
    channels = channels or (FORWARD if kind == "forward" else INVERSE)
    lines = ["[rig]", f'kind = "{kind}"', head, "[columns]"]
    for name in channels:
        column, unit = COLUMNS[name]
        lines.append(f'"{name}" = {changes.pop(column, None) or f"{{ column = {chr(34)}{column}{chr(34)}, unit = {chr(34)}{unit}{chr(34)} }}"}')  # fmt: skip
    lines.append("[parameters]")
    if changes.pop("nothing", False):
        return "\n".join(lines)
    given = PARAMETERS | {name.replace("__", "."): value for name, value in changes.items()}
    return "\n".join(lines + [f'"{name}" = {value!r}' for name, value in given.items()])


def boxed(folder, text, log=LOG):
    (folder / "rig.toml").write_text(text)
    log.to_parquet(folder / "log.parquet")
    rig = rigs.load(folder / "rig.toml")
    runs = read(folder / "log.parquet", rig)
    check(runs, rig)
    return box(rig, runs)


def stopped(folder, text, log=LOG):
    """The one sentence that stops."""
    found = boxed(folder, text, log)
    assert len(found.gross) == 1, found.lines()
    return found.gross[0]


@pytest.mark.parametrize("kind", ["forward", "inverse"])
def test_a_right_rig_passes_without_a_word(kind, tmp_path):
    found = boxed(tmp_path, written(kind))
    assert not found.findings, found.lines()
    assert "reducer.shaft_stiffness" in found.assumed and "reducer.gear_ratio" not in found.assumed
    assert any("(rig 60)" in line for line in found.shows)


FORWARDS = {  # of a forward rig
    "millivolts": ({}, LOG.assign(u=1e3 * LOG.u), ("'u' (motor.voltage)", "mV read as V", 'unit = "mV"')),
    "rpm per volt": ({"motor__voltage_constant": 191.0}, LOG, ("rpm/V given as V.s/rad", "motor.voltage_constant = 0.05")),
    "sign of a speed": ({}, LOG.assign(n=-LOG.n), ("'n' (reducer.input_speed)", "the other way", "factor = -1")),
    "ratio 6 for 60": ({"reducer__gear_ratio": 6.0}, LOG, ("turn in a ratio of 60", "the rig says 6", "reducer.gear_ratio = 60")),
    "ratio inverted": ({"reducer__gear_ratio": 1 / 60}, LOG, ("upside down", "reducer.gear_ratio = 60")),
    "ms as s": ({}, LOG.assign(time=1e3 * LOG.time), ("'time' 1000 times", "ms read as s", "[time]")),
    "degrees as radians": ({}, LOG.assign(phi=np.degrees(LOG.phi)), ("'phi' (load.angle)", "degrees read as radians", 'unit = "deg"')),
    "rpm as rad/s": ({}, LOG.assign(n=LOG.n * 30 / np.pi), ("'n' (reducer.input_speed)", "rpm read as rad/s", 'unit = "rpm"')),
    "milliamperes": ({}, LOG.assign(i=1e3 * LOG.i), ("'i' (motor.current)", "mA read as A", 'unit = "mA"')),
    "sign of a current": ({}, LOG.assign(i=-LOG.i), ("turn the sign of column 'i' (motor.current), factor = -1",)),
    "columns exchanged": ({"u": '"i"', "i": '"u"'}, LOG, ("exchanged", "'i' (motor.voltage)", "'u' (motor.current)")),
    "kiloohms": ({"motor__resistance": 0.002}, LOG, ("kOhm given as Ohm?", "motor.resistance = 2")),
    "no parameters": ({"nothing": True}, LOG, ("[parameters] of rig.toml is empty", "data sheets", "gear's ratio")),
}  # fmt: skip
INVERSES = {
    "sign of a torque": ({}, LOG.assign(m=-LOG.m), ("'m' (motor.torque)", "against the motion", "factor = -1")),
    "millinewtonmetres": ({}, LOG.assign(m=1e3 * LOG.m), ("'m' (motor.torque)", "mN.m read as N.m", 'unit = "mN.m"')),
    "inertia in g.cm2": ({"reducer__shaft_inertia": 1e3}, LOG, ("reducer.shaft_inertia may be in g.cm2", "0.0001 kg.m2")),
    "sign of an angle": ({}, LOG.assign(phi=-LOG.phi), ("load.angle", "the other way", "factor = -1")),
}


@pytest.mark.alike
@pytest.mark.parametrize("slip", FORWARDS)
def test_a_slip_of_a_forward_rig_is_told_in_a_sentence(slip, tmp_path):
    changes, log, words = FORWARDS[slip]
    text = stopped(tmp_path, written("forward", **changes), log)
    assert all(word in text for word in words), text


@pytest.mark.parametrize("slip", INVERSES)
def test_a_slip_of_an_inverse_rig_is_told_in_a_sentence(slip, tmp_path):
    changes, log, words = INVERSES[slip]
    text = stopped(tmp_path, written("inverse", **changes), log)
    assert all(word in text for word in words), text


ONE_SHAFT = ("motor.voltage", "motor.current", "reducer.input_speed")  # nothing else tells of the motion


@pytest.mark.parametrize(
    "log, words",
    [
        (LOG.assign(n=-LOG.n), ("turn the sign of column 'n' (reducer.input_speed), factor = -1",)),
        (LOG.assign(u=1e3 * LOG.u), ("mV read as V", "'u' (motor.voltage)")),
        (LOG.assign(n=LOG.n * 30 / np.pi), ("rpm read as rad/s", "'n' (reducer.input_speed)")),
    ],
    ids=["sign of a speed", "millivolts", "rpm as rad/s"],
)
def test_a_slip_shows_in_the_voltages_balance_alone(log, words, tmp_path):
    text = stopped(tmp_path, written("forward", ONE_SHAFT), log)
    assert all(word in text for word in words), text


TORQUED = ("motor.voltage", "reducer.input_speed", "motor.torque")


@pytest.mark.parametrize(
    "log, channels, words",
    [
        (LOG.assign(m=LOG.i), TORQUED, ("times what the motor can give with column 'u'", "a current in A? Then it is \"motor.current\"")),
        (LOG.assign(m=1e3 * LOG.i), TORQUED, ("a current in mA? Then it is \"motor.current\", unit = \"mA\"",)),
        (LOG.assign(m=1e3 * LOG.m), (*TORQUED, "motor.current"), ("1000 times what column 'i' (motor.current) makes of it", "mN.m read as N.m")),
        (LOG, (*TORQUED, "motor.current"), ()),
    ],
    ids=["amperes", "milliamperes", "millinewtonmetres", "as it is"],
)  # fmt: skip
def test_a_torque_is_what_the_motor_can_give(log, channels, words, tmp_path):
    found = boxed(tmp_path, written("forward", channels), log)
    assert len(found.gross) == bool(words) and all(word in found.gross[0] for word in words), found.gross


@pytest.mark.parametrize("turning, stops", [(1.0, True), (0.0, False)])
def test_an_angle_that_begins_anew_is_no_motion(turning, stops, tmp_path):
    """A load that goes on turning; as it is written by an encoder of one turn, and where it never comes round."""
    phi = np.mod(LOG.phi + turning * 2.0 * LOG.time, 2.0 * np.pi) if turning else LOG.phi
    column = '{ column = "phi", unit = "rad" }'
    found = boxed(tmp_path, written("inverse", phi=column), LOG.assign(phi=phi, n=LOG.n + turning * 2.0 * RATIO))
    assert any("'phi' (load.angle) jumps back by a turn" in text and "wraps = 360.0" in text for text in found.gross) == stops
    mended = written("inverse", phi=column.replace(" }", ", wraps = 6.283185307 }"))
    found = boxed(tmp_path, mended, LOG.assign(phi=phi, n=LOG.n + turning * 2.0 * RATIO))
    assert not any("jumps back" in text for text in found.gross)


def test_a_clock_that_no_second_channel_shows_is_remarked_on(tmp_path):
    found = boxed(tmp_path, written("forward", ONE_SHAFT), LOG.assign(time=1e3 * LOG.time))
    (remark,) = (f.sentence for f in found.findings)
    assert not found.gross and "rows are 4 s apart by column 'time'" in remark and 'unit = "ms" under [time]' in remark


@pytest.mark.parametrize("inertia", [1e-4, 1e-2])
def test_what_runs_down_or_falls_without_a_torque_is_no_slip(inertia, tmp_path):
    """Coasting after a start that was not recorded, and a weight that falls and pulls its motor along."""
    rng = np.random.default_rng(7)
    noise = lambda sigma: sigma * rng.standard_normal(len(t))
    t = np.arange(0.0, 10.0, 0.002)
    rig = written("inverse", ("motor.torque", "reducer.input_speed"), reducer__shaft_inertia=inertia)
    coasts = pd.DataFrame({"time": t, "n": 300.0 * np.exp(-t / 3.0) + noise(0.1), "m": noise(1e-3)})
    assert not boxed(tmp_path, rig, coasts).gross
    rises = 2.0 * (t % 2.0) * np.where(t % 4.0 < 2.0, 1.0, -1.0)  # rad/s at the load, five times
    lifted = written(
        "inverse",
        ("motor.torque", "reducer.input_speed"),
        reducer__shaft_inertia=inertia,
        load__mass=0.0,
        load__constant_torque=5.0,
    )
    assert not boxed(tmp_path, lifted, coasts).gross  # by the inertia of the shaft
    falls = pd.DataFrame({"time": t, "n": RATIO * rises + noise(0.1), "m": noise(1e-3)})
    assert not boxed(tmp_path, rig, falls).gross


def test_a_gear_that_nothing_loads_is_told(tmp_path):
    """Its torque is 0 at every speed: a replay that shows only that would pass for a result."""
    log = pd.DataFrame({"time": np.arange(40.0), "n": np.linspace(-200.0, 200.0, 40), "m": 0.002 * np.sign(np.arange(40) - 19.5)})
    columns = '[columns]\n"reducer.input_speed" = "n"\n"motor.torque" = "m"\n[parameters]\n"reducer.gear_ratio" = 60.0\n'
    rig = f'[rig]\nname = "worm"\nkind = "steady"\n{columns}"reducer.friction_kinetic" = 0.12\n'
    (remark,) = boxed(tmp_path, rig, log).findings
    assert not remark.gross and "its torque is 0 at every speed" in remark.sentence and "load.constant_torque" in remark.sentence
    for name in ("load.constant_torque", "load.mass", "load.damping", "reducer.preload", "reducer.viscous_damping"):
        assert not any("loads the gear" in f.sentence for f in boxed(tmp_path, f'{rig}"{name}" = 1e-4\n', log).findings), name


def test_the_wrong_kind_is_told(tmp_path):
    text = stopped(tmp_path, written("steady", ("motor.torque", "reducer.input_speed")))
    assert 'kind = "steady"' in text and "constant speed" in text and '"inverse"' in text
    found = boxed(tmp_path, written("inverse", FORWARD))  # a motion that may have been imposed: a remark
    (remark,) = (f.sentence for f in found.findings)
    assert (
        'kind = "inverse" says that the motion was imposed' in remark
        and "'u' (motor.voltage)" in remark
        and '"forward"' in remark
        and not found.gross
    )


def test_gradians_are_asked_about(tmp_path):
    (tmp_path / "rig.toml").write_text(written("forward", phi='{ column = "phi", unit = "grad" }'))
    with pytest.raises(DataError, match="'load.angle'.*'grad' is a gradian.*write deg"):
        rigs.load(tmp_path / "rig.toml")


@pytest.mark.parametrize("off", [np.pi / 2, -3 * np.pi / 2])
def test_an_angles_zero_is_remarked_on_and_stops_nothing(off, tmp_path):
    found = boxed(tmp_path, written("forward"), LOG.assign(phi=LOG.phi + off))
    (remark,) = (f.sentence for f in found.findings)
    assert not found.gross and f"lies {off:.3g} rad" in remark and f"offset = {-off:.4g}" in remark
    found = boxed(tmp_path, written("inverse"), LOG.assign(phi=LOG.phi + off))  # no set-point: by gravity
    (remark,) = (f.sentence for f in found.findings)
    assert not found.gross and "gravity pulls on column 'phi'" in remark and "-90 degrees" in remark, remark


def lasting(log, times=60):
    """The same motions over and over, for twenty minutes: in a 200th of it there are several."""
    every = log.iloc[::4]
    whole = every.time.iloc[-1] - every.time.iloc[0] + every.time.iloc[1] - every.time.iloc[0]
    return pd.concat([every.assign(time=every.time + whole * k) for k in range(times)])


@pytest.mark.slow
@pytest.mark.alike
@pytest.mark.parametrize(
    "slip", ["ms as s", "degrees as radians", "milliamperes", "columns exchanged", "sign of a torque", "inertia in g.cm2"]
)
def test_a_slip_is_told_of_a_long_log_too(slip, tmp_path):
    """Of whole motions in a piece nothing is left: it was silent."""
    kind, (changes, log, words) = ("forward", FORWARDS[slip]) if slip in FORWARDS else ("inverse", INVERSES[slip])
    text = stopped(tmp_path, written(kind, **changes), lasting(log))
    assert all(word in text for word in words if not any(c.isdigit() for c in word)), text


@pytest.mark.slow
@pytest.mark.parametrize("kind", ["forward", "inverse"])
def test_a_right_rig_of_a_long_log_passes(kind, tmp_path):
    found = boxed(tmp_path, written(kind), lasting(LOG))
    assert not found.findings and any("(rig 60)" in line for line in found.shows), found.lines()


@pytest.mark.slow
def test_a_long_log_whose_angle_lags_a_little_has_no_other_zero(tmp_path):
    """Means over its pieces, of many motions each, lie closer together than what a load pulls them off."""
    every = LOG.iloc[::20]
    long = pd.concat([every.assign(time=every.time + 20.0 * k, phi=every.phi - 0.02) for k in range(400)])
    channels = ("controller.angle_setpoint", "motor.voltage", "load.angle")
    assert not [f for f in boxed(tmp_path, written("forward", channels), long).findings if "lies" in f.sentence]


@pytest.mark.parametrize("off, stops", [(np.pi / 2, True), (-3 * np.pi / 2, True), (1.2, False)])
def test_another_zero_stops_a_loop_that_is_simulated_whole(off, stops, tmp_path):
    """No number of the drive moves its angle by quarters of a turn: causes that were named for it were none."""
    text = written("forward", ("controller.angle_setpoint", "load.angle", "load.speed"), 'simulate = "closed"')
    found = boxed(tmp_path, text, LOG.assign(phi=LOG.phi + off))
    described = boxed(tmp_path, written("forward", controller__angle_gain=300.0), LOG.assign(phi=LOG.phi + off))
    (about,) = (f for f in found.findings if "controller.angle_setpoint" in f.sentence)
    assert bool(described.gross) == stops
    assert about.gross == stops and f"offset = {-off:.{6 if stops else 4}g}" in about.sentence
    assert ("counted from another zero" in about.sentence) == stops


@pytest.mark.parametrize("channels", [INVERSE, ("motor.current", "reducer.input_speed", "load.angle")], ids=["torque", "current"])
def test_an_arm_half_a_turn_from_where_it_hangs_is_remarked_on(channels, tmp_path):
    (remark,) = (f.sentence for f in boxed(tmp_path, written("inverse", channels, load__arm_angle=3.14159)).findings)
    assert "gravity pushes column 'phi' (load.angle) up" in remark and "load.arm_angle = -2.65" in remark or "= 0" in remark, (
        remark
    )


def test_an_arms_angle_in_degrees_is_remarked_on(tmp_path):
    (remark,) = (f.sentence for f in boxed(tmp_path, written("inverse", load__arm_angle=-90.0)).findings)
    assert remark == "load.arm_angle = -90 rad is more than a turn: degrees given as rad? Write -1.5708."


def test_an_angle_and_its_set_point_in_one_wrong_unit_are_told_both(tmp_path):
    log = LOG.assign(phi=np.degrees(LOG.phi), goal=np.degrees(LOG.goal))
    text = stopped(tmp_path, written("forward", FORWARD[:-1]), log)
    assert "Write unit = \"deg\" of column 'phi' (load.angle) and of column 'goal' (controller.angle_setpoint)" in text, text


@pytest.mark.parametrize("late, told", [(0.0, False), (0.04, False), (-0.008, False), (-0.04, True)])
def test_an_angle_ahead_of_its_set_point_may_be_exchanged_with_it(late, told, tmp_path):
    """Late by a loop's lag, or early by two rows as a recorder may read it, it is none."""
    late_by = np.interp(LOG.time - late, LOG.time, LOG.goal) + 1e-4 * np.random.default_rng(4).standard_normal(len(LOG))
    found = boxed(
        tmp_path, written("forward", ("controller.angle_setpoint", "motor.voltage", "load.angle")), LOG.assign(phi=late_by)
    )
    sentences = [f.sentence for f in found.findings if "may be exchanged, then swap" in f.sentence]
    assert len(sentences) == told and not found.gross
    assert not told or "column 'phi' (load.angle) runs 40 ms ahead of column 'goal' (controller.angle_setpoint)" in sentences[0]


def test_what_a_column_is_in_already_is_not_proposed(tmp_path):
    """mOhm for Ohm beside a current in mA: the current's unit is said."""
    columns = written("forward", motor__resistance=2000.0, i='{ column = "i", unit = "mA" }')
    text = stopped(tmp_path, columns, LOG.assign(i=1e3 * LOG.i))
    assert "mOhm given as Ohm? motor.resistance = 2" in text and "mA read as A" not in text


def test_a_constant_that_is_wrong_accuses_no_column(tmp_path):
    """The torque of a current by a constant in mN.m/A: one sentence, of the constant."""
    text = stopped(tmp_path, written("forward", motor__torque_constant=50.0))
    assert "motor.torque_constant = 0.05, if 50 is in mN.m/A" in text


def test_an_inertia_at_the_load_is_told_beside_friction(tmp_path):
    text = stopped(tmp_path, written("inverse", load__inertia=5000.0), LOG.assign(m=LOG.m + 0.1 * np.sign(LOG.n)))
    assert "load.inertia may be in kg.cm2: 0.5 kg.m2 would do" in text


@pytest.mark.parametrize("moved", ["load.speed", "load.angle"])
def test_an_inertia_is_told_by_the_loads_motion_alone(moved, tmp_path):
    channels = ("motor.torque", moved)
    assert not boxed(tmp_path, written("inverse", channels)).findings
    text = stopped(tmp_path, written("inverse", channels, reducer__shaft_inertia=1e3))
    assert f"({moved}) does, the rig's inertia asks for" in text and "reducer.shaft_inertia may be in g.cm2: 0.0001 kg.m2" in text


def test_a_mass_in_g_of_a_linear_drive_is_told(tmp_path):
    """A force in N, and kg stand for kg.m2."""
    log = LOG.assign(m=12.0 * np.gradient(LOG.w, LOG.time).clip(-9.0, 9.0) + 8.0 * np.sign(LOG.w))
    text = written("inverse", ("motor.torque", "load.speed"), "linear = true", reducer__gear_ratio=1.0, load__mass=0.0, load__inertia=1e-3, reducer__shaft_inertia=12e3)  # fmt: skip
    text = text.replace('unit = "N.m"', 'unit = "N"').replace('unit = "rad/s"', 'unit = "m/s"')
    assert "times the force of column 'm' (motor.torque): reducer.shaft_inertia may be in g: 12 kg would do" in stopped(
        tmp_path, text, log
    )


def test_a_friction_beyond_1_is_blamed_before_arms(tmp_path):
    text = stopped(tmp_path, written("inverse", reducer__friction_kinetic=3.0))
    assert "reducer.friction_kinetic may be in percent" in text and "load.arm may be" not in text


def test_a_constant_that_was_assumed_beside_a_motors_other_one(tmp_path):
    text = written("forward", motor__voltage_constant=0.5, motor__torque_constant=0.5)
    text = text.replace('"motor.torque_constant" = 0.5\n', "")
    scaled = LOG.assign(u=R * LOG.i + 0.5 * LOG.n)
    assert "motor.torque_constant is not given, and 0.03" in stopped(tmp_path, text, scaled)


@pytest.mark.parametrize("name", ["torque_constant", "voltage_constant"])
def test_of_two_constants_the_one_in_rpm_per_volt_is_named(name, tmp_path):
    constants = {"motor__torque_constant": 0.05, "motor__voltage_constant": 0.05, f"motor__{name}": 191.0}
    *_, text = boxed(tmp_path, written("forward", ("motor.voltage", "load.angle"), **constants)).gross
    assert f"motor.{name} = 0.05" in text and "rpm/V" in text and "= 191, if" not in text


def test_a_replay_begins_with_the_box(tmp_path):
    (tmp_path / "rig.toml").write_text(written("inverse", reducer__shaft_inertia=1e3))
    LOG.to_parquet(tmp_path / "log.parquet")
    with pytest.raises(DataError, match="contradict each other(?s:.*)g.cm2(?s:.*)--anyway"):
        replay(tmp_path / "rig.toml", tmp_path / "log.parquet", None)


@pytest.mark.slow
def test_a_replay_goes_on_when_asked(tmp_path):
    (tmp_path / "rig.toml").write_text(written("inverse", reducer__shaft_inertia=1e3))
    LOG.to_parquet(tmp_path / "log.parquet")
    result = replay(tmp_path / "rig.toml", tmp_path / "log.parquet", None, anyway=True)
    assert "CONTRADICTION" in result.summary() and "assumed" in result.summary()


def test_noise_alone_says_nothing(tmp_path):
    """A drive at rest: no sign, no ratio."""
    rng = np.random.default_rng(5)
    rest = LOG.assign(**{name: 1e-3 * rng.standard_normal(len(LOG)) for name in ("n", "phi", "w", "i", "m")}, u=0.0, goal=0.0)
    assert not boxed(tmp_path, written("forward"), rest).gross
    assert not boxed(tmp_path, written("inverse"), rest).gross


@pytest.mark.in_turn
@pytest.mark.slow
@pytest.mark.parametrize("name, kind", [("", "steady"), ("motor.supply_sag", "forward"), ("reducer.viscous", "inverse")])
def test_what_a_diagnosis_is_there_to_find_passes(name, kind, tmp_path):
    """Hidden drives, sound and with strong effects: nothing is stopped, nothing remarked on."""
    case = bench.hide([name] if name else [], seed=1010, target=10.0, kind=kind)
    rig, *logs = case.write(tmp_path)
    for log in logs:
        rig = rigs.load(tmp_path / "rig.toml")
        runs = read(log, rig)
        check(runs, rig)
        assert not box(rig, runs).findings, box(rig, runs).lines()


@pytest.mark.slow
@pytest.mark.alike
@pytest.mark.skipif(
    not DATA.exists(), reason="the measured data are not in ../shared/data (docs/measurements.md names their sources)"
)
@pytest.mark.parametrize("name", ["lead_screw/steady_state.csv", "worm_drive/steady_state.csv", "emps/DATA_EMPS.mat", "xl330/kp100_lift_and_drop.csv"])  # fmt: skip
def test_measured_drives_pass_without_a_word(name):
    rig = rigs.load(ROOT / "examples" / "rigs" / f"{name.partition('/')[0]}.toml")
    runs = read(DATA / name, rig)
    check(runs, rig)
    found = box(rig, runs)
    assert not found.findings and found.assumed, found.lines()


TURNED = ("motor.torque", "reducer.input_speed")  # no angle: nobody tells where the arm hangs
LIFTED = {
    "by a torque": ("inverse", INVERSE),
    "by a current": ("inverse", ("motor.current", "reducer.input_speed", "load.angle")),
    "by a voltage": ("forward", ("motor.voltage", "reducer.input_speed", "load.angle")),
    "by what the supply lets it give": ("forward", ("controller.angle_setpoint", "load.angle", "load.speed")),
    "by a torque, whatever the arm's angle": ("inverse", TURNED),
    "by a voltage, whatever the arm's angle": ("forward", ("motor.voltage", "reducer.input_speed")),
}
OVER = {  # what somebody wrote, and the words that tell it
    "an arm in mm": ({"load__arm": 250.0}, ("load.arm may be in mm: 0.25 m would do",)),
    "an arm in cm": ({"load__arm": 25.0}, ("load.arm may be in cm: 0.25 m would do",)),
    "a mass in g": ({"load__mass": 2000.0}, ("load.mass may be in g: 2 kg would do",)),
    "a torque in mN.m": ({"load__constant_torque": 4905.0}, ("load.constant_torque may be in mN.m: 4.905 N.m would do",)),
    "a damping in mN.m.s/rad": ({"reducer__viscous_damping": 1.0}, ("reducer.viscous_damping may be in mN.m.s/rad",)),
    "friction in percent": ({"reducer__friction_kinetic": 1.0}, ("reducer.friction_kinetic may be in percent: 0.01 would do",)),
}  # fmt: skip


# an arm that hangs at some other angle asks for less, whatever its gear's friction: that slip of 100 is below what stops
SEEN = [(slip, by) for slip in OVER for by in LIFTED if (slip, "whatever" in by) != ("friction in percent", True)]


@pytest.mark.alike
@pytest.mark.parametrize("slip, by", SEEN)
def test_what_no_motor_could_lift_is_told(slip, by, tmp_path):
    changes, words = OVER[slip]
    kind, channels = LIFTED[by]
    limits = {} if "voltage" not in by and "supply" not in by else {"controller__voltage_min": -12.0, "controller__voltage_max": 12.0}  # fmt: skip
    assert not boxed(tmp_path, written(kind, channels, **limits)).findings
    found = boxed(tmp_path, written(kind, channels, **limits, **changes))
    (finding,) = found.findings
    assert "to move the load as" in finding.sentence and all(word in finding.sentence for word in words), finding.sentence


def test_limits_that_were_assumed_tell_what_is_gross_alone(tmp_path):
    channels = ("controller.angle_setpoint", "load.angle", "load.speed")
    assert not boxed(tmp_path, written("forward", channels)).findings
    text = stopped(tmp_path, written("forward", channels, load__arm=250.0))
    assert "controller.voltage_max = 24 V, which was assumed" in text and "load.arm may be in mm: 0.25 m" in text
    assert not boxed(tmp_path, written("forward", channels, load__mass=40.0)).findings  # at 120 V it may do


@pytest.mark.parametrize(
    "changes, words",
    [
        ({"reducer__friction_static": 1.5}, ("reducer.friction_static = 1.5 is beyond 1", "in percent? Write 0.015")),
        ({"reducer__friction_static": 0.8}, ("reducer.friction_static = 0.8 is 80 times reducer.friction_kinetic = 0.01",)),
        ({"reducer__friction_static": 0.1}, ()),
    ],
    ids=["beyond 1", "in percent beside a share", "sticky"],
)
def test_a_friction_that_no_gear_has_is_remarked_on(changes, words, tmp_path):
    found = boxed(tmp_path, written("inverse", **changes))
    assert not found.gross and [all(word in f.sentence for word in words) for f in found.findings] == [True] * bool(words)


@pytest.mark.parametrize(
    "ratio, words", [(None, ("so that 50 was assumed", "= 60")), (45.0, ("the rig says 45", "= 60")), (55.0, ())]
)
def test_a_ratio_that_is_not_the_logs_is_remarked_on(ratio, words, tmp_path):
    """One that was assumed by 1 %, one that somebody gave by a quarter: a sensor may have a scale."""
    text = written("inverse", **({"reducer__gear_ratio": ratio} if ratio else {}))
    text = text if ratio else text.replace('"reducer.gear_ratio" = 60.0\n', "")
    about = [f for f in boxed(tmp_path, text).findings if "turn in a ratio of 60" in f.sentence]
    assert [all(word in f.sentence for word in words) and not f.gross for f in about] == [True] * bool(words)
