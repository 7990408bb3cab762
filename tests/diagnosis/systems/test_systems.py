"""Any FMU system on a log: compiled FMUs that are not ours, in a chain in which one may misbehave."""

import sys
from pathlib import Path

import numpy as np
import pandas as pd
import pytest
from typer.testing import CliRunner

from selflock import master
from selflock.cli import app
from selflock.diagnosis import DataError, diagnose, replay

sys.path.append(str(Path(__file__).parents[2] / "native"))

SYSTEM = """
[run]
stop = 20.0
step = 0.01
open_inputs = true

[components.first]
fmu = "relaxation.fmu"
start = {{ rate = {first} }}

[components.second]
fmu = "relaxation.fmu"
start = {{ rate = {second} }}

[components.third]
fmu = "relaxation.fmu"
start = {{ rate = {third} }}

[connections]
"second.u" = "first.x"
"third.u" = {{ from = "second.x", factor = 2.0, offset = -1.0 }}
"""
RATES = {"first": 2.0, "second": 0.5, "third": 1.0}
RIG = """
[rig]
system = "chain.toml"
named = true

[columns]
"first.u" = {{ column = "wanted", unit = "K" }}
"second.x" = {{ column = "middle", unit = "mK" }}
{more}
"""


@pytest.fixture(scope="module")
def fmu(tmp_path_factory):
    from pack import pack

    return pack("relaxation", tmp_path_factory.mktemp("native"))


class Wanted:
    """A staircase with a sine, asked for at any time."""

    def __new__(cls, name="wanted"):
        from selflock.diagnosis.systems.parts import Signals

        time = np.arange(0.0, 20.001, 0.01)
        column = np.sin(1.3 * time) + np.floor(time / 3.0) % 2
        return Signals(name, time, {"u": column}, {"u": "Real"})


def chain(folder, fmu, nature=None, noise=0.005, columns=("first.x", "second.x", "third.x"), seed=1):
    """A system file with the sheet's rates, and the log of a chain in which some rates, or the law, are nature's."""
    (folder / "relaxation.fmu").write_bytes(fmu.read_bytes())
    (folder / "chain.toml").write_text(SYSTEM.format(**RATES))
    (folder / "nature.toml").write_text(SYSTEM.format(**(RATES | (nature or {}))))
    system = master.load(folder / "nature.toml")
    system.components["wanted"] = master.system.Component(part="test_systems:Wanted")
    system.connections["first.u"] = master.system.Connection("wanted.u")
    table = master.run(system, allow_code=True).table
    rng = np.random.default_rng(seed)
    log = pd.DataFrame({"time": table["time"], "wanted": table["wanted.u"]})
    for name in columns:
        values = table[name] + noise * rng.standard_normal(len(table))
        log["middle" if name == "second.x" else f"{name} [K]"] = 1e3 * values if name == "second.x" else values
    log["room.temperature"] = 20.0 + np.sin(0.7 * table["time"])
    log.to_csv(folder / "log.csv", index=False)
    more = '"room.temperature" = { column = "room.temperature" }'
    rig = RIG.format(more=more)
    (folder / "rig.toml").write_text(rig if "second.x" in columns else rig.replace('"second.x"', '# "second.x"'))
    return folder / "rig.toml", folder / "log.csv"


@pytest.fixture(autouse=True)
def here(monkeypatch):
    monkeypatch.syspath_prepend(str(Path(__file__).parent))


def test_a_sound_chain_replays_to_its_noise_and_nothing_is_missing(tmp_path, fmu):
    rig, log = chain(tmp_path, fmu)
    for comparison in replay(rig, log, None).comparisons:
        assert comparison.error < 1.1 * 0.005, comparison
    result = diagnose(rig, [log], out=None)
    assert (result.verdict, result.exit_code, result.blame) == ("none", 3, [])


@pytest.mark.alike
@pytest.mark.parametrize("name", RATES)
def test_the_component_whose_own_replay_is_off_is_to_blame(tmp_path, fmu, name):
    rig, log = chain(tmp_path, fmu, {name: 1.25 * RATES[name]})
    result = diagnose(rig, [log], out=None)
    assert result.verdict == "unknown" and result.exit_code == 4
    assert result.blame[0]["component"] == name and result.blame[0]["share"] > 0.95
    whole = {c.output: c.error for c in replay(rig, log, None).comparisons if c.name.startswith("whole")}
    assert whole["third.x"] > 5 * 0.005  # the whole is wrong from there on; the others are not to blame


@pytest.mark.slow
def test_what_the_error_depends_on_is_named(tmp_path, fmu):
    rig, log = chain(tmp_path, fmu)
    table = pd.read_csv(log)
    table["third.x [K]"] += 0.03 * (table["room.temperature"] - 20.0)  # the room acts on it, as no FMU here knows
    table.to_csv(log, index=False)
    result = diagnose(rig, [log], out=None)
    assert result.verdict == "unknown"
    assert result.blame[0]["component"] == "third"
    assert "room.temperature" in result.remainder["depends_on"]


def test_what_is_not_measured_runs_along_and_shares_the_blame(tmp_path, fmu):
    rig, log = chain(tmp_path, fmu, {"second": 0.7}, columns=("first.x", "third.x"))
    result = diagnose(rig, [log], out=None)
    assert {b["component"]: round(b["share"], 2) for b in result.blame} == {"second": 0.5, "third": 0.5}


@pytest.mark.slow
def test_report_replay_and_exit_codes_from_the_command_line(tmp_path, fmu):
    rig, log = chain(tmp_path, fmu, {"second": 0.7})
    said = CliRunner().invoke(app, ["diagnose", str(rig), str(log), "-o", str(tmp_path / "out")])
    assert said.exit_code == 4 and "unknown" in said.output
    report = (tmp_path / "out" / "report.html").read_text()
    assert "second" in report and 'data-figure="missing"' in report  # a picture, though nothing has a name
    said = CliRunner().invoke(app, ["replay", str(rig), str(log), "-o", str(tmp_path / "replay")])
    assert said.exit_code == 0 and "whole third.x" in said.output
    assert (tmp_path / "replay" / "replay.json").exists()


SLIPS = {
    "millikelvin": (dict(unit="K"), ("'middle' (second.x) is 1000 times what second computes", "milli (mV, mA, mN.m) read as")),
    "a sign": (dict(unit="mK", factor=-1.0), ("'middle' (second.x) goes against what second computes", "factor = -1.0")),
    "another scale": (dict(unit="mK", offset=273.15), ("'middle' (second.x) lies +273.", "K and degC exchanged?")),
}


@pytest.mark.slow
@pytest.mark.parametrize("slip", SLIPS)
def test_a_slip_of_a_systems_rig_is_told_before_anything_is_judged(tmp_path, fmu, slip):
    rig, log = chain(tmp_path, fmu)
    entry, words = SLIPS[slip]
    told = "".join(f", {key} = {value!r}".replace("'", '"') for key, value in entry.items())
    rig.write_text(rig.read_text().replace('column = "middle", unit = "mK"', f'column = "middle"{told}'))
    for call in (replay, lambda *a, **k: diagnose(a[0], [a[1]], **k)):
        with pytest.raises(DataError) as refused:
            call(rig, log, out=None)
        assert all(word in str(refused.value) for word in words) and "--anyway" in str(refused.value)
    found = replay(rig, log, out=None, anyway=True)
    assert found.sanity.gross and any("first.x = 1 times what first computes" in line for line in found.sanity.lines())


def test_a_column_that_is_no_variable_is_refused(tmp_path, fmu):
    rig, log = chain(tmp_path, fmu)
    rig.write_text(rig.read_text().replace('"first.u"', '"first.uu"'))
    with pytest.raises(DataError, match="first.uu.*no such variable"):
        diagnose(rig, [log], out=None)


OURS = """
[run]
stop = 8.0
step = 0.002
open_inputs = true

[components.winder]
fmu = "selflock:Motor"
start = { resistance = 0.299, inductance = 8.23e-5, voltage_constant = 0.0302, torque_constant = 0.0302 }
"""


@pytest.mark.slow
def test_a_cause_is_named_where_the_fmu_to_blame_is_ours(tmp_path):
    from misbehaving import Motor

    (tmp_path / "motor.toml").write_text(OURS)
    (tmp_path / "rig.toml").write_text('[rig]\nsystem = "motor.toml"\nnamed = true\n')
    rng = np.random.default_rng(3)
    time = np.arange(4001) * 0.002
    speed = 60.0 * np.sin(1.7 * time) + 30.0 * np.sin(0.6 * time)
    voltage = 0.03 * speed + 2.0 * np.interp(time, np.arange(0.0, 9.0, 0.4), rng.uniform(-1.0, 1.0, 23))
    nature, current = Motor("nature", brush_drop=0.4), np.zeros(len(time))
    for i in range(1, len(time)):
        current[i] = nature.advance(voltage[i - 1], 0.5 * (speed[i - 1] + speed[i]), 0.002)[0]
    current += 0.05 * rng.standard_normal(len(time))
    log = pd.DataFrame({"time": time, "winder.voltage": voltage, "winder.speed": speed, "winder.current": current})
    log.to_csv(tmp_path / "log.csv", index=False)
    result = diagnose(tmp_path / "rig.toml", [tmp_path / "log.csv"], out=tmp_path / "out", seed=1)
    assert [c.label for c in result.causes] == ["winder_motor brush_drop"], result.summary()
    assert result.blame[0]["component"] == "winder" and result.exit_code == 0
    assert result.gain.after < 0.5 * result.gain.before


@pytest.mark.slow
def test_an_fmu_of_ours_is_fitted_from_what_it_was_built_with(tmp_path):
    """Start values in the FMU, over them those of the system; what the rig leaves open or knows keeps its meaning."""
    from selflock.diagnosis.data.rig import load
    from selflock.diagnosis.systems.ours import as_drive
    from selflock.diagnosis.systems.parts import Parts
    from selflock.fmus.build import build

    build("Motor", tmp_path / "own.fmu", resistance=0.4, brush_voltage=0.3)
    system = OURS.replace("selflock:Motor", "own.fmu").replace("resistance = 0.299, ", "")
    (tmp_path / "motor.toml").write_text(system)
    (tmp_path / "rig.toml").write_text(
        '[rig]\nsystem = "motor.toml"\nnamed = true\nknown = ["winder.inductance", "winder.*"]\n'
        '[uncertain]\n"winder.torque_constant" = [0.02, 0.04]\n[logs."a*"]\n"winder.resistance" = 0.5\n'
    )
    rig = load(tmp_path / "rig.toml")
    drive = as_drive(Parts(rig), rig, "winder", {"winder.voltage", "winder.speed", "winder.current"})
    assert drive.parameters["winder_motor.resistance"] == 0.4 and drive.parameters["winder_motor.brush_voltage"] == 0.3
    assert drive.parameters["winder_motor.inductance"] == 8.23e-5
    assert drive.uncertain == {"winder_motor.torque_constant": (0.02, 0.04)} and drive.of_log("a.csv") == {
        "winder_motor.resistance": 0.5
    }
    assert not drive.questioned("winder_motor.inductance") and not drive.questioned("winder_motor.resistance")


@pytest.mark.slow
def test_a_system_with_shared_values_replays_alike(tmp_path, fmu):
    """The chain's numbers said once, the rig giving one of them; and the same numbers written out."""
    rig, log = chain(tmp_path, fmu)
    plain = [c.error for c in replay(rig, log, None).comparisons]
    text = (
        (tmp_path / "chain.toml")
        .read_text()
        .replace("rate = 2.0", 'rate = "= 4 * slow"')
        .replace("rate = 0.5", 'rate = "= slow"')
    )
    text = text.replace("factor = 2.0", 'factor = "= 2 * last"').replace("rate = 1.0", 'rate = "= last"')
    (tmp_path / "chain.toml").write_text("[values]\nslow = 0.7\nlast = 1.0\n" + text)
    assert [c.error for c in replay(rig, log, None).comparisons] != plain
    rig.write_text(rig.read_text() + "\n[parameters]\nslow = 0.5\n")
    assert [c.error for c in replay(rig, log, None).comparisons] == plain
    rig.write_text(rig.read_text() + '\n[logs."log*"]\nlast = 2.0\n')
    with pytest.raises(DataError, match="'last' is a value of the whole system: put it under .parameters."):
        replay(rig, log, None)
