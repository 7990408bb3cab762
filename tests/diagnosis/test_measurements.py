"""Real measurements, where ../shared/data is: what their authors found must be found, with at least as much error closed."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from selflock.diagnosis import diagnose
from selflock.diagnosis.data.rig import load
from selflock.diagnosis.pipeline.run import gather
from selflock.diagnosis.residuals.drive_experiment import DriveExperiment
from selflock.diagnosis.search.problem import Problem
from selflock.diagnosis.search.selection import ForwardSelection

ROOT = Path(__file__).resolve().parents[2]
DATA, RIGS = ROOT.parent / "shared" / "data", ROOT / "examples" / "rigs"
RIVALS = {"reducer load_dependent", "reducer stribeck", "motor torque_constant"}
pytestmark = pytest.mark.skipif(
    not DATA.exists(), reason="the measured data are not in ../shared/data (docs/measurements.md names their sources)"
)


def named(result) -> list[str]:
    return [cause.label for cause in result.causes]


@pytest.mark.slow
def test_the_lead_screws_friction_falls_with_speed():
    result = diagnose(RIGS / "lead_screw.toml", [DATA / "lead_screw" / "steady_state.csv"], out=None)
    assert result.verdict == "explained" and named(result) == ["reducer stribeck"], result.summary()
    assert result.gain.before > 0.12e-3  # N.m, what Coulomb friction leaves on the runs held out
    assert result.gain.after <= 0.044e-3, result.summary()


@pytest.mark.slow
def test_the_worm_drives_start_transients_are_found_then_its_friction_falls_with_speed(tmp_path):
    result = diagnose(RIGS / "worm_drive.toml", [DATA / "worm_drive" / "steady_state.csv"], out=tmp_path)
    assert {(fault["run"], fault["kind"]) for fault in result.faults} == {
        ("1", "corrupted"),
        ("2", "corrupted"),
        ("n1", "corrupted"),
    }
    assert all(
        fault["channel"] == "motor.torque" and fault["first"] % 500 == 0 for fault in result.faults
    )  # the first sample of a run
    assert result.verdict == "explained" and named(result) == ["reducer stribeck"], result.summary()
    assert result.gain.after <= 0.040e-3 < 0.065e-3 < result.gain.before, result.summary()
    assert result.extension["fmu"] == pytest.approx(result.extension["promised"], rel=0.01)


@pytest.mark.in_turn
@pytest.mark.slow
def test_the_linear_drives_friction_differs_by_direction():
    """Janot, Gautier, Brunot 2019: 4.08 % of the force left with symmetric friction, 3.11 % with Fv+ 166.7, Fv- 240.4 N.s/m."""
    result = diagnose(RIGS / "emps.toml", [DATA / "emps" / "DATA_EMPS.mat"], out=None)
    assert named(result)[0] == "reducer asymmetric", result.summary()  # a wave of the position may follow: what the authors left
    assert result.gain.after < 3.06 / 4.04 * result.gain.before, result.summary()
    asymmetry = result.causes[0].parameters["reducer.viscous_asymmetry"]
    authors = (166.7 - 240.4) / (166.7 + 240.4)
    assert asymmetry["low"] - 0.02 < authors < asymmetry["high"] + 0.02


@pytest.mark.parametrize("seconds", [0.02, 0.04, 0.08])
def test_what_a_long_log_teaches_outlasts_the_smoothing_that_its_rig_asks_for(seconds):
    """A window of 81 samples left nothing of the stretches of 80 that a fit compares."""
    rig = replace(load(RIGS / "emps.toml"), smoothing=seconds)
    runs, _, _ = gather(rig, [DATA / "emps" / "DATA_EMPS.mat"], ())
    experiment = DriveExperiment(rig, runs, sampled=True)
    (_, _, good), *_ = experiment.compare(experiment.residuals[0], {})
    assert good.sum() > 0.25 * 3000  # of the samples that a fit compares


@pytest.mark.in_turn(1)
@pytest.mark.slow
def test_the_servos_friction_differs_between_lifting_and_lowering():
    """Duclusaud et al. 2025: load-dependent friction with a direction halves the closed loop's error, Stribeck changes next to nothing.

    One round between three rivals alone: the whole search takes minutes and is in docs/measurements.md.
    """
    rig = load(RIGS / "xl330.toml")
    paths = [path for gain in (100, 800) for path in sorted((DATA / "xl330").glob(f"kp{gain}_*.csv"))]
    runs, _, _ = gather(rig, paths, ())
    bench = DriveExperiment(rig, runs, sampled=True)
    problem = Problem.of(bench, np.ones(bench.layout.count, bool))
    problem = replace(problem, hypotheses=tuple(h for h in problem.hypotheses if h.label in RIVALS)).with_noise()
    assert len(problem.hypotheses) == len(RIVALS)
    base = problem.fit(problem.base_free, problem.nominal)
    winner = ForwardSelection(problem, np.random.default_rng(1)).step(base, []).winner
    assert winner.hypothesis.label == "reducer load_dependent"
    unseen = gather(rig, sorted((DATA / "xl330").glob("kp200_*.csv")), ())[0]
    judge = DriveExperiment(rig, unseen)
    before, after = (
        np.mean([np.mean(abs(m - s)[good]) for s, m, good in judge.compare(judge.residuals[0], problem.absolute(fit.values))])
        for fit in (base, winner.fit)
    )
    assert before > 0.055  # rad
    assert after < min(0.0315, 0.5 * before)
