"""What is told of a log's recorder: as it was where a whole drive is simulated, what was assumed where its parts are."""

import json
from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest
from lxml import html

from selflock.diagnosis import diagnose
from selflock.diagnosis.data.log import read
from selflock.diagnosis.data.rig import load
from selflock.diagnosis.judge.recorded import loop, recorded
from selflock.diagnosis.pipeline.run import whole_where_described
from selflock.diagnosis.residuals import driven
from selflock.diagnosis.residuals.drive_experiment import DriveExperiment
from selflock.diagnosis.residuals.whole import WHOLE
from selflock.diagnosis.search import problem as ground
from selflock.diagnosis.search.problem import Problem

from ..plant import recordings
from ..plant.recorder import NOISE, Recorder, Speed

EVEN = Recorder(
    control=0.0, step=0.002, jitter=0.0, counts={"motor_angle": 4000, "angle": 8000},
    speeds={"motor_speed": Speed("tacho", ripple=0.01, order=2.0), "speed": Speed("tacho")},
    lags={"current": 1.5e-3}, noise=NOISE, averaged=True, duration=8.0, seed=1,
    channels=("setpoint_angle", "setpoint_speed", "voltage", "current", "motor_angle", "motor_speed", "angle", "speed"),
)  # fmt: skip
COUNTED = replace(EVEN, speeds=EVEN.speeds | {"speed": Speed("difference", rows=3)})
EXACT = replace(EVEN, noise=NOISE | {"voltage": 0.0})
SEED = recordings.DEVELOPMENT + 21


@pytest.fixture(scope="module")
def counted(tmp_path_factory):
    """A sound drive whose load's speed is made of counts."""
    folder = tmp_path_factory.mktemp("counted")
    return recordings.hide([], SEED, recorder=COUNTED).write(folder)


@pytest.mark.in_turn
@pytest.mark.slow
def test_of_a_whole_drive_each_channel_is_told_with_units_and_intervals(counted):
    rig, train, _ = counted
    rig, why = whole_where_described(load(rig), runs := read(train, load(rig)))
    assert rig.simulate == WHOLE and "load.speed is a difference of counts over 3 rows" in why
    problem = Problem.of(DriveExperiment(rig, runs), np.ones(DriveExperiment(rig, runs).layout.count, bool)).with_noise()
    told = recorded(problem, problem.fit(problem.base_free, problem.nominal), why, rig)
    assert (told["mode"], told["why"], told["estimated"]) == (WHOLE, why, True)
    of = {one["channel"]: one for one in told["channels"]}
    assert set(of) == {residual.output for residual in problem.experiment.residuals}
    assert (of["load.speed"]["rows"], of["load.speed"]["unit"]) == (3, "rad")
    assert of["load.speed"]["count"] == pytest.approx(2.0 * np.pi / 8000, rel=1e-3) == of["load.angle"]["count"]
    assert set(of["load.speed"]["numbers"]) == {"shift"}  # what is exact is not fitted
    assert set(of["controller.voltage"]["numbers"]) == {"shift", "window"} and of["motor.current"]["count"] == 0.0
    late = of["motor.current"]["numbers"]["shift"]
    assert late["unit"] == "s" and late["low"] < late["value"] < late["high"] and not late["at_end"]
    assert late["value"] == pytest.approx(1.5e-3, abs=4e-4)
    waves = {wave["waves"]: wave for wave in of["reducer.input_speed"]["ripple"]}
    assert waves[2]["value"] == pytest.approx(0.01, rel=0.2) and waves[2]["low"] > waves[1]["high"]
    fitted = of["reducer.input_speed"]["numbers"]
    assert waves[2]["value"] == pytest.approx(np.hypot(fitted["ripple_cos_2"]["value"], fitted["ripple_sin_2"]["value"]))
    assert {name: number["unit"] for name, number in told["controller"]["numbers"].items()} == {"hold": "s", "filter": "s"}
    names = {p.name for p in problem.base_free}
    told_names = {f"recorder.{channel}.{name}" for channel, one in of.items() for name in one["numbers"]}
    assert told_names | {"recorder.controller.hold", "recorder.controller.filter"} == names


@pytest.mark.slow
def test_what_the_log_does_not_feel_has_no_interval(counted):
    rig, train, _ = counted
    rig = replace(load(rig), simulate=WHOLE)
    experiment = DriveExperiment(rig, read(train, rig))
    problem = Problem.of(experiment, np.ones(experiment.layout.count, bool))
    fit = problem.fit((), {})
    free = next(p for p in problem.base_free if p.name == "recorder.motor.current.shift")
    flat = replace(fit, free=(free,), values={free.name: free.high}, jacobian=np.zeros((len(fit.misfit), 1)))
    number = next(c for c in recorded(problem, flat, "", problem.experiment.rig)["channels"] if c["channel"] == "motor.current")[
        "numbers"
    ]["shift"]
    assert number["low"] is None and number["high"] is None and number["at_end"]


@pytest.mark.alike
@pytest.mark.parametrize(
    "recorder, more, mode, said",
    [
        (EXACT, {}, "", "nothing says that the log was not taken in step"),
        (EVEN, {}, WHOLE, "controller.voltage was measured: it has noise of its own"),
        (replace(EVEN, jitter=0.1), {}, WHOLE, "its rows are uneven, half of them by more than"),
        (replace(EVEN, control=0.01), {}, WHOLE, "a period of its own, 10 ms"),
        (EVEN, {"simulate": WHOLE}, WHOLE, 'the rig asks for it (simulate = "whole")'),
        (COUNTED, {"simulate": "parts"}, "parts", 'the rig asks for it (simulate = "parts")'),
        (COUNTED, {"parameters": {}}, "", "describe no whole loop, which needs the controller's angle_gain in [parameters]"),
    ],
)
def test_the_reason_for_the_way_of_comparing_is_told(recorder, more, mode, said, tmp_path):
    case = recordings.hide([], SEED, recorder=replace(recorder, duration=2.0))
    path, train, _ = case.write(tmp_path)
    rig = replace(load(path), **more)
    found, why = whole_where_described(rig, read(train, rig))
    assert found.simulate == mode and said in why


@pytest.mark.parametrize(
    "channels, at, seen",
    [
        (("load.angle", "reducer.input_speed"), "", "load.angle and load.speed"),
        (("load.angle", "reducer.input_angle"), "motor", "reducer.input_angle and reducer.input_speed"),
        (("load.angle", "reducer.input_speed"), "dual", "load.angle and reducer.input_speed"),
        (("load.angle", "load.speed"), "", ""),
        (("reducer.input_angle", "reducer.input_speed"), "", ""),
    ],
)
@pytest.mark.parametrize("way", [driven.ANGLE, driven.SPEED, driven.VOLTAGE])
def test_at_which_shaft_a_controller_sees_is_told_where_both_are_logged(way, channels, at, seen):
    """And who says so: the rig, the command, or what the drive leaves."""
    setting = SimpleNamespace(rig=(given := SimpleNamespace(loop=at)))
    ch = SimpleNamespace(has=lambda name: name in channels, memory={"way": way}, setting=setting)
    told = loop(ch, given)
    assert bool(told) == bool(seen and way == driven.ANGLE)
    assert not told or f"is taken to see {seen}, {'as the rig says' if at else 'for so least is left'}" in told


@pytest.mark.slow
def test_it_stands_in_the_result_and_on_the_page(counted, tmp_path, monkeypatch):
    """No cause is looked for, which would take its time."""
    monkeypatch.setattr(ground, "vocabulary", lambda *given: [])
    rig, *logs = counted
    told, words = {}, {}
    for mode in (WHOLE, "parts"):
        (path := tmp_path / f"{mode}.toml").write_text(rig.read_text().replace("[rig]", f'[rig]\nsimulate = "{mode}"', 1))
        out = tmp_path / mode
        diagnose(path, logs[:1], test=logs[1:] if mode == WHOLE else (), out=out, seed=1)
        told[mode] = json.loads((out / "diagnosis.json").read_text())["recorder"]
        texts = html.parse(out / "report.html").getroot().find("body").itertext()
        words[mode] = " ".join(" ".join(texts).split())
        assert "Spectrum of the error over angle" in words[mode] and "as waves over the angle of a shaft" in words[mode]
        assert f'the rig asks for it (simulate = "{mode}")' in words[mode]
    assert "load.speed the difference of an angle's counts over 3 rows, divided by their time 0.0007854 rad" in words[WHOLE]
    assert " ms (" in words[WHOLE] and "controller acts later than its row" in words[WHOLE]
    (voltage,) = told["parts"]["channels"]  # which was measured; nothing else is estimated
    assert voltage["channel"] == "controller.voltage" and set(voltage["numbers"]) == {"shift"}
    assert "controller.voltage a voltage that" in words["parts"] and "but its voltage were read at its instant" in words["parts"]
    assert all(sentence in words["parts"] for sentence in told["parts"]["assumed"])
    assert any("a set-point keeps its value" in sentence for sentence in told["parts"]["assumed"])
