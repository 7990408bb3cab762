"""A command that a controller gives in coarse steps, as a PWM of 8 bits has them, compared with its law of what was logged."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from selflock.diagnosis.data.faults import check
from selflock.diagnosis.data.log import MeasuredRun
from selflock.diagnosis.data.rig import LogColumn, Rig
from selflock.diagnosis.data.values import noise_of
from selflock.diagnosis.pipeline.in_step import whole_where_described
from selflock.diagnosis.residuals.drive_experiment import DriveExperiment
from selflock.diagnosis.residuals.recorder import written_step
from selflock.diagnosis.rules import RULES
from selflock.diagnosis.search.candidate import Candidate
from selflock.diagnosis.search.hypotheses import Free, Hypothesis
from selflock.diagnosis.search.problem import Problem
from selflock.diagnosis.search.selection import Selection
from selflock.diagnosis.search.step import CHANCE, WITHIN, Stage
from selflock.fmus.effect import LAG

from .test_row_by_row import DRIVE

ROW, N, SUPPLY, GAIN, DAMPS = 0.01, 1500, 12.0, 6.0, 0.15
STEP = SUPPLY / 255.0
RIG = DRIVE | {
    "controller.angle_gain": GAIN,
    "controller.speed_gain": DAMPS,
    "controller.voltage_max": SUPPLY,
    "controller.voltage_min": -SUPPLY,
    "controller.release_time": 1e6,
}


def logged(rng, gives, gain=1.0, battery=False, lag=None, least=0.0):
    """A rig and a log of set-points that jump and a load that follows; `gives` makes a command of what the law says, of `gain` times GAIN.

    lag: s, of the load. least: rad, of jumps to and fro; else they are as drawn.
    """
    time = ROW * np.arange(N)
    jumps = rng.uniform(least, 1.0, N // 100) * (-1.0) ** np.arange(N // 100) if least else rng.uniform(-1.0, 1.0, N // 100)
    wanted = np.repeat(jumps, 100)
    lag = lag or rng.uniform(0.05, 0.2)
    follows, angle = np.exp(-ROW / lag), np.zeros(N)
    for i in range(1, N):
        angle[i] = wanted[i - 1] + (angle[i - 1] - wanted[i - 1]) * follows
    speed = (np.append(0.0, wanted[:-1]) - angle) / lag + 0.01 * rng.standard_normal(
        N
    )  # as a controller in step sees it, noise and all
    u = np.clip(gives(gain * GAIN * (wanted - angle) - DAMPS * speed), -SUPPLY, SUPPLY)
    signals = {
        "controller.angle_setpoint": wanted,
        "controller.speed_setpoint": np.zeros(N),
        "motor.duty" if battery else "motor.voltage": u / SUPPLY if battery else u,
        "load.angle": angle,
        "load.speed": speed,
    }
    if battery:
        signals["motor.supply_voltage"] = SUPPLY + 0.01 * rng.standard_normal(N)
    columns = tuple(LogColumn(name, name) for name in signals)
    rig = Rig(Path("rig.toml"), "bot", "forward", columns, RIG, time=LogColumn("time", "time"), loop="load")
    run = MeasuredRun("log.csv", "", np.arange(N), time, signals)
    check([run], rig)
    return rig, run


def asked_of(rig, run):
    """The problem of a log, part by part, with its noise."""
    bench = DriveExperiment(rig, [run])
    return Problem.of(bench, np.ones(bench.layout.count, bool)).with_noise()


def in_steps(to):
    return lambda u: STEP * to(u / STEP)


ROUNDED = {"to the nearest": np.round, "down": np.floor, "to zero": np.trunc}


@pytest.mark.parametrize("to", ROUNDED.values(), ids=ROUNDED)
def test_a_command_in_steps_is_its_law_whichever_way_it_is_rounded_and_a_wrong_gain_is_not(rng, to):
    """Within a step the law is right, to less than the steps' noise in samples and in bins; a gain that is off by a fifth is seen beyond."""
    sound, wrong = (asked_of(*logged(rng, in_steps(to), gain, least=0.3)) for gain in (1.0, 1.2))
    (place,) = [i for i, one in enumerate(sound.experiment.residuals) if one.kind == "controller"]
    part = sound.experiment.slice(sound.experiment.residuals[place])
    of = lambda problem: problem.misfit(problem.nominal).reshape(problem.shape)[:, part][problem.present[:, part]]
    assert sound.excess(sound.nominal)[place] <= 1.0 and abs(of(sound)).max() < 1.0
    assert wrong.excess(wrong.nominal)[place] > RULES.search.natural
    assert np.sqrt(np.mean(of(wrong) ** 2)) > 1.5


def test_noise_of_a_command_is_at_least_that_of_its_steps_where_it_rests(rng):
    """A drive that rests has the same rounding in row after row: no difference of neighbours has it, and the bins' noise does."""
    problem = asked_of(*logged(rng, in_steps(np.round)))
    (place,) = [i for i, one in enumerate(problem.experiment.residuals) if one.kind == "controller"]
    assert 0.3 * STEP / np.sqrt(12.0) < problem.noise[place] < 1.1 * STEP / np.sqrt(12.0)


def test_the_steps_of_a_written_command_are_no_fault_of_a_sensor_and_those_of_a_measured_voltage_may_be(rng):
    """Nobody reads what a controller writes."""
    of = lambda problem: {h.effect for h in problem.hypotheses if h.channel == "motor.voltage"}
    written = of(asked_of(*logged(rng, in_steps(np.round))))
    noisy = of(asked_of(*logged(rng, lambda u: u + 0.1 * rng.standard_normal(len(u)))))
    assert "scale" in written and noisy - written == {"quantisation"}


def test_a_controller_that_commands_a_duty_is_compared_as_a_whole_and_one_of_a_voltage_part_by_part(rng):
    """No comparison of single parts has a duty's controller; what a voltage's makes of its row is one of them."""
    ways = {}
    for battery in (True, False):
        rig, run = logged(rng, in_steps(np.round), battery=battery)
        ways[battery] = whole_where_described(rig, [run])
    assert ways[True][0].simulate == "whole" and "commands motor.duty" in ways[True][1]
    assert ways[False][0].simulate == "", ways[False][1]


@pytest.mark.parametrize(("doubts", "within"), [([WITHIN, CHANCE], True), ([CHANCE, WITHIN], False), ([], False)])
def test_what_is_left_is_a_matter_between_rows_where_what_explains_most_of_it_is_late_within_one(doubts, within):
    fit = object()
    candidates = [Candidate(Hypothesis("", "", ()), (), fit, np.zeros((1, 1)), doubt=doubt) for doubt in doubts]
    stage = Stage(Candidate(Hypothesis("", "none", ()), (), fit, np.zeros((1, 1))), candidates)
    outcome = Selection(None, [stage], [], [], fit, fit, None)
    assert outcome.within_rows == within
    stage.winner = candidates[0] if candidates else None
    assert not (candidates and outcome.within_rows)


@pytest.mark.parametrize(("channels", "late"), [(["a", "b"], True), (["a", "a"], False), (["a"], False), ([], False)])
def test_sensors_of_several_channels_that_lag_are_a_command_that_acts_late(channels, late):
    lag = Free("lag", 0.0, -1.0, 1.0, role=LAG)
    causes = [Candidate(Hypothesis("sensor", "lag", (lag,), name), (lag,), None, np.zeros((1, 1))) for name in channels]
    scale = Free("scale", 1.0, 0.0, 2.0)
    beside = Candidate(Hypothesis("sensor", "scale", (scale,), "c"), (scale,), None, np.zeros((1, 1)))
    assert Selection(None, [], [*causes, beside], [], None, None, None).late_at_once == late


def test_a_command_that_changes_in_most_rows_was_written_in_steps_and_a_measured_voltage_was_not(rng):
    """Rounding is noise anew in each row, and all there is; a converter's counts lie in steps, too, but in the noise that it reads."""
    slow = rng.uniform(0.5, 1.0)
    for noise, step in ((0.0, STEP), (rng.uniform(1.0, 3.0) * STEP, 0.0)):
        read = lambda u: STEP * np.round((u + noise * rng.standard_normal(len(u))) / STEP)
        rig, run = logged(rng, read, lag=slow, least=0.3)
        assert np.mean(np.diff(run.signals["motor.voltage"]) == 0.0) < 0.5
        assert written_step("motor.voltage", DriveExperiment(rig, [run]).channels[0, ""]) == pytest.approx(step)


def test_rounding_a_ramp_leaves_no_more_noise_than_is_taken_for_its_own(rng):
    ramps = (rng.uniform(0.0, 3.0) * np.arange(N) + rng.uniform() for _ in range(100))
    assert max(noise_of(to(ramp)) for ramp in ramps for to in ROUNDED.values()) < RULES.residuals.of_own_steps


def test_numbers_of_a_law_that_lie_in_no_step_were_written_in_none(rng):
    """Between the values of a law that is computed to its last digit there is a least distance, too, as if it were a step."""
    for gives, step in ((lambda u: u, 0.0), (lambda u: STEP * np.round(u / STEP), STEP)):
        rig, run = logged(rng, gives)
        bench = DriveExperiment(rig, [run])
        assert written_step("motor.voltage", bench.channels[0, ""]) == pytest.approx(step, rel=1e-9, abs=1e-15)
