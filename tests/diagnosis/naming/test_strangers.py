"""The hidden plants of benchmarks.strangers; what is named in them is the study's. Here: where steps would pass for a law."""

import numpy as np
import pytest
import strangers

from selflock.diagnosis import name


@pytest.mark.in_turn
@pytest.mark.slow
def test_steps_that_are_too_long_are_halved_and_nothing_is_named(tmp_path, monkeypatch):
    """FMUs in a ring hand over held values: with long steps what they leave looks like a lag between them."""
    monkeypatch.setattr(strangers, "ROWS", 300)
    rig, train, test = strangers.write(strangers.hide("none", 10_000, "electrical"), tmp_path)
    result = name(rig, [train], test=[test], out=None, starts=1)
    assert (result.verdict, result.causes) == ("none", [])
    assert any("0.0025 s are too long" in note for note in result.notes)


def test_what_hides_is_drawn_anew_for_each_seed_and_moves_what_is_recorded(monkeypatch):
    monkeypatch.setattr(strangers, "ROWS", 60)
    cases = [strangers.hide("path: offset", seed, "mechanical") for seed in (10_000, 10_001, 10_000)]
    first, other, again = (case.logs[0]["position"].to_numpy() for case in cases)
    assert np.array_equal(first, again) and not np.array_equal(first, other)
    assert cases[0].right[1] == {"controller.wanted", "recorded controller.wanted"}
