"""The plant that lifts nothing: its own physics, and what the diagnosis makes of it. `python -m benchmarks.fieldbus` asks each cause."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest

from selflock.diagnosis import diagnose
from selflock.diagnosis.data.rig import load
from selflock.diagnosis.pipeline.run import gather, problem_of
from selflock.diagnosis.residuals import driven, whole
from selflock.diagnosis.residuals.drive_experiment import DriveExperiment
from selflock.diagnosis.rules import RULES
from selflock.diagnosis.search.instants import place_jumps, place_jumps_again, place_ticks

from .plant import bus, fieldbus


def _winch(rng, friction):
    """A winch of which only the voltage is given."""
    of = replace(fieldbus.make(rng), load="winch", way="voltage", act=1, seen=0.0, battery=(1.0, 0.0, 0.0, 0.0))
    s = fieldbus.sheet(rng, of)
    return of, s | {"friction": friction * s["tangent"], "preload": 0.0}


def test_its_gear_holds_a_rope_that_pulls_and_slides_by_the_law_of_the_wedge(rng):
    """A winch at rest under its load stays there without a volt (12); at even speed its current is that of (2), (3), (13)."""
    n = 100_000
    of, s = _winch(rng, 1.2)
    still = fieldbus.simulate(s, of, np.zeros((3, n)))
    assert np.ptp(still[1000:, 2]) < 1e-2
    of, s = _winch(rng, 0.5)
    even = fieldbus.simulate(s, of, np.stack([np.zeros(n), np.zeros(n), np.full(n, 0.9 * s["supply"])]))[-1]
    slope = math.tan(math.atan(s["tangent"]) + math.atan(s["friction"])) / (s["ratio"] * s["tangent"])
    assert even[1] * s["constant"] == pytest.approx(s["pull"] * slope, rel=0.01)
    assert even[3] * s["constant"] == pytest.approx(0.9 * s["supply"] - s["resistance"] * even[1], rel=0.01)


@pytest.mark.slow
def test_the_second_log_begins_in_motion_and_files_are_written_as_a_user_would(tmp_path):
    case = fieldbus.hide([], fieldbus.DEVELOPMENT + 1, 3.0)
    rig, train, test = case.write(tmp_path)
    assert [path.name for path in (*train, test)] == ["train1.csv", "train2.csv", "test.csv"]
    assert "[columns]" in rig.read_text() and "controller" in rig.read_text()
    assert len(case.logs[1]) < len(case.logs[0])


@pytest.mark.slow
@pytest.mark.parametrize("span", [1e-3, 5e-3, 20e-3])
def test_what_its_senders_average_is_over_all_of_their_time(span, rng):
    """A motor that turns evenly under an even current: a step too few of 250 was a scale of 0.996, which the diagnosis named."""
    n, rate, current = 5000, rng.uniform(10.0, 100.0), rng.uniform(0.5, 2.0)
    rows = np.zeros((n, 7))
    rows[:, 1], rows[:, 2] = current, rate * fieldbus.STEP * np.arange(n)
    case = fieldbus.hide([], fieldbus.DEVELOPMENT, 3.0)
    by = replace(case.recorder, window=span, mean=span, counts=(1e-9, 1e-9))
    found = bus._measured(rng, by, case.sheet, rows, np.zeros((3, n)), fieldbus.STEP)
    assert found["n"][-1] == pytest.approx(rate, rel=1e-5) and found["i"][-1] == pytest.approx(current, rel=1e-9)


def _problem(seed, folder):
    """What teaches of a sound drive that is compared as a whole."""
    rig, train, _ = fieldbus.hide([], fieldbus.DEVELOPMENT + seed).write(folder)
    found = replace(load(rig), simulate=whole.WHOLE)
    runs, _, held = gather(found, train, [])
    experiment = DriveExperiment(found, runs)
    return problem_of(experiment, runs, held, np.ones(experiment.layout.count, bool))


@pytest.mark.slow
@pytest.mark.parametrize(
    "seed",
    [
        pytest.param(110, id="begun in motion, some way behind its set-point, its encoder counts from anywhere"),
        pytest.param(104, id="a table of what was last sent, of another age in each log"),
        pytest.param(154, id="the same, in uneven rows, its messages even and one of two stand in two rows"),
    ],
)
def test_a_sound_drive_leaves_noise_behind_its_recorder(seed, tmp_path):
    problem = _problem(seed, tmp_path).with_noise()
    assert problem.excess(problem.nominal).max() < RULES.search.sound


@pytest.mark.slow
def test_a_shaft_in_motion_is_as_fast_as_it_was_when_its_log_began(tmp_path):
    """An average about the first row, as if it had stood before, was half as fast."""
    problem = _problem(158, tmp_path)
    ch = problem.experiment.channels[1, ""]
    angle, time = ch.raw("load.angle"), ch.run.time
    _, _, began, speed = whole.begin({}, ch)[0]
    assert began == pytest.approx(angle[0], abs=0.002 * np.ptp(angle))
    assert speed == pytest.approx((angle[4] - angle[0]) / (time[4] - time[0]), rel=0.03) and abs(speed) > 5.0


@pytest.mark.slow
@pytest.mark.parametrize("seed", [pytest.param(111, marks=pytest.mark.in_turn(8)), 116])
def test_jumps_are_placed_by_noise_and_not_by_what_a_drive_at_rest_errs(seed, tmp_path):
    """A spindle that rests for most of its log: in units of its median error there all places of a jump were as wrong.

    A cart, whose messages are late by what is held while places are tried: else that followed, and all places were as right.
    """
    problem = _problem(seed, tmp_path)
    assert place_jumps(problem.experiment, problem)
    problem = problem.on(problem.experiment.but_with(problem.experiment.setting)).with_noise()
    assert problem.excess(problem.nominal).max() < RULES.search.sound


@pytest.mark.slow
@pytest.mark.in_turn(4)
def test_jumps_that_were_placed_for_a_wrong_drive_are_placed_again_for_the_right_one(rng, tmp_path):
    """Of two fits for that which leaves less; what is right by then is not asked again."""
    problem = _problem(116, tmp_path)
    assert place_jumps(problem.experiment, problem)
    for ch in problem.experiment.channels.values():
        driven.sooner(ch).update(dict.fromkeys(driven.sooner(ch), 0.0))
    problem = problem.on(problem.experiment.but_with(problem.experiment.setting)).with_noise()
    right = problem.fit(problem.base_free, problem.nominal)
    heavy = problem.fit(
        problem.base_free, problem.nominal | {"load.inertia": 2.0 * problem.experiment.rig.parameters["load.inertia"]}
    )
    assert problem.excess(right.values).max() > RULES.search.sound
    found, fitted = place_jumps_again(problem.experiment, problem, [heavy, right])
    assert found.excess(fitted.values).max() < RULES.search.sound
    assert place_jumps_again(found.experiment, found, [fitted]) is None


@pytest.mark.slow
def test_when_a_controller_acts_is_told_closer_than_by_rows_as_far_apart_as_its_acts(tmp_path, monkeypatch):
    """Every 2 ms, 0.02 s before the first row among them. Half a row off its current was a scale of it."""
    problem = _problem(244, tmp_path)
    with monkeypatch.context() as asked:  # as its rows tell it it leaves 1.13 times its noise, hardly what is not good enough
        asked.setitem(vars(RULES.search), "sound", 1.0)
        assert place_ticks(problem.experiment, problem)
    ticked = problem.experiment.runs[0].memory["ticks"][2e-3]
    assert min(ticked, 2e-3 - ticked) < 0.15e-3
    problem = problem.on(problem.experiment.but_with(problem.experiment.setting)).with_noise()
    assert problem.excess(problem.nominal).max() < RULES.search.sound


def _answered_none(seed, folder):
    """The diagnosis of a sound drive, which has no cause."""
    rig, train, test = fieldbus.hide([], fieldbus.DEVELOPMENT + seed).write(folder)
    result = diagnose(rig, train, test=[test], out=None, seed=1)
    assert result.verdict == "none", result.summary()
    return result


@pytest.mark.in_turn
@pytest.mark.slow
def test_counts_that_the_controller_never_saw_are_no_fault_of_the_drive(tmp_path):
    """A carriage whose loop closes over its motor's 512 counts, as the log has them, and steps with none."""
    _answered_none(19, tmp_path)


@pytest.mark.in_turn
@pytest.mark.slow
def test_a_command_without_noise_whose_rows_hold_older_messages_is_no_log_in_step_with_its_controller(tmp_path):
    """Its parts on what was measured had a false scale and lag of the voltage; the whole drive makes the voltage as it is logged."""
    result = _answered_none(118, tmp_path)
    assert result.recorder["mode"] == "whole" and "not taken in step" in result.recorder["why"], result.recorder


@pytest.mark.in_turn
@pytest.mark.slow
@pytest.mark.parametrize("hidden", [[], ["reducer.viscous"]], ids=["nothing", "viscous"])
def test_causes_that_the_whole_drive_speaks_against_are_not_the_last_word(hidden, tmp_path):
    """A carriage held at an angle, in rows of whole ms that hold messages: two gains of its controller were named, or nothing at all."""
    rig, train, test = fieldbus.hide(hidden, 501).write(tmp_path)
    result = diagnose(rig, train, test=[test], out=None, seed=501)
    assert [cause.label for cause in result.causes] == [name.replace(".", " ") for name in hidden], result.summary()
    assert result.verdict == ("explained" if hidden else "none") and result.recorder["mode"] == "whole"


@pytest.mark.in_turn
@pytest.mark.slow
@pytest.mark.parametrize(
    ("seed", "drives"),
    [(4, "motor.voltage"), (16, "motor.duty times motor.supply_voltage"), (25, "motor.duty"), (43, "reducer.input_speed")],
)
def test_a_sound_drive_in_open_loop_or_held_at_a_speed_has_no_cause(seed, drives, tmp_path):
    """A winch jogged by a voltage, carts by a duty, one at once and in rows of 5 ms, a spindle whose controller holds a speed."""
    result = _answered_none(seed, tmp_path)
    assert result.recorder["mode"] == "whole" and drives in " ".join(result.recorder["assumed"]), result.recorder


@pytest.mark.in_turn
@pytest.mark.slow
def test_a_viscous_friction_behind_an_open_loop_is_named(tmp_path):
    """To a tenth of what is hidden, and extended.toml does on the log's voltage what the fit promised."""
    case = fieldbus.hide(["reducer.viscous"], fieldbus.DEVELOPMENT + 4)
    rig, train, test = case.write(tmp_path)
    result = diagnose(rig, train, test=[test], out=tmp_path / "out", seed=1)
    assert [cause.label for cause in result.causes] == ["reducer viscous"], result.summary()
    assert result.causes[0].parameters["reducer.viscous_damping"]["value"] == pytest.approx(case.true["viscous"], rel=0.1)
    assert result.extension["agrees"], result.extension


@pytest.mark.in_turn
@pytest.mark.slow
def test_a_ripple_has_a_phase_of_its_own_in_a_log_that_began_in_motion_where_a_speed_alone_tells(tmp_path):
    """With one phase for both logs it had 1.1 waves in a turn in place of one."""
    rig, train, test = fieldbus.hide(["reducer.ripple"], fieldbus.DEVELOPMENT + 309).write(tmp_path)
    result = diagnose(rig, train, test=[test], out=None, seed=10_309)
    assert [cause.label for cause in result.causes] == ["reducer ripple"], result.summary()
    found = {name: p["value"] for name, p in result.causes[0].parameters.items()}
    assert found["reducer.output_ripple"] == pytest.approx(0.6, rel=0.05)
    assert found.get("reducer.output_ripple_order", 1.0) == pytest.approx(1.0, abs=0.01), found
    assert {run["parameter"] for run in result.runs} == {"reducer.output_ripple_phase"}, result.runs


@pytest.mark.in_turn
@pytest.mark.slow
@pytest.mark.parametrize("seed", [761, 772])
def test_a_supply_that_sags_before_a_linear_stage_is_no_resistance(seed, tmp_path):
    """A tenth of its current's square flows while the motor brakes, or a three-hundredth: the stage takes it of the supply all the same.

    Seeds of development, since they were looked at.
    """
    case = fieldbus.hide(["motor.supply_sag"], seed)
    rig, train, test = case.write(tmp_path)
    result = diagnose(rig, train, test=[test], out=None, seed=seed)
    assert [cause.label for cause in result.causes] == ["motor supply_sag"], result.summary()
    found = {name: p["value"] for name, p in result.causes[0].parameters.items()}
    assert found["motor.supply_resistance"] == pytest.approx(case.true["sag"], rel=0.05)
    assert found["motor.supply_driver"] == pytest.approx(-1.0, abs=0.05)


@pytest.mark.in_turn
@pytest.mark.slow
def test_a_viscous_friction_is_no_damping_of_the_load_because_its_fit_read_the_log_otherwise(tmp_path):
    """One law by two names, of which one had a filter of the controller's speed of 0.3 ms and the other of 1.3 ms."""
    case = fieldbus.hide(["reducer.viscous"], fieldbus.DEVELOPMENT + 300)
    rig, train, test = case.write(tmp_path)
    result = diagnose(rig, train, test=[test], out=None, seed=10_300)
    assert result.causes[0].label == "reducer viscous", result.summary()
    assert result.causes[0].parameters["reducer.viscous_damping"]["value"] == pytest.approx(case.true["viscous"], rel=0.02)
