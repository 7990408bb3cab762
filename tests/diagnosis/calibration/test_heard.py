"""Inputs that heard what was measured of another component, its noise included, and columns of inputs that something else is connected to."""

import numpy as np
import oscillators
import pandas as pd
import pytest

from selflock import master
from selflock.diagnosis import calibrate, name
from selflock.master.dump import save
from selflock.master.system import Component, Connection, Run, System

STEP, NOISE, HIDDEN = 0.01, 0.02, {"first.rate": 2.5, "second.rate": 30.0}
COLUMNS = {"first.u": "wanted", "first.x": "first", "second.x": "second"}


def chained(folder, native, rng, heard, log, given=None):
    """The log of a slow body and a fast one behind it, which is given the slow one's state with its sensor's noise, without, or this."""
    (folder / "relaxation.fmu").write_bytes(native("relaxation").read_bytes())
    wanted = np.repeat(rng.uniform(-1.0, 2.0, 16), 50)
    first, second, rows = 0.0, 0.0, []
    for k, u in enumerate(wanted):
        seen = first + NOISE * rng.standard_normal()
        rows.append([k * STEP, u, seen, second + 0.1 * NOISE * rng.standard_normal()])
        first += (1.0 - np.exp(-HIDDEN["first.rate"] * STEP)) * (u - first)
        into = given[k] if given is not None else 2.0 * (seen if heard else first) - 1.0  # as the master's step goes on
        second += (1.0 - np.exp(-HIDDEN["second.rate"] * STEP)) * (into - second)
    pd.DataFrame(rows, columns=["time", "wanted", "first", "second"]).to_csv(folder / log, index=False)
    return folder / log


def ranges(folder, columns=COLUMNS):
    """A rig of the chain, which begins at 0, with both rates to be found."""
    components = {
        n: Component(fmu="relaxation.fmu", start={"rate": 1.5 * HIDDEN[f"{n}.rate"], "x": 0.0}) for n in ("first", "second")
    }
    wired = {"second.u": Connection("first.x", 2.0, -1.0)}
    save(System("chain", folder=folder, components=components, connections=wired, run=Run(step=STEP)), folder / "chain.toml")
    wanted = {rate: [0.1 * value, 10.0 * value] for rate, value in HIDDEN.items()}
    return oscillators.rig(folder / "rig.toml", "chain.toml", wanted, columns=columns, more=f'step = {STEP}\ninputs = "held"')


@pytest.mark.slow
@pytest.mark.parametrize("heard", [True, False])
def test_a_component_that_heard_a_sensors_noise_is_given_what_was_measured(tmp_path, native, rng, heard):
    logs = [chained(tmp_path, native, rng, heard, log) for log in ("log.csv", "test.csv")]
    result = calibrate(ranges(tmp_path), logs[:1], test=logs[1:], out=None, starts=2)
    told = [note for note in result.notes if note.startswith("second.u is given what was measured of first.x")]
    assert len(told) == heard
    for rate, hidden in HIDDEN.items():
        number = next(n for n in result.numbers if n.name == rate)
        assert abs(hidden - number.value) <= 1.5 * (number.high - number.low) and number.high - number.low < 0.05 * hidden
    errors = {error.name: error.held_out for error in result.errors}
    assert errors == pytest.approx({"first.x": NOISE, "second.x": 0.1 * NOISE}, rel=0.15)


@pytest.mark.slow
def test_what_is_sound_beside_that_lacks_nothing(tmp_path, native, rng):
    logs = [chained(tmp_path, native, rng, True, log) for log in ("log.csv", "test.csv")]
    result = name(ranges(tmp_path), logs[:1], test=logs[1:], out=tmp_path / "out")
    assert result.verdict == "none"
    whole = master.run(
        master.load(tmp_path / "out/extended.toml"), inputs=tmp_path / "out/inputs.csv"
    )  # its loop closes by itself
    assert {"first.x", "second.x"} <= {*whole.table}
    assert any("second heard its noise" in note for note in result.notes)


def test_an_inputs_own_column_goes_before_what_is_connected_to_it(tmp_path, native, rng):
    given = np.repeat(rng.uniform(-1.0, 2.0, 20), 40)
    log = chained(tmp_path, native, rng, False, "log.csv", given)
    pd.read_csv(log).assign(into=given).to_csv(log, index=False)
    result = calibrate(ranges(tmp_path, COLUMNS | {"second.u": "into"}), [log], out=None, starts=1)
    assert result.values["second.rate"] == pytest.approx(HIDDEN["second.rate"], rel=0.02)
    assert "second.u is given by its own column, and not by first.x, which is connected to it" in result.notes
