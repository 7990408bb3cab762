"""Noise of the voltage that drives an open loop: how much of it there is, and what it makes of the other channels."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from selflock.diagnosis.data.rig import load
from selflock.diagnosis.pipeline.run import gather
from selflock.diagnosis.residuals import dilution, driven, whole
from selflock.diagnosis.residuals.drive_experiment import DriveExperiment

from ..plant import cascade


@pytest.fixture
def case(rng, monkeypatch):
    """A sound drive whose voltage is logged as the mean over each row, so that all noise on it is what a test puts there.

    Its motor has an angle: of an arm that hangs a speed alone describes no whole drive.
    """
    drawn = cascade.recorder
    exact = lambda rng: replace(drawn(rng), mean_voltage=True, channels=("u", "i", "n", "rotor"))
    monkeypatch.setattr(cascade, "recorder", exact)
    return cascade.hide([], cascade.DEVELOPMENT + int(rng.integers(10**6)), 4.0)


def experiment(case, folder, volts, rng):
    """Of the case's first log with so much white noise on its voltage, V."""
    folder.mkdir()
    logs = [log.assign(u=log["u"] + volts * rng.standard_normal(len(log))) for log in case.logs]
    rig, train, _ = replace(case, logs=logs).write(folder)
    rig = replace(load(rig), simulate=whole.WHOLE)
    return DriveExperiment(rig, gather(rig, train[:1], [])[0])


def of(bench, output):
    return next(r for r in bench.residuals if r.output == output)


def told(bench):
    """The fast current that is taken for noise of the voltage, A."""
    return dilution._of_current(bench, of(bench, "motor.current"), {})


@pytest.mark.slow
def test_noise_of_the_voltage_is_found_in_the_current_and_carried_on_to_the_speed(case, rng, tmp_path):
    """What is said of both is by how much the simulation from the noisy voltage is another than that from the clean one."""
    volts = 0.05 * case.sheet["supply"]
    clean, noisy = (experiment(case, tmp_path / str(v), v, rng) for v in (0.0, volts))
    moved = {}
    for name in ("motor.current", "reducer.input_speed"):
        ((s0, _, g0),), ((s1, _, g1),) = (b.compare(of(b, name), {}) for b in (clean, noisy))
        good = g0 & g1
        moved[name] = dilution.fast([np.where(good, s1 - s0, 0.0)], [good]), float(np.sqrt(np.mean((s1 - s0)[good] ** 2)))
    assert told(noisy) == pytest.approx(moved["motor.current"][0], rel=0.25)
    assert told(clean) < 0.2 * told(noisy)
    fast, all_of_it = moved["reducer.input_speed"]
    slow, _ = dilution.of_driving(noisy, of(noisy, "reducer.input_speed"), {})
    assert slow == pytest.approx(np.sqrt(all_of_it**2 - fast**2), rel=0.5)


@pytest.mark.slow
def test_noise_of_the_current_alone_is_none_of_the_voltage(case, rng, tmp_path):
    spread = 5.0 * float(case.logs[0]["i"].std())
    loud = replace(case, logs=[log.assign(i=log["i"] + spread * rng.standard_normal(len(log))) for log in case.logs])
    assert told(experiment(loud, tmp_path / "loud", 0.0, rng)) < 0.1 * spread


def told_of(case, folder, volts):
    """What the rows say of the voltage between them, V, where the log has volts(time) for its voltage."""
    folder.mkdir()
    logs = [log.assign(u=volts(log["t"].to_numpy(), n)) for n, log in enumerate(case.logs)]
    rig, train, _ = replace(case, logs=logs).write(folder)
    rig = replace(load(rig), simulate=whole.WHOLE)
    bench = DriveExperiment(rig, gather(rig, train, [])[0])
    return between_rows(bench), bench


def between_rows(bench):
    return dilution.between_rows([bench.channels[i, ""] for i in range(len(bench.runs))])


@pytest.mark.slow
def test_what_a_voltage_does_between_its_rows_is_told_by_how_far_each_lies_from_the_line_between_its_neighbours(
    case, rng, tmp_path
):
    """Of a walk that is known in a fortieth of a row it is how far the means from row to row are off those of the lines."""
    walks, off = {}, []

    def walk(time, n):
        fine, step = 40, float(np.median(np.diff(time)))
        path = 0.2 * np.cumsum(rng.standard_normal(fine * (len(time) + 1)))
        places = np.clip(np.round((time - time[0]) / step * fine).astype(int), 0, len(path) - 1)
        walks[n] = path
        for a, b in zip(places[:-1], places[1:]):
            if b - a == fine:
                off.append(path[a:b].mean() - 0.5 * (path[a] + path[b]))
        return path[places]

    found, _ = told_of(case, tmp_path / "walk", walk)
    assert found == pytest.approx(np.sqrt(np.mean(np.square(off))), rel=0.25)


@pytest.mark.slow
def test_what_is_new_in_each_row_is_missed_by_as_much_over_many_of_them(case, rng, tmp_path):
    """Of a controller that acts on counts several times in a row the log has one of these: what its line misses of twenty rows adds up."""
    fine, many, missed = 5, 20, []

    def spikes(time, n):
        acted = 0.5 * rng.standard_normal(fine * len(time))
        rows = acted[::fine]
        off = acted.reshape(-1, fine).mean(1)[:-1] - 0.5 * (rows[1:] + rows[:-1])
        missed.extend(off[: len(off) // many * many].reshape(-1, many).sum(1) / np.sqrt(many))
        return rows

    found, _ = told_of(case, tmp_path / "spikes", spikes)
    assert found == pytest.approx(np.sqrt(np.mean(np.square(missed))), rel=0.3)


def test_a_command_that_stays_as_it_is_has_no_noise(rng):
    """And the others as much more, so that all have as much on average."""
    command = np.concatenate([np.zeros(40), rng.standard_normal(50), np.full(30, 5.0)])
    every = np.ones(len(command), bool)
    times = driven.lively(command, every)
    assert not times[:39].any() and not times[91:].any() and (times[40:90] > 1.0).all()
    assert np.mean(times**2) == pytest.approx(1.0)
    assert not driven.lively(np.full(9, 2.0), every[:9]).any()


def test_a_command_of_steps_has_no_noise_where_it_jumps(rng):
    """Jogs of a duty: what few rows in which it changes would have had was all of the noise, as spikes of a hundred times as much."""
    command = np.repeat(rng.uniform(-5.0, 5.0, 12), 60)
    told = np.abs((np.arange(len(command)) + 30) % 60 - 30) > 1
    assert not driven.lively(command, told).any()


@pytest.mark.slow
def test_what_few_rows_of_a_current_have_is_no_noise_of_the_voltage(case, rng, tmp_path):
    """As flanks of a play that meet: what the simulated current has there and the measured one has not, of a log without any noise."""
    bench = experiment(case, tmp_path / "clean", 0.0, rng)
    ((simulated, measured, good),) = bench.compare(of(bench, "motor.current"), {})
    size, rows = 200.0 * float(np.std(measured - simulated)), rng.choice(len(measured) - 1, len(measured) // 200, replace=False)
    for few in (rows, np.arange(len(measured))):
        spikes = np.zeros(len(measured))
        spikes[few] = size * rng.choice([-1.0, 1.0], len(few))
        bench.compare = lambda *_: [(simulated + spikes, measured, good)]
        noise = told(bench) / size
        if few is rows:
            assert noise < 0.015  # the mean of all rows has 0.07
        else:
            assert noise == pytest.approx(1.0, rel=0.1)


@pytest.mark.slow
def test_a_voltage_that_goes_straight_or_is_held_from_each_row_on_does_nothing_between_them(case, tmp_path):
    size = 0.3 * case.sheet["supply"]
    slow, _ = told_of(case, tmp_path / "slow", lambda time, n: size * np.sin(3.0 * time))
    assert slow < 1e-3 * size
    jumpy, bench = told_of(case, tmp_path / "held", lambda time, n: size * (np.arange(len(time)) % 7 > 3))
    assert jumpy > 1e-2 * size
    for run in bench.runs:
        run.memory[driven.ACTS] = frozenset({driven.BY_ROWS})
    assert between_rows(bench) == 0.0
