"""Numbers hidden in FMUs come out of their logs, and what the logs do not tell is told.

Bounds of values are 2.5 of their 95 % intervals: five standard errors, which one in a million seeds exceeds.
"""

import json
import shutil

import oscillators
import pandas as pd
import pytest

from selflock import master
from selflock.diagnosis import calibrate
from selflock.master import system

ONCE, QUICK = {"out": None, "starts": 1}, {"out": None, "starts": 2}
TWO = {f"oscillator.{name}": oscillators.RANGES[name] for name in ("stiffness", "gain")}


def found(result):
    return {number.name: number for number in result.numbers}


def recovered(result, truth, prefix="oscillator."):
    for name, hidden in truth.items():
        number = found(result)[prefix + name]
        middle, half = 0.5 * (number.low + number.high), 0.5 * (number.high - number.low)
        assert abs(hidden - middle) <= 2.5 * half and number.determined and not number.at_bound, (name, number)
        assert half < 0.01 * abs(hidden)


@pytest.mark.slow
def test_hidden_numbers_are_found_and_a_silent_one_is_named(tmp_path, oscillator, rng):
    log, test = (oscillators.log(tmp_path / name, oscillator, rng) for name in ("log.csv", "test.csv"))
    wanted = {f"oscillator.{name}": ends for name, ends in oscillators.RANGES.items()} | {"oscillator.nothing": [0.0, 2.0]}
    rig = oscillators.rig(tmp_path / "rig.toml", "oscillator.fmu", wanted, more=f"step = {oscillators.STEP}")
    result = calibrate(rig, [log], test=[test], out=tmp_path / "out", starts=2)
    recovered(result, oscillators.TRUTH)
    silent = found(result)["oscillator.nothing"]
    assert silent.silent and silent.value == 1.0 and silent.low is None
    assert any("oscillator.nothing changes nothing" in doubt for doubt in result.doubts())
    (error,) = result.errors
    assert result.held_out == "test.csv" and error.held_out_before > 10 * error.held_out
    assert error.held_out == pytest.approx(0.002, rel=0.2) and error.noise == pytest.approx(0.002, rel=0.2)
    told = json.loads((tmp_path / "out/calibration.json").read_text())
    assert told["numbers"][0]["value"] == result.numbers[0].value and told["effort"]["failed"] == 0
    page = (tmp_path / "out/report.html").read_text("utf-8").partition("<h1>")[2]
    first = ["3 of 4 numbers were found beyond doubt", 'data-figure="first"', "held out", "What to do next", "changes nothing that is compared",
             "selflock run calibrated.toml", "<table>", 'data-figure="traces"']  # fmt: skip
    assert sorted(first, key=page.index) == first and result.lacking() == []
    again = master.run(tmp_path / "out/calibrated.toml", stop=0.1)
    assert again.steps == 20
    assert (
        master.load(tmp_path / "out/calibrated.toml").components["oscillator"].start["gain"] == result.values["oscillator.gain"]
    )
    text = result.summary()
    for words in ("[[Variables]]", "+/-", "(init = 100)", "[[Correlations]]", "C(oscillator."):
        assert words in text


@pytest.mark.slow
def test_what_cannot_be_told_apart_and_what_wants_to_leave_its_range(tmp_path, oscillator, rng):
    log = oscillators.log(tmp_path / "log.csv", oscillator, rng, count=600)
    names = ("mass", *oscillators.RANGES)
    wanted = {f"oscillator.{name}": ends for name, ends in ({"mass": [0.2, 5.0]} | oscillators.RANGES).items()}
    more = f"step = {oscillators.STEP}"
    together = calibrate(oscillators.rig(tmp_path / "rig.toml", "oscillator.fmu", wanted, more=more), [log], **ONCE)
    for name in names:  # mass x'' + damping x' + stiffness x = gain u: all of them times any number is the same
        number = found(together)[f"oscillator.{name}"]
        assert not number.determined and set(number.collinear_with) == {f"oscillator.{n}" for n in names if n != name}
    assert sum("cannot be told from one another" in doubt for doubt in together.doubts()) == 1
    wanted = {
        f"oscillator.{name}": ends
        for name, ends in (oscillators.RANGES | {"gain": {"start": 0.5, "low": 0.1, "high": 1.0}}).items()
    }
    bound = calibrate(oscillators.rig(tmp_path / "rig.toml", "oscillator.fmu", wanted, more=more), [log], **ONCE)
    gain = found(bound)["oscillator.gain"]
    assert gain.at_bound == "highest" and gain.value == 1.0
    assert any("oscillator.gain is at the highest value of its range, 1" in doubt for doubt in bound.doubts())


@pytest.mark.parametrize("end", [2, 3, 6])
@pytest.mark.slow
def test_runs_that_break_off_do_not_break_the_fit(tmp_path, oscillator, rng, end):
    """Discard, Error and not a number where the position leaves what the hidden oscillator reaches: half of all starts do."""
    log = oscillators.log(tmp_path / "log.csv", oscillator, rng)
    limit = 1.3 * float(pd.read_csv(log)["position"].abs().max())
    parameters = {"oscillator.limit": limit, "oscillator.end": end, "oscillator.damping": oscillators.TRUTH["damping"]}
    rig = oscillators.rig(tmp_path / "rig.toml", "oscillator.fmu", TWO, parameters, more=f"step = {oscillators.STEP}")
    result = calibrate(rig, [log], **QUICK)
    recovered(result, {name: oscillators.TRUTH[name] for name in ("stiffness", "gain")})
    assert result.effort["failed"] > 0 and sum(result.effort["reasons"].values()) == result.effort["failed"]
    assert "failed" in result.summary()


@pytest.mark.slow
def test_a_start_that_breaks_off_is_left_for_one_that_does_not(tmp_path, oscillator, rng):
    log = oscillators.log(tmp_path / "log.csv", oscillator, rng)
    limit = 1.3 * float(pd.read_csv(log)["position"].abs().max())
    wanted = {f"oscillator.{name}": ends for name, ends in oscillators.RANGES.items()}
    wanted["oscillator.stiffness"] = {"start": 10.0, "low": 10.0, "high": 1000.0}
    wanted["oscillator.damping"] = {"start": -1.0, "low": -1.0, "high": 20.0}
    rig = oscillators.rig(
        tmp_path / "rig.toml", "oscillator.fmu", wanted, {"oscillator.limit": limit}, more=f"step = {oscillators.STEP}"
    )
    result = calibrate(rig, [log], out=None, starts=3)
    recovered(result, oscillators.TRUTH)
    assert result.errors[0].before is None and "failed ->" in result.summary()


@pytest.mark.parametrize(
    "reset, words", [(1, "another after fmi2Reset"), (2, ""), (3, "crashes its process (SIGSEGV) when it is reset")]
)
@pytest.mark.slow
def test_fmus_that_cannot_be_reset_are_made_anew(tmp_path, oscillator, rng, reset, words):
    log = oscillators.log(tmp_path / "log.csv", oscillator, rng)
    parameters = {"oscillator.reset": reset, "oscillator.damping": oscillators.TRUTH["damping"]}
    rig = oscillators.rig(tmp_path / "rig.toml", "oscillator.fmu", TWO, parameters, more=f"step = {oscillators.STEP}")
    result = calibrate(rig, [log], **ONCE)
    recovered(result, {name: oscillators.TRUTH[name] for name in ("stiffness", "gain")})
    assert not words or any(words in doubt for doubt in result.doubts())


@pytest.mark.slow
def test_each_run_begins_where_it_begins(tmp_path, oscillator, rng):
    """The position at the start is another in each log, that which judges too; stiffness and gain are those of all."""
    begins = {"a.csv": 0.7, "b.csv": -0.4, "test.csv": 0.2}
    logs = [
        oscillators.log(tmp_path / n, oscillator, rng, oscillators.TRUTH | {"position": x}, count=400) for n, x in begins.items()
    ]
    wanted = TWO | {"oscillator.position": {"low": -2.0, "high": 2.0, "each_run": True}}
    rig = oscillators.rig(
        tmp_path / "rig.toml", "oscillator.fmu", wanted, {"oscillator.damping": 1.5}, more=f"step = {oscillators.STEP}"
    )
    result = calibrate(rig, logs[:2], test=logs[2:], out=tmp_path / "out", starts=1)
    recovered(result, {name: oscillators.TRUTH[name] for name in ("stiffness", "gain")})
    for name, begin in begins.items():
        assert result.values[f"oscillator.position of {name}"] == pytest.approx(begin, abs=0.01)
    assert result.errors[0].held_out == pytest.approx(0.002, rel=0.25)
    assert '[logs."a.csv"]' in (tmp_path / "out/parameters.toml").read_text()


@pytest.mark.slow
def test_events_do_not_break_the_slopes(tmp_path, native, rng):
    """A ball that bounces, seen by its height: the impacts fall between samples, and move from one to the next."""
    shutil.copy(native("ball"), tmp_path)
    ball = system.System(
        folder=tmp_path,
        components={"ball": system.Component(fmu="ball.fmu", start={"gravity": 9.3, "restitution": 0.85})},
        run=system.Run(stop=3.0, step=0.01, record=["ball.height"]),
    )
    table = master.run(ball).table
    table["ball.height"] += 0.003 * rng.standard_normal(len(table))
    table.to_csv(tmp_path / "log.csv", index=False)
    wanted = {"ball.gravity": [8.0, 11.0], "ball.restitution": [0.5, 1.0], "ball.height": {"low": 0.5, "high": 1.5}}
    rig = oscillators.rig(tmp_path / "rig.toml", "ball.fmu", wanted, columns={"ball.height": "ball.height"}, more="step = 0.01")
    result = calibrate(rig, [tmp_path / "log.csv"], out=None, starts=3)
    for name, hidden in {"ball.gravity": 9.3, "ball.restitution": 0.85, "ball.height": 1.0}.items():
        assert result.values[name] == pytest.approx(hidden, rel=0.005)
    assert result.errors[0].after == pytest.approx(0.003, rel=0.3)
