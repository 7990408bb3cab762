"""A whole drive in closed loop against every channel: its steps, its recorder, its noise, and where nothing is compared."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from selflock.diagnosis.data.faults import check
from selflock.diagnosis.data.log import MeasuredRun, read
from selflock.diagnosis.data.rig import LOAD, LogColumn, Rig, load
from selflock.diagnosis.errors import DataError
from selflock.diagnosis.residuals import driven, whole
from selflock.diagnosis.residuals.drive_experiment import DriveExperiment
from selflock.diagnosis.residuals.mending import excess
from selflock.diagnosis.residuals.recorder import counts, periods, step_of, steps_of, ticks
from selflock.diagnosis.residuals.rounding import rounding, sees_counts
from selflock.diagnosis.rules import RULES
from selflock.diagnosis.search import hypotheses
from selflock.diagnosis.search.problem import Problem

from ..plant import recordings
from ..plant.recorder import Speed, draw
from ..plant.rig import COLUMNS
from .test_row_by_row import DRIVE


@pytest.fixture
def seed(rng):
    """A seed for development, another each time."""
    return recordings.DEVELOPMENT + int(rng.integers(10**6))


DIFFERENCED = {
    "step": 1e-3,
    "jitter": 0.0,
    "duration": 8.0,
    "channels": ("setpoint_angle", "setpoint_speed", "voltage", "current", "angle", "motor_speed", "speed", "ambient"),
    "speeds": {"motor_speed": Speed("filter", time=1e-3), "speed": Speed("difference", 4)},
}


def experiment(case, folder, spoil=lambda table: table):
    """Of the log to learn from."""
    rig, train, _ = case.write(folder)
    if spoil is not None:
        spoil(case.logs[0]).to_csv(train, index=False, float_format="%.9g")
    found = replace(load(rig), simulate=whole.WHOLE)
    runs = read(train, found)
    check(runs, found)
    return DriveExperiment(found, runs)


def elsewhere(table, row):
    """A log whose set-point is somewhere else from this row on, so that what it did before it is not to be told."""
    return table.assign(setpoint_angle=table["setpoint_angle"] + 0.1 * (np.arange(len(table)) >= row))


def in_steps(bench, step):
    """The drive, computed in steps of at most `step` s."""
    return bench.but_with(replace(bench.setting, whole_step=step))


def at_rows(bench):
    """A simulation of the nominal drive at the rows."""
    (ch,) = bench.channels.values()
    rows, time = whole.simulate({}, ch), ch.run.time - ch.run.time[0]
    return {name: np.interp(time, whole.grid(ch).time, x) for name, x in rows.items()}


def parts_of(bench):
    (ch,) = bench.channels.values()
    return len(whole.grid(ch).time)


@pytest.mark.slow
def test_the_simulation_converges_with_its_step(seed, tmp_path):
    """Four times as many steps leave less than 0.7 of the error.

    Rows and samples of the controller end steps of their own, so that steps are counted and not asked for. Where a
    count of an encoder or a switch at rest tips at another sample, a row of the voltage is off by as much whatever the
    step: such rows, no more than one in a hundred, are held to the bound of all rows alone.
    """
    bench = experiment(recordings.hide([], seed, longest=6.0, duration=6.0), tmp_path)
    coarse, used, finer = (in_steps(bench, step) for step in (8e-4, 4e-4, 2e-4))
    while parts_of(finer) < 4 * parts_of(coarse):
        finer = in_steps(bench, 0.9 * finer.setting.whole_step)
    fine = at_rows(in_steps(bench, 0.1 * finer.setting.whole_step))
    off = [{name: np.sort((x - fine[name]) ** 2) for name, x in at_rows(b).items()} for b in (coarse, used, finer)]
    for name in ("voltage", "current", "angle", "input_speed"):
        height = np.ptp(fine[name])
        rows = int(0.99 * len(off[0][name]))
        long, short = (np.sqrt(np.mean(o[name][:rows])) for o in (off[0], off[2]))
        assert short < 0.7 * long or long < 1e-6 * height, (name, long, short, height)
        assert np.sqrt(np.mean(off[1][name])) < 5e-3 * height, (name, height)


@pytest.mark.slow
def test_a_sound_drive_is_off_by_little_more_than_its_noise_whatever_the_recorder(seed, tmp_path):
    """Nature's forms of friction, contact and armature are not ours; mostly they leave less than `natural`."""
    bench = experiment(recordings.hide([], seed, longest=10.0, duration=10.0), tmp_path)
    problem = Problem.of(bench, np.ones(bench.layout.count, bool)).with_noise()
    fitted = problem.fit(problem.base_free, problem.nominal)
    off = excess(bench, fitted.values, np.ones(bench.layout.count, bool))
    assert np.median(off) < RULES.search.natural, dict(zip([r.output for r in bench.residuals], off))


@pytest.mark.slow
def test_what_a_recorder_did_is_found(seed, tmp_path):
    case = recordings.hide([], seed, longest=10.0, duration=10.0)
    bench = experiment(case, tmp_path)
    (ch,) = bench.channels.values()
    for column, angle in (("speed", "angle"), ("motor_speed", "motor_angle")):
        speed, name = case.recorder.speeds[column], COLUMNS[column][0]
        if ch.has(name):
            count, rows = counts(name, ch)
            assert rows in (0, speed.rows if speed.by == "difference" else 0)
            if rows:
                assert count == pytest.approx(2.0 * np.pi / case.recorder.counts[angle], rel=1e-3)
    problem = Problem.of(bench, np.ones(bench.layout.count, bool)).with_noise()
    values = problem.fit(problem.base_free, problem.nominal).values
    late = case.recorder.lags.get("angle", 0.0)
    assert values["recorder.load.angle.shift"] == pytest.approx(late, abs=4e-4)


@pytest.mark.slow
def test_the_error_of_rounding_is_that_of_its_counts(seed, tmp_path):
    """Even over a count: count / sqrt(12) (Widrow 1956), for an angle that goes through many of them."""
    case = recordings.hide([], seed, longest=6.0, duration=6.0)
    bench = experiment(case, tmp_path)
    (ch,) = bench.channels.values()
    count, _ = counts("load.angle", ch)
    assert count == pytest.approx(2.0 * np.pi / case.recorder.counts["angle"], rel=1e-3)
    errors = rounding("load.angle", {}, ch, np.arange(8) / 8)
    assert np.sqrt(np.mean(errors**2)) == pytest.approx(count / np.sqrt(12.0), rel=0.1)
    assert abs(errors).max() <= count * (1.0 + 1e-9)


def test_a_channel_that_is_early_is_read_to_the_last_row_as_far_as_was_simulated(seed, tmp_path):
    """The last row of a mean or a difference over rows asks for more than that: it is no smaller for it."""
    recorder = replace(draw(np.random.default_rng(seed), (), True), **DIFFERENCED)
    bench = experiment(recordings.hide([], seed, recorder=recorder, longest=2.0), tmp_path)
    (ch,) = bench.channels.values()
    grid, rows, early = whole.grid(ch), whole.simulate({}, ch), 0.8e-3
    window = {"recorder.controller.voltage.window": 1e-3, "recorder.controller.voltage.shift": -early}
    late = {"recorder.load.speed.shift": -early}
    for name, values, of in (("controller.voltage", window, "voltage"), ("load.speed", late, "speed")):
        x = whole.read(name, values, ch)
        assert len(x) == len(ch.run) and counts("load.speed", ch)[1] > 1
        around = rows[of][grid.time > grid.time[-1] - 6e-3]
        assert around.min() - 1e-6 <= x[-1] <= around.max() + 1e-6, (name, x[-3:], around)


@pytest.mark.slow
def test_an_encoder_that_rounds_down_is_no_bias(seed, tmp_path):
    """Its reading is half a count too little on average, as no data sheet tells; what is beyond a count is not its zero."""
    recorder = replace(draw(np.random.default_rng(seed), ("angle",), True), **DIFFERENCED)
    recorder = replace(recorder, counts=recorder.counts | {"angle": 2000})
    count = 2.0 * np.pi / 2000

    def down(table):
        return table.assign(angle=table["angle"] - 0.5 * count)  # which was taken out

    bench = experiment(recordings.hide([], seed, recorder=recorder, longest=4.0), tmp_path, down)
    (zero,) = (p for p in hypotheses.recorder(bench) if p.name == "recorder.load.angle.zero")
    assert (zero.low, zero.high) == pytest.approx((-0.5 * count, 0.5 * count))
    problem = Problem.of(bench, np.ones(bench.layout.count, bool)).with_noise()
    values = problem.fit(problem.base_free, problem.nominal).values
    assert values[zero.name] == pytest.approx(-0.5 * count, abs=0.15 * count)


@pytest.mark.parametrize(("told", "gain"), [(True, 40.0), (False, 40.0), (False, 0.0)])
def test_whether_a_controller_sees_counts_is_told_by_its_voltage(told, gain, rng):
    """u = k (w - phi), phi in counts or as it is; the voltage acts at the row of a count, or half of it only at the next."""
    n, count = 4000, 2.0 * np.pi / 2000
    time = 1e-3 * np.arange(n)
    shaft = 0.7 * np.sin(2.0 * np.pi * 0.3 * time) + 1e-3 * rng.standard_normal()
    read = count * np.floor(shaft / count)
    asked = gain * (1.1 * np.sin(2.0 * np.pi * 0.3 * time) - (read if told else shaft))
    late = np.convolve(asked, [0.5, 0.5])[:n]
    signals = {
        "controller.angle_setpoint": 1.1 * np.sin(2.0 * np.pi * 0.3 * time),
        "load.angle": read,
        "controller.voltage": late + 0.3 * gain * count * rng.standard_normal(n),
    }
    columns = tuple(LogColumn(name, name) for name in signals)
    parts = {"controller.angle_gain": gain, "motor.resistance": 2.0, "reducer.gear_ratio": 50.0, "load.mass": 1.0}
    found = Rig(Path("rig.toml"), "bench", "forward", columns, parts, time=LogColumn("time", "time"), simulate=whole.WHOLE)
    run = MeasuredRun("log.csv", "", np.arange(n), time, signals)
    check([run], found)
    (ch,) = DriveExperiment(found, [run]).channels.values()
    assert sees_counts(ch) is told


@pytest.mark.slow
def test_what_a_controller_makes_of_counts_is_noise_of_its_voltage(seed, tmp_path):
    """The same drive, once with a controller that sees counts: what it differs by is of the size that is told, in voltage and current."""
    recorder = replace(draw(np.random.default_rng(seed), ("angle",), True), **DIFFERENCED, control=1e-4)
    recorder = replace(recorder, counts=recorder.counts | {"angle": 1000}, lags={}, noise=dict.fromkeys(recorder.noise, 0.0))
    case = recordings.hide([], seed, recorder=recorder, longest=4.0)
    coarse = case.base._replace(step=(0.0, 0.0, 0.0, 2.0 * np.pi / 1000, 0.0))
    rows = [recorder.read(recordings.dense(drive, case.plans[0]), 0) for drive in (case.base, coarse)]
    bench = experiment(case, tmp_path, lambda table: table.assign(voltage=rows[1]["voltage"], angle=rows[1]["angle"]))
    (ch,) = bench.channels.values()
    ch.memory["sees counts"] = True
    for name, column in (("controller.voltage", "voltage"), ("motor.current", "current")):
        differs = (rows[1][column] - rows[0][column]).to_numpy()[len(rows[0]) // 4 :]
        told = rounding(name, {}, ch, np.arange(8) / 8)[:, len(rows[0]) // 4 :]
        assert 0.4 < np.std(told) / np.std(differs) < 2.5, (name, np.std(told), np.std(differs))


@pytest.mark.slow
def test_nothing_is_compared_behind_a_gap_nor_at_the_start(seed, tmp_path):
    case = recordings.hide([], seed, longest=8.0, duration=8.0)
    n = len(case.logs[0])
    lost = slice(n // 2, n // 2 + n // 20)
    bench = experiment(case, tmp_path, lambda table: elsewhere(table, lost.stop).drop(index=range(lost.start, lost.stop)))
    (ch,) = bench.channels.values()
    for residual in bench.residuals:
        ((_, _, good),) = bench.compare(residual, {})
        since = ch.run.time - ch.run.time[lost.start]
        away = min(RULES.residuals.settling, RULES.residuals.settling_share * np.ptp(ch.run.time))
        assert not good[(since >= 0.0) & (since < away)].any() and not good[ch.run.time < ch.run.time[0] + away].any()
        assert good.sum() > 0.7 * len(good)


@pytest.mark.slow
def test_a_difference_that_goes_over_a_lost_row_is_not_compared(seed, tmp_path):
    """Whether it was taken before the row was lost or behind it nobody knows; an angle is compared all the same."""
    case = recordings.hide([], seed, recorder=replace(draw(np.random.default_rng(seed)), **DIFFERENCED), longest=8.0)
    n = len(case.logs[0])
    bench = experiment(case, tmp_path, lambda table: table.drop(index=n // 2))
    (ch,) = bench.channels.values()
    for name, rows in (("load.speed", slice(n // 2, n // 2 + 4)), ("load.angle", slice(0, 0))):
        good = whole.channel(name, {}, ch)[2]
        assert not good[rows].any() and good[n // 2 - 4 : n // 2].all() and good[n // 2 + 4 : n // 2 + 20].all()


@pytest.mark.slow
def test_behind_a_gap_the_drive_is_put_where_it_was_measured(seed, tmp_path):
    """What its set-point did meanwhile is lost: without that a drive that locks itself may stay anywhere else for long."""
    case = recordings.hide([], seed, longest=8.0, duration=8.0)
    n = len(case.logs[0])
    lost = slice(n // 2, n // 2 + n // 5)
    bench = experiment(case, tmp_path, lambda table: elsewhere(table, lost.stop).drop(index=range(lost.start, lost.stop)))
    (ch,) = bench.channels.values()
    (first, behind), starts = whole.begins({}, ch, whole.grid(ch))
    assert first == 0
    after = case.logs[0][lost.stop : lost.stop + 3]
    count = 2.0 * np.pi / case.recorder.counts["angle"]
    travel = np.ptp(case.logs[0]["setpoint_angle"])
    assert starts[1, 2] == pytest.approx(after["angle"].iloc[0], abs=2.0 * count + 0.01 * travel)
    simulated = whole.simulate({}, ch)
    assert simulated["angle"][behind] == starts[1, 2] and simulated["input_angle"][behind] == starts[1, 0]
    assert abs(np.diff(simulated["angle"])[behind:]).max() < 0.01 * travel  # and goes on from there


def as_measured(given, channels):
    """Channels of a run of 100 rows, 10 ms apart, that a drive with these parameters was measured in; a motor's loop."""
    columns = tuple(LogColumn(n, n) for n in channels)
    time = LogColumn("time", "time")
    rig = Rig(
        Path("rig.toml"),
        "bot",
        "forward",
        columns,
        DRIVE | {"controller.angle_gain": 1.0} | given,
        time=time,
        loop="motor",
        simulate=whole.WHOLE,
    )
    rows = {name: np.broadcast_to(x, 100).copy() for name, x in channels.items()}
    run = MeasuredRun("log.csv", "", np.arange(100), 0.01 * np.arange(100), rows)
    check([run], rig)
    (ch,) = DriveExperiment(rig, [run]).channels.values()
    return ch


def of_motor_alone(ratio, given, at):
    """A drive at rest where it is asked to be, of which the motor's shaft alone is measured: at `at`, rad."""
    given = {"reducer.gear_ratio": ratio} | given
    return as_measured(given, {"controller.angle_setpoint": at / ratio, "motor.voltage": 0.0, "reducer.input_angle": at})


@pytest.mark.parametrize("holds", [True, False])
def test_each_shaft_begins_with_its_own_speed_where_both_are_measured(rng, holds):
    """A load that swings behind a gear that holds: begun with the load's speed its motor turned away, and was elsewhere for good."""
    ratio, at, speed = 50.0, rng.uniform(-1.0, 1.0), rng.choice([-1.0, 1.0]) * rng.uniform(0.05, 0.5)
    time = 0.01 * np.arange(100)
    swings = speed * np.exp(-time / 0.3) * np.cos(time / 0.1)
    turns = np.zeros(100) if holds else rng.uniform(0.3, 0.9) * ratio * swings
    channels = {
        "controller.angle_setpoint": at,
        "motor.voltage": 0.0,
        "reducer.input_speed": turns,
        "load.speed": swings,
        "load.angle": at,
    }
    ch = as_measured({"reducer.gear_ratio": ratio}, channels)
    _, motor, _, load = whole.begin({}, ch)[0]
    assert load == pytest.approx(speed, rel=0.2)
    assert motor == pytest.approx(load * turns[0] / swings[0], rel=1e-9)


@pytest.mark.parametrize("side", [-1.0, 1.0])
def test_a_drive_whose_motor_alone_is_measured_begins_with_its_motor_where_it_was(rng, side):
    """And its load half a play from there, on the side to which it pulls: it was the motor that stood elsewhere."""
    ratio, play, at = 50.0, rng.uniform(0.01, 0.05), rng.uniform(-20.0, 20.0)
    ch = of_motor_alone(ratio, {"load.constant_torque": side, "reducer.backlash": play}, at)
    motor, _, load, _ = whole.begin({}, ch)[0]
    stretched = 1.0 / whole.carried_in({}, ch)[0]
    assert motor == pytest.approx(at) and load == pytest.approx(at / ratio - side * (0.5 * play + stretched))


def test_an_arm_that_hangs_within_its_play_begins_where_it_hangs(rng):
    """Where neither flank holds it: of whichever was said to touch it fell off at once, and swung."""
    play = rng.uniform(0.02, 0.1)
    hangs = float(rng.uniform(-0.4, 0.4)) * play
    arm = {"load.mass": 1.0, "load.arm": 0.2, "load.arm_angle": -0.5 * np.pi - hangs}
    motor, _, load, _ = whole.begin({}, of_motor_alone(50.0, {"reducer.backlash": play} | arm, 0.0))[0]
    assert motor == 0.0 and load == pytest.approx(hangs, abs=1e-3 * play)


@pytest.mark.slow
def test_a_gap_through_which_the_set_point_went_on_is_simulated_through(tmp_path):
    """Some lost rows, and a rest: the drive goes on, and its next rows are compared. Where the set-point turned it begins anew."""
    case = recordings.hide([], recordings.DEVELOPMENT + 1, longest=3.0, duration=3.0)
    table = case.logs[0]
    time = table["time"].to_numpy()
    table["setpoint_angle"] = np.interp(time, [0.0, 1.0, 2.0, 2.4, 3.0], [0.0, 0.5, 0.5, 0.1, 0.4])
    table["setpoint_speed"] = np.gradient(table["setpoint_angle"], time)
    rows = lambda begin, end: np.flatnonzero((time > begin) & (time < end))
    lost = np.concatenate([rows(0.5, 0.53), rows(1.3, 1.7), rows(2.3, 2.5)])
    (full,), (ch,) = (
        experiment(case, tmp_path / name, lambda t, gone=gone: t.drop(index=gone)).channels.values()
        for name, gone in (("full", []), ("gaps", lost))
    )
    places, _ = whole.begins({}, ch, whole.grid(ch))
    assert whole.grid(ch).time[places] == pytest.approx([0.0, time[lost[-1] + 1] - time[0]], abs=2e-3)
    before = ch.run.time - ch.run.time[0] < 2.2
    at = ch.run.time[before] - ch.run.time[0]
    ours, all_rows = (np.interp(at, whole.grid(c).time, whole.simulate({}, c)["angle"]) for c in (ch, full))
    assert np.max(abs(ours - all_rows)) < 1e-3
    behind = before & (ch.run.time - ch.run.time[0] > 1.7)
    assert whole.settled(ch)[behind][:20].all()


@pytest.mark.slow
def test_a_sensor_before_the_controller_acts_in_the_loop_and_one_beside_it_does_not(seed, tmp_path):
    bench = experiment(recordings.hide([], seed, longest=6.0, duration=6.0), tmp_path)
    bench = DriveExperiment(
        replace(bench.rig, loop=LOAD), bench.runs
    )  # of some logs the motor's encoder is found to be before it
    (ch,) = bench.channels.values()
    plain = whole.simulate({}, ch)
    biased = whole.simulate({"sensor.load.angle.bias": 0.01}, ch)
    assert np.median((biased["angle"] - plain["angle"])[len(plain["angle"]) // 2 :]) == pytest.approx(-0.01, rel=0.2)
    assert whole.simulate({"sensor.motor.current.bias": 0.5}, ch)["current"] is plain["current"]


@pytest.mark.parametrize(("rows", "noise"), [(2.3, 0.02), (5.0, 0.02), (17.7, 0.02), (28.5, 0.09)])
@pytest.mark.slow
def test_the_period_of_a_command_is_read_from_its_steps(rows, noise, rng, tmp_path):
    """Of slow ones the second line, of half the period, may stand a trifle taller than the first."""
    case = recordings.hide([], recordings.DEVELOPMENT + 1, longest=8.0, duration=8.0)
    bench = experiment(case, tmp_path)
    (ch,) = bench.channels.values()
    time = ch.run.time - ch.run.time[0]
    wanted, first = rows * float(np.median(np.diff(time))), 0.3 * rows * float(np.median(np.diff(time)))
    last = np.floor((time - first) / wanted) * wanted + first
    held = 5.0 * np.sin(3.0 * last) + 2.0 * np.sin(11.0 * last) + noise * rng.standard_normal(len(time))
    ch.run.memory["controller.voltage"] = held
    found = periods(ch)
    assert any(one == pytest.approx(wanted, rel=1e-3) for one in found), found
    assert all(wanted / one == pytest.approx(round(wanted / one), rel=2e-3) for one in found), found
    late = (-ticks(wanted, ch) - first) % wanted
    assert min(late, wanted - late) < 0.6 * float(np.median(np.diff(time)))


@pytest.mark.slow
def test_a_command_that_follows_has_no_period(seed, tmp_path):
    case = recordings.hide([], seed, longest=6.0, duration=6.0)
    case.recorder = replace(case.recorder, control=0.0)
    bench = experiment(case, tmp_path)
    (ch,) = bench.channels.values()
    time = ch.run.time
    ch.run.memory["controller.voltage"] = 5.0 * np.sin(3.0 * time) + np.random.default_rng(seed).standard_normal(len(time)) * 0.02
    assert periods(ch) == ()


def test_few_steps_are_told_by_the_rows_that_go_on_to_another(rng):
    """A current in five steps of an ampere was told in halves; where a signal only stays at few values it lies in no steps."""
    time = np.linspace(0.0, 12.0, 12000)
    step, read = rng.uniform(0.9, 1.2), lambda x: np.round((x + 0.03 * rng.standard_normal(len(x))) / 0.01) * 0.01
    turns = np.pi * rng.uniform(-1.0, 1.0)
    smooth = 2.4 * np.sin(3.0 * time + turns) + 0.3 * np.sin(40.0 * time)
    assert step_of(read(step * np.round(smooth / step)), 0.01) == pytest.approx(step, rel=5e-3)
    held = 3.0 * np.clip(2.0 * np.sin(2.0 * time + turns), -1.0, 1.0)  # it stays at two values and goes from one to the other
    assert step_of(read(held), 0.01) == 0.0


@pytest.mark.parametrize("step, noise", [(0.3, 0.02), (1.1, 0.1)])
def test_the_step_of_a_coarse_sensor_is_found_behind_noise_and_a_finer_rounding(step, noise, rng):
    x = 4.0 * np.sin(np.linspace(0.0, 40.0, 8000)) + rng.uniform(-0.1, 0.1)
    read = np.round((step * np.round(x / step) + noise * rng.standard_normal(len(x))) / 0.01) * 0.01
    assert step_of(read, 0.01) == pytest.approx(step, rel=5e-3)
    assert step_of(np.round((x + noise * rng.standard_normal(len(x))) / 0.01) * 0.01, 0.01) == 0.0


def test_of_steps_of_about_two_counts_both_are_told_in_which_the_values_lie(rng):
    """What an encoder reads in steps of 1.885 of its counts lies in steps of 2.13 of them as well; an angle that is off twice its rounding has 1.73."""
    count, times = rng.uniform(1e-4, 1e-2), rng.uniform(1.75, 2.45)
    turned = count * rng.uniform(1000.0, 3000.0) * np.sin(np.linspace(0.0, rng.uniform(5.0, 9.0), 8000) + rng.uniform(0.0, 6.0))
    read = lambda x: np.round(x / count) * count
    coarse = times * count
    found = steps_of(read(coarse * np.round(turned / coarse)), count)
    assert min(abs(q / coarse - 1.0) for q in found) < 2e-3
    assert all(1.66 < q / count < 2.52 for q in found)
    assert steps_of(read(turned), count) == ()


@pytest.mark.alike
@pytest.mark.parametrize(
    "lost, said",
    [
        ("controller.angle_setpoint", "a column of controller.angle_setpoint"),
        ("load.angle", "a column of load.angle or reducer.input_angle"),
        ("controller.angle_gain", "the controller's angle_gain"),
        ("motor.", "parameters of the motor"),
    ],
)
def test_what_describes_no_loop_is_told_by_name(lost, said, tmp_path):
    bench = experiment(recordings.hide([], recordings.DEVELOPMENT + 1, longest=2.0, duration=2.0), tmp_path)
    signals = {name: x for name, x in bench.runs[0].signals.items() if name not in (lost, "reducer.input_angle")}
    parameters = {name: value for name, value in bench.rig.parameters.items() if not name.startswith(lost)}
    rig = replace(bench.rig, parameters=parameters)
    assert whole.undescribed(bench.rig, set(bench.runs[0].signals)) == ""
    with pytest.raises(DataError, match=f'simulate = "whole" needs {said}'):
        DriveExperiment(rig, [replace(bench.runs[0], signals=signals)])


@pytest.mark.slow
@pytest.mark.parametrize("channel", ["controller.voltage", "motor.voltage"])
def test_a_controller_slower_than_its_log_acts_when_it_did(seed, channel, tmp_path):
    """Whatever its voltage is called, and wherever the instants of the simulation lie."""
    rng = np.random.default_rng(seed)
    control = rng.uniform(2.5e-3, 5e-3)
    recorder = replace(draw(rng), control=control, step=1e-3, jitter=0.0, duration=3.0, averaged=False)
    case = recordings.hide([], seed, recorder=replace(recorder, lags=dict.fromkeys(recorder.lags, 0.0)))
    rig, train, _ = case.write(tmp_path)
    rig.write_text(rig.read_text().replace('"controller.voltage"', f'"{channel}"'))
    found = replace(load(rig), simulate=whole.WHOLE)
    runs = read(train, found)
    check(runs, found)
    (ch,) = DriveExperiment(found, runs).channels.values()
    rows, ticked = whole.simulate({}, ch), ticks(control, ch)
    acted = whole.grid(ch).time[1:][np.diff(rows["voltage"]) != 0.0]
    off = (acted + ticked + 0.5 * control) % control - 0.5 * control
    assert len(acted) > 100 and abs(off).max() < 1e-6
    assert whole.grid(ch).dt.min() > 0.0


@pytest.mark.slow
def test_of_less_than_a_wave_no_tachos_ripple_is_asked(seed, tmp_path):
    slow = Speed("tacho", ripple=0.01, order=1.0)
    recorder = replace(draw(np.random.default_rng(seed), ("speed", "motor_speed")), duration=3.0, step=1e-3)
    case = recordings.hide([], seed, recorder=replace(recorder, speeds=dict.fromkeys(recorder.speeds, slow)))
    bench = experiment(case, tmp_path)
    turned = np.ptp(case.logs[0]["angle"]) / (2.0 * np.pi)
    asked = [p.name for p in Problem.of(bench, np.ones(bench.layout.count, bool)).base_free if "load.speed.ripple_cos" in p.name]
    orders = [int(name.rsplit("_", 1)[1]) for name in asked]
    assert all(n * turned > 0.9 for n in orders)
    assert all(n in orders for n in RULES.residuals.ripples if n * turned > 1.1)


@pytest.mark.parametrize(
    ("more", "channels", "way"),
    [
        ({"controller.angle_gain": 9.0}, ["controller.angle_setpoint", "controller.voltage"], driven.ANGLE),
        ({"controller.speed_gain": 9.0}, ["controller.speed_setpoint", "controller.voltage"], driven.SPEED),
        ({}, ["controller.voltage"], driven.VOLTAGE),
        ({}, ["controller.angle_setpoint", "motor.duty", "motor.supply_voltage"], driven.VOLTAGE),
        ({}, ["controller.speed_setpoint", "motor.voltage"], driven.VOLTAGE),
        ({}, ["controller.angle_setpoint"], ""),
        ({"controller.angle_gain": 9.0}, ["controller.angle_setpoint", "motor.duty", "motor.supply_voltage"], driven.ANGLE),
        ({"controller.angle_gain": 9.0}, ["controller.angle_setpoint", "motor.duty"], ""),
        (
            {"controller.angle_gain": 9.0},
            ["controller.angle_setpoint", "motor.duty", "motor.supply_voltage", "motor.voltage"],
            "",
        ),
    ],
)
def test_a_controller_that_nobody_describes_leaves_the_voltage_to_say_what_drove_the_motor(more, channels, way, tmp_path):
    """A log of an amplifier may well have its set-points; gains that nobody gave are no gains of it."""
    parts = {"motor.resistance": 1.0, "reducer.gear_ratio": 20.0, "load.inertia": 0.1} | more
    rig = Rig(tmp_path / "rig.toml", "bench", "forward", (LogColumn("load.angle", "load.angle"),), parts)
    assert driven.way(rig, {"load.angle", *channels}) == way
