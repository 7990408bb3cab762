"""A log too coarse for its replay, and one that is not: the same hidden drive, without any cause, recorded less often."""

import pandas as pd
import pytest

from selflock.diagnosis import diagnose

from ..plant import bench


def recorded(folder, every):
    """Nothing is hidden; every so many rows of the log (2 ms) are kept."""
    case = bench.hide([], seed=1, duration=12.0 * min(every, 4))
    files = case.write(folder)
    for path in files[1:]:
        pd.read_csv(path).iloc[::every].to_csv(path, index=False)
    return diagnose(files[0], [files[1]], test=[files[2]], out=folder / "out", seed=1)


@pytest.mark.in_turn
@pytest.mark.slow
def test_a_log_every_10_ms_is_too_coarse_for_the_winding_and_nothing_else_is_blamed(tmp_path):
    result = recorded(tmp_path, 5)
    (cause,) = result.causes
    assert cause.label == "simulation step" and result.verdict == "explained" and not result.remainder["significant"]
    assert cause.parameters["step"]["value"] == pytest.approx(0.01) and cause.confidence > 0.99
    assert result.step.residual == "motor" and not result.step.held  # commands between the rows were left out
    assert result.gain.after < 1.3 * bench.NOISE["current"] < 0.5 * result.gain.before
    assert result.blame[0]["component"] == "simulation" and not list((tmp_path / "out").glob("*.fmu"))
    assert "coarse" in result.report.read_text() and "Log more rows a second" in result.summary()


@pytest.mark.slow
def test_the_same_drive_every_2_ms_is_fine(tmp_path):
    result = recorded(tmp_path, 1)
    assert result.verdict == "none" and result.step.ratio < 0.5 and result.step.held
    assert "fine enough" in result.summary() and "fine enough" in result.report.read_text()
