"""The Silverbox, where ../shared/data is: what a linear oscillator leaves of it is what its authors say."""

import sys
from pathlib import Path

import pytest

from selflock.diagnosis import calibrate

sys.path.append(str(Path(__file__).parents[3]))

from benchmarks import silverbox

pytestmark = pytest.mark.skipif(not silverbox.DATA.exists(), reason="the measured data are not in ../shared/data")


@pytest.mark.slow
def test_a_linear_oscillator_leaves_what_is_published(tmp_path):
    """On a piece of the multisine, and on the beginning of the arrow, where the spring is straight yet."""
    rig, log, test = silverbox.prepared(tmp_path, (60_000, 61_500), (1_500, 3_000))
    result = calibrate(rig, [log], test=[test], out=None, starts=1)
    (error,) = result.errors
    assert 0.005 < error.after < 0.008  # V; published over all ten: 0.0068
    assert error.held_out < 0.2 * error.held_out_before
    frequency = (result.values["oscillator.stiffness"] ** 0.5) / 6.2832
    assert frequency == pytest.approx(70.0, abs=1.5)  # Hz, of the resonance
