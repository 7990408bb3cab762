"""Frozen and clipped channels, beside what stands still honestly: a motion that every test records otherwise."""

import numpy as np
import pytest

from selflock.diagnosis.data.faults import check
from selflock.diagnosis.data.log import MeasuredRun
from selflock.diagnosis.data.rig import LogColumn, Rig

RATIO, STEP = 50.0, 1e-3
INPUT, SPEED, OUTPUT, LOAD, CURRENT = (
    "reducer.input_angle", "reducer.input_speed", "load.angle", "load.speed", "motor.current",
)  # fmt: skip


@pytest.fixture
def rig(tmp_path):
    return Rig(tmp_path / "rig.toml", "bench", "forward", (LogColumn(LOAD, LOAD),), {}, time=LogColumn("time", "time"))


@pytest.fixture
def speed(rng):
    """Of the load: moves to and fro with rests between, 12 s."""
    parts = []
    while sum(map(len, parts)) * STEP < 12.0:
        top, ramp, flat, rest = rng.uniform(0.3, 3.0), *rng.uniform((0.1, 0.1, 0.05), (0.3, 0.6, 0.4))
        up = np.linspace(0.0, 1.0, int(ramp / STEP))
        move = top * np.concatenate([up, np.ones(int(flat / STEP)), up[::-1]])
        parts += [(-1) ** (len(parts) // 2) * move, np.zeros(int(rest / STEP))]
    return np.concatenate(parts)


def turned(speed):
    return np.cumsum(speed) * STEP


def counted(angle, counts):
    count = 2.0 * np.pi / counts
    return count * np.floor(angle / count)


def difference(angle, rows):
    before = np.maximum(np.arange(len(angle)) - rows, 0)
    return (angle - angle[before]) / (rows * STEP)


def run_of(**signals):
    n = len(next(iter(signals.values())))
    return MeasuredRun("log.csv", "", np.arange(n), STEP * np.arange(n), dict(signals))


def recorded(rng, speed, counts=2000, rows=3, noise=0.3):
    """Both shafts: the motor's by a tachometer, the load's by counts and their difference; and a current."""
    angle = turned(speed)
    torque = np.convolve(np.gradient(speed) / STEP / 20.0 + np.sign(speed), np.ones(60) / 60.0, "same")
    current = torque + 0.05 * rng.standard_normal(len(speed))
    return run_of(
        **{
            INPUT: counted(RATIO * angle, counts),
            SPEED: RATIO * speed + noise * rng.standard_normal(len(speed)),
            OUTPUT: counted(angle, counts),
            LOAD: difference(counted(angle, counts), rows),
            CURRENT: 0.01 * np.round(current / 0.01),
        }
    )


def fast(speed, length, held=0.0):
    """First row of a stretch in which the load goes far, neither first nor last; farther, or less far, than at the speeds `held`."""
    way = np.abs(turned(speed)[length:] - turned(speed)[:-length] - np.resize(held, len(speed))[:-length] * length * STEP)
    return 500 + int(np.argmax(way[500 : -500 - length]))


def rows(faults, kind, channel, count):
    told = np.zeros(count, bool)
    for fault in faults:
        if (fault.kind, fault.channel) == (kind, channel):
            told[fault.first : fault.last + 1] = True
    return told


def kinds(faults):
    return {(fault.kind, fault.channel) for fault in faults}


@pytest.mark.parametrize("counts, rows_back", [(500, 1), (2000, 3), (20_000, 10)])
def test_a_sound_drive_rests_and_moves_by_less_than_a_count(rig, rng, speed, counts, rows_back):
    assert check([recorded(rng, speed, counts, rows_back)], rig) == []


def test_a_simulated_current_that_dies_away_at_rest_is_not_frozen(rig, rng):
    """In its winding, to the least numbers that a double has, of which one stays: no noise that a fault would hide."""
    rests = [rng.integers(120, 180) for _ in range(7)]
    rests[5] = 350
    move = np.sin(np.linspace(0.0, np.pi, 700))
    speed = np.concatenate([part for k, rest in enumerate(rests) for part in ((-1) ** k * move, np.zeros(rest))])
    run, current = recorded(rng, speed, noise=0.0), [0.0]
    for v in speed:
        x = current[-1]
        for _ in range(40):
            x += 0.1 * (np.sign(v) * (1.0 + abs(v)) - x)
        current.append(x)
    run.signals[CURRENT] = np.array(current[1:])
    assert 0.0 < np.unique(abs(run.signals[CURRENT]))[1] < 1e-320
    assert check([run], rig) == []


@pytest.mark.alike
@pytest.mark.parametrize("channel", [INPUT, SPEED, OUTPUT, LOAD, CURRENT])
def test_a_frozen_channel_is_told_and_no_other(rig, rng, speed, channel):
    run, length = recorded(rng, speed), 300
    # a speed that freezes at what it is, in a move that is even, cannot be told
    held = run.signals[LOAD] if channel == LOAD else 0.0
    first = fast(speed, length, held)
    run.signals[channel][first : first + length] = run.signals[channel][first]
    faults = check([run], rig)
    # what freezes at its highest value is clipped there, too
    assert kinds(faults) in ({("frozen", channel)}, {("clipped", channel)})
    told = rows(faults, "frozen", channel, len(speed)) | rows(faults, "clipped", channel, len(speed))
    assert told[first + 1 : first + length].all() and told.sum() < 1.1 * length
    assert not run.good[channel][first + 1 : first + length].any()


def longest_rest(speed):
    """First row and length."""
    edges = np.flatnonzero(np.diff(np.concatenate([[0], speed == 0.0, [0]])))
    first, length = max(zip(edges[::2], np.diff(edges)[::2]), key=lambda rest: rest[1])
    return int(first), int(length)


def test_a_current_that_is_noisy_at_rest_is_told_where_it_freezes_at_rest(rig, rng, speed):
    run = recorded(rng, speed)
    first, length = longest_rest(speed)
    first += 80 + int(np.flatnonzero(run.signals[CURRENT][first + 80 :])[0])  # the last of the motion is over, and it is not 0
    run.signals[CURRENT][first : first + 80] = run.signals[CURRENT][first]
    faults = check([run], rig)
    assert kinds(faults) == {("frozen", CURRENT)}
    assert rows(faults, "frozen", CURRENT, len(speed))[first + 1 : first + 80].all()


def test_a_current_that_is_switched_off_at_rest_is_not_frozen(rig, rng, speed):
    run = recorded(rng, speed)
    run.signals[CURRENT][speed == 0.0] = 0.0
    assert check([run], rig) == []


@pytest.mark.parametrize("both", [True, False])
def test_play_lets_the_load_rest_while_the_motor_turns(rig, rng, speed, both):
    """Whether or not a second sensor of the load says so too."""
    run, play = recorded(rng, speed), 0.02
    angle, behind = turned(speed), np.zeros(len(speed))
    for k in range(1, len(speed)):
        behind[k] = np.clip(behind[k - 1], angle[k] - play, angle[k])
    run.signals[OUTPUT], run.signals[LOAD] = counted(behind, 2000), difference(counted(behind, 2000), 3)
    if not both:
        del run.signals[LOAD]
    assert check([run], rig) == []


@pytest.mark.alike
@pytest.mark.parametrize("channel", [INPUT, SPEED, LOAD, CURRENT])
def test_a_clipped_channel_is_told_in_every_row(rig, rng, speed, channel):
    run = recorded(rng, speed, counts=20_000, rows=10)
    x = run.signals[channel]
    limit = 0.7 * abs(x).max()
    run.signals[channel] = np.clip(x, -limit, limit)
    faults = check([run], rig)
    assert kinds(faults) == {("clipped", channel)}
    assert np.array_equal(rows(faults, "clipped", channel, len(x)), abs(x) >= limit)


@pytest.mark.parametrize("limit, told", [(1.4, True), (2.0, False)])
def test_a_speed_of_few_counts_is_clipped_between_two_of_them(rig, rng, speed, limit, told):
    """Its rows at the limit are too few in a row for its angle to go on by a count; at a whole count nobody can tell."""
    run = recorded(rng, 0.9 * np.pi * speed / abs(speed).max(), counts=700, rows=1)
    count = 2.0 * np.pi / 700.0 / STEP  # rad/s, one a row; up to two after noise that the encoder's lines have
    angle = turned(speed / abs(speed).max() * 9.0) + 0.3 * count * STEP * rng.standard_normal(len(speed))
    run.signals[OUTPUT], run.signals[LOAD] = counted(angle, 700), difference(counted(angle, 700), 1)
    run.signals[LOAD] = np.clip(run.signals[LOAD], -limit * count, limit * count)
    for name in (INPUT, SPEED):
        del run.signals[name]
    assert kinds(check([run], rig)) == ({("clipped", LOAD)} if told else set())


VOLTAGE = "controller.voltage"


@pytest.mark.parametrize("rests", [True, False])
def test_a_measured_voltage_that_freezes_is_told_at_rest_and_in_motion(rig, rng, speed, rests):
    """At the most of its noise it would be at its limit, where a voltage stays honestly: see below."""
    run, length = recorded(rng, speed), 80
    run.signals[VOLTAGE] = np.clip(8.0 * speed, -15.0, 15.0) + 0.05 * rng.standard_normal(len(speed))
    first = longest_rest(speed)[0] if rests else fast(speed, length)
    run.signals[VOLTAGE][first : first + length] = np.median(run.signals[VOLTAGE][first : first + length])
    faults = check([run], rig)
    assert kinds(faults) == {("frozen", VOLTAGE)}
    assert np.array_equal(np.flatnonzero(rows(faults, "frozen", VOLTAGE, len(speed))), np.arange(first + 1, first + length))


def test_a_voltage_that_creeps_by_single_steps_is_none_that_froze(rig, rng, speed):
    """What an integrator makes of a rest, while the noise of the speed that the controller is told is away."""
    run = recorded(rng, speed)
    voltage = np.clip(8.0 * speed, -15.0, 15.0) + 0.05 * rng.standard_normal(len(speed))
    first, length = longest_rest(speed)
    voltage[first : first + length] = 0.4 + 0.04 * STEP * np.arange(length)
    run.signals[VOLTAGE] = 1e-3 * np.round(voltage / 1e-3)
    assert check([run], rig) == []


def test_a_voltage_that_is_a_number_may_stay(rig, rng, speed):
    """Computed anew in each row, held for a while in motion, at rest, and where it is saturated."""
    run, length = recorded(rng, speed), 200
    voltage = np.clip(8.0 * speed + 3.0 * np.sin(7.0 * STEP * np.arange(len(speed))), -15.0, 15.0)
    first = fast(speed, length)
    voltage[first : first + length] = voltage[first]
    run.signals[VOLTAGE] = voltage
    assert check([run], rig) == []


def test_a_voltage_with_noise_may_stay_at_its_limits(rig, rng, speed):
    """A controller makes its command of counts and noise, and what is beyond its limits it cuts off."""
    run = recorded(rng, speed)
    voltage = 8.0 * speed + 0.05 * rng.standard_normal(len(speed))
    run.signals[VOLTAGE] = np.clip(voltage, *np.quantile(voltage, [0.1, 0.9]))
    assert check([run], rig) == []


def test_a_plateau_and_the_end_of_a_travel_are_no_limits(rig, rng, speed):
    """One top speed for all moves, whose difference of counts has two levels; and a rest at the same end after each."""
    top = 0.6 * abs(speed).max()
    run = recorded(rng, np.clip(speed, -top, top), counts=700)
    assert check([run], rig) == []


def test_without_noise_what_is_steady_repeats(rig, speed):
    """As a simulation writes it."""
    angle = turned(speed)
    run = run_of(
        **{INPUT: RATIO * angle, SPEED: RATIO * speed, OUTPUT: angle, LOAD: speed, CURRENT: np.sign(speed) + 0.2 * speed}
    )
    assert check([run], rig) == []


def test_a_ramp_steeper_than_all_others_lets_nothing_go(rig, rng):
    """A speed that is constant before it was not frozen: a ramp goes on as it begins."""
    slow = np.concatenate([np.linspace(0.0, 1.0, 2000), np.ones(600), np.linspace(1.0, 0.0, 2000)])
    fast = rng.uniform(2.0, 4.0) * np.concatenate([np.linspace(0.0, 1.0, 1500), np.ones(600), np.linspace(1.0, 0.0, 60)])
    speed = np.concatenate([slow, np.zeros(300), -slow, np.zeros(300), fast, np.zeros(300)])
    angle = turned(speed)
    run = run_of(**{INPUT: RATIO * angle, SPEED: RATIO * speed, OUTPUT: angle, LOAD: speed})
    assert check([run], rig) == []


def test_a_channel_frozen_at_its_extreme_is_not_clipped(rig, rng, speed):
    run, length = recorded(rng, speed), 300
    first = int(np.argmax(run.signals[SPEED][500:-1000])) + 500
    run.signals[SPEED][first : first + length] = run.signals[SPEED].max() + 1.0
    assert ("clipped", SPEED) not in kinds(check([run], rig))


@pytest.mark.parametrize("felt", [True, False])
def test_a_spike_that_others_feel_is_an_impact(rig, rng, speed, felt):
    run, row = recorded(rng, speed, noise=0.05), fast(speed, 300) + 100
    run.signals[CURRENT][row] += 30.0
    if felt:
        run.signals[SPEED][row:] -= 40.0 * np.exp(-0.1 * np.arange(len(speed) - row))
        run.signals["motor.torque"] = 0.01 * rng.standard_normal(len(speed))
        run.signals["motor.torque"][row : row + 8] += 0.2
    assert kinds(check([run], rig)) == (set() if felt else {("corrupted", CURRENT)})


def test_a_spike_where_a_motion_turns_is_none_that_others_feel(rig, rng, speed):
    run, row = recorded(rng, speed, noise=0.05), fast(speed, 300) + 100
    run.signals[CURRENT][row] += 30.0
    bends = np.clip(np.arange(len(speed)) - row + 40.0, 0.0, 80.0) ** 2  # all the way, as nothing does elsewhere
    run.signals[SPEED] = run.signals[SPEED] + 0.05 * bends
    run.signals["motor.torque"] = 0.01 * rng.standard_normal(len(speed)) + 0.01 * bends
    assert kinds(check([run], rig)) == {("corrupted", CURRENT)}


@pytest.mark.slow
def test_what_builds_up_or_rings_down_is_no_corrupted_sample(rig, rng, speed):
    for shape in ([1.0, -0.6, 0.4, -0.2, 0.1], [0.3, 0.8, 1.0, 0.7, 0.2], [1.0, 0.8, 0.6, 0.5, 0.4, 0.3]):
        run, row = recorded(rng, speed), fast(speed, 300) + 100
        run.signals[CURRENT][row : row + len(shape)] += 30.0 * np.array(shape)
        assert check([run], rig) == [], shape


def test_an_only_angle_that_is_elsewhere_after_it_stood_still_was_frozen(rig, rng, speed):
    """No other channel tells of its motion; but no shaft jumps."""
    angle = counted(RATIO * turned(speed), 2000)
    first = fast(speed, 200)
    stood = angle.copy()
    stood[first : first + 200] = angle[first]
    honest, found = ([f for f in check([run_of(**{INPUT: x})], rig) if f.kind == "frozen"] for x in (angle, stood))
    assert not honest
    assert [(f.channel, f.last) for f in found] == [(INPUT, first + 199)] and abs(found[0].first - first - 1) <= 3


def test_a_speed_that_froze_while_its_shaft_turned_back_is_told_by_its_leap(rig, rng):
    """The load's angle, in few counts, is where it was before: of that turn it shows nothing."""
    slow = 2.0 * np.pi * np.arange(12_000) * STEP
    speed = 0.3 * np.sin(0.2 * slow + rng.uniform(0.0, 6.3)) + 0.1 * np.sin(slow + rng.uniform(0.0, 6.3))
    sound = run_of(**{SPEED: difference(counted(RATIO * turned(speed), 16_000), 2), OUTPUT: counted(turned(speed), 1250)})
    assert check([sound], rig) == []
    turns = 500 + np.flatnonzero(np.diff(np.sign(speed[500:-500])))
    first = int(turns[np.argmax(abs(np.diff(speed))[turns])]) - 125
    stuck = sound.signals[SPEED].copy()
    stuck[first : first + 250] = stuck[first]
    found = check([run_of(**{SPEED: stuck, OUTPUT: sound.signals[OUTPUT]})], rig)
    told = rows(found, "frozen", SPEED, len(speed))
    assert told[first + 1 : first + 250].all() and (stuck[told] == stuck[first]).all() and told.sum() < 275
