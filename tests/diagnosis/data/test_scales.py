"""Numbers that are a unit off where no balance of torques tells: inductance, stiffness, gains, limits; and which a log says nothing of.

The log is of a drive by closed forms: two shafts with a twist between them, the voltage of a motor, and the set-point that a PD
controller makes that voltage of.
"""

from __future__ import annotations

import numpy as np
import pandas as pd
import pytest

from selflock.diagnosis.data import rig as rigs
from selflock.diagnosis.data.faults import check
from selflock.diagnosis.data.log import read
from selflock.diagnosis.data.sanity import box

RATIO, R, K, COIL, SHAFT, GAIN, DAMPS, WEIGHT = 60.0, 2.0, 0.05, 5e-4, 2000.0, 300.0, 6.0, 4.905
COLUMNS = {
    "controller.angle_setpoint": ("goal", "rad"), "controller.speed_setpoint": ("rate", "rad/s"), "motor.voltage": ("u", "V"),
    "motor.current": ("i", "A"), "motor.duty": ("duty", "1"), "motor.supply_voltage": ("supply", "V"), "reducer.input_angle": ("a", "rad"), "reducer.input_speed": ("n", "rad/s"), "load.angle": ("phi", "rad"),
}  # fmt: skip
PARAMETERS = {
    "motor.resistance": R, "motor.inductance": COIL, "motor.voltage_constant": K, "motor.torque_constant": K, "reducer.gear_ratio": RATIO,
    "reducer.friction_kinetic": 0.01, "reducer.shaft_inertia": 1e-4, "reducer.shaft_stiffness": SHAFT, "load.inertia": 0.01, "load.mass": 2.0,
    "load.arm": 0.25, "controller.angle_gain": GAIN, "controller.speed_gain": DAMPS, "controller.voltage_max": 24.0, "controller.voltage_min": -24.0,
}  # fmt: skip
LOOP = ("controller.angle_setpoint", "controller.speed_setpoint", "motor.voltage", "motor.current", "reducer.input_angle", "reducer.input_speed", "load.angle")  # fmt: skip


def table(step=0.002, lasting=20.0):
    rng = np.random.default_rng(5)
    t = np.arange(0.0, lasting, step)
    waves = ((0.8, 1.1, 0.0), (0.3, 2.9, 1.0), (0.1, 7.0, 2.0))
    phi = sum(a * np.sin(w * t + p) for a, w, p in waves)
    speed = sum(a * w * np.cos(w * t + p) for a, w, p in waves)
    faster = sum(-a * w * w * np.sin(w * t + p) for a, w, p in waves)
    pull = WEIGHT * np.cos(phi) + (0.01 + 2.0 * 0.25**2) * faster
    tangent, rubs = np.arctan(1.0 / RATIO), np.arctan(0.01)
    torque = pull * np.where(pull * speed > 0.0, np.tan(tangent + rubs), np.tan(tangent - rubs)) + 1e-4 * RATIO * faster
    current = torque / K
    voltage = R * current + K * RATIO * speed + COIL * np.gradient(current, t)
    error, goal = np.zeros(len(t)), phi.copy()  # U = k_phi e + k_w de/dt
    for k in range(len(t) - 1):
        error[k + 1] = error[k] + step * (voltage[k] - GAIN * error[k]) / DAMPS
    goal = phi + error
    noisy = lambda x, sigma: x + sigma * rng.standard_normal(len(t))
    return pd.DataFrame(
        {"time": t, "goal": goal, "rate": speed + (voltage - GAIN * error) / DAMPS, "u": noisy(voltage, 0.01), "i": noisy(current, 0.01),
         "a": RATIO * (phi + pull / SHAFT), "n": noisy(RATIO * speed, 0.1), "phi": noisy(phi, 2e-5)}
    )  # fmt: skip


LOG = table()


def boxed(folder, channels=LOOP, log=LOG, without=(), **changes):
    """What is found with some parameters as somebody wrote them, by component__name."""
    columns = [f'"{name}" = {{ column = "{COLUMNS[name][0]}", unit = "{COLUMNS[name][1]}" }}' for name in channels]
    given = {n: v for n, v in PARAMETERS.items() if n not in without} | {n.replace("__", "."): v for n, v in changes.items()}
    numbers = [f'"{name}" = {value!r}' for name, value in given.items()]
    text = ["[rig]", 'kind = "forward"', "[columns]", *columns, "[parameters]", *numbers]
    (folder / "rig.toml").write_text("\n".join(text))
    log.to_parquet(folder / "log.parquet")
    rig = rigs.load(folder / "rig.toml")
    runs = read(folder / "log.parquet", rig)
    check(runs, rig)
    return box(rig, runs)


def test_right_numbers_pass_and_each_would_be_missed(tmp_path):
    found = boxed(tmp_path)
    assert not found.findings and not found.silent, found.lines()


SLIPS = {  # as it was written, whether it stops, and words of the sentence
    "mH": ({"motor__inductance": 0.5}, True, ("motor.inductance = 0.5 H takes", "beyond R i + k_e w", "mH given as H? Write motor.inductance = 0.0005.")),
    "µH": ({"motor__inductance": 500.0}, True, ("µH given as H? Write motor.inductance = 0.0005.",)),
    "per degree": ({"reducer__shaft_stiffness": 34.9066}, True, ("the output winds up", "'a' (reducer.input_angle)", "= 2000, if 34.9066 is in N.m/deg")),
    "per arcmin": ({"reducer__shaft_stiffness": 0.581776}, True, ("= 2000, if 0.581776 is in N.m/arcmin",)),
    "V per degree": ({"controller__angle_gain": 5.23599}, True, ("'u' (motor.voltage)", "the log says about 300", "= 300, if 5.23599 is in V/deg")),
    "mV per rad": ({"controller__angle_gain": 3e5}, True, ("controller.angle_gain = 300, if 300000 is in mV/rad",)),
    "V per mrad": ({"controller__angle_gain": 0.3}, True, ("controller.angle_gain = 300, if 0.3 is in V/mrad",)),
    "mV.s per rad": ({"controller__speed_gain": 6e3}, True, ("controller.speed_gain = 6, if 6000 is in mV.s/rad",)),
    "kV": ({"controller__voltage_max": 0.024}, True, ("goes to", "beyond controller.voltage_max = 0.024 V", "kV given as V? Write controller.voltage_max = 24.")),
    "mV": ({"controller__voltage_max": 24000.0}, False, ("more than drives have", "stays within", "mV given as V? Write controller.voltage_max = 24.")),
    "a limit without its sign": ({"controller__voltage_min": 24.0}, True, ("beyond controller.voltage_min = 24 V", "write controller.voltage_min = -24.")),
}  # fmt: skip


def test_an_angle_that_alone_tells_the_speed_may_be_in_degrees(tmp_path):
    """They were a voltage constant in mV/rpm, although the torque constant, which is the same number, spoke against that."""
    channels = ("motor.voltage", "motor.current", "reducer.input_angle")
    (finding,) = boxed(tmp_path, channels, LOG.assign(a=np.degrees(LOG.a))).findings
    words = "degrees read as rad? Write unit = \"deg\" for column 'a' (reducer.input_angle)"
    assert finding.gross and words in finding.sentence and "mV/rpm" not in finding.sentence, finding.sentence


@pytest.mark.alike
@pytest.mark.parametrize("slip", SLIPS)
def test_a_unit_that_the_log_contradicts_is_told_in_a_sentence(slip, tmp_path):
    changes, stops, words = SLIPS[slip]
    found = boxed(tmp_path, **changes)
    (finding,) = found.findings
    assert finding.gross == stops and all(word in finding.sentence for word in words), finding.sentence
    (name,) = changes
    assert name.replace("__", ".") in finding.about


@pytest.mark.parametrize(
    "changes, words",
    [
        ({"motor__inductance": 0.5}, ("time constant of 0.25 s", "mH given as H? Write motor.inductance = 0.0005.")),
        ({"motor__inductance": 500.0}, ("µH given as H?",)),
        ({"motor__inductance": 5e-7}, ("time constant of 2.5e-07 s", "sheets have mH; 0.0005 or so would do")),
        ({"reducer__shaft_stiffness": 4.0}, ("winds up by", "the load's weight", "N.m/deg", "N.m/arcmin")),
        ({"reducer__shaft_stiffness": 25.0, "load__inertia": 9.0}, ("the load swings at 0.26", "N.m/deg")),
    ],
    ids=["mH", "µH", "henries of nothing", "per arcmin", "a load that swings"],
)
def test_where_the_log_does_not_show_it_physics_may(changes, words, tmp_path):
    """Without the current, and with one shaft alone."""
    channels = ("motor.voltage", "load.angle")
    assert not boxed(tmp_path, channels).findings
    found = boxed(tmp_path, channels, **changes)
    (finding,) = (f for f in found.findings if set(f.about) & {"motor.inductance", "reducer.shaft_stiffness"})
    assert all(word in finding.sentence for word in words), finding.sentence


def test_what_a_log_says_nothing_of_is_told_as_that(tmp_path):
    found = boxed(tmp_path, ("motor.voltage", "load.angle"))
    assert found.silent == ("reducer.shaft_stiffness",)  # no sheet's unit would wind it up so that somebody saw it
    assert found.row()["silent"] == ["reducer.shaft_stiffness"]
    assert any("nothing here would show another unit of it: reducer.shaft_stiffness" in line for line in found.lines())
    slow = LOG.assign(goal=LOG.phi, rate=np.gradient(LOG.phi, LOG.time))  # nothing is missed: no gain can be told
    silent = boxed(tmp_path, log=slow).silent
    assert {"controller.angle_gain", "controller.speed_gain"} <= set(silent)
    assert "motor.inductance" not in silent and "controller.voltage_max" not in silent
    assert boxed(tmp_path, ("motor.voltage", "load.angle"), without=("reducer.shaft_stiffness",)).silent == ()


@pytest.mark.parametrize("times, stops", [(1.0, False), (float(np.degrees(1.0)), True)], ids=["as it is", "degrees"])
def test_a_loop_that_goes_slower_than_it_is_asked_to_is_no_slip(times, stops, tmp_path):
    """A proportional gain alone: the speed is a ninth of what was asked for, as the gain and the motor have it; a unit is a slip."""
    speed = 8.0 * LOG.n / RATIO
    volts = 1.3 * K * RATIO * speed
    log = pd.DataFrame(
        {
            "time": LOG.time,
            "n": RATIO * speed,
            "u": volts,
            "i": 0.3 * K * RATIO * speed / R,
            "rate": times * (speed + 2.0 * volts),
        }
    )
    assert np.std(log.rate) > 8.0 * np.std(speed)
    channels = ("controller.speed_setpoint", "motor.voltage", "motor.current", "reducer.input_speed")
    found = boxed(tmp_path, channels, log, controller__angle_gain=0.0, controller__speed_gain=0.5)
    assert any("controller.speed_setpoint" in f.about for f in found.findings) == stops, found.lines()


@pytest.mark.parametrize(
    "columns, words",
    [
        ({"supply": 24e3}, "mV read as V? Write unit = \"mV\" for column 'supply' (motor.supply_voltage)."),
        ({"times": 100.0}, "percent read as 1? Write unit = \"%\" for column 'duty' (motor.duty)."),
    ],
    ids=["mV", "percent"],
)
def test_of_a_duty_the_supplys_unit_is_told_and_its_own(columns, words, tmp_path):
    channels = (*LOOP[:2], "motor.duty", "motor.supply_voltage", *LOOP[3:])
    log = LOG.assign(
        duty=columns.get("times", 1.0) * LOG.u / 24.0, supply=columns.get("supply", 24.0) * (1.0 + 1e-3 * np.sin(LOG.time))
    )
    gross = boxed(tmp_path, channels, log, controller__voltage_max=1.0, controller__voltage_min=-1.0).gross
    assert any(words in sentence for sentence in gross), gross


@pytest.mark.slow
def test_a_duty_is_held_against_gains_of_a_duty(tmp_path):
    """Its limits are no voltages, and its gains are per rad of 1."""
    changes = {"controller__angle_gain": GAIN / 24.0, "controller__speed_gain": DAMPS / 24.0, "controller__voltage_max": 1.0, "controller__voltage_min": -1.0}  # fmt: skip
    channels = (*LOOP[:2], "motor.duty", "motor.supply_voltage", *LOOP[3:])
    log = LOG.assign(duty=LOG.u / 24.0, supply=24.0 + 0.01 * np.sin(LOG.time))
    assert not boxed(tmp_path, channels, log, **changes).findings
    found = boxed(tmp_path, channels, log, **changes | {"controller__angle_gain": GAIN})
    assert not found.findings  # by 24: no unit is that
    (finding,) = boxed(tmp_path, channels, log, **changes | {"controller__angle_gain": 1e3 * GAIN / 24.0}).findings
    assert finding.about == ("controller.angle_gain",)
    (finding,) = boxed(tmp_path, channels, log).findings  # as for a voltage
    assert "controller.voltage_min = -24 and controller.voltage_max = 24, and what drives this log" in finding.sentence
    assert set(finding.about) == {"controller.voltage_min", "controller.voltage_max"} and not finding.gross


@pytest.mark.parametrize(
    "ratio, words",
    [
        (15.0, "or column 'a' (reducer.input_angle) counts each line of its encoder 4 times: divide its factor by 4"),
        (120.0, "or column 'phi' (load.angle) counts each line of its encoder 2 times: divide its factor by 2"),
        (45.0, ""),
    ],
)
def test_shafts_that_turn_four_times_or_twice_as_far_may_be_an_encoders_counts(ratio, words, tmp_path):
    """Only another ratio was told, and a user whose encoder counts four to a line was asked to write it."""
    found = [f.sentence for f in boxed(tmp_path, reducer__gear_ratio=ratio).findings if "turn in" in f.sentence]
    assert len(found) == 1 and (words in found[0] if words else "encoder" not in found[0]), found


def test_a_ratio_below_1_may_stand_upside_down(tmp_path):
    """Where one shaft alone is logged no other tells: the drive then seems to lift 60² times as much."""
    found = boxed(tmp_path, ("motor.voltage", "motor.current", "reducer.input_speed"), reducer__gear_ratio=1.0 / RATIO)
    assert any("(input speed over output speed: 60?)" in sentence for sentence in found.gross), found.lines()
