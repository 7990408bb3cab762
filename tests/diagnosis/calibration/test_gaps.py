"""Behind a gap in a log nothing is compared for as long as a system remembers what its inputs may have done in it."""

import numpy as np
import oscillators
import pandas as pd
import pytest

from selflock.diagnosis import calibrate, name

COUNT, FIRST, LAST = 5000, 1000, 1060
OFF = {f"oscillator.{name}": {"start": 0.9 * x, "low": 0.1 * x, "high": 10.0 * x} for name, x in oscillators.TRUTH.items()}


def gapped(path, fmu, rng, lost=(FIRST, LAST), **of_log):
    """A log without some of its rows."""
    log = oscillators.log(path, fmu, rng, count=COUNT, **of_log)
    table = pd.read_csv(log)
    table.drop(range(*lost)).to_csv(log, index=False)
    return log


def told(result):
    return [note for note in result.notes if "nothing was recorded" in note]


def until(note):
    return float(note.rsplit("until ", 1)[1].split(" s")[0])


def test_what_a_gap_left_in_a_system_is_not_compared(tmp_path, oscillator, rng):
    """The force stepped once or twice in it unseen; the body swings on for some of its 1.3 s (2 / damping), down to the noise."""
    rig = oscillators.rig(tmp_path / "rig.toml", oscillator, OFF, more='inputs = "held"')
    result = calibrate(rig, [gapped(tmp_path / "log.csv", oscillator, rng)], out=None, starts=1)
    (note,) = told(result)
    assert f"{oscillators.STEP * (FIRST - 1):g} s and {oscillators.STEP * LAST:g} s" in note
    assert 5.0 < until(note) - oscillators.STEP * LAST < 13.0
    assert result.values == pytest.approx({f"oscillator.{name}": value for name, value in oscillators.TRUTH.items()}, rel=0.02)
    (error,) = result.errors
    assert error.after < 1.15 * 0.002


@pytest.mark.slow
def test_a_gap_is_no_cause(tmp_path, oscillator, rng):
    rig = oscillators.rig(
        tmp_path / "rig.toml",
        oscillator,
        {},
        {f"oscillator.{n}": x for n, x in oscillators.TRUTH.items()},
        more='inputs = "held"',
    )
    result = name(rig, [gapped(tmp_path / "log.csv", oscillator, rng)], out=None)
    assert result.verdict == "none" and len(told(result)) == 1


def test_a_gap_in_which_an_input_can_have_done_nothing_costs_no_row(tmp_path, oscillator, rng):
    """The force is constant wherever it was recorded, but for a step long before."""
    force = np.repeat([5.0, 9.0], [200, COUNT - 200])
    lost = (FIRST, FIRST + 8)
    log = gapped(tmp_path / "log.csv", oscillator, rng, lost, force=force, noise=0.05)
    result = calibrate(oscillators.rig(tmp_path / "rig.toml", oscillator, OFF), [log], out=None, starts=1)
    assert told(result) == []


def test_what_never_forgets_is_not_compared_to_the_end_and_that_is_said(tmp_path, oscillator, rng):
    """A body without a spring, whose position is what the force did in all."""
    free = {"stiffness": 0.0, "damping": 1e-3, "gain": 1.4}
    log = gapped(tmp_path / "log.csv", oscillator, rng, truth=free)
    given = {f"oscillator.{n}": x for n, x in free.items() if n != "gain"}
    rig = oscillators.rig(tmp_path / "rig.toml", oscillator, {"oscillator.gain": [0.1, 5.0]}, given, more='inputs = "held"')
    result = calibrate(rig, [log], out=None, starts=1)
    (note,) = told(result)
    assert "to its end" in note and "begins behind the gap" in note
    assert result.values["oscillator.gain"] == pytest.approx(1.4, rel=0.02)


def test_each_of_two_gaps_is_told(tmp_path, oscillator, rng):
    log = gapped(tmp_path / "log.csv", oscillator, rng, (400, 430))
    table = pd.read_csv(log)
    table.drop(range(3000, 3030)).to_csv(log, index=False)
    rig = oscillators.rig(tmp_path / "rig.toml", oscillator, OFF, more='inputs = "held"')
    first, second = map(until, told(calibrate(rig, [log], out=None, starts=1)))
    assert 400 * oscillators.STEP < first < 3030 * oscillators.STEP < second


def test_of_rows_that_were_written_as_things_happened_none_is_lost(tmp_path, oscillator, rng):
    log = gapped(tmp_path / "log.csv", oscillator, rng, (0, 0))
    table = pd.read_csv(log)
    table.iloc[np.sort(rng.choice(COUNT, COUNT // 2, replace=False))].to_csv(log, index=False)
    rig = oscillators.rig(tmp_path / "rig.toml", oscillator, OFF, more='inputs = "held"')
    result = calibrate(rig, [log], out=None, starts=1)
    assert any(fault["kind"] == "irregular" for fault in result.faults) and told(result) == []
