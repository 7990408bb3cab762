"""A shaft is simulated no stiffer than its log shows, and as stiff as it shows."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from selflock.diagnosis.data.faults import check
from selflock.diagnosis.data.log import MeasuredRun
from selflock.diagnosis.data.rig import LogColumn, Rig
from selflock.diagnosis.judge.recorded import recorded
from selflock.diagnosis.residuals import whole
from selflock.diagnosis.residuals.drive_experiment import DriveExperiment
from selflock.diagnosis.residuals.forward import stable, swinging
from selflock.diagnosis.residuals.laws import law
from selflock.diagnosis.rules import RULES
from selflock.diagnosis.search.problem import Problem
from selflock.diagnosis.search.swings import SHAFT, place_shaft, place_swings

RATIO, ROTOR, INERTIA = 20.0, 2e-6, 4e-4
TOGETHER = 1.0 / (1.0 / INERTIA + 1.0 / (ROTOR * RATIO**2))  # what swings on the shaft, kg.m2


def logged(rng, row, count, noise, swing, unsaid=(), **other):
    """The problem of a log that the product's own drive makes: rows so far apart, s, angles in counts, rad; swing of its shaft, rad/s.

    unsaid: what its rig does not say; other: what it says otherwise, for a component's parameter.
    """
    time, wave = np.arange(0.0, 4.0, row), rng.uniform(4.0, 9.0)
    given = {
        "motor.resistance": 2.0,
        "motor.voltage_constant": 0.02,
        "motor.torque_constant": 0.02,
        "motor.inductance": 0.0,
        "reducer.gear_ratio": RATIO,
        "reducer.friction_kinetic": 0.02,
        "reducer.shaft_inertia": ROTOR,
        "reducer.shaft_stiffness": TOGETHER * swing**2,
        "reducer.shaft_damping": 0.1 * TOGETHER * swing,
        "load.inertia": INERTIA,
    }
    signals = {
        "motor.voltage": 6.0 * np.sin(wave * time) + 2.0 * np.sign(np.sin(2.6 * wave * time)),
        "load.angle": np.zeros(len(time)),
    }
    signals["motor.current"] = np.zeros(len(time))
    rig = Rig(
        Path("rig.toml"), "bot", "forward", tuple(LogColumn(n, n) for n in signals), given, time=LogColumn("time", "time"),
        simulate=whole.WHOLE,
    )  # fmt: skip
    run = MeasuredRun("log.csv", "", np.arange(len(time)), time, signals)
    made = whole.simulate({}, DriveExperiment(rig, [run]).channels[0, ""])
    here = whole.grid(DriveExperiment(rig, [run]).channels[0, ""]).time
    of = lambda name: np.interp(time, here, made[name])
    read = {
        "load.angle": count * np.floor(of("angle") / count),
        "motor.current": of("current") + noise * rng.standard_normal(len(time)),
    }
    run = MeasuredRun("log.csv", "", np.arange(len(time)), time, signals | read)
    check([run], rig)
    told = {name: value for name, value in given.items() if name not in unsaid}
    rig = replace(rig, parameters=told | {name.replace("__", "."): value for name, value in other.items()})
    bench = DriveExperiment(rig, [run])
    return Problem.of(bench, np.ones(bench.layout.count, bool))


def test_a_swing_that_is_nowhere_in_a_log_is_not_simulated(rng):
    """Coarse counts each hundredth of a second say nothing of a thousand radians a second."""
    problem = logged(rng, 0.01, 0.01, 0.05, 3000.0)
    ch = problem.experiment.channels[0, ""]
    before = whole.carried_in({}, ch)[2]
    assert place_swings(problem.experiment, problem)
    stiffness, _, parts = whole.carried_in({}, ch)
    assert parts < before
    assert np.sqrt(stiffness / TOGETHER) == pytest.approx(ch.run.memory[whole.FASTEST])


def test_a_swing_that_a_log_shows_is_simulated(rng):
    problem = logged(rng, 5e-4, 1e-6, 1e-4, 900.0)
    ch = problem.experiment.channels[0, ""]
    before = whole.carried_in({}, ch)
    place_swings(problem.experiment, problem)
    assert whole.carried_in({}, ch)[0] == pytest.approx(before[0], rel=0.5)


def test_what_is_not_shown_is_softened_alike_in_steps_of_any_length(rng):
    """A first look takes longer steps than a fit, and sees the same shaft."""
    reducer = law("reducer").Parameters(**{p.name: p.off for p in law("reducer").BASE})
    reducer = reducer._replace(gear_ratio=RATIO, shaft_inertia=ROTOR, shaft_stiffness=TOGETHER * 5e3**2, shaft_damping=0.0)
    load = law("load").Parameters(**{p.name: p.off for p in law("load").BASE})._replace(inertia=INERTIA)
    fastest = float(rng.uniform(200.0, 900.0))
    for step, most in ((5e-4, RULES.residuals.shaft_step), (1e-3, RULES.residuals.shaft_look)):
        stiffness, _, parts = stable(reducer, load, step, fastest, most)
        assert np.sqrt(stiffness / swinging(reducer, load)) == pytest.approx(fastest)
        assert step * fastest / parts <= most * (1.0 + 1e-9)
    assert stable(reducer, load, 5e-4) == stable(reducer, load, 5e-4, np.inf)


def test_a_softened_shaft_is_damped_as_much(rng):
    """So that a load leaves a flank as fast as it does that of a stiffer one: damped by as much as before in N.m.s it hardly rebounded."""
    damped = float(rng.uniform(0.02, 0.5))
    given = [law(name).Parameters(**{p.name: p.off for p in law(name).BASE}) for name in ("reducer", "load")]
    stiff = TOGETHER * 5e3**2
    reducer = given[0]._replace(
        gear_ratio=RATIO, shaft_inertia=ROTOR, shaft_stiffness=stiff, shaft_damping=2.0 * damped * np.sqrt(stiff * TOGETHER)
    )
    load = given[1]._replace(inertia=INERTIA)
    stiffness, damping, _ = stable(reducer, load, 5e-4, float(rng.uniform(200.0, 900.0)))
    together = swinging(reducer, load)
    assert stiffness < 0.1 * stiff and together == pytest.approx(TOGETHER)
    assert damping / (2.0 * np.sqrt(stiffness * together)) == pytest.approx(damped)


@pytest.mark.slow
def test_a_shaft_of_which_a_rig_says_nothing_is_the_one_that_leaves_only_noise(rng):
    """As stiff as it is; one that the rig says is left as it says."""
    swing = float(rng.uniform(120.0, 300.0))
    problem = logged(rng, 2e-3, 1e-4, 1e-2, swing, unsaid=SHAFT)
    found = place_shaft(problem.experiment, problem)
    assert found["reducer.shaft_stiffness"] == pytest.approx(TOGETHER * swing**2, rel=0.05)
    told = logged(rng, 2e-3, 1e-4, 1e-2, swing, reducer__shaft_stiffness=20.0 * TOGETHER * swing**2)
    assert not place_shaft(told.experiment, told)


@pytest.mark.slow
def test_a_shaft_makes_up_for_nothing_that_is_wrong_elsewhere(rng):
    """Nor is it asked for where the drive is right as it is described."""
    swing = float(rng.uniform(120.0, 300.0))
    wrong = logged(rng, 2e-3, 1e-4, 1e-2, swing, unsaid=SHAFT, motor__resistance=float(rng.uniform(2.4, 3.0)))
    assert not place_shaft(wrong.experiment, wrong)
    right = logged(rng, 0.01, 0.01, 0.05, 3000.0, unsaid=SHAFT)
    assert not place_shaft(right.experiment, right)


def test_a_shaft_that_was_found_is_told_beside_what_was_assumed(rng):
    """With its swing in a second; one that the rig says is not."""
    swing = float(rng.uniform(120.0, 300.0))
    problem = logged(rng, 0.01, 0.01, 0.05, swing)
    told = problem.experiment.rig
    untold = replace(told, parameters={name: value for name, value in told.parameters.items() if name not in SHAFT})
    fitted = problem.fit((), {})
    sentence = recorded(problem, fitted, "", untold)["assumed"][-1]
    assert f"{TOGETHER * swing**2:.3g} N.m/rad" in sentence and f"{swing / 2.0 / np.pi:.3g} times a second" in sentence
    assert "shaft" not in " ".join(recorded(problem, fitted, "", told)["assumed"])
