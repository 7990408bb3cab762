"""What a user may get wrong about a calibration ends in one sentence; what he gets is safe to look at."""

import shutil
from dataclasses import replace

import numpy as np
import oscillators
import pandas as pd
import pytest
from typer.testing import CliRunner

from selflock.cli import app
from selflock.diagnosis import DataError, calibrate
from selflock.diagnosis import name as naming


@pytest.fixture
def refused(tmp_path, oscillator, rng):
    """refused(*words, log=…, **of the rig): the sentence has all the words."""

    def check(*words, log=None, **given):
        log = log or oscillators.log(tmp_path / "log.csv", oscillator, rng, count=400)
        rig = oscillators.rig(tmp_path / "rig.toml", "oscillator.fmu", **({"more": f"step = {oscillators.STEP}"} | given))
        with pytest.raises(DataError) as caught:
            calibrate(rig, [log], out=None, starts=1)
        assert "\n" not in str(caught.value).partition(" answered ")[0]
        for word in words:
            assert word in str(caught.value), str(caught.value)

    return check


@pytest.fixture
def forgetful(native, tmp_path):
    """One FMU under another name than its model's, and a log of what it computes by itself: 1.7 t."""
    time = np.arange(0.0, 4.01, 0.1)
    (tmp_path / "log.csv").write_text("time,y\n" + "".join(f"{t},{1.7 * t}\n" for t in time))
    return shutil.copy(native("forgetful"), tmp_path / "any name.fmu").name


@pytest.mark.alike
@pytest.mark.parametrize(
    "wanted, words",
    [
        ({}, ("names no number to fit", "oscillator.stiffness")),
        ({"oscillator.stifness": [1.0, 2.0]}, ("oscillator.stifness", "no such variable", "Did you mean oscillator.stiffness?")),
        ({"oscillator.end": [1.0, 6.0]}, ("oscillator.end", "Integer", "only Reals are fitted")),
        ({"oscillator.force": [1.0, 6.0]}, ("oscillator.force", "is fixed", "the log gives it")),
        ({"oscillator.gain": {"low": 0.1}}, ("oscillator.gain", "has no highest value", "write high")),
        ({"oscillator.gain": [5.0, 0.1]}, ("oscillator.gain", "the lowest value comes first")),
        ({"oscillator.gain": {"low": 5.0, "high": 0.1}}, ("oscillator.gain", "low = 5 must be below high = 0.1")),
        ({"oscillator.gain": {"lowest": 5.0}}, ("oscillator.gain", "{ start = 0.5, low = 0.0, high = 2.0 }")),
        ({"oscillator.gain": [2.0, 3.0]}, ("start = 1", "outside of its range from 2 to 3", "its FMU")),
        ({"oscillator.gain": {"start": 9.0, "low": 2.0, "high": 3.0}}, ("start = 9 is outside of its range from 2 to 3",)),
        ({"oscillator.mass": [-1.0, 3.0]}, ("oscillator.mass", "at least", "narrow the range")),
    ],
)
def test_a_number_that_cannot_be_fitted_is_told(refused, wanted, words):
    refused(*words, wanted=wanted)


def test_a_known_number_is_not_fitted(refused):
    refused("is fixed", "[rig] known", more='known = ["oscillator.gain"]')


def test_nothing_measured_is_told(refused):
    refused("no column is an output", "oscillator.position", columns={"oscillator.force": "u"})


@pytest.mark.parametrize("unit", ["mm", "furlongs"])
def test_a_unit_that_cannot_be_converted_for_want_of_the_fmus_is_refused(refused, unit):
    """It was taken as it is, without a word."""
    columns = {"oscillator.force": "u", "oscillator.position": {"column": "position", "unit": unit}}
    refused("oscillator.position", f"unit = '{unit}' cannot be converted", "write factor", columns=columns)


def test_times_in_ms_that_pass_for_seconds_are_refused_until_the_rig_says_what_they_are(refused, tmp_path, oscillator, rng):
    """A thousand times as many steps were taken, and a naming ended at its time limit with nothing."""
    table = pd.read_csv(oscillators.log(tmp_path / "s.csv", oscillator, rng, count=400))
    table["time"] *= 1e3
    table.to_csv(log := tmp_path / "ms.csv", index=False)
    refused("rows lie 5 s apart, which is 1000 steps of 0.005 s", 'unit = "ms" under [time]', 'or unit = "s"', log=log)
    step = f"step = {oscillators.STEP}"
    rig = oscillators.rig(tmp_path / "rig.toml", "oscillator.fmu", more=f'{step}\n[time]\nunit = "ms"')
    assert calibrate(rig, [log], out=None, starts=1).numbers


@pytest.mark.slow
@pytest.mark.parametrize("asked", [calibrate, naming])
def test_inputs_that_no_column_gives_are_told(tmp_path, oscillator, rng, asked):
    """With nothing that moves the system no number moves anything, which ended a naming with a traceback."""
    log = oscillators.log(tmp_path / "log.csv", oscillator, rng, count=400)
    step = f"step = {oscillators.STEP}"
    rig = oscillators.rig(tmp_path / "rig.toml", "oscillator.fmu", columns={"oscillator.position": "position"}, more=step)
    assert "no column gives oscillator.force: taken to stay as the FMU starts" in asked(rig, [log], out=None).summary()


def test_a_system_without_inputs_of_which_no_number_is_free_is_told(native, tmp_path):
    shutil.copy(native("fall"), tmp_path / "fall.fmu")
    (tmp_path / "log.csv").write_text("time,h\n" + "".join(f"{0.01 * k:g},{1.0 - 4.9e-4 * k * k:g}\n" for k in range(40)))
    (rig := tmp_path / "rig.toml").write_text('[rig]\nsystem = "fall.fmu"\n[columns]\n"fall.h" = "h"\n')
    with pytest.raises(DataError, match=r"fall has no inputs, .* Name a number of it under \[calibrate\], such as 'fall\.g'"):
        naming(rig, [tmp_path / "log.csv"], out=None)


def test_a_log_in_which_nothing_moves_is_refused(refused, tmp_path, oscillator, rng):
    log = oscillators.log(tmp_path / "still.csv", oscillator, rng, count=400, force=np.zeros(400))
    refused("still.csv", "the inputs do not move (oscillator.force)", "nothing can be learnt", log=log)


@pytest.mark.slow
@pytest.mark.parametrize("times, told", [(1, False), (4, True)])
def test_steps_that_are_longer_than_the_logs_rows_are_told(tmp_path, oscillator, rng, times, told):
    log = oscillators.log(tmp_path / "log.csv", oscillator, rng, count=200)
    rig = oscillators.rig(tmp_path / "rig.toml", "oscillator.fmu", more=f"step = {times * oscillators.STEP}")
    said = calibrate(rig, [log], out=None, starts=1).summary()
    assert (f"with step = {oscillators.STEP:.4g} under [rig]" in said) == told


def test_a_system_that_always_breaks_off_is_told_with_its_words(refused):
    refused(
        "breaks off wherever its numbers are tried",
        "oscillator answered Error",
        parameters={"oscillator.limit": 1e-9, "oscillator.end": 3},
    )


@pytest.mark.parametrize(
    "wanted, parameters, words",
    [
        ({"limit": [0.5, 3.0]}, {}, ("forgetful.limit = 1.75 was not taken: the FMU has 1.0", "narrow its range")),
        ({"gain": [0.1, 3.0]}, {"ends_at": 1.05}, ("breaks off wherever", "forgetful ends the run itself at t = 1.05 s")),
    ],
)
def test_numbers_that_are_not_taken_and_runs_that_end_themselves(tmp_path, forgetful, wanted, parameters, words):
    named = lambda values: {f"forgetful.{name}": value for name, value in values.items()}
    rig = oscillators.rig(tmp_path / "rig.toml", forgetful, named(wanted), named(parameters), {"forgetful.y": "y"})
    with pytest.raises(DataError) as caught:
        calibrate(rig, [tmp_path / "log.csv"], out=None, starts=1)
    assert all(word in str(caught.value) for word in words), str(caught.value)


def test_one_that_takes_its_defaults_back_is_fitted_and_what_it_does_not_tell_is_told(tmp_path, forgetful):
    """It keeps its gain as a float; nobody can read back whether it took the other."""
    wanted = {"forgetful.gain": [0.1, 3.0], "forgetful.secret": [0.0, 1.0], "forgetful.limit": [0.0, 1.0]}
    rig = oscillators.rig(tmp_path / "rig.toml", forgetful, wanted, columns={"forgetful.y": "y"})
    result = calibrate(rig, [tmp_path / "log.csv"], out=None, starts=1)
    assert result.values["forgetful.gain"] == pytest.approx(1.7, rel=1e-5)
    assert [number.name for number in result.numbers if number.silent] == ["forgetful.secret", "forgetful.limit"]
    assert any("forgetful.secret = 0.0 cannot be read back" in doubt for doubt in result.doubts())


def test_a_rig_of_a_drive_is_told_where_to_go(tmp_path):
    path = tmp_path / "rig.toml"
    path.write_text('[rig]\nkind = "forward"\n[columns]\n"motor.voltage" = "u"\n')
    with pytest.raises(DataError, match="names no system to calibrate.*selflock diagnose"):
        calibrate(path, ["log.csv"], out=None)


@pytest.mark.slow
def test_an_input_at_rest_is_told_where_the_start_moves_the_system(tmp_path, oscillator, rng):
    """A free decay tells stiffness over mass, and of the gain nothing: it changes nothing where no force is."""
    log = oscillators.log(
        tmp_path / "log.csv", oscillator, rng, oscillators.TRUTH | {"position": 1.0}, count=600, force=np.zeros(600)
    )
    rig = oscillators.rig(
        tmp_path / "rig.toml", "oscillator.fmu", parameters={"oscillator.position": 1.0}, more=f"step = {oscillators.STEP}"
    )
    result = calibrate(rig, [log], out=None, starts=1)
    assert any("no input moves in these logs (oscillator.force)" in doubt for doubt in result.doubts())
    numbers = {number.name: number for number in result.numbers}
    assert numbers["oscillator.gain"].silent
    assert numbers["oscillator.stiffness"].value == pytest.approx(60.0, rel=0.01)


@pytest.mark.slow
def test_the_page_and_the_notebook_take_hostile_names_as_words(tmp_path, oscillator, rng, harmless, hostile):
    from lxml import html

    log = oscillators.log(tmp_path / "log.csv", oscillator, rng, oscillators.TRUTH | {"stiffness": 100.0}, count=400)
    name = hostile.replace("\\", "\\\\").replace('"', '\\"')
    more = f'step = {oscillators.STEP}\nname = "{name}"'
    rig = oscillators.rig(tmp_path / "rig.toml", "oscillator.fmu", {"oscillator.gain": [0.1, 5.0]}, more=more)
    result = calibrate(rig, [log], out=tmp_path / "out", starts=1)
    page = harmless(tmp_path / "out/report.html", scripts=1)
    assert hostile in page.xpath("//h1")[0].text_content()
    assert html.fromstring(f"<div>{result._repr_html_()}</div>").xpath("//td[text()='oscillator.gain']")
    result.numbers[0] = replace(result.numbers[0], low=None, high=None, error=None)  # as of what judges alone told
    assert "fitted to what judges" in result._repr_html_()


@pytest.mark.slow
def test_the_command_says_what_the_call_says(tmp_path, oscillator, rng):
    log = oscillators.log(tmp_path / "log.csv", oscillator, rng, oscillators.TRUTH | {"stiffness": 100.0}, count=400)
    wanted = {"oscillator.damping": [-1.0, 20.0]}
    rig = oscillators.rig(tmp_path / "rig.toml", "oscillator.fmu", wanted, more=f"step = {oscillators.STEP}")
    told = CliRunner().invoke(app, ["calibrate", str(rig), str(log), "-o", str(tmp_path / "out"), "--starts", "1"])
    assert told.exit_code == 0, told.output
    assert "[[Variables]]" in told.output and "oscillator.damping:" in told.output
    for name in ("calibrated.toml", "parameters.toml", "calibration.json", "report.html"):
        assert (tmp_path / "out" / name).is_file()
