"""What a command tells of its controller, beside commands that were made of known sensors at known times."""

import numpy as np
import pandas as pd
import pytest

from selflock.diagnosis.data.log import read
from selflock.diagnosis.data.rig import DUAL, LOAD, MOTOR, load
from selflock.diagnosis.residuals.channels import Channels
from selflock.diagnosis.residuals.closing import ahead, command_missed, dual, shaft, unseen, zero
from selflock.diagnosis.residuals.drive import speed_setpoint
from selflock.diagnosis.residuals.kernels import kernels
from selflock.diagnosis.residuals.setting import Setting

RIG = """[rig]
kind = "forward"
drives = ["arm_"]
[columns]
"arm_controller.angle_setpoint" = "wanted"
"arm_controller.voltage" = "u"
"arm_reducer.input_angle" = "motor"
"arm_load.angle" = "load"
[parameters]
"arm_controller.angle_gain" = 100.0
"arm_controller.speed_gain" = 5.0
"arm_reducer.gear_ratio" = 40.0
"""


def channels(folder, rng, at=LOAD, early=0, count=1e-3, zero=0.7, noise=0.02, limit=None, over=0, late=0.0):
    """A swinging shaft that follows late, wound up by what an arm weighs, both angles in counts; its speed a difference `over` rows, the load `late`, s."""
    time = 1e-3 * np.arange(6000)
    angle = lambda t: 0.9 * np.sin(2.1 * t) + 0.2 * np.sin(5.3 * t)
    rate = lambda t: 1.89 * np.cos(2.1 * t) + 1.06 * np.cos(5.3 * t)
    wound = lambda t: 2e-3 * np.sin(angle(t - 0.02))
    shafts = {LOAD: lambda t: angle(t - 0.02), MOTOR: lambda t: angle(t - 0.02) + wound(t)}
    seen, turns = shafts[LOAD if at == DUAL else at], shafts[MOTOR if at == DUAL else at]
    turned = lambda t: (turns(t + 1e-6) - turns(t - 1e-6)) / 2e-6
    then = time + 1e-3 * early
    u = 100.0 * (angle(then) - seen(then)) + 5.0 * (rate(then) - turned(then)) + noise * rng.standard_normal(len(time))
    rounded = lambda x, step: step * np.floor(x / step) if step else x
    motor = 40.0 * rounded(angle(time - 0.02) + wound(time), count / 5.0) + zero
    table = {"time": time, "wanted": angle(time), "u": u, "motor": motor, "load": rounded(angle(time - 0.02 - late), count)}
    columns = RIG
    if over:
        before = angle(np.maximum(time - 1e-3 * over, 0.0) - 0.02)
        table["speed"] = (angle(time - 0.02) - before) / np.maximum(np.minimum(time, 1e-3 * over), 1e-3)
        columns = RIG.replace("[parameters]", '"arm_load.speed" = "speed"\n[parameters]')
    pd.DataFrame(table).to_csv(folder / "log.csv", index=False, float_format="%.12g")
    limits = [f'"arm_controller.voltage_{end}" = {sign}{limit}' for end, sign in (("min", "-"), ("max", "")) if limit]
    (folder / "rig.toml").write_text(columns + "\n".join(limits))
    rig = load(folder / "rig.toml")
    (run,) = read(folder / "log.csv", rig)
    return Channels(run, "", Setting(rig, len(run), kernels(), {"": 1}))


@pytest.mark.parametrize("at", [LOAD, MOTOR])
def test_the_command_tells_at_which_shaft_the_controllers_sensors_are(at, tmp_path, rng):
    """Through a wind-up of two counts, an encoder's zero, and a command that was read a row and a half early."""
    ch = channels(tmp_path, rng, at, early=1.5)
    assert shaft(command_missed([ch])) == at
    assert at != MOTOR or not dual(command_missed([ch]))


@pytest.mark.parametrize("at", [LOAD, MOTOR])
def test_an_angle_that_is_logged_late_does_not_move_them(at, tmp_path, rng):
    """By up to 2 ms, which is more of a wind-up than there is; set-points stand in their rows."""
    ch = channels(tmp_path, rng, at, late=float(rng.uniform(-2e-3, 2e-3)))
    assert shaft(command_missed([ch])) == at
    assert at != MOTOR or not dual(command_missed([ch]))


@pytest.mark.parametrize("at", [LOAD, MOTOR])
def test_a_speed_that_is_logged_late_does_not_move_them(at, tmp_path, rng):
    """What the controller was told is the speed of its angle; that of the log, a difference over many rows, is 20 to 40 ms old."""
    ch = channels(tmp_path, rng, at, over=int(rng.integers(40, 80)))
    assert shaft(command_missed([ch])) == at
    assert at != MOTOR or not dual(command_missed([ch]))


def test_a_coarse_encoder_does_not_move_the_sensors_to_the_other_shaft(tmp_path, rng):
    """Each of its counts is more than the command's range as the difference of two rows: where one falls would not be compared."""
    ch = channels(tmp_path, rng, LOAD, count=float(rng.uniform(8e-3, 12e-3)), limit=24.0)
    assert shaft(command_missed([ch])) == LOAD


def test_a_command_of_the_next_row_is_told(tmp_path, rng):
    assert ahead(channels(tmp_path, rng, LOAD, early=1, count=0.0, noise=1e-3))
    assert not ahead(channels(tmp_path, rng, LOAD, early=0, count=0.0, noise=1e-3))
    assert not ahead(channels(tmp_path, rng, LOAD, early=-1, count=0.0, noise=1e-3))  # late: a cause may do that


def test_the_rate_of_a_set_point_at_rest_is_nothing_at_all(tmp_path, rng):
    """To the last digit, the rows at its ends included: a controller lets go then. What goes in counts does not rest."""
    ch = channels(tmp_path, rng)
    time = np.cumsum(ch.dt)
    wanted = np.interp(time, [0.0, 2.0, 4.0, 6.1], [0.1, np.pi / 3.0, np.pi / 3.0, 0.2])
    rate = speed_setpoint(wanted, {}, ch)
    rests = np.flatnonzero(wanted == np.pi / 3.0)
    assert np.all(rate[rests] == 0.0) and np.all(rate[rests[0] - 2 : rests[0]] > 0.0) and np.all(rate[rests[-1] + 1 :] < 0.0)
    coarse = 0.004 * np.floor(0.5 * time / 0.004)
    assert np.mean(speed_setpoint(coarse, {}, ch)) == pytest.approx(0.5, rel=0.02)


@pytest.mark.parametrize(
    ("told", "late", "noise", "seen"),
    [(True, 0, 0.1, True), (True, 7, 0.1, True), (False, 0, 0.1, False), (False, 0, 30.0, True)],
)
def test_a_command_without_its_encoders_counts_saw_another_sample(told, late, noise, seen, tmp_path, rng):
    """u = k (w - phi / r), phi in counts or as it is, some rows late; noise in counts times k. Beyond it nothing can be told."""
    time, count = 1e-3 * np.arange(6000), 2.0 * np.pi / 500
    wanted = 0.7 * np.sin(1.9 * time)
    turned = 40.0 * 0.95 * np.roll(wanted, 20) + 0.3
    read_as = count * np.floor(turned / count)
    u = 100.0 * (wanted - (read_as if told else turned) / 40.0)
    u = np.roll(u, late) + noise * 100.0 / 40.0 * count * rng.standard_normal(len(time))
    table = {"time": time, "wanted": wanted, "u": u, "motor": read_as}
    pd.DataFrame(table).to_csv(tmp_path / "log.csv", index=False, float_format="%.12g")
    (tmp_path / "rig.toml").write_text(
        RIG.replace("arm_", "").replace('drives = [""]\n', "").replace('"load.angle" = "load"\n', "")
    )
    rig = load(tmp_path / "rig.toml")
    (run,) = read(tmp_path / "log.csv", rig)
    assert unseen(Channels(run, "", Setting(rig, len(run), kernels(), {"": 1}))) == ("" if seen else "reducer.input_angle")


@pytest.mark.parametrize("late", [0, 3])
def test_where_an_encoder_counts_from_is_told_by_the_command_of_a_drive_in_motion(late, tmp_path, rng):
    """It was not where it was asked to be, by 0.04 rad; its angle is read up to three rows after its command."""
    time = 0.3 + 1e-3 * np.arange(6000)
    wanted, rate = 0.7 * np.sin(1.9 * time), 0.7 * 1.9 * np.cos(1.9 * time)
    lag = 0.02 * rate + 0.02 * np.tanh(20.0 * rate)  # friction, too
    turned = wanted - lag
    u = 100.0 * lag + 5.0 * (rate - np.gradient(turned, time)) + 0.2 * rng.standard_normal(len(time))
    motor = np.interp(time - 1e-3 * late, time, 40.0 * turned) + 11.0
    pd.DataFrame({"time": time, "wanted": wanted, "u": u, "motor": motor}).to_csv(tmp_path / "log.csv", index=False)
    (tmp_path / "rig.toml").write_text(
        RIG.replace("arm_", "").replace('drives = [""]\n', "").replace('"load.angle" = "load"\n', "")
    )
    rig = load(tmp_path / "rig.toml")
    (run,) = read(tmp_path / "log.csv", rig)
    ch = Channels(run, "", Setting(rig, len(run), kernels(), {"": 1}))
    assert lag[0] > 0.035
    assert zero({}, ch) == pytest.approx(-11.0 / 40.0, abs=1e-3)
    twice = zero({"reducer.gear_ratio": 80.0}, ch)  # as it would be of another gear
    assert twice != pytest.approx(zero({}, ch), abs=0.1) and zero({"controller.angle_gain": 50.0}, ch) != zero({}, ch)
