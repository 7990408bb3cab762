"""Strangers' FMUs of a rig in processes without rights: the same numbers, and nothing of them is loaded here."""

import oscillators
import pytest
from typer.testing import CliRunner

from selflock.cli import app
from selflock.diagnosis import calibrate, diagnose, name, replay
from selflock.master import binary

CALLS = {
    "replay": lambda rig, log, **how: replay(rig, log, None, **how).comparisons,
    "diagnose": lambda rig, log, **how: diagnose(rig, [log], out=None, seed=1, **how).data(),
    "calibrate": lambda rig, log, **how: calibrate(rig, [log], out=None, starts=1, **how).numbers,
    "name": lambda rig, log, **how: name(rig, [log], out=None, starts=1, kinds=["parameter"], **how).data(),
}


@pytest.fixture
def rig(tmp_path, oscillator, rng, call):
    wanted = {"oscillator.gain": oscillators.RANGES["gain"]}
    log = oscillators.log(tmp_path / "log.csv", oscillator, rng, count=400 if call == "diagnose" else 200)
    return oscillators.rig(tmp_path / "rig.toml", "oscillator.fmu", wanted, more=f"step = {oscillators.STEP}"), log


def refuse(*given, **more):
    raise AssertionError("an FMU is loaded in this process")


@pytest.mark.parametrize("call", CALLS)
@pytest.mark.slow
def test_the_same_answer_with_nothing_loaded_here(rig, call, monkeypatch):
    usual = CALLS[call](*rig)
    monkeypatch.setattr(binary.Binary, "library", refuse)
    with pytest.raises(AssertionError):
        CALLS[call](*rig)
    isolated = CALLS[call](*rig, isolate=True)
    for told in (usual, isolated):
        if isinstance(told, dict):
            told.pop("effort", None)
            told.pop("elapsed", None)
    assert str(isolated) == str(usual)


@pytest.mark.parametrize("call", CALLS)
@pytest.mark.slow
def test_the_command_line_asks_for_it(rig, call, tmp_path, monkeypatch):
    asked = []

    def heard(*given, isolate=False, **more):
        asked.append(isolate or True in given)
        raise KeyboardInterrupt

    monkeypatch.setattr(f"selflock.diagnosis.{call}", heard)
    for words in ([], ["--isolate"]):
        CliRunner().invoke(app, [call, *map(str, rig), "-o", str(tmp_path / "out"), *words])
    assert asked == [False, True]


@pytest.mark.slow
def test_other_commands_load_none(oscillator, tmp_path, monkeypatch):
    """They read what an FMU says of itself; `export` asks it which variables act at once."""
    monkeypatch.setattr(binary.Binary, "library", refuse)
    system, table = tmp_path / "system.toml", tmp_path / "x.csv"
    system.write_text(f'[run]\nstop = 1.0\nopen_inputs = true\n[components.o]\nfmu = "{oscillator.name}"\n')
    table.write_text("time [s],o.position [m]\n0.0,0.0\n1.0,1.0\n")
    words = (["info", oscillator], ["info", system], ["info", tmp_path / "x.ssp"])
    words = (["export", system, "--isolate", "-o", tmp_path / "x.ssp"], *words)
    for command in (*words, ["view", table, "--system", system, "-o", tmp_path / "x.html"]):
        done = CliRunner().invoke(app, [*map(str, command)])
        assert done.exit_code == 0, (command, done.output, done.exception)
