"""A calibration and a naming that were stopped go on where they were, to the same bits."""

import json
import sys
import threading
from pathlib import Path

import numpy as np
import oscillators
import pandas as pd
import pytest

from selflock import diagnosis
from selflock.diagnosis.calibration import fit
from selflock.diagnosis.data import table
from selflock.master import TimeUp

sys.path.append(str(Path(__file__).parents[1] / "naming"))
import hidden


@pytest.fixture
def fits(monkeypatch):
    """How many fits were made."""
    made, squares = [], fit._squares
    monkeypatch.setattr(fit, "_squares", lambda *given: (made.append(1), squares(*given))[1])
    return made


def answer(out, name):
    """What was found, without what time it took."""
    told = json.loads((out / name).read_text().replace(str(out), "OUT"))
    for key in ("seconds", "steps_per_second", "elapsed"):
        told["effort"].pop(key, None)
    return told


def goes_on(call, tmp_path, name, stop, fits):
    """Stopped once, torn, and gone on with: the answer of one that nobody stopped, with fewer fits."""

    def at(what, share):
        if stop(what, share):
            raise KeyboardInterrupt

    call(out=tmp_path / "whole")
    of_all, out = len(fits), tmp_path / "out"
    fits.clear()
    with pytest.raises(KeyboardInterrupt, match="fits are kept in .*out.*goes on with them"):
        call(out=out, progress=at)
    of_first, there = len(fits), sorted((out / "kept").glob("*.npz"))
    assert 2 <= len(there) == of_first < of_all
    there[0].write_bytes(there[0].read_bytes()[:-100])  # torn
    fits.clear()
    call(out=out)
    assert len(fits) == of_all - of_first + 1
    assert answer(out, name) == answer(tmp_path / "whole", name)
    assert not (out / "kept").exists() and not (tmp_path / "whole" / "kept").exists()


@pytest.mark.slow
@pytest.mark.filterwarnings("ignore:unclosed file:ResourceWarning")  # the limit may come between a file's opening and its `with`
def test_a_calibration_goes_on(tmp_path, oscillator, rng, fits):
    log = oscillators.log(tmp_path / "log.csv", oscillator, rng, count=200)
    wanted = {f"oscillator.{name}": oscillators.RANGES[name] for name in ("stiffness", "gain")}
    more = {"oscillator.damping": oscillators.TRUTH["damping"]}
    rig = oscillators.rig(tmp_path / "rig.toml", "oscillator.fmu", wanted, more, more=f"step = {oscillators.STEP}")

    def call(out, **given):
        return diagnosis.calibrate(rig, [log], out=out, starts=2, **given)

    goes_on(call, tmp_path, "calibration.json", lambda what, share: share >= 0.7, fits)
    with pytest.raises(TimeUp, match="The calibration took more than its time limit, 0.001 s"):
        call(tmp_path / "late", max_time=1e-3)


def test_a_limit_that_a_reader_meets_is_told_as_one(tmp_path, oscillator, rng, monkeypatch):
    """pandas' reader in C makes an error of its own of the interrupt, and the file would pass for a damaged one."""
    log = oscillators.log(tmp_path / "log.csv", oscillator, rng, count=20)
    rig = oscillators.rig(tmp_path / "rig.toml", "oscillator.fmu", {"oscillator.gain": oscillators.RANGES["gain"]})

    def met(*_):
        try:
            threading.Event().wait(60.0)
        except KeyboardInterrupt:
            raise pd.errors.ParserError("Calling read(nbytes) on source failed") from None

    monkeypatch.setattr(table, "_read", met)
    with pytest.raises(TimeUp, match="The calibration took more than its time limit, 0.05 s"):
        diagnosis.calibrate(rig, [log], out=tmp_path / "out", max_time=0.05)


@pytest.mark.slow
def test_a_naming_goes_on(tmp_path, native, fits):
    rig = hidden.rig(tmp_path, native("relaxation"), "")
    rng = np.random.default_rng(1)
    for log in ("log.csv", "test.csv"):
        hidden.body(rng, 200, loss=30.0).to_csv(tmp_path / log, index=False)

    def call(out, **given):
        return diagnosis.name(rig, [tmp_path / "log.csv"], [tmp_path / "test.csv"], out, kinds=["parameter"], **given)

    goes_on(call, tmp_path, "naming.json", lambda what, share: "chance" in what, fits)
