"""When a set-point jumped, and how late the channels of a log were read, tell each other only with what moves besides."""

from __future__ import annotations

import numpy as np
import pytest

from selflock.diagnosis.residuals import driven
from selflock.diagnosis.search import instants
from selflock.diagnosis.search.instants import place_jumps

from ..residuals.test_small_controllers import LASTS, ROW, asked_of, simulated


@pytest.mark.slow
@pytest.mark.in_turn
@pytest.mark.parametrize("share", [0.1, 0.5, 0.9])
def test_jumps_that_all_came_as_soon_are_no_late_reading(rng, share, monkeypatch):
    """A controller of 1 ms behind rows of 20 that were read at their instants: by `share` of a row all came sooner than their rows.

    Of some draws a third of a row is less than the noise, and where nothing is missing no nearer place is looked for.
    """
    rows = np.array([30, 80, 140])
    heights = np.cumsum(rng.uniform(1.0, 2.0, 3) * np.array([1.0, -1.0, 1.0]))
    often, phase = rng.uniform(0.5, 1.0), rng.uniform(0.0, 6.0)

    def wanted(t):
        behind = int(np.searchsorted((rows - share) * ROW, t + 1e-9))
        return 0.3 * np.sin(2.0 * np.pi * often * t + phase) + (heights[behind - 1] if behind else 0.0)

    anew = asked_of(rng, simulated(wanted, row=1e-3), True)
    problem, looks = anew(), []
    placed = instants._placed
    monkeypatch.setattr(instants, "_placed", lambda *args: looks.append(args) or placed(*args))
    assert place_jumps(problem.experiment, problem)
    found = anew().with_noise()
    if len(looks) < 2:
        return
    ch = found.experiment.channels[0, ""]
    found_at = [driven.sooner(ch)[row] for row in rows]
    assert found_at == pytest.approx([share] * 3, abs=0.25)  # counts alone move one of three by a twentieth
    fitted = found.fit(found.base_free, found.nominal)
    assert abs(fitted.values["recorder.load.angle.shift"]) < 0.2 * ROW and LASTS > rows[-1] * ROW
