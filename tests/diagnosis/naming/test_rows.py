"""Outputs that were read beside the times of their rows: within a row by a recorder, beyond it by a cause."""

from types import SimpleNamespace

import hidden
import numpy as np
import pytest

from selflock.diagnosis import name
from selflock.diagnosis.naming import rows


def named(tmp_path, native, rng, **nature):
    """What is named in a heated body; nature: as hidden.body has it."""
    logs = [tmp_path / "log.csv", tmp_path / "test.csv"]
    for log in logs:
        hidden.body(rng, **nature).to_csv(log, index=False)
    return name(hidden.rig(tmp_path, native("relaxation")), logs[:1], test=logs[1:], out=None)


@pytest.mark.slow
@pytest.mark.parametrize("side", [-1.0, 1.0])
def test_what_was_read_beside_its_rows_within_one_is_a_recorder_and_told(tmp_path, native, rng, side):
    """What was read before its row lags, and what was read behind it leads, as what goes with a rate."""
    behind = side * rng.uniform(0.3, 0.9) * hidden.STEP
    result = named(tmp_path, native, rng, read=lambda t, x: np.interp(t + behind, t, x))
    assert (result.verdict, result.causes) == ("none", [])
    (note,) = [note for note in result.notes if "than its rows say" in note]
    by, _, which = note.removeprefix("relaxation.x was read ").split()[:3]
    assert float(by) == pytest.approx(abs(behind), rel=0.15) and which == ("later" if side > 0.0 else "earlier")


@pytest.mark.slow
def test_what_comes_later_than_a_row_is_no_recorder(tmp_path, native, rng):
    late = int(rng.integers(3, 8))
    result = named(tmp_path, native, rng, heater=lambda t, u: np.concatenate([np.full(late, u[0]), u[:-late]]))
    assert result.verdict == "explained" and result.causes[0].law == "delay"
    assert not any("than its rows say" in note for note in result.notes)


def test_only_outputs_that_are_nearer_by_it_are_told():
    held = lambda **sizes: SimpleNamespace(held=sizes, taught=None)
    told = rows.told_late({"a.x": -0.02, "a.y": 0.01}, held(**{"a.x": 1.0, "a.y": 1.0}), held(**{"a.x": 0.1, "a.y": 0.99}))
    assert len(told) == 1 and told[0].startswith("a.x was read 0.02 s earlier than its rows say") and "(1 -> 0.1)" in told[0]
