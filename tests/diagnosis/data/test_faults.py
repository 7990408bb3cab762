"""Faults that a log may have, put there by hand: each is found where it is, and a sound log has none."""

from dataclasses import replace

import numpy as np
import pytest

from selflock.diagnosis.data.faults import check
from selflock.diagnosis.data.log import MeasuredRun
from selflock.diagnosis.data.rig import LogColumn, Rig

N = 4000


@pytest.fixture
def rig(tmp_path):
    columns = tuple(LogColumn(name, name) for name in ("reducer.input_speed", "motor.torque", "reducer.input_angle"))
    return Rig(tmp_path / "rig.toml", "bench", "inverse", columns, {}, time=LogColumn("time", "time"))


@pytest.fixture
def run(rng):
    time = np.arange(N) * 1e-3
    speed = 40.0 * np.sin(3.0 * time)
    torque = 0.1 * np.sign(speed) + 0.05 * np.sin(3.0 * time) + 2e-3 * rng.standard_normal(N)
    signals = {
        "reducer.input_speed": speed + 0.05 * rng.standard_normal(N),
        "motor.torque": torque,
        "reducer.input_angle": np.cumsum(speed) * 1e-3 + 1e-4 * rng.standard_normal(N),
    }
    return MeasuredRun("log.csv", "", np.arange(N), time, signals)


def kinds(faults):
    return {(f.kind, f.channel) for f in faults}


def test_a_sound_log_has_no_faults(rig, run):
    assert check([run], rig) == []
    assert all(good.all() for good in run.good.values())


def test_corrupted_samples_are_found_one_by_one(rig, run):
    run.signals["motor.torque"][[500, 2000, 2001]] = [1.4, -2.0, -2.1]
    faults = check([run], rig)
    assert [(f.kind, f.channel, f.first, f.last) for f in faults] == [
        ("corrupted", "motor.torque", 500, 500),
        ("corrupted", "motor.torque", 2000, 2001),
    ]
    assert (~run.good["motor.torque"]).sum() == 3 and run.good["reducer.input_speed"].all()


def test_a_supply_goes_to_and_fro_between_its_levels_and_is_corrupted_beyond_them(rig, run, rng):
    levels = np.full(N, 7.1)
    levels[: N // 3] = levels[N // 2 : N // 2 + 200] = 7.9  # nothing hangs on it
    short = rng.choice(np.arange(N // 3 + 50, N // 2 - 50, 40), 12, replace=False)
    levels[short] = levels[short + 1] = 7.9
    run.signals["motor.supply_voltage"] = levels + 0.05 * rng.integers(-1, 2, N)
    run.signals["motor.supply_voltage"][3000] = 0.0
    assert [(f.kind, f.channel, f.first) for f in check([run], rig)] == [("corrupted", "motor.supply_voltage", 3000)]


@pytest.mark.parametrize(
    "spikes",
    [
        {600: 1.5, 602: -1.5, 604: 1.5},
        dict.fromkeys((600, 601, 602, 604, 605, 606), 1.5),  # more than half of seven neighbours, all to one side
        {600: 3.0, 601: 3.0, 602: 3.0, 605: 1.2, 606: 1.2},
    ],
)
def test_corrupted_samples_close_together_do_not_hide_each_other(rig, run, spikes):
    for row, height in spikes.items():
        run.signals["motor.torque"][row] += height
    check([run], rig)
    assert set(np.flatnonzero(~run.good["motor.torque"])) == set(spikes)


@pytest.mark.parametrize("share", [0.05, 0.15, 0.4])
def test_an_angle_that_drops_to_zero_for_a_few_rows_is_corrupted_however_near_zero_is(rig, run, rng, share):
    """Below a quarter of its range such rows were trusted: a sound drive was `unknown`, by nine of them."""
    angle = run.signals["reducer.input_angle"]
    width = np.ptp(angle)
    first = int(rng.choice(np.flatnonzero(abs(abs(angle[100:-100]) - share * width) < 0.01 * width))) + 100
    angle[first : first + 3] = 0.0
    assert [(f.kind, f.channel, f.first, f.last) for f in check([run], rig)] == [
        ("corrupted", "reducer.input_angle", first, first + 2)
    ]


@pytest.mark.parametrize("counts", [0, 48, 2000])
def test_a_shaft_that_rings_behind_a_blow_is_sound(rig, run, rng, counts):
    """As fast as it turns all the time, and faster for a few rows."""
    time = run.time
    angle = np.sin(2.0 * time) + sum(
        rng.uniform(0.005, 0.05) * (time > at) * np.exp(-(time - at) / 0.02) * np.sin(rng.uniform(300.0, 800.0) * (time - at))
        for at in rng.uniform(0.2, 3.8, 5)
    )
    if counts:
        angle = np.floor(angle * counts / (2.0 * np.pi)) * 2.0 * np.pi / counts
    run.signals["reducer.input_angle"] = angle
    rate = np.gradient(angle, time) if not counts else 2.0 * np.cos(2.0 * time)
    run.signals["reducer.input_speed"] = rate + 0.01 * rng.standard_normal(N)
    assert not any(f.channel == "reducer.input_angle" for f in check([run], rig))


def test_a_ring_that_crosses_zero_is_no_row_of_corrupted_samples(rig, run):
    """Every other sample of it is quiet, and what it ends in is too small for a spike."""
    run.signals["motor.torque"][600:628:2] += 1.5 * (-0.7) ** np.arange(14)
    assert check([run], rig) == []


@pytest.mark.parametrize("felt", [True, False])
def test_a_drive_that_jerks_between_two_rows_of_a_slow_log_is_sound(rig, rng, felt):
    """It creeps in counts of its tacho, and its torque is another behind the jerk; a speed that no torque feels is wrong."""
    n, at = 500, 300
    speed = -0.1 * rng.choice(3, n, p=(0.25, 0.6, 0.15))
    torque = -2.5e-3 + 2e-5 * rng.standard_normal(n)
    speed[at] = -1.2
    torque[at - 12 : at + 12] = -2.5e-3  # or its noise is felt by chance: one row in a hundred has some that is rare
    if felt:
        torque[at:] += 8e-4
    run = MeasuredRun("log.csv", "", np.arange(n), 0.25 * np.arange(n), {"reducer.input_speed": speed, "motor.torque": torque})
    told = {(f.channel, f.first, f.last) for f in check([run], rig) if f.kind == "corrupted"}
    assert told == (set() if felt else {("reducer.input_speed", at, at)})


def test_a_corrupted_sample_of_a_coarse_speed(rig, run):
    """Five counts high, where the motion makes two: its rounding is no noise of twelve times a count."""
    coarse = 25.0
    run.signals["reducer.input_speed"] = coarse * np.round(40.0 * np.sin(3.0 * run.time) / coarse)
    run.signals["reducer.input_speed"][1800] += 8.0 * coarse
    assert [(f.kind, f.first, f.last) for f in check([run], rig)] == [("corrupted", 1800, 1800)]


@pytest.mark.parametrize("counts, told", [(1, False), (-1, False), (3, True)])
def test_the_first_rows_of_a_difference_may_be_of_one_count(rig, run, rng, counts, told):
    """A difference over five rows has one in the first, where a count is five times as much."""
    still, count = run.time < 0.3, 2.0 * np.pi / 700.0
    speed = np.where(still, 0.0, np.sin(3.0 * (run.time - 0.3)))
    angle = count * np.round(np.cumsum(speed) * 1e-3 / count + rng.uniform(-0.4, 0.4))
    run.signals["reducer.input_angle"] = angle
    back = np.maximum(np.arange(N) - 5, 0)
    made = (angle - angle[back]) / np.maximum(run.time - run.time[back], 1e-3)
    made[0] = counts * count / 1e-3
    run.signals["reducer.input_speed"] = made
    found = [(f.channel, f.first) for f in check([run], rig) if f.kind == "corrupted" and f.first < 20]
    assert found == ([("reducer.input_speed", 0)] if told else [])


@pytest.mark.parametrize("rows, lost", [(1, 1), (4, 3), (9, 120)])
def test_a_difference_over_lost_rows_is_no_speed(rig, run, rows, lost):
    """A recorder that divides by the time of as many rows as usual, and one that knows the time."""
    angle = run.signals["reducer.input_angle"]
    keep = np.append(np.arange(2600), np.arange(2600 + lost, N))
    angle, time = np.cumsum(40.0 * np.sin(3.0 * run.time))[keep] * 1e-3, run.time[keep]
    turned = np.append(np.zeros(rows), angle[rows:] - angle[:-rows])
    passed = np.append(np.full(rows, rows * 1e-3), time[rows:] - time[:-rows])
    for by, wrong in ((rows * 1e-3, True), (passed, False)):
        speed = turned / by + 0.05 * np.sin(1e3 * time)
        found = MeasuredRun("log.csv", "", keep, time, {"reducer.input_speed": speed, "reducer.input_angle": angle})
        told = {(f.kind, f.first, f.last) for f in check([found], rig)}
        assert told == {("missing", 2599, 2600 + lost)} | ({("corrupted", 2600 + lost, 2599 + lost + rows)} if wrong else set())


@pytest.mark.parametrize("behind", [35.0, 2.0], ids=["another speed", "a count of a shaft that creeps"])
def test_what_is_honest_behind_lost_rows(rig, run, behind):
    """A speed that changed meanwhile, and the last rows of a difference in which one count was."""
    speed = np.where(run.time < 2.0, -35.0, 35.0) if behind == 35.0 else 30.0 * (run.time > 3.0)
    speed[2100:2103] = behind
    keep = np.append(np.arange(2000), np.arange(2100, N))
    found = MeasuredRun("log.csv", "", keep, run.time[keep], {"reducer.input_speed": speed[keep] + 0.01 * (keep % 7)})
    assert kinds(check([found], rig)) == {("missing", "time")}


@pytest.mark.parametrize(
    "limits, told", [({"min": -24.0, "max": 24.0}, [700, 3000]), ({}, []), ({"min": -600.0, "max": 600.0}, [])]
)
def test_a_command_far_beyond_its_controllers_limits_is_corrupted(rig, run, limits, told):
    """Within them it may jump, and without them nobody knows."""
    run.signals["controller.voltage"] = 20.0 * np.sign(np.sin(9.0 * run.time))
    run.signals["controller.voltage"][[700, 3000]] = [930.0, -55.0]
    run = MeasuredRun("log.csv", "", np.arange(N), run.time, run.signals)
    rig = replace(rig, parameters={f"controller.voltage_{end}": limit for end, limit in limits.items()})
    found = [(f.kind, f.first) for f in check([run], rig) if f.channel == "controller.voltage"]
    assert found == [("corrupted", row) for row in told]


def test_values_that_are_no_numbers(rig, run):
    run.signals["motor.torque"][100:103] = [np.nan, np.inf, -np.inf]
    assert [(f.kind, f.first, f.last) for f in check([run], rig)] == [("non-finite", 100, 102)]


def test_a_channel_cut_off_at_a_limit(rig, run):
    run.signals["reducer.input_speed"] = np.minimum(run.signals["reducer.input_speed"], 38.0)
    assert kinds(check([run], rig)) == {("clipped", "reducer.input_speed")}


def test_a_frozen_torque_while_the_shaft_turns(rig, run):
    run.signals["motor.torque"][1000:1200] = run.signals["motor.torque"][1000]
    (fault,) = check([run], rig)
    assert (fault.kind, fault.channel, fault.last) == ("frozen", "motor.torque", 1199) and fault.first in (1000, 1001)


def test_rest_is_no_fault(rig, run):
    for values in run.signals.values():
        values[:] = np.round(values, 2)
        values[1500:2500] = values[1500]
    run.signals["reducer.input_speed"][1500:2500] = 0.0
    assert check([run], rig) == []


def test_missing_samples(rig, run):
    run.time[2000:] += 0.5
    (fault,) = check([run], rig)
    assert (fault.kind, fault.channel, fault.first, fault.last) == ("missing", "time", 1999, 2000)


def test_a_single_lost_row_is_missing_where_rows_are_even(rig, run):
    run.time[2000:] += 1e-3
    assert [(f.kind, f.first, f.last) for f in check([run], rig)] == [("missing", 1999, 2000)]


@pytest.mark.parametrize("speed, rests", [(0.0, True), (0.5, False), (-0.5, False)])
def test_a_steady_state_point_that_may_be_at_rest(rig, speed, rests, rng):
    """Noise of 2 rad/s over 4000 samples leaves a mean uncertain by 0.03 rad/s."""
    steady = Rig(rig.path, "bench", "steady", rig.columns, {}, time=rig.time, run="run")
    noisy = MeasuredRun(
        "log.csv",
        "7",
        np.arange(N),
        np.arange(N) * 1e-3,
        {"reducer.input_speed": speed + 2.0 * rng.standard_normal(N), "motor.torque": 0.1 + 0.01 * rng.standard_normal(N)},
    )
    other = MeasuredRun("log.csv", "8", np.arange(N), np.arange(N) * 1e-3, {"reducer.input_speed": 9.0 + rng.standard_normal(N)})
    if rests:  # once in a few thousand seeds chance alone looks like motion
        noisy.signals["reducer.input_speed"] -= noisy.signals["reducer.input_speed"].mean()
    faults = check([noisy, other], steady)
    assert [(f.kind, f.channel, f.run) for f in faults] == ([("at rest", "reducer.input_speed", "7")] if rests else [])
    assert noisy.good["reducer.input_speed"].any() != rests


def test_rows_that_are_points_already_may_turn_both_ways(rig):
    steady = Rig(rig.path, "bench", "steady", rig.columns, {}, time=rig.time)
    points = MeasuredRun("log.csv", "", np.arange(80), np.arange(80.0), {"reducer.input_speed": np.tile([-5.0, 5.0], 40)})
    assert check([points], steady) == []


def test_what_is_given_may_rest_jump_and_saturate(rig, run):
    """A staircase of voltage, a run-up at its limit, a room's temperature in steps of 0.1 K: no faults, but spikes are."""
    time = run.time
    run.signals["motor.voltage"] = np.clip(20.0 * np.floor(3.0 * np.sin(2.0 * time)), -24.0, 24.0)
    run.signals["room.temperature"] = np.round(20.0 + 0.2 * np.sin(time), 1)
    assert check([run], rig) == []
    run.signals["motor.voltage"][1234] = 500.0
    assert [(f.kind, f.channel, f.first) for f in check([run], rig)] == [("corrupted", "motor.voltage", 1234)]
